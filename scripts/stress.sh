#!/usr/bin/env bash
# The stress suite at length: shots chosen by chance over the whole parameter table, each rendered and held to the laws
# of tests/stress (no NaN, no negative light, alpha in [0, 1], energy within bounds), or refused in a sentence; a twentieth as
# many through shaders, GL errors looked for after each frame; and the worst cases by name.
#
#   scripts/stress.sh                 3,000 shots of seed 1
#   scripts/stress.sh 20000 7         20,000 shots of seed 7
#   scripts/stress.sh 3000 7 812      number 812 of seed 7 alone, with all that it is made of
#
# A failure names seed and number. VIRGA_STRESS_DEVICE chooses the OpenGL device. A picture of 16384x16384 takes 9 GB.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

export VIRGA_STRESS_LONG=1 VIRGA_STRESS_COUNT=${1:-3000} VIRGA_STRESS_SEED=${2:-1}
filter='*'
if [[ -n ${3:-} ]]; then
    export VIRGA_STRESS_ONLY=$3
    filter='Combinations.RenderLawfully*'
fi
VIRGA_TARGETS=test_stress build_preset "${VIRGA_PRESET:-test}"
exec "$build/bin/test_stress" --gtest_filter="$filter"
