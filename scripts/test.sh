#!/usr/bin/env bash
# Installs what is missing, builds everything, and runs every test; CTest's summary comes last.
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
exec ctest --test-dir "$build" --output-on-failure --no-tests=error --parallel "$jobs" "$@"
