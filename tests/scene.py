"""Runs the scripts that two bakes leave for Blender, and looks at the scene: python tests/scene.py BAKE BESIDE.

Both are of the same world, with the export exr, and the second begins where the first one ends in the east. Needs bpy 4.5
or later. Exits with 1 if something is not as it should be.
"""

import json
import re
import runpy
import sys
import tempfile
import warnings
from pathlib import Path

import bpy
import numpy as np


def main():
    folder, beside = map(Path, sys.argv[1:])
    bake, second = (json.loads((path / "bake.json").read_text()) for path in (folder, beside))
    with tempfile.TemporaryDirectory() as made:
        still, saved = Path(made) / "still.png", Path(made) / "scene.blend"
        bpy.ops.wm.read_factory_settings()
        run(folder, "--render", str(still), "--save", str(saved), "--size", "96x54", "--samples", "1")
        check(saved.stat().st_size > 0, "the scene is saved")
        image = bpy.data.images.load(str(still))
        pixels = list(image.pixels)
        check(max(pixels[::4]) - min(pixels[::4]) > 0.2, "the still shows something")
        image.user_clear()
        bpy.data.images.remove(image)
        look(bake)
        solid_view()
        clips(folder)
        # As people go on with it another day.
        bpy.ops.wm.open_mainfile(filepath=str(saved))
        add(beside, bake, second)
    keep_what_is_there(folder)
    displace(folder, bake)


def run(folder, *options):
    """Runs a bake's script, which may not warn."""
    sys.argv = ["import_terrane.py", "--", *options]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        runpy.run_path(str(folder / "import_terrane.py"), run_name="__main__")
    own = [str(one.message) for one in said if one.filename.endswith("import_terrane.py")]
    sure(not own, "the script warns of nothing", own)


def lands():
    return [thing for thing in bpy.context.scene.objects if thing.type == "MESH" and thing.name.startswith("land")]


def places(thing):
    """The vertices of an object in the scene, in doubles."""
    found = np.empty(3 * len(thing.data.vertices), dtype=np.float32)
    thing.data.vertices.foreach_get("co", found)
    matrix = np.array(thing.matrix_world)
    return found.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def look(bake):
    region, scene = bake["region"], bpy.context.scene
    sure("Cube" not in scene.objects, "what Blender starts with is gone")
    tiles = [child for child in bpy.data.collections["terrane"].children if child.name.startswith("tile_")]
    at = region["at"]
    numbers = [(at["x"] + col, at["y"] + row) for col in range(region["cols"]) for row in range(region["rows"])]
    named = lambda part: sorted(f"{part}_x{x}_y{y}" for x, y in numbers)
    check(sorted(tile.name for tile in tiles) == named("tile"), "a collection a tile, with its numbers in the world")
    sure(sorted(land.name for land in lands()) == named("land"), "a land in each", [land.name for land in lands()])
    for land in lands():
        sure(land.name == land.data.name == land.data.materials[0].name, "its mesh and material have its name", land)
    for tile in tiles:
        kinds = {"land", "river", "lake", "sea", "road", "bridge", "tile"}
        others = [thing.name for thing in tile.objects if thing.name not in {tile.name.replace("tile", kind) for kind in kinds}]
        sure(not others, "names tell kind and tile", others)
    unnumbered()
    for land in lands():
        tree = land.data.materials[0].node_tree
        images = {node.image.name: node.image for node in tree.nodes if node.type == "TEX_IMAGE"}
        blends = [image for name, image in images.items() if name.startswith("blend_")]
        sure(len(blends) == 2 and all(image.size[0] == region["tile_cells"] + 1 for image in blends), "both blend images")
        sure(all(image.colorspace_settings.name == "Non-Color" for image in images.values()), "no data is a colour")
        sure(all(image.packed_file for image in blends), "the blend images are in the scene")
        groups = [node for node in tree.nodes if node.type == "GROUP"]
        sure(len(groups) == 1 and all(socket.is_linked for socket in groups[0].inputs), "all weights reach the group")
    check(True, "materials of the land")
    corners = np.concatenate([places(thing) for thing in lands()])
    sides = np.ptp(corners, axis=0)[:2]
    expected = [(region[key] - 1) * bake["spacing_m"] for key in ("width", "height")]
    check(np.abs(sides - expected).max() < 0.01, "the region has its size", sides)
    check(("open sea" in scene.objects) == (bake["sea_level_m"] is not None), "a sea where the world has one")
    camera = scene.camera
    far = np.sqrt(((corners - np.array(camera.location)) ** 2).sum(1)).max()
    check(camera.data.clip_end > far, "the camera sees all of it", (camera.data.clip_end, far))
    check(camera.location.z > corners[:, 2].max(), "from above")
    check(any(thing.type == "LIGHT" and thing.data.type == "SUN" for thing in scene.objects), "there is a sun")


