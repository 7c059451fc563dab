#!/usr/bin/env bash
# The whole command against a plain transcode of the same clip with the same codec settings, in one run:
#   bench/end_to_end.sh [path/to/virga] [strokes]
# Makes a 720x480 clip from the sample, times `ffmpeg` and `virga rain --strokes N` in turn, three times each, and prints
# the medians, their ratio and where virga's time goes.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
virga=${1:-$root/build/release/bin/virga}
strokes=${2:-80000}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

ffmpeg -v error -i "$root/samples/street.mp4" -vf scale=720:480 -an -c:v libx264 -crf 16 "$work/clip.mp4"
seconds() { local start=$EPOCHREALTIME; "$@" >/dev/null 2>&1; echo "$EPOCHREALTIME $start" | awk '{printf "%.3f\n", $1 - $2}'; }
median() { sort -n | sed -n 2p; }

for _ in 1 2 3; do
    seconds ffmpeg -y -i "$work/clip.mp4" -c:v libx264 -crf 18 "$work/plain.mp4" >> "$work/plain.txt"
    seconds "$virga" rain "$work/clip.mp4" -o "$work/rain.mp4" --strokes "$strokes" --fov 60 --codec libx264 \
        --quality 18 >> "$work/rain.txt"
done
"$virga" rain "$work/clip.mp4" -o "$work/rain.mp4" --strokes "$strokes" --fov 60 --codec libx264 --quality 18 --json \
    --quiet > "$work/report.json"
plain=$(median < "$work/plain.txt") rain=$(median < "$work/rain.txt")
frames=$(ffprobe -v error -count_packets -select_streams v -show_entries stream=nb_read_packets -of csv=p=0 "$work/clip.mp4" | tr -d ,)
awk -v p="$plain" -v r="$rain" -v n="$frames" 'BEGIN {
    printf "plain transcode  %.2f s, %.1f ms a frame\nvirga rain       %.2f s, %.1f ms a frame\nratio            %.2f\n",
        p, 1e3 * p / n, r, 1e3 * r / n, r / p }'
python3 - "$work/report.json" <<'PY'
import json, sys
r = json.load(open(sys.argv[1]))
print(f"{r['device']}: {r['strokes_per_frame']:.0f} strokes a frame, rendering {r['render_ms_per_frame']:.1f} ms a frame")
print(", ".join(f"{name} {ms:.1f}" for name, ms in r["passes"].items()))
PY
