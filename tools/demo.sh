#!/usr/bin/env bash
# The demonstration: a flight is made (or taken from DATASET), build/rover runs on it, the result is
# judged, and a report is written to look at.   tools/demo.sh [DATASET [MODE]]
#
# What was made by the same program from the same arguments is kept: a second call takes seconds.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root output=$root/build/demo rover=$root/build/rover
readonly run=$output/run
dataset=${1:-} mode=${2:-}

say() { echo "demo: $*"; }

# kept FOLDER KEY: whether the folder was finished with this key.
kept() { [[ -f $1.stamp && $(< "$1.stamp") == "$2" && -d $1 ]]; }

# Twenty seconds of a stereo flight through a room, with inertial data.
simulate() {
  local arguments=(--scene room --duration 20 --scene-seed 1 --seed 1)
  local key="$program ${arguments[*]}"
  dataset=$output/flight
  kept "$dataset" "$key" && return
  say "rendering a flight through a room: a minute or two"
  "$rover" simulate --output "$dataset" --overwrite "${arguments[@]}"
  echo "$key" > "$dataset.stamp"
}

run_slam() {
  local key="$program $dataset $mode"
  if kept "$run" "$key"; then
    say "nothing has changed since the last run, which is judged again"
    return
  fi
  rm -rf "$run" "$run.stamp"
  say "running rover ($mode) on $dataset"
  "$rover" run --dataset "$dataset" --mode "$mode" --output "$run"
  echo "$key" > "$run.stamp"
}

# The features that two images some way apart have in common.
draw_matches() {
  local images
  mapfile -t images < <(find -L "$dataset" -path '*cam0*' -name '*.png' | sort)
  [[ ${#images[@]} -gt 20 ]] || return 0
  "$rover" match "${images[0]}" "${images[20]}" --output "$output/matches.png" > /dev/null
  say "what two images have in common: $output/matches.png"
}

if [[ -n $dataset && ! -d $dataset ]]; then
  echo "demo: there is no sequence in $dataset" >&2
  echo "demo: give a folder in the layout of EuRoC, TUM RGB-D or KITTI odometry:" \
    "make demo DATASET=folder MODE=mono; or none, and one is made" >&2
  exit 2
fi

mkdir -p "$output"
program=$(sha256sum < "$rover" | cut -c1-16)
if [[ -z $dataset ]]; then
  simulate
  mode=${mode:-stereo}
fi
mode=${mode:-mono}
run_slam
"$rover" evaluate --run "$run" --dataset "$dataset"
draw_matches
say "everything to look at: $run/report.html"
