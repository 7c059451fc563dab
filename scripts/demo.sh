#!/usr/bin/env bash
# From a fresh clone to a picture: installs what is missing, builds, and rains on the sample street.
#
#   scripts/demo.sh              demo/street_rain.mp4, demo/before_after.png, demo/layers.####.exr
#   scripts/demo.sh --rate 80    the same with other settings of `virga rain`
#
# VIRGA_DEMO_DIR=/somewhere puts the results elsewhere.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

demo=${VIRGA_DEMO_DIR:-$repo/demo}
samples=$repo/samples
mkdir -p "$demo"
demo=$(cd "$demo" && pwd)
build_preset release
virga=$build/bin/virga

street=(--depth "$samples/street_depth.####.exr" --env "$samples/street_env.exr" --camera "$samples/street.chan")
"$virga" rain "$samples/street.mp4" -o "$demo/street_rain.mp4" --rate 25 "${street[@]}" \
    --preview "$demo/before_after.png" "$@"
"$virga" rain "$samples/street.mp4" -o "$demo/layers.####.exr" --rate 25 "${street[@]}" \
    --frames 48 --layers "$@"

echo
echo "The movie:       $demo/street_rain.mp4"
echo "Before/after:    $demo/before_after.png"
echo "Layers (EXR):    $demo/layers.0048.exr"
