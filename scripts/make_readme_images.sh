#!/usr/bin/env bash
# Renders the pictures of README.md from the sample street into docs/images/ (JPEG, each under 300 KB).
#
#   scripts/make_readme_images.sh
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

build_preset release
virga=$build/bin/virga
samples=$repo/samples
images=$repo/docs/images
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$images"
frame=60
street=("$samples/street.mp4" --frames "$frame" --quiet --depth "$samples/street_depth.####.exr"
        --env "$samples/street_env.exr" --camera "$samples/street.chan")
off=(--rate 0 --fog 0 --darken 0 --desaturate 0 --blur 0 --splashes 0)
number=$(printf %04d "$frame")

# jpeg NAME INPUT... FILTER: pictures through a filter graph into docs/images/NAME.jpg.
jpeg() {
    local name=$1 inputs=()
    for file in "${@:2:$#-2}"; do inputs+=(-i "$file"); done
    ffmpeg -v error -y "${inputs[@]}" -filter_complex "${*: -1}" -q:v 4 "$images/$name.jpg"
    echo "docs/images/$name.jpg: $(($(stat -c %s "$images/$name.jpg") / 1024)) KB"
}

"$virga" rain "${street[@]}" -o "$work/plate.png" "${off[@]}"
"$virga" rain "${street[@]}" -o "$work/rain.png" --rate 40
"$virga" rain "${street[@]}" -o "$work/storm.png" --rate 80 --wind 5,2 --gust 2
"$virga" rain "${street[@]}" -o "$work/night.png" --rate 30 --darken 0.85 --desaturate 0.4 --env-gain 0.15 \
    --lights "$samples/street_lamps.toml"
"$virga" rain "${street[@]}" -o "$work/layers.####.exr" --rate 80 --layers

jpeg before_after "$work/plate.png" "$work/rain.png" "vstack"
jpeg storm_night "$work/storm.png" "$work/night.png" "[0]scale=720:-2[a];[1]scale=720:-2[b];[a][b]hstack"

# The layers as they are: premultiplied, scene-linear light shown through the sRGB curve.
for layer in plate fog splash rain; do
    oiiotool "$work/layers.$number.exr" --ch "$layer.R,$layer.G,$layer.B" --chnames R,G,B \
        --colorconvert linear sRGB --clamp:min=0:max=1 -d uint8 -o "$work/$layer.png"
done
jpeg layers "$work/plate.png" "$work/fog.png" "$work/splash.png" "$work/rain.png" \
    "[0]scale=720:-2[a];[1]scale=720:-2[b];[2]scale=720:-2[c];[3]scale=720:-2[d];[a][b]hstack[e];[c][d]hstack[f];[e][f]vstack"