def unnumbered():
    """Blender puts .001 behind a name that is there already."""
    kinds = [bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.collections, bpy.data.images, bpy.data.node_groups]
    numbered = [one.name for kind in kinds for one in kind if re.search(r"\.\d+$", one.name)]
    check(not numbered, "nothing is there twice", numbered)


def solid_view():
    for land in lands():
        layer = land.data.color_attributes.active_color
        sure(layer is not None, "land has colours for the Solid view")
        colours = np.empty(4 * len(layer.data), dtype=np.float32)
        layer.data.foreach_get("color", colours)
        colours = colours.reshape(-1, 4)[:, :3]
        sure(colours.max() <= 1 and 0.03 < colours.mean() < 0.9, "they are neither black nor white", colours.mean(0))
    grey = [material.name for material in bpy.data.materials if len(set(material.diffuse_color[:3])) == 1]
    sure(not grey, "every material has a colour of its own in the windows", grey)
    meshes = [thing for thing in bpy.context.scene.objects if thing.type == "MESH" and thing not in lands()]
    sure(all(len(set(thing.color[:3])) > 1 for thing in meshes), "what has no colours of vertices has one as an object")
    spaces = [space for screen in bpy.data.screens for area in screen.areas for space in area.spaces if space.type == "VIEW_3D"]
    check(spaces and all(space.shading.color_type == "VERTEX" for space in spaces), "the Solid view shows colours")


def clips(folder):
    notes = (folder / "IMPORT.md").read_text()
    start, end = map(float, re.search(r"\| Camera, .* \| ([\d.]+) m and ([\d.]+) m \|", notes).groups())
    camera = bpy.context.scene.camera.data
    found = [(camera.clip_start, camera.clip_end)]
    for screen in bpy.data.screens:
        found += [(space.clip_start, space.clip_end) for area in screen.areas for space in area.spaces if space.type == "VIEW_3D"]
    same = all(abs(one[0] / start - 1) < 1e-6 and abs(one[1] / end - 1) < 1e-6 for one in found)
    check(same, "camera and windows see as far as IMPORT.md says", (start, end, found))


def add(beside, bake, second):
    scene, before = bpy.context.scene, {thing.name: np.array(thing.matrix_world) for thing in bpy.context.scene.objects}
    count = {kind: len(getattr(bpy.data, kind)) for kind in ("cameras", "lights", "worlds", "node_groups", "scenes")}
    clip = scene.camera.data.clip_end
    run(beside)
    bpy.context.view_layer.update()
    kept = all((np.array(scene.objects[name].matrix_world) == matrix).all() for name, matrix in before.items() if name != "camera")
    check(kept, "a second bake leaves the first where it is")
    check(count == {kind: len(getattr(bpy.data, kind)) for kind in count}, "and brings no second sun, sky, camera or ground")
    unnumbered()
    check(scene.camera.data.clip_end > clip, "the camera sees further")
    # Each vertex of each tile by its place in the world, of which the first bake's origin is the scene's.
    off_m, origin = 0.0, bake["region"]["mesh_origin_m"]
    for file in (file for one in (bake, second) for file in one["files"] if file.get("mesh")):
        x, y = file["tile"]["x"], file["tile"]["y"]
        side_m = bake["region"]["tile_cells"] * bake["spacing_m"]
        found = places(scene.objects[f"land_x{x}_y{y}"])
        west, north = x * side_m - origin[0], origin[1] - y * side_m
        box = np.array([found[:, :2].min(0), found[:, :2].max(0)])
        off_m = max(off_m, np.abs(box - [[west, north - side_m], [west + side_m, north]]).max())
    check(off_m < 1e-3, "all tiles of both lie at their place in the world", f"{off_m} m off")
    # The edge that both have.
    edge = (second["region"]["origin_m"][0]) - origin[0]
    rows = {file["tile"]["y"] for file in second["files"] if file.get("mesh")}
    x = second["region"]["at"]["x"]
    for row in rows:
        ours, theirs = (places(scene.objects[f"land_x{column}_y{row}"]) for column in (x - 1, x))
        ours, theirs = (np.unique(one[np.abs(one[:, 0] - edge) < 1e-3].round(3), axis=0) for one in (ours, theirs))
        sure(ours.shape == theirs.shape and np.abs(ours - theirs).max() < 2e-3, "they meet", (ours.shape, theirs.shape))
    walls = scene.objects["sides"]
    corners = np.array([vertex.co for vertex in walls.data.vertices])
    # South of the second one the edge of the first is free.
    south = origin[1] - (max(rows) + 1) * bake["region"]["tile_cells"] * bake["spacing_m"]
    on_edge = [face for face in walls.data.polygons if (np.abs(corners[face.vertices, 0] - edge) < 0.01).all()]
    between = [face for face in on_edge if face.center.y > south]
    sure(len(rows) == bake["region"]["rows"] or len(on_edge) > len(between), "a wall stands where the edge is free")
    check(len(walls.data.polygons) > 8 and not between, "they meet, and no wall is between them", len(between))
    things = len(bpy.data.objects)
    run(beside)
    check(len(bpy.data.objects) == things, "what is there already is not added again")


