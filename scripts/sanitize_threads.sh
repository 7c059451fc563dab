#!/usr/bin/env bash
# Readers, writers, queues and the library under the thread sanitizer, in a build folder of its own (build/threads).
#
#   scripts/sanitize_threads.sh                      all tests of src/io, src/core, and those of the library with many threads
#   scripts/sanitize_threads.sh 'Sequence*:Bad*'     GoogleTest's filter
#
# Libraries are not built with the sanitizer; what they do among themselves is left out (scripts/sanitize_threads.supp).
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

# OpenEXR's pool unlocks, at the end of the program, a mutex that is gone: nothing of ours is told by that kind of report.
export TSAN_OPTIONS=${TSAN_OPTIONS:-second_deadlock_stack=1:report_mutex_bugs=0:suppressions=$repo/scripts/sanitize_threads.supp}
VIRGA_TARGETS="test_core test_io test_lib" build_preset threads
status=0
for test in test_core test_io; do
    "$build/bin/$test" --gtest_brief=1 --gtest_filter="${1:-*}" || status=1
done
"$build/bin/test_lib" --gtest_brief=1 --gtest_filter="${1:-Threads*}" || status=1
exit "$status"
