#!/usr/bin/env bash
# Lets Godot 3 import GLBs: bash tests/godot.sh GODOT-SERVER FILE... Fails if one does not become a scene.
set -euo pipefail
godot=$1
shift
project=$(mktemp -d)
trap 'rm -rf "$project"' EXIT
printf 'config_version=4\n[application]\nconfig/name="import"\n' >"$project/project.godot"
cp "$@" "$project"
# The editor imports what it finds when it starts, and never ends by itself.
timeout 300 "$godot" --editor --path "$project" >"$project/godot.txt" 2>&1 &
editor=$!
for _ in {1..290}; do
    [ "$(find "$project/.import" -name '*.scn' 2>/dev/null | wc -l)" -lt $# ] || break
    sleep 1
done
kill "$editor" 2>/dev/null || true
scenes=$(find "$project/.import" -name '*.scn' -size +1k | wc -l)
echo "$scenes of $# files became scenes"
[ "$scenes" -eq $# ] || { grep -a ERROR "$project/godot.txt" | head -20 >&2; exit 1; }
