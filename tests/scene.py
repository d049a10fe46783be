"""Runs the script that a bake leaves for Blender, and looks at the scene: python tests/scene.py BAKE.

Needs bpy 4.5. Exits with 1 if something is not as it should be.
"""

import json
import runpy
import sys
import tempfile
from pathlib import Path

import bpy


def main():
    folder = Path(sys.argv[1])
    bake = json.loads((folder / "bake.json").read_text())
    with tempfile.TemporaryDirectory() as made:
        still, saved = Path(made) / "still.png", Path(made) / "scene.blend"
        sys.argv = ["import_terrane.py", "--", "--render", str(still), "--save", str(saved), "--size", "96x54", "--samples", "1"]
        runpy.run_path(str(folder / "import_terrane.py"), run_name="__main__")
        check(saved.stat().st_size > 0, "the scene is saved")
        image = bpy.data.images.load(str(still))
        pixels = list(image.pixels)
        check(max(pixels[::4]) - min(pixels[::4]) > 0.2, "the still shows something")
        image.user_clear()
        bpy.data.images.remove(image)
    look(bake)


def look(bake):
    region, scene = bake["region"], bpy.context.scene
    tiles = [child for child in bpy.data.collections["terrane"].children if child.name.startswith("tile_")]
    check(len(tiles) == region["cols"] * region["rows"], f"{len(tiles)} collections of tiles")
    lands = [thing for thing in scene.objects if thing.type == "MESH" and thing.name.startswith("land")]
    check(len(lands) == len(tiles), "a land in each")
    for land in lands:
        tree = land.data.materials[0].node_tree
        images = {node.image.name: node.image for node in tree.nodes if node.type == "TEX_IMAGE"}
        blends = [image for name, image in images.items() if name.startswith("blend_")]
        sure(len(blends) == 2 and all(image.size[0] == region["tile_cells"] + 1 for image in blends), "both blend images")
        sure(all(image.colorspace_settings.name == "Non-Color" for image in images.values()), "no data is a colour")
        sure(all(image.packed_file for image in blends), "the blend images are in the scene")
        groups = [node for node in tree.nodes if node.type == "GROUP"]
        sure(len(groups) == 1 and all(socket.is_linked for socket in groups[0].inputs), "all weights reach the group")
    check(True, "materials of the land")
    others = [material.name for material in bpy.data.materials if "." in material.name and not material.name.startswith("land")]
    check(not others, "no material is there twice", others)
    corners = [thing.matrix_world @ vertex.co for thing in lands for vertex in thing.data.vertices]
    sides = [max(corner[axis] for corner in corners) - min(corner[axis] for corner in corners) for axis in range(2)]
    expected = [(region[key] - 1) * bake["spacing_m"] for key in ("width", "height")]
    check(all(abs(a - b) < 0.01 for a, b in zip(sides, expected)), "the region has its size", sides)
    check(("open sea" in scene.objects) == (bake["sea_level_m"] is not None), "a sea where the world has one")
    camera = scene.camera
    far = max((corner - camera.location).length for corner in corners)
    check(camera.data.clip_end > far, "the camera sees all of it", (camera.data.clip_end, far))
    check(camera.location.z > max(corner.z for corner in corners), "from above")
    check(any(thing.type == "LIGHT" and thing.data.type == "SUN" for thing in scene.objects), "there is a sun")


def check(holds, what, found=""):
    sure(holds, what, found)
    print(f"ok: {what}", flush=True)


def sure(holds, what, found=""):
    if not holds:
        sys.exit(f"FAILED: {what} {found}")


main()
