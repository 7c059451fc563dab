#!/usr/bin/env bash
# Renders the pictures of docs/env.md from the sample street into docs/images/, and prints the figures beside them.
#
#   scripts/make_env_images.sh
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

build_preset release
virga=$build/bin/virga
samples=$repo/samples
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# jpeg NAME PNG: a preview into docs/images/NAME.jpg.
jpeg() {
    ffmpeg -v error -y -i "$2" -vf scale=1200:-2:flags=area -q:v 4 "$repo/docs/images/$1.jpg"
    echo "docs/images/$1.jpg: $(($(stat -c %s "$repo/docs/images/$1.jpg") / 1024)) KB"
}

"$virga" env "$samples/street_env.exr" -o "$work/panorama.exr"
jpeg env_panorama "$work/panorama_preview.png"
"$virga" env "$samples/street.mp4" -o "$work/street.exr" --yaw -9.5 --pitch 4.6
jpeg env_street "$work/street_preview.png"
/usr/bin/python3 "$repo/scripts/env/film_pan.py" "$samples/street_env.exr" "$work"
"$virga" env "$work/pan.####.exr" -o "$work/pan.exr" --yaw -100
jpeg env_pan "$work/pan_preview.png"
