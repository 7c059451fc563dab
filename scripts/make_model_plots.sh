#!/usr/bin/env bash
# Draws the charts of docs/model.md into docs/images/model_*.svg.
#
#   scripts/make_model_plots.sh                    builds virga first
#   VIRGA=build/bin/virga scripts/make_model_plots.sh
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

virga=${VIRGA:-}
if [ -z "$virga" ]; then
    build_preset release
    virga=$build/bin/virga
fi
images=$repo/docs/images
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$images"

# Once around the horizon, from behind over the left, ahead and the right, as the panorama has it.
python3 - > "$work/horizon.json" << 'PYTHON'
import json, math
angles = [math.radians(5 * i - 180) for i in range(73)]
print(json.dumps([[math.sin(a), 0, -math.cos(a)] for a in angles]))
PYTHON

for model in "transfer --order 64" fresnel shape airlight velocity sizes extinction; do
    # shellcheck disable=SC2086  # the words of a model are apart
    "$virga" model $model --plot "$images/model_${model%% *}.svg"
done
cp "$repo/samples/street_env.exr" "$work/"
(cd "$work" && "$virga" model radiance --env street_env.exr --directions horizon.json --plot "$images/model_radiance.svg")
ls -l "$images"/model_*.svg