def keep_what_is_there(folder):
    """A scene in use is kept, and so is what has the names that we use."""
    bpy.ops.wm.read_factory_settings()
    bpy.data.objects["Cube"].name = "mine"
    bpy.data.materials["Material"].name = "river"
    run(folder)
    mine = bpy.data.objects["mine"]
    check(mine.users_scene and mine.material_slots[0].material.name == "river", "a scene in use is kept")
    used = [slot.material for thing in bpy.context.scene.objects for slot in thing.material_slots]
    check(lands() and bpy.data.materials["river"] not in used, "and its materials are its own")


def displace(folder, bake):
    """Does what IMPORT.md says of a plane, with its numbers."""
    notes = (folder / "IMPORT.md").read_text()
    typed = lambda name: re.search(rf"^\| {re.escape(name)} \| (.*) \|$", notes, re.MULTILINE).group(1).removesuffix(" m")
    number = lambda name: float(typed(name))
    columns, rows = int(typed("X Subdivisions")) + 1, int(typed("Y Subdivisions")) + 1
    image = bpy.data.images.load(str(folder / "height/height.exr"))
    pixels = np.empty(image.size[0] * image.size[1] * 4, dtype=np.float32)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_get(pixels)
    heights = pixels.reshape(rows, columns, 4)[:, :, 0]
    for picture, strength, middle, bound_m in (
        (typed("Texture, *Image*, *Open*").strip("`"), number("Strength"), number("Midlevel"), 0.52 * bake["height_range"]["step_m"]),
        ("height/height.exr", 1.0, 0.0, 2e-3),
    ):
        # As the clicks do it.
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=columns - 1, y_subdivisions=rows - 1, calc_uvs=True)
        grid = bpy.context.object
        grid.location = [float(part) for part in typed("Location X, Y, Z").split(",")]
        grid.dimensions = (number("Sidebar (N), *Item*, *Dimensions* X"), number("Sidebar (N), *Item*, *Dimensions* Y"), 0.0)
        warp = grid.modifiers.new("UV Warp", "UV_WARP")
        warp.center = [float(part) for part in typed("UV Center").split(",")]
        warp.scale = (number("Scale X"), number("Scale Y"))
        texture = bpy.data.textures.new("heights", "IMAGE")
        texture.image = bpy.data.images.load(str(folder / picture))
        texture.image.colorspace_settings.name = typed("Texture, *Image*, *Color Space*")
        texture.extension, texture.filter_size = typed("Texture, *Mapping*, *Extension*").upper(), number("Texture, *Sampling*, *Filter Size*")
        modifier = grid.modifiers.new("Displace", "DISPLACE")
        modifier.texture, modifier.texture_coords, modifier.direction = texture, typed("Coordinates"), typed("Direction")
        modifier.strength, modifier.mid_level = strength, middle
        graph = bpy.context.evaluated_depsgraph_get()
        shape = grid.evaluated_get(graph)
        found = np.empty(3 * columns * rows, dtype=np.float32)
        shape.data.vertices.foreach_get("co", found)
        found = found.reshape(-1, 3) * np.array(grid.scale) + np.array(grid.location)
        off_m = np.abs(found[:, 2].reshape(rows, columns) - heights).max()
        check(off_m <= bound_m, f"a plane that {picture} displaces has its heights", f"{off_m:.4f} m off")
        corners = np.concatenate([places(thing) for thing in lands()])
        off_m = np.abs([found[:, :2].min(0) - corners[:, :2].min(0), found[:, :2].max(0) - corners[:, :2].max(0)]).max()
        sure(off_m < 0.01, "and lies where the meshes do", off_m)
        bpy.data.objects.remove(grid)


def check(holds, what, found=""):
    sure(holds, what, found)
    print(f"ok: {what} {found if isinstance(found, str) else ''}", flush=True)


def sure(holds, what, found=""):
    if not holds:
        sys.exit(f"FAILED: {what} {found}")


main()
