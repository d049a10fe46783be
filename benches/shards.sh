#!/usr/bin/env bash
# What shards cost, in one run:
#
#     benches/shards.sh [LARGEST]
#
# First what is planned beyond their edges: the middle one of nine shards, 3 x 3 of so many tiles a side, beside what a tile costs in
# a large bake; for land of noise, and for land with rivers and roads. Then a model of a bake in shards up to 10^12 vertices, and its
# test at 10^8 and 10^9 vertices, or up to 10^LARGEST.
#
# The model, of a bake of V vertices in N shards: a shard takes a + b V/N + c sqrt(V/N) of a core's time, where a is its begin and end,
# b what a vertex costs, and c what lies beyond its edge. Its assumptions: tiles cost the same everywhere, cores are those of this machine
# and have their shard for themselves, disks are as fast for all as for one, and the merge reads what shards keep at the rate measured here.
set -euo pipefail
cd "$(dirname "$0")/.."

largest=${1:-9}
target=${CARGO_TARGET_DIR:-target}
work=$target/shards-bench
terrane=${TERRANE:-$target/release/terrane}

[ -n "${TERRANE:-}" ] || cargo build --release
rm -rf "$work"
mkdir -p "$work"

# Seconds of all cores that a command takes.
spent() {
    local TIMEFORMAT='%U %S'
    { time "$@" >"$work/log.txt" 2>&1; } 2>"$work/time.txt" || { cat "$work/log.txt" >&2; return 1; }
    awk '{ print $1 + $2 }' "$work/time.txt"
}

# Seconds of a shard of so many tiles a side, with eight others around it.
shard() {
    local preset=$1 side=$2 exports=$3
    rm -rf "$work/shard"
    spent "$terrane" bake "$preset" --size "$((3 * side))x$((3 * side))" --shard 5/9 --export "$exports" --quiet --out "$work/shard"
}

echo "| preset | shard | vertices | core seconds | us a vertex | over the largest |"
echo "|---|---|---|---|---|---|"
for row in thesis:8,16,32,64 alps:2,4,8,16; do
    preset=${row%:*}
    sides=${row#*:}
    : >"$work/$preset.txt"
    for side in ${sides//,/ }; do
        vertices=$((side * side * 256 * 256))
        echo "$side $vertices $(shard "$preset" "$side" height,hashes)" >>"$work/$preset.txt"
    done
    awk -v preset="$preset" '
        { side[NR] = $1; vertices[NR] = $2; seconds[NR] = $3 }
        END {
            least = seconds[NR] / vertices[NR]
            for (i = 1; i <= NR; i++)
                printf "| %s | %d x %d tiles | %.2g | %.2f | %.3f | %+.0f %% |\n", preset, side[i], side[i], vertices[i], seconds[i],
                    1e6 * seconds[i] / vertices[i], 100 * (seconds[i] / vertices[i] / least - 1)
        }' "$work/$preset.txt"
done

# The model of land of noise, by least squares of the share of each in what was measured.
read -r a b c < <(python3 - "$work/thesis.txt" <<'FIT'
import sys

rows = [[float(word) for word in line.split()] for line in open(sys.argv[1])]
# Divided by what was measured, so that all sizes count alike.
lines = [[1 / seconds, vertices / seconds, vertices**0.5 / seconds] for _, vertices, seconds in rows]
matrix = [[sum(line[i] * line[j] for line in lines) for j in range(3)] + [sum(line[i] for line in lines)] for i in range(3)]
for i in range(3):
    for j in range(3):
        if i != j:
            factor = matrix[j][i] / matrix[i][i]
            matrix[j] = [x - factor * y for x, y in zip(matrix[j], matrix[i])]
print(*(matrix[i][3] / matrix[i][i] for i in range(3)))
FIT
)
printf '\na shard takes %.3g s + %.3g us a vertex + %.3g us for each vertex of a side, of a core\n\n' "$a" "$(awk -v b="$b" 'BEGIN { print 1e6 * b }')" "$(awk -v c="$c" 'BEGIN { print 1e6 * c }')"
model() {
    awk -v a="$a" -v b="$b" -v c="$c" -v v="$1" -v n="$2" 'BEGIN { s = v / n; print n * (a + b * s + c * sqrt(s)) }'
}

echo "| vertices | shards | model, core seconds | measured | error |"
echo "|---|---|---|---|---|"
for power in $(seq 8 12); do
    # Squares of 256 cells: 10,000 vertices a side are 39 tiles.
    tiles=$(awk -v p="$power" 'BEGIN { printf "%.0f", sqrt(10 ^ p) / 256 }')
    shards=$(awk -v p="$power" 'BEGIN { printf "%.0f", 4 ^ (p - 7) }')
    vertices=$((tiles * tiles * 65536))
    expected=$(model "$vertices" "$shards")
    measured=- error=-
    if [ "$power" -le "$largest" ]; then
        measured=0
        for number in $(seq "$shards"); do
            rm -rf "$work/shard"
            seconds=$(spent "$terrane" bake thesis --size "${tiles}x$tiles" --shard "$number/$shards" --export height,hashes --quiet --out "$work/shard")
            measured=$(awk -v a="$measured" -v b="$seconds" 'BEGIN { print a + b }')
        done
        error=$(awk -v m="$measured" -v e="$expected" 'BEGIN { printf "%+.1f %%", 100 * (e / m - 1) }')
    fi
    printf '| %.3g | %d | %.4g | %s | %s |\n' "$vertices" "$shards" "$expected" "$measured" "$error"
done
rm -rf "$work"
