#!/usr/bin/env bash
# Looks with libFuzzer for input that a parser of ours neither answers nor refuses (tests/fuzz), under the address and
# undefined-behaviour sanitizers, in a build folder of its own (build/fuzz). Needs clang, and installs it if it may.
#
#   scripts/fuzz.sh                   every target, a minute each
#   scripts/fuzz.sh 600               ten minutes each
#   scripts/fuzz.sh 60 lights match   these targets
#
# What was found before is kept in build/fuzz/corpus and goes on from there; an input that breaks a parser is written to
# build/fuzz/broken, and named. VIRGA_FUZZ_SEED chooses other random numbers.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

seconds=60
if [[ ${1:-} =~ ^[0-9]+$ ]]; then
    seconds=$1
    shift
fi
command -v clang++ > /dev/null || "$repo/scripts/setup.sh" clang
# Mesa and libav keep what they allocate until the process ends, so leaks are not looked for.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=0:strict_string_checks=1}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1:halt_on_error=1}
VIRGA_TARGETS=virga_fuzz build_preset fuzz

targets=("$@")
[[ $# -gt 0 ]] || mapfile -t targets < <("$build/bin/virga_fuzz")
mkdir -p "$build/broken"
status=0
for target in "${targets[@]}"; do
    corpus=$build/corpus/$target
    "$build/bin/virga_fuzz" "$target" --seeds "$corpus"
    echo "$target: $seconds s from $(find "$corpus" -type f | wc -l) inputs" >&2
    dictionary=()
    [[ ! -s $corpus.dict ]] || dictionary=(-dict="$corpus.dict")
    if ! "$build/bin/virga_fuzz" "$target" "$corpus" "${dictionary[@]}" -max_total_time="$seconds" -max_len=4096 \
        -timeout=10 -rss_limit_mb=2048 -seed="${VIRGA_FUZZ_SEED:-1}" -print_final_stats=1 -verbosity=0 \
        -artifact_prefix="$build/broken/$target-" 2> "$build/$target.log"; then
        grep -vE '^(INFO|#[0-9]|Dictionary)' "$build/$target.log" >&2
        status=1
    fi
    grep -E '^stat::number_of_executed_units' "$build/$target.log" >&2 || true
done
exit "$status"
