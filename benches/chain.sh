#!/usr/bin/env bash
# A whole bake beside the programs that one would chain for the same, on one core, in one run:
#
#     benches/chain.sh [TILES]
#
# A square of so many tiles a side of the thesis' terrain (32: 8192 x 8192 cells) becomes a 16-bit PNG, a shaded map in
# colours and meshes that are 1 m off at most. The peers are given the heights, so that their first step, the noise, costs
# them nothing; terrane makes its own, with rivers and roads, and wraps its meshes in textures.
#
# Takes GDAL's programs from Debian's package, and hmm (https://github.com/fogleman/hmm) from its source or from the path in
# HMM; where it cannot be had its line is left out.
set -euo pipefail
cd "$(dirname "$0")/.."

tiles=${1:-32}
target=${CARGO_TARGET_DIR:-target}
work=$target/chain

cargo build --release
if ! command -v gdaldem >/dev/null; then
    apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends gdal-bin
fi
hmm=${HMM:-$target/hmm/hmm}
if ! [ -x "$hmm" ]; then
    apt-get install -y --no-install-recommends g++ git libglm-dev make >/dev/null || true
    { [ -d "$target/hmm" ] || git clone --quiet https://github.com/fogleman/hmm "$target/hmm"; } && make -s -C "$target/hmm" ||
        echo "hmm cannot be had here" >&2
fi

rm -rf "$work"
mkdir -p "$work"
# The first of the cores that this may run on.
core=$(taskset -cp $$ | sed 's/.*: *\([0-9]*\).*/\1/')
bake=(taskset -c "$core" "$target/release/terrane" bake thesis --size "${tiles}x$tiles" --threads 1)

. benches/timed.sh

# The peers' heights: as bare numbers, with the header by which GDAL knows them.
"${bake[@]}" --export r16 --out "$work/heights" >/dev/null
raw=$work/heights/height/height.r16
side=$((tiles * 256 + 1))
printf 'ENVI\nsamples = %d\nlines = %d\nbands = 1\ndata type = 12\nbyte order = 0\n' "$side" "$side" >"${raw%.r16}.hdr"
printf '0 60 90 50\n20000 120 140 80\n40000 150 130 100\n65535 250 250 250\n' >"$work/colours.txt"
# Metres of the 65,535 steps.
range_m=$(python3 -c "import json; r = json.load(open('$work/heights/bake.json'))['height_range']; print(r['max_m'] - r['min_m'])")
scale=$(awk -v range="$range_m" 'BEGIN { print range / 65535 }')

echo "| step | time |"
echo "|---|---|"
one=(taskset -c "$core")
timed "terrane: PNG, map, meshes with textures" "${bake[@]}" --lod 1 --mesh-error 1 --export height,map,gltf --out "$work/bake" --overwrite
ours=$sum
sum=0
timed "gdal_translate: 16-bit PNG" "${one[@]}" gdal_translate -q -of PNG -co ZLEVEL=1 "$raw" "$work/height.png"
timed "gdaldem: hillshade" "${one[@]}" gdaldem hillshade -q -z "$scale" "$raw" "$work/shade.tif"
timed "gdaldem: colour relief" "${one[@]}" gdaldem color-relief -q "$raw" "$work/colours.txt" "$work/colours.tif"
if [ -x "$hmm" ]; then
    timed "hmm: mesh at 1 m" "${one[@]}" "$hmm" "$work/height.png" "$work/mesh.stl" -z "$range_m" -e "$(awk -v range="$range_m" 'BEGIN { print 1 / range }')"
else
    echo "SKIPPED: hmm, since its source cannot be had here"
fi
awk -v ours="$ours" -v peers="$sum" 'BEGIN { printf "\nthe peers together: %.2f s, %.2f times terrane\n", peers, peers / ours }'
rm -rf "$work"
