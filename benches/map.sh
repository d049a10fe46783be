#!/usr/bin/env bash
# Maps beside GDAL's programs, in one run:
#
#     benches/map.sh [PIXELS]
#
# Draws a square of so many pixels a side (8192) of the thesis' terrain, at a pixel a vertex: in the style `relief`, which is
# light and shadow, on one core, beside `gdaldem hillshade`; and in the style `topographic`, with contours, names and legend, on
# two cores, beside `gdaldem hillshade` and `gdaldem color-relief`. GDAL's are given the heights; terrane makes its own, and the
# table says how long that takes it.
#
# Takes GDAL's programs from Debian's package.
set -euo pipefail
cd "$(dirname "$0")/.."

pixels=${1:-8192}
target=${CARGO_TARGET_DIR:-target}
work=$target/map-bench

cargo build --release
if ! command -v gdaldem >/dev/null; then
    apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends gdal-bin
fi
rm -rf "$work"
mkdir -p "$work"
terrane=$target/release/terrane
# The first of the cores that this may run on.
core=$(taskset -cp $$ | sed 's/.*: *\([0-9]*\).*/\1/')

. benches/timed.sh

tiles=$((pixels / 256))
"$terrane" bake thesis --size "${tiles}x$tiles" --export r16 --out "$work/heights" >/dev/null
raw=$work/heights/height/height.r16
side=$((tiles * 256 + 1))
printf 'ENVI\nsamples = %d\nlines = %d\nbands = 1\ndata type = 12\nbyte order = 0\n' "$side" "$side" >"${raw%.r16}.hdr"
printf '0 60 90 50\n20000 120 140 80\n40000 150 130 100\n65535 250 250 250\n' >"$work/colours.txt"
size=$((tiles * 256))
km=$(python3 -c "import json; print(json.load(open('$work/heights/bake.json'))['spacing_m'] * $size / 1000)")
map=("$terrane" map thesis --bounds "0,-$km,$km,0" --width "$size" --furniture none --overwrite)

printf '| %s x %s pixels | |\n|---|---|\n' "$size" "$size"
timed "gdaldem hillshade, one core" taskset -c "$core" gdaldem hillshade -q -s 1 "$raw" "$work/shade.tif"
timed "gdaldem color-relief, one core" taskset -c "$core" gdaldem color-relief -q "$raw" "$work/colours.txt" "$work/colours.tif"
timed "terrane bake, heights alone, one core" taskset -c "$core" "$terrane" bake thesis --size "${tiles}x$tiles" --threads 1 \
    --set 'rivers={density=0,width_m=[1,1],bank_m=1}' --export hashes --out "$work/land" --overwrite
timed "terrane map --style relief, one core" taskset -c "$core" "${map[@]}" --threads 1 --style relief --out "$work/relief.png"
timed "terrane map --style topographic, two cores" "${map[@]}" --threads 2 --out "$work/map.png"
