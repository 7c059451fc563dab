#!/usr/bin/env bash
# Makes the pictures of docs/extract.md in docs/images: rain over a still of the sample street, coded as a camera would,
# taken out again. Needs build/release (scripts/demo.sh makes it) and ffmpeg.
set -euo pipefail
repo=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
virga=${VIRGA:-$repo/build/release/bin/virga}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
samples=$repo/samples images=$repo/docs/images

ffmpeg -v error -i "$samples/street.mp4" -vf "select=eq(n\,48)" -frames:v 1 "$work/still.png"
"$virga" rain "$work/still.png" -o "$work/rain.%04d.png" --frames 48-67 --rate 40 --wind 1,0 --exposure 0.006 \
    --depth "$samples/street_depth.0048.exr" --env "$samples/street_env.exr" --env-gain 1.5 --darken 0 --desaturate 0 \
    --fog 0 --quiet
ffmpeg -v error -framerate 25 -start_number 48 -i "$work/rain.%04d.png" -c:v libx264 -crf 16 -pix_fmt yuv420p "$work/rain.mp4"
"$virga" extract "$work/rain.mp4" -o "$work/out"
ffmpeg -v error -y -i "$work/out/sheet.png" -q:v 3 "$images/extract_sheet.jpg"

# The curve of docs/benchmarks.md, where the benchmarks are built.
curve=$repo/build/test/bin/bench_extract_curve
[[ -x $curve ]] && "$curve" --svg "$images/extract_curve.svg" >/dev/null
exit 0
