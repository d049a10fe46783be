"""Reads the meshes of a bake with assimp's command, and compares them with its manifest: python3 tests/assimp.py BAKE

BAKE must have the exports gltf, gltf-region, obj and obj-tiles, in floats: assimp 5.2 takes the whole numbers of
KHR_mesh_quantization for floats. It may have collision. Prints one line a check, with a figure; exits with 1 if one has failed.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

from checks import Checks

# The box is told to six places; an OBJ has as many digits as a float needs, and a GLB's places are moved by its tile.
EXACT_M = 1e-3
# Half a road's width and a bridge's rail, by which they may stick out of their tile.
ROAD_M = 20.0
MESH = re.compile(r"^ +\d+ \((.*)\): \[(\d+) / \d+ / (\d+) \| (\w+)\]$", re.MULTILINE)
POINT = re.compile(r"^(Minimum|Maximum) point +\((\S+) (\S+) (\S+)\)$", re.MULTILINE)


def read(path):
    """The meshes (name, vertices, triangles) in the file's order, and the box. An OBJ's vertices are those that differ."""
    told = subprocess.run(["assimp", "info", path, "-jiv" if path.suffix == ".obj" else "-r"], capture_output=True, text=True)
    if told.returncode:
        raise SystemExit(f"assimp does not read {path}:\n{told.stdout[-2000:]}{told.stderr}")
    meshes = [(name, int(vertices), int(faces), kind) for name, vertices, faces, kind in MESH.findall(told.stdout)]
    assert meshes and all(kind == "triangle" for *_, kind in meshes), (path, meshes)
    return [mesh[:3] for mesh in meshes], [[float(it) for it in point[1:]] for point in POINT.findall(told.stdout)]


def land_name(file, first):
    """The name of a tile's land: the first level of detail has no ending."""
    lod = file["mesh"]["lod"]
    ending = "-colonly" if file["export"] == "collision" else "" if lod == first else f"_lod{lod}"
    return f"land_x{file['tile']['x']}_y{file['tile']['y']}{ending}"


def off_box(box, mesh, room_m, sea_m):
    """Metres by which a box is not that of the manifest's land and the sea above it, with room for what sticks out of them."""
    east_m, up_m, south_m = mesh["max_m"]
    top_m = [east_m, max(up_m, sea_m), south_m]
    low = [told - found for told, found in zip(mesh["min_m"], box[0])]
    high = [found - told for told, found in zip(top_m, box[1])]
    return max(max(-off, off - room_m) for off in low + high)


def check_tiles(folder, checks, what, files, first, sea_m):
    """Tiles of one form and level of detail: all their meshes, in their order."""
    everything, wrong, off_m = [], [], []
    for file in files:
        meshes, box = read(folder / file["path"])
        mesh = file["mesh"]
        lands, seas = ([it for it in meshes if it[0].startswith(kind)] for kind in ("land", "sea"))
        if lands != [(land_name(file, first), mesh["vertices"], mesh["triangles"])]:
            wrong.append((file["path"], lands))
        off_m.append(off_box(box, mesh, 0.0 if len(meshes) == 1 else ROAD_M, sea_m if seas else mesh["max_m"][1]))
        everything += meshes
    lands = [it for it in everything if it[0].startswith("land")]
    checks.check(files and not wrong, f"{what}: lands, their vertices and triangles",
                 wrong[:2] or (len(lands), sum(it[1] for it in lands), sum(it[2] for it in lands)))
    checks.check(max(off_m) <= EXACT_M, f"{what}: boxes", f"{max(off_m):.6f} m off")
    return everything


def main():
    folder = Path(sys.argv[1])
    bake = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
    if bake["meshes"]["quantized"]:
        sys.exit(f"{folder} is quantised, which assimp 5.2 reads wrongly")
    checks, first, sea_m = Checks(), min(bake["meshes"]["lods"]), bake["sea_level_m"]
    meshes = [file for file in bake["files"] if file.get("mesh") and not file["path"].endswith(".mtl")]
    for lod in bake["meshes"]["lods"]:
        chosen = lambda export, ending: [
            file for file in meshes if (file["export"], file["mesh"]["lod"]) == (export, lod) and file["path"].endswith(ending)
        ]
        glb = check_tiles(folder, checks, f"GLBs of LOD {lod}", chosen("gltf", ".glb"), first, sea_m)
        obj = check_tiles(folder, checks, f"OBJs of LOD {lod}", chosen("obj-tiles", ".obj"), first, sea_m)
        totals = lambda them: (len(them), sum(it[1] for it in them), sum(it[2] for it in them))
        # Vertices of water and roads may coincide, which makes them one in an OBJ.
        same = [it[::2] for it in glb] == [it[::2] for it in obj] and totals(obj)[1] <= totals(glb)[1]
        checks.check(same, f"LOD {lod}: meshes of the GLBs and of the OBJs", (totals(glb), totals(obj)))
        for ending in ("glb", "gltf", "obj"):
            path = folder / "mesh" / f"region{'' if lod == first else f'_lod{lod}'}.{ending}"
            region, box = read(path)
            tiles = obj if ending == "obj" else glb
            checks.check(sorted(region) == sorted(tiles), f"{path.name}: the meshes of all tiles", totals(region))
            corners = [file["mesh"] for file in chosen("gltf", ".glb")]
            whole = {
                "min_m": [min(mesh["min_m"][axis] for mesh in corners) for axis in range(3)],
                "max_m": [max(mesh["max_m"][axis] for mesh in corners) for axis in range(3)],
            }
            off_m = off_box(box, whole, ROAD_M, sea_m)
            checks.check(off_m <= EXACT_M, f"{path.name}: box", f"{off_m:.6f} m off")
        if chosen("collision", ".glb"):
            check_tiles(folder, checks, f"collision of LOD {lod}", chosen("collision", ".glb"), first, sea_m)
    print(f"{checks.done} checks, {checks.failed} failed")
    sys.exit(checks.failed > 0)


main()
