#!/usr/bin/env bash
# clang-tidy over src/, cli/ and lib/ (.clang-tidy has the checks).
#
#   scripts/tidy.sh                       everything
#   scripts/tidy.sh src/sh/Harmonics.cpp  these files
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

"$repo/scripts/setup.sh"
"$repo/scripts/setup.sh" clang-tidy
build=${VIRGA_BUILD_ROOT:-$repo/build}/release
cd "$repo"
[[ -f $build/compile_commands.json ]] || cmake --preset release -B "$build" --log-level=WARNING
if (($#)); then
    files=("$@")
else
    mapfile -t files < <(git ls-files 'src/*.cpp' 'cli/*.cpp' 'lib/*.cpp')
fi
printf '%s\0' "${files[@]}" | xargs -0 --max-args=1 --max-procs="$jobs" clang-tidy -p "$build" --quiet
