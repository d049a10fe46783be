#!/usr/bin/env bash
# All that is measured on a GPU, in one run: the kernels, and the land and the tiles that come back (docs/speed.md), whether bakes and maps
# have the same bytes, how long they take, and the experiment's columns.
#
#     benches/gpu.sh [FOLDER]
#
# The report of the experiment is left in the folder (out/gpu). Takes a GPU that `terrane devices` lists, and a quarter of an hour.
set -euo pipefail
cd "$(dirname "$0")/.."

out=${1:-out/gpu}
target=${CARGO_TARGET_DIR:-target}
terrane=$target/release/terrane
work=$target/gpu

cargo build --release
"$terrane" devices
cargo bench --bench gpu

rm -rf "$work"
for device in cpu gpu; do
    for preset in thesis hills mountains; do
        "$terrane" bake "$preset" --size 32x32 --device "$device" --no-progress --out "$work/$device/$preset"
    done
    "$terrane" map mountains --around=40,-30,40 --width 8000 --device "$device" --out "$work/$device/map.png"
done
diff --recursive --brief --exclude runs.jsonl "$work"/cpu "$work"/gpu
echo "the same bytes"
rm -rf "$work"

"$terrane" experiment --device cpu,gpu --workgroup 8,16,32 --overwrite --out "$out"
