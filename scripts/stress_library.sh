#!/usr/bin/env bash
# The library at length: shots that come and go, whose memory is watched, and many threads at once, again and again.
#
#   scripts/stress_library.sh             10,000 shots, and 100 times the threads' tests
#   scripts/stress_library.sh 2000 20
#
# VIRGA_PRESET chooses the build: test, sanitize or threads.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

export VIRGA_SHOT_CYCLES=${1:-10000}
VIRGA_TARGETS=test_lib build_preset "${VIRGA_PRESET:-test}"
"$build/bin/test_lib" --gtest_brief=1 --gtest_filter='Sharing.ShotsThatComeAndGo*'
exec "$build/bin/test_lib" --gtest_brief=1 --gtest_filter='Threads*' --gtest_repeat="${2:-100}" --gtest_break_on_failure
