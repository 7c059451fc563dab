#!/bin/bash
# Makes samples/: a street without rain, with its depth, panorama and camera, from nothing but the Python in
# scripts/make_sample/. Debian 12; Blender renders on the CPU. Half an hour or so on two cores.
#
#   scripts/make_sample.sh                    everything, into samples/
#   WORK=/somewhere scripts/make_sample.sh    where renders are kept; finished ones are not rendered again
#   PASSES=4 scripts/make_sample.sh           more passes of 40 samples a pixel (2 unless said): slower, crisper
set -euo pipefail
here="$(cd "$(dirname "$0")" && pwd)"
out="${OUT:-$here/../samples}"
work="${WORK:-${TMPDIR:-/tmp}/virga_sample}"
passes="${PASSES:-2}"

needed=(blender python3-numpy python3-opencv python3-openimageio ffmpeg)
missing=()
for package in "${needed[@]}"; do
    dpkg -s "$package" >/dev/null 2>&1 || missing+=("$package")
done
if ((${#missing[@]})); then
    echo "installing: ${missing[*]}" >&2
    sudo=""; ((EUID == 0)) || sudo=sudo
    $sudo apt-get install -y --no-install-recommends "${missing[@]}"
fi

mkdir -p "$work" "$out"

# render FILE WHAT [options]: renders to a temporary name first, so that a file that exists is whole.
render() {
    local file="$work/$1"; shift
    [[ -s "$file" ]] && return
    echo "rendering $(basename "$file")" >&2
    nice -n "${NICE:-19}" blender --background --factory-startup --python-exit-code 1 \
        --python "$here/make_sample/render.py" -- "$1" "${file%.*}.part.${file##*.}" "${@:2}" >"$file.log" 2>&1 ||
        { tail -20 "$file.log" >&2; exit 1; }
    mv "${file%.*}.part.${file##*.}" "$file"
}

render points.json points
render depth.exr depth
for ((pass = 1; pass <= passes; ++pass)); do
    render "plate_$pass.exr" plate --samples 40 --seed "$pass"
done
render env_1.exr env --samples 64 --seed 101 --scale 2.8444444
# A folder of small files, each whole; goes on where it stopped.
echo "rendering car" >&2
nice -n "${NICE:-19}" blender --background --factory-startup --python-exit-code 1 \
    --python "$here/make_sample/render.py" -- car "$work/car" --samples 20 >"$work/car.log" 2>&1 ||
    { tail -20 "$work/car.log" >&2; exit 1; }

# The system's Python has Debian's NumPy, OpenCV and OpenImageIO; another one first on PATH may not.
nice -n "${NICE:-19}" /usr/bin/python3 "$here/make_sample/post.py" --work "$work" --out "$out" --passes "$passes"
