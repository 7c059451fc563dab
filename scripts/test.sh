#!/usr/bin/env bash
# Installs what is missing, builds everything, and runs every test; CTest's summary is the last line.
#
#   scripts/test.sh                   all tests
#   scripts/test.sh -R particles      CTest's own flags pass through
#
# VIRGA_PRESET=ci makes warnings errors. VIRGA_FOOTAGE_DIR=/footage lets tests that want real footage find it.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

build_preset "${VIRGA_PRESET:-test}"
if [[ -n ${VIRGA_FOOTAGE_DIR:-} ]]; then
    VIRGA_FOOTAGE_DIR=$(cd "$VIRGA_FOOTAGE_DIR" && pwd)
    export VIRGA_FOOTAGE_DIR
fi
status=0
ctest --test-dir "$build" --output-on-failure --no-tests=error --parallel "$jobs" "$@" | tee "$build/tests.log" || status=$?
grep -E '^[0-9]+% tests passed' "$build/tests.log" || echo "no test ran"
exit "$status"
