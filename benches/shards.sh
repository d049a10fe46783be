#!/usr/bin/env bash
# What shards cost, in one run:
#
#     benches/shards.sh [LARGEST]
#
# First what is planned beyond their edges: the middle one of nine shards, of so many tiles a side, for land of noise with rivers and
# roads of agents, and for land of rivers with planned roads. Then a model of a bake in shards up to 10^12 vertices, and its test at 10^8
# and 10^9 vertices, or up to 10^LARGEST; heights and hashes are written. Takes python3, and 10 GiB of the disk.
#
# The model: a shard of V vertices takes a + b V + c sqrt(V) of a core's time, where a is its begin and its end, b what a vertex costs, and
# c what lies beyond its edges; and a merge d for each vertex. Its assumptions: tiles cost the same everywhere, cores are those of
# this machine, and disks are as fast for all shards at once as for one. TERRANE may name the program.
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

# The least of three times: other work only adds to them.
shard() {
    for _ in 1 2 3; do
        rm -rf "$work/shard"
        spent "$terrane" bake "$1" --size "$((3 * $2))x$((3 * $2))" --shard 5/9 --export height,hashes --quiet --out "$work/shard"
    done | sort -g | head -n 1
}

# The a, b and c of lines of vertices and seconds, none of them below zero.
fit() {
    python3 - "$1" <<'FIT'
import itertools
import sys

rows = [[float(word) for word in line.split()] for line in open(sys.argv[1])]


def solved(terms):
    """Least squares of what is off in parts of what was measured, so that all sizes count alike."""
    lines = [[(1, v, v**0.5)[term] / s for term in terms] for _, v, s in rows]
    size = len(terms)
    matrix = [[sum(l[i] * l[j] for l in lines) for j in range(size)] + [sum(l[i] for l in lines)] for i in range(size)]
    for i in range(size):
        for j in range(size):
            if i != j:
                factor = matrix[j][i] / matrix[i][i]
                matrix[j] = [x - factor * y for x, y in zip(matrix[j], matrix[i])]
    found = [matrix[i][size] / matrix[i][i] for i in range(size)]
    off = sum((sum(x * y for x, y in zip(line, found)) - 1) ** 2 for line in lines)
    values = [0, 0, 0]
    for term, value in zip(terms, found):
        values[term] = value
    return off, values


choices = [terms for count in (1, 2, 3) for terms in itertools.combinations(range(3), count)]
fits = [fit for fit in map(solved, choices) if min(fit[1]) >= 0]
print(*min(fits)[1])
FIT
}

echo "| preset | shard | vertices | core seconds | us a vertex | more than without an edge |"
echo "|---|---|---|---|---|---|"
for row in alps:2,4,8,16 thesis:8,16,32,64; do
    preset=${row%:*}
    sides=${row#*:}
    : >"$work/$preset.txt"
    for side in ${sides//,/ }; do
        echo "$side $((side * side * 256 * 256)) $(shard "$preset" "$side")" >>"$work/$preset.txt"
    done
    read -r a b c < <(fit "$work/$preset.txt")
    awk -v preset="$preset" -v b="$b" '{
        printf "| %s | %d x %d tiles | %.2g | %.2f | %.3f | %+.0f %% |\n", preset, $1, $1, $2, $3, 1e6 * $3 / $2, 100 * ($3 / $2 / b - 1)
    }' "$work/$preset.txt"
    echo "$preset: a = $a s, b = $b s, c = $c s" >>"$work/models.txt"
done
echo
cat "$work/models.txt"
echo

# Of the last one, whose bakes are cheap enough to be tried.
merging=0
echo "| vertices | shards | model, core seconds | measured | model is off by | merge, core seconds |"
echo "|---|---|---|---|---|---|"
for power in $(seq 8 12); do
    tiles=$(awk -v p="$power" 'BEGIN { printf "%.0f", sqrt(10 ^ p) / 256 }')
    shards=$((4 ** (power - 7)))
    vertices=$((tiles * tiles * 65536))
    expected=$(awk -v a="$a" -v b="$b" -v c="$c" -v v="$vertices" -v n="$shards" 'BEGIN { s = v / n; print n * (a + b * s + c * sqrt(s)) }')
    measured=- off=- merged=$(awk -v m="$merging" -v v="$vertices" 'BEGIN { printf "%.0f by the model", m * v }')
    if [ "$power" -le "$largest" ]; then
        measured=0
        for number in $(seq "$shards"); do
            # More of them than 10^9 vertices would fill the disk: they are baked, and not merged.
            [ "$power" -le 9 ] || rm -rf "$work/shards"
            seconds=$(spent "$terrane" bake thesis --size "${tiles}x$tiles" --shard "$number/$shards" --export height,hashes --quiet \
                --out "$work/shards/$number")
            measured=$(awk -v a="$measured" -v b="$seconds" 'BEGIN { print a + b }')
        done
        off=$(awk -v m="$measured" -v e="$expected" 'BEGIN { printf "%+.1f %%", 100 * (e / m - 1) }')
        if [ "$power" -le 9 ]; then
            merged=$(spent "$terrane" merge "$work"/shards/* --quiet --out "$work/merged")
            merging=$(awk -v m="$merged" -v v="$vertices" 'BEGIN { print m / v }')
        fi
        rm -rf "$work/shards" "$work/merged"
    fi
    printf '| %.3g | %d | %.4g | %s | %s | %s |\n' "$vertices" "$shards" "$expected" "$measured" "$off" "$merged"
done
rm -rf "$work"
