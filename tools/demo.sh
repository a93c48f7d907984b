#!/usr/bin/env bash
# Runs build/rover on a sequence and judges the result.   tools/demo.sh DATASET MODE
set -euo pipefail

readonly dataset=$1 mode=$2
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root output=$root/build/demo rover=$root/build/rover

if [[ ! -d $dataset ]]; then
  cat >&2 << EOF
demo: there is no sequence in $dataset
demo: download and unpack "fr1/xyz" of the TUM RGB-D benchmark (freiburg1_xyz, 0.4 GB), then:
demo:     make demo DATASET=<folder with rgb.txt and groundtruth.txt>
demo: EuRoC and KITTI odometry folders work as well (MODE=mono, stereo, ...).
EOF
  exit 2
fi

rm -rf "$output"
echo "demo: running rover ($mode) on $dataset"
"$rover" run --dataset "$dataset" --mode "$mode" --output "$output"
"$rover" evaluate --run "$output" --dataset "$dataset"
echo "demo: everything is in $output"
find "$output" \( -name '*.png' -o -name '*.svg' -o -name '*.html' \) -printf 'demo: picture %p\n' |
  sort
