#!/usr/bin/env bash
# From a fresh clone to a picture: installs what is missing, builds, and rains on the sample street.
#
#   scripts/demo.sh                          demo/street_rain.mp4, demo/before_after.png, demo/layers.####.exr
#   scripts/demo.sh --rate 80 --wind 5,2     other settings of `virga rain` than --rate 25
#
# VIRGA_DEMO_DIR=/somewhere puts the results elsewhere.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

demo=${VIRGA_DEMO_DIR:-$repo/demo}
samples=$repo/samples
mkdir -p "$demo"
demo=$(cd "$demo" && pwd)
build_preset release
virga=$build/bin/virga

look=(--rate 25)
(($#)) && look=("$@")
street=(--depth "$samples/street_depth.####.exr" --env "$samples/street_env.exr" --camera "$samples/street.chan")
"$virga" rain "$samples/street.mp4" -o "$demo/street_rain.mp4" "${look[@]}" "${street[@]}" \
    --preview "$demo/before_after.png"
"$virga" rain "$samples/street.mp4" -o "$demo/layers.####.exr" "${look[@]}" "${street[@]}" \
    --frames 48 --layers --quiet

echo
echo "The movie:       $demo/street_rain.mp4"
echo "Before/after:    $demo/before_after.png"
echo "Layers (EXR):    $demo/layers.0048.exr"
