#!/usr/bin/env bash
# Every test with the address and undefined-behaviour sanitizers, in a build folder of its own.
#
#   scripts/sanitize.sh               all tests
#   scripts/sanitize.sh -R matte      CTest's own flags pass through
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

# Mesa and libav keep what they allocate until the process ends, so leaks are not looked for.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=0:strict_string_checks=1}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1:halt_on_error=1}
VIRGA_PRESET=sanitize exec "$repo/scripts/test.sh" "$@"
