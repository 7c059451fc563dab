#!/usr/bin/env bash
# Renders the pictures of docs/light.md: the sample street in the rain under the skies of scripts/light/skies.py.
#
#   scripts/make_light_images.sh
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

build_preset release
samples=$repo/samples
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
/usr/bin/python3 "$repo/scripts/light/skies.py" "$work"

# render SKY FLAG...: one frame of the street under that sky.
render() {
    "$build/bin/virga" rain "$samples/street.mp4" --frames 60 --quiet --depth "$samples/street_depth.####.exr" \
        --camera "$samples/street.chan" --env "$work/$1.exr" --rate 60 -o "$work/$1.png" "${@:2}"
}
render overcast --darken 0.1
render low_sun --darken 0.2 --desaturate 0
render night --darken 0.85 --desaturate 0.4
ffmpeg -v error -y -i "$work/overcast.png" -i "$work/low_sun.png" -i "$work/night.png" \
    -filter_complex "vstack=3,scale=840:-2" -q:v 4 "$repo/docs/images/light_street.jpg"

# The sun behind: what the many small drops of the fog return, seen through a wide lens.
"$build/bin/virga" rain "$samples/street.mp4" --frames 60 --quiet --fov 100 --env "$work/sun_behind.exr" --rate 60 \
    --exposure 0.04 --darken 0.7 -o "$work/bow.png"
ffmpeg -v error -y -i "$work/bow.png" -vf "scale=840:-2" -q:v 3 "$repo/docs/images/light_bow.jpg"
for name in street bow; do
    echo "docs/images/light_$name.jpg: $(($(stat -c %s "$repo/docs/images/light_$name.jpg") / 1024)) KB"
done
