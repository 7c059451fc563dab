#!/usr/bin/env bash
# Formats the C++ sources in place (.clang-format).
#
#   scripts/format.sh             everything
#   scripts/format.sh --check     changes nothing; fails and says where if something would change
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

"$repo/scripts/setup.sh" clang-format
cd "$repo"
flags=(-i)
[[ ${1:-} == --check ]] && flags=(--dry-run --Werror)
git ls-files -z '*.cpp' '*.h' '*.c' | xargs -0 clang-format "${flags[@]}"
