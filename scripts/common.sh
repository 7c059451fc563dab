# Sourced by the scripts beside it: where the repository is, and how it is built.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
jobs=${VIRGA_JOBS:-$(nproc)}

# build_preset NAME: installs what is missing, configures and builds build/NAME, which is then $build.
# With VIRGA_BUILD_ROOT set, builds go there instead of build/. VIRGA_TARGETS: build these alone.
build_preset() {
    build=${VIRGA_BUILD_ROOT:-$repo/build}/$1
    "$repo/scripts/setup.sh"
    mkdir -p "$build" || { echo "cannot make '$build'; set VIRGA_BUILD_ROOT to a folder that can be written" >&2; exit 1; }
    echo "building $build with $jobs jobs" >&2
    (cd "$repo" && cmake --preset "$1" -B "$build" --log-level=WARNING)
    local targets=()
    [[ -z ${VIRGA_TARGETS:-} ]] || read -ra targets <<< "--target $VIRGA_TARGETS"
    cmake --build "$build" --parallel "$jobs" "${targets[@]}"
}
