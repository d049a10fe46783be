"""Builds the scene of a terrane bake in Blender 3.6 or later.

In Blender: Scripting workspace, Open, this file, Run. Without a window:

    blender --background --python import_terrane.py -- --render still.png --save scene.blend

The script stands beside bake.json and reads mesh/*.glb. One unit is one metre, +X is east, +Y is north, +Z is up; the
origin is that of the bake's meshes at height 0. What it makes:

    terrane              a collection, and in it one a tile, or one a row where there are many tiles
    land_x3_y-4 ...      a land a tile, with a material of that name: its blend map mixes the grounds of the group
                         "terrane ground"; the numbers are the tile's in the world, as in bake.json
    river, lake, sea     one material each, for all tiles; road, bridge likewise
    sun, camera, sky     clip ends are set, in the windows too, and colours for the Solid view

In a scene that has a bake of terrane the region comes beside it, at its own place in the world, and nothing is made twice:

    blender --background scene.blend --python import_terrane.py -- --save scene.blend
"""

import argparse
import hashlib
import json
import math
import struct
import sys
import tempfile
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

MATERIALS = ["grass", "dirt", "rock", "sand", "snow", "forest", "scree", "wetland"]

# The attributes of vertices that have the weights of four each, and which is the first.
WEIGHTS = [(0, "_GROUND"), (4, "_COVER")]

# Linear colours between which noise chooses, and roughness.
GROUND = {
    "grass": ((0.040, 0.062, 0.014), (0.092, 0.105, 0.028), 0.95),
    "dirt": ((0.100, 0.066, 0.038), (0.170, 0.122, 0.074), 0.95),
    "rock": ((0.070, 0.064, 0.058), (0.185, 0.170, 0.150), 0.85),
    "sand": ((0.330, 0.265, 0.165), (0.450, 0.375, 0.250), 0.90),
    "snow": ((0.780, 0.815, 0.870), (0.870, 0.885, 0.910), 0.55),
    "forest": ((0.012, 0.026, 0.008), (0.030, 0.048, 0.016), 0.95),
    "scree": ((0.160, 0.145, 0.125), (0.290, 0.265, 0.230), 0.95),
    "wetland": ((0.038, 0.050, 0.018), (0.075, 0.085, 0.035), 0.60),
}
WATER = {
    "river": (0.020, 0.065, 0.075),
    "lake": (0.010, 0.045, 0.065),
    "sea": (0.004, 0.030, 0.055),
}
# Linear colours of the Solid view, whose lamps are dimmer than the sun: brighter than the substances are.
SOLID = {
    "river": (0.110, 0.300, 0.450),
    "lake": (0.080, 0.240, 0.400),
    "sea": (0.050, 0.170, 0.320),
    "road": (0.450, 0.340, 0.230),
    "bridge": (0.400, 0.380, 0.360),
    "sides": (0.200, 0.170, 0.145),
}
# Of grounds: this power, which lifts the dark ones more than snow.
SOLID_POWER = 0.65
BELOW, HORIZON, ZENITH = (0.10, 0.15, 0.22), (0.58, 0.72, 0.90), (0.08, 0.22, 0.60)

# More tiles than this share a collection by row: each collection is a line of the outliner.
MOST_TILE_COLLECTIONS = 256

# How far the camera and the windows see, in sides of all that is there; IMPORT.md says the same of one region.
CLIP_SIDES = 12.0
# How near.
CLIP_START_SIDES = 1e-4

# What the collection "terrane" keeps: metres east and south in the world at which the scene has its origin, the world,
# and the regions, each as six numbers.
ORIGIN, WORLD, REGIONS = "terrane_origin_m", "terrane_world", "terrane_regions"
# What is kept on the root of a tile, and on a material that all tiles share.
TILE, SHARED = "terrane_tile", "terrane_shared"


def main():
    options = arguments()
    folder = bake_folder()
    bake = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
    meshes = finest_meshes(bake, options.lod)
    scene, collection, is_first = scene_to_fill(bake)
    move = moved(collection, bake)
    extent = with_region(collection, bake, meshes, move)
    # The land and its water, tile by tile.
    ground = bpy.data.node_groups.get("terrane ground") if not is_first else None
    ground = ground or ground_group(bake["spacing_m"], extent)
    shared = {material[SHARED]: material for material in bpy.data.materials if SHARED in material}
    finished = set(shared)
    count = import_tiles(folder, bake, meshes, collection, ground, shared, move)
    for name in WATER.keys() & shared.keys() - finished:
        water_material(shared[name], name, bake["spacing_m"], extent)
    # What surrounds them.
    surroundings = collection_in(collection, "surroundings")
    cut_sides(surroundings, collection, extent, bake["spacing_m"])
    if bake.get("sea_level_m") is not None:
        open_sea(surroundings, bake["sea_level_m"], extent, bake["spacing_m"], shared)
    if is_first:
        sun(surroundings)
        sky(scene)
    camera(scene, surroundings, extent)
    set_windows(scene, extent, is_first)
    print(f"terrane: {count} tiles, {len(extent.regions)} region{'s' if len(extent.regions) > 1 else ''}, "
          f"{extent.side_m:.0f} m a side, {extent.low_m:.0f} to {extent.high_m:.0f} m high; "
          f"clip end {extent.clip_m:.0f} m")
    if options.save:
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(options.save).resolve()))
    if options.render:
        render(scene, options)


def arguments():
    parser = argparse.ArgumentParser(prog="import_terrane.py", description="Builds the scene of a terrane bake.")
    parser.add_argument("--render", metavar="FILE", help="render a still")
    parser.add_argument("--save", metavar="FILE", help="save the scene")
    parser.add_argument("--lod", type=int, help="level of detail [default: the finest there is]")
    parser.add_argument("--size", default="1920x1080", metavar="WxH", help="pixels of the still")
    parser.add_argument("--samples", type=int, default=64, help="samples a pixel of the still")
    given = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    return parser.parse_args(given)


def bake_folder():
    """The folder of this script, which may be a text in Blender."""
    paths = [Path(globals().get("__file__", "."))]
    paths += [Path(bpy.path.abspath(text.filepath)) for text in bpy.data.texts if text.filepath]
    for path in paths:
        if (path.resolve().parent / "bake.json").is_file():
            return path.resolve().parent
    stop("there is no bake.json beside import_terrane.py; open the script in the folder of the bake")


def stop(message):
    """Ends the script, and in the background Blender too."""
    if bpy.app.background:
        sys.exit(f"terrane: {message}")
    raise RuntimeError(message)


def finest_meshes(bake, lod):
    """The GLBs of all tiles at one level of detail, as the manifest lists them."""
    records = [record for record in bake["files"] if record["export"] == "gltf" and "mesh" in record]
    there = sorted({record["mesh"]["lod"] for record in records})
    if not there:
        stop("the bake has no GLB; bake with --profile blender or --export gltf")
    if lod is None:
        lod = there[0]
    if lod not in there:
        stop(f"the bake has no LOD {lod}, only {', '.join(map(str, there))}")
    return [record for record in records if record["mesh"]["lod"] == lod]


class Extent:
    """Where all regions of a scene lie, in its metres: each as west, east, south, north, lowest and highest."""

    def __init__(self, regions):
        self.regions = regions
        west, east, south, north, low, high = zip(*regions)
        self.west, self.east, self.south, self.north = min(west), max(east), min(south), max(north)
        self.low_m, self.high_m = min(low), max(high)
        self.side_m = max(self.east - self.west, self.north - self.south)
        # Where the walls of the block end, and where the camera sees no further, and no nearer.
        self.foot_m = self.low_m - 0.03 * self.side_m
        self.clip_m, self.clip_start_m = CLIP_SIDES * self.side_m, max(0.1, CLIP_START_SIDES * self.side_m)

    def covers(self, x, y):
        """Whether a place lies inside a region."""
        return any(west < x < east and south < y < north for west, east, south, north, _, _ in self.regions)


def scene_to_fill(bake):
    """A scene, its collection "terrane", and whether that is new.

    A scene that has one already is filled further. What Blender starts with is replaced when there is no window; a scene
    in use stays as it is, and a new one is made beside it.
    """
    import addon_utils
    window, scene = bpy.context.window or bpy.context.window_manager.windows[0], bpy.context.scene
    for known in [scene, *bpy.data.scenes]:
        for collection in known.collection.children:
            if ORIGIN in collection:
                window.scene = known
                addon_utils.enable("io_scene_gltf2")
                return known, collection, False
    is_fresh = not bpy.data.filepath and {thing.name for thing in scene.objects} <= {"Cube", "Light", "Camera"}
    if bpy.app.background and is_fresh:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    elif scene.objects:
        window.scene = bpy.data.scenes.new("terrane")
    addon_utils.enable("io_scene_gltf2")
    scene = bpy.context.scene
    collection = bpy.data.collections.new("terrane")
    scene.collection.children.link(collection)
    collection[ORIGIN] = [float(metres) for metres in bake["region"]["mesh_origin_m"]]
    collection[WORLD], collection[REGIONS] = world_of(bake), []
    return scene, collection, True


def world_of(bake):
    """What tells worlds and their tiles apart."""
    recipe = [bake[key] for key in ("preset", "seed", "stride")] + [bake["region"]["tile_cells"]]
    return hashlib.sha256(json.dumps(recipe, sort_keys=True).encode()).hexdigest()[:16]


def moved(collection, bake):
    """How far from the scene's origin the middle of the region lies, east and north, and a word where that matters."""
    east, south = (own - first for own, first in zip(bake["region"]["mesh_origin_m"], collection[ORIGIN]))
    if len(collection[REGIONS]) > 0:
        print(f"terrane: added beside what is there, {east:.3f} m east and {0.0 - south:.3f} m north of its origin")
        if collection[WORLD] != world_of(bake):
            print("terrane: it is of another world or has tiles of another size: its land and that beside it may not meet")
        far = max(abs(east), abs(south))
        if far > 1e5:
            # A float has 24 bits.
            print(f"terrane: so far from the origin Blender counts places in steps of {far * 2.0 ** -23 * 1000:.0f} mm")
    return Vector((east, -south, 0.0))


def with_region(collection, bake, meshes, move):
    """The extent of a scene with a region more, which the collection keeps."""
    region = bake["region"]
    west, south = (own - origin for own, origin in zip(region["origin_m"], region["mesh_origin_m"]))
    west, north = west + move.x, move.y - south
    width_m, height_m = ((region[key] - 1) * bake["spacing_m"] for key in ("width", "height"))
    # Bounds are east, up, south.
    low = min(record["mesh"]["min_m"][1] for record in meshes)
    high = max(record["mesh"]["max_m"][1] for record in meshes)
    flat = list(collection[REGIONS])
    regions = [tuple(flat[first:first + 6]) for first in range(0, len(flat), 6)]
    own = (west, west + width_m, north - height_m, north, low, high)
    if own not in regions:
        regions.append(own)
        collection[REGIONS] = [float(number) for one in regions for number in one]
    return Extent(regions)


def collection_in(parent, name):
    """A child of a collection, which is made if there is none of that name."""
    for child in parent.children:
        # Blender numbers a name that another collection of the file has.
        if child.name.split(".")[0] == name:
            return child
    child = bpy.data.collections.new(name)
    parent.children.link(child)
    return child


def object_in(collection, name):
    return next((thing for thing in collection.objects if thing.name.split(".")[0] == name), None)


def import_tiles(folder, bake, meshes, collection, ground, shared, move):
    """Imports the tiles that are not there yet, says how far that is, and gives their number."""
    world = world_of(bake)
    there = {thing[TILE] for thing in collection.all_objects if TILE in thing}
    key = lambda record: f"{world} {record['tile']['x']} {record['tile']['y']} {record['mesh']['lod']}"
    missing = [record for record in meshes if key(record) not in there]
    if len(missing) < len(meshes):
        print(f"terrane: {len(meshes) - len(missing)} of {len(meshes)} tiles are there already")
    window, start = bpy.context.window_manager, time.monotonic()
    # By name, for there may be thousands.
    children = {}
    window.progress_begin(0, max(1, len(missing)))
    for number, record in enumerate(missing):
        column, row = record["tile"]["x"], record["tile"]["y"]
        of_tile = len(meshes) <= MOST_TILE_COLLECTIONS
        name = f"tile_x{column}_y{row}" if of_tile else f"row_y{row}"
        if name not in children:
            children[name] = collection_in(collection, name)
        import_tile(folder / record["path"], children[name], ground, shared, move, key(record))
        done = number + 1
        window.progress_update(done)
        # Twenty lines, however many tiles there are.
        if done == len(missing) or done * 20 // len(missing) > number * 20 // len(missing):
            left_s = (time.monotonic() - start) / done * (len(missing) - done)
            print(f"terrane: {done} of {len(missing)} tiles, {left_s:.0f} s left", flush=True)
    window.progress_end()
    return len(missing)


def import_tile(path, collection, ground, shared, move, key):
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(path))
    pictures = None
    for thing in set(bpy.data.objects) - before:
        for other in list(thing.users_collection):
            other.objects.unlink(thing)
        collection.objects.link(thing)
        if thing.parent is None:
            # The root of the tile. The sum is exact where both are: a matrix would round on the way.
            thing.location += move
            thing[TILE] = key
        if thing.type != "MESH":
            continue
        kind = thing.name.split("_x")[0]
        for slot in thing.material_slots:
            if slot.material is None:
                continue
            if kind == "land":
                pictures = blend_images(path) if pictures is None else pictures
                land_material(slot.material, pictures, ground)
                land_colours(thing.data, slot.material)
            else:
                slot.material = shared_material(slot.material, kind, shared)
        if kind in SOLID:
            thing.color = (*SOLID[kind], 1.0)


def shared_material(material, kind, shared):
    """The one material of a kind, of which each GLB brings its own: the first one, whatever else the scene may have."""
    if kind not in shared:
        shared[kind] = material
        material.name = kind
        material[SHARED] = kind
        material.diffuse_color = (*SOLID.get(kind, (0.5, 0.5, 0.5)), 1.0)
    elif material != shared[kind]:
        material.user_remap(shared[kind])
        bpy.data.materials.remove(material)
    return shared[kind]


def solid(name):
    """The colour of a ground in the Solid view, linear."""
    dark, light, _ = GROUND[name]
    return [((a + b) / 2) ** SOLID_POWER for a, b in zip(dark, light)]


def land_colours(mesh, material):
    """Colours of a tile's land for the Solid view: of its vertices, and as its material's that of the most common ground."""
    weights = np.zeros((len(mesh.vertices), len(MATERIALS)), dtype=np.float32)
    for first, name in WEIGHTS:
        attribute = mesh.attributes.get(name)
        if attribute is not None:
            values = np.empty(4 * len(mesh.vertices), dtype=np.float32)
            attribute.data.foreach_get("color", values)
            weights[:, first:first + 4] = values.reshape(-1, 4)
    if not weights.any():
        return
    colours = np.ones((len(weights), 4), dtype=np.float32)
    colours[:, :3] = weights @ np.array([solid(name) for name in MATERIALS], dtype=np.float32)
    layer = mesh.color_attributes.new("ground", "BYTE_COLOR", "POINT")
    layer.data.foreach_set("color", colours.ravel())
    mesh.color_attributes.active_color = layer
    material.diffuse_color = (*solid(MATERIALS[int(weights.sum(axis=0).argmax())]), 1.0)


def blend_images(path):
    """The images of the blend map, which Blender leaves in the GLB because no material of glTF can use them."""
    data = path.read_bytes()
    length, = struct.unpack_from("<I", data, 12)
    document, start = json.loads(data[20:20 + length]), 28 + length
    images = []
    for entry in document.get("images", []):
        if not entry.get("name", "").startswith("blend_") or "bufferView" not in entry:
            continue
        view = document["bufferViews"][entry["bufferView"]]
        first = start + view.get("byteOffset", 0)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / (entry["name"] + ".png")
            file.write_bytes(data[first:first + view["byteLength"]])
            image = bpy.data.images.load(str(file))
            # Weights are no colours, and the fourth one is no opacity.
            image.colorspace_settings.name = "Non-Color"
            image.alpha_mode = "CHANNEL_PACKED"
            image.name = entry["name"]
            image.pack()
        images.append(image)
    return images


class Nodes:
    """Makes nodes and links of a tree."""

    def __init__(self, tree):
        self.tree = tree

    def add(self, kind, inputs=(), **properties):
        node = self.tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        for name, value in dict(inputs).items():
            self.put(value, node.inputs[name])
        return node

    def put(self, value, socket):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        else:
            socket.default_value = value

    def math(self, operation, *values):
        node = self.add("ShaderNodeMath", operation=operation)
        for value, socket in zip(values, node.inputs):
            self.put(value, socket)
        return node.outputs[0]

    def vector(self, operation, *values):
        node = self.add("ShaderNodeVectorMath", operation=operation)
        for value, socket in zip(values, node.inputs):
            self.put(value, socket)
        return node.outputs[0]

    def scaled(self, vector, factor):
        return self.add("ShaderNodeVectorMath", {"Vector": vector, "Scale": factor}, operation="SCALE").outputs[0]

    def noise(self, position, period_m, detail, shift=0.0):
        """Noise about 0.5, which a vertex has wherever its tile lies."""
        moved = self.vector("ADD", position, (shift, shift, shift))
        inputs = {"Vector": moved, "Scale": 1.0 / period_m, "Detail": detail, "Roughness": 0.6}
        return self.add("ShaderNodeTexNoise", inputs).outputs[0]

    def principled(self, colour, roughness, normal=None):
        node = self.add("ShaderNodeBsdfPrincipled", {"Base Color": colour, "Roughness": roughness})
        # Renamed in Blender 4.0.
        for name in ("Specular IOR Level", "Specular"):
            if name in node.inputs:
                node.inputs[name].default_value = 0.3
        if normal is not None:
            self.put(normal, node.inputs["Normal"])
        return node

    def hazed(self, shader, extent):
        """A shader behind air: what the camera sees far away takes on the colour of the horizon."""
        distance = self.add("ShaderNodeCameraData").outputs["View Distance"]
        clear = self.math("POWER", 1.0 / math.e, self.math("DIVIDE", distance, 30.0 * extent.side_m))
        seen = self.add("ShaderNodeLightPath").outputs["Is Camera Ray"]
        haze = self.math("MULTIPLY", self.math("SUBTRACT", 1.0, clear), seen)
        air = self.add("ShaderNodeEmission", {"Color": (*HORIZON, 1.0), "Strength": 0.8})
        mix = self.add("ShaderNodeMixShader", {0: haze})
        self.tree.links.new(shader, mix.inputs[1])
        self.tree.links.new(air.outputs[0], mix.inputs[2])
        return mix.outputs[0]


def socket_in(group, name, kind, is_input):
    # The lists of sockets became one interface in Blender 4.0.
    if hasattr(group, "interface"):
        return group.interface.new_socket(name, in_out="INPUT" if is_input else "OUTPUT", socket_type=kind)
    return (group.inputs if is_input else group.outputs).new(kind, name)


def ground_group(spacing_m, extent):
    """The node group that all tiles have in common: weights and a normal to a shader."""
    group = bpy.data.node_groups.new("terrane ground", "ShaderNodeTree")
    for name in MATERIALS:
        socket_in(group, name, "NodeSocketFloat", True)
    socket_in(group, "normal", "NodeSocketVector", True)
    socket_in(group, "shader", "NodeSocketShader", False)
    nodes = Nodes(group)
    given = nodes.add("NodeGroupInput").outputs
    position = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    broad = nodes.noise(position, 60.0 * spacing_m, 6.0)
    fine = nodes.noise(position, 2.0 * spacing_m, 5.0, shift=1000.0)
    # Noise breaks the borders between materials; then the weights add up to 1 again.
    weights = []
    for number, name in enumerate(MATERIALS):
        patches = nodes.noise(position, 5.0 * spacing_m, 4.0, shift=7919.0 * (number + 1))
        sharp = nodes.math("POWER", given[name], 1.6)
        weights.append(nodes.math("MULTIPLY", sharp, nodes.math("POWER", nodes.math("ADD", patches, 0.5), 3.0)))
    total = 1e-6
    for weight in weights:
        total = nodes.math("ADD", total, weight)
    # The colour and the roughness of each, mixed.
    shade = nodes.math("ADD", nodes.math("MULTIPLY", broad, 0.6), nodes.math("MULTIPLY", fine, 0.4))
    ramp = nodes.add("ShaderNodeMapRange", {"Value": shade, "From Min": 0.35, "From Max": 0.65})
    colour, roughness = None, None
    for weight, name in zip(weights, MATERIALS):
        dark, light, rough = GROUND[name]
        part = nodes.math("DIVIDE", weight, total)
        between = nodes.vector("SUBTRACT", light, dark)
        own = nodes.vector("ADD", dark, nodes.scaled(between, ramp.outputs[0]))
        own, rough = nodes.scaled(own, part), nodes.math("MULTIPLY", part, rough)
        colour = own if colour is None else nodes.vector("ADD", colour, own)
        roughness = rough if roughness is None else nodes.math("ADD", roughness, rough)
    bump = nodes.add("ShaderNodeBump", {"Height": fine, "Strength": 0.35, "Distance": 0.6 * spacing_m, "Normal": given["normal"]})
    surface = nodes.principled(colour, roughness, bump.outputs[0]).outputs[0]
    result = nodes.add("NodeGroupOutput")
    nodes.put(nodes.hazed(surface, extent), result.inputs["shader"])
    return group


def land_material(material, pictures, ground):
    """The material of a tile's land: its blend map, or the weights of its vertices, into the group."""
    normal_image = None
    for node in material.node_tree.nodes:
        if node.type == "TEX_IMAGE" and node.image and node.image.name.startswith("normal"):
            normal_image = node.image
    material.node_tree.nodes.clear()
    nodes = Nodes(material.node_tree)
    group = nodes.add("ShaderNodeGroup", node_tree=ground)
    uv = nodes.add("ShaderNodeUVMap", uv_map="UVMap").outputs[0]

    def texture(image):
        # Texels are vertices: 0 is the middle of the first one, and 1 that of the last one.
        texels = image.size[0]
        inner = nodes.vector("MULTIPLY_ADD", uv, ((texels - 1) / texels,) * 3, (0.5 / texels,) * 3)
        return nodes.add("ShaderNodeTexImage", {"Vector": inner}, image=image, extension="EXTEND")

    if len(pictures) == 2:
        first, second = map(texture, pictures)
        names = iter(MATERIALS)
        for node in (first, second):
            split = nodes.add("ShaderNodeSeparateColor", {"Color": node.outputs["Color"]})
            for output in (*split.outputs[:3], node.outputs["Alpha"]):
                name = next(names, None)
                if name is not None:
                    nodes.put(output, group.inputs[name])
    else:
        for first, name in WEIGHTS:
            weights = nodes.add("ShaderNodeAttribute", attribute_name=name)
            split = nodes.add("ShaderNodeSeparateColor", {"Color": weights.outputs["Color"]})
            for output, material in zip((*split.outputs[:3], weights.outputs["Alpha"]), MATERIALS[first:first + 4]):
                nodes.put(output, group.inputs[material])
    if normal_image is not None:
        normal_image.colorspace_settings.name = "Non-Color"
        colour = texture(normal_image).outputs["Color"]
        normal = nodes.add("ShaderNodeNormalMap", {"Color": colour}, uv_map="UVMap").outputs[0]
    else:
        normal = nodes.add("ShaderNodeNewGeometry").outputs["Normal"]
    nodes.put(normal, group.inputs["normal"])
    nodes.put(group.outputs[0], nodes.add("ShaderNodeOutputMaterial").inputs["Surface"])


def nodes_of(thing):
    """The nodes of a material or a world, from none on."""
    if thing.node_tree is None:
        # From Blender 5.0 on they are always there, and to ask for them is a warning.
        thing.use_nodes = True
    thing.node_tree.nodes.clear()
    return Nodes(thing.node_tree)


def water_material(material, name, spacing_m, extent):
    nodes = nodes_of(material)
    position = nodes.add("ShaderNodeNewGeometry").outputs["Position"]
    waves = nodes.noise(position, 1.5 * spacing_m, 3.0)
    bump = nodes.add("ShaderNodeBump", {"Height": waves, "Strength": 0.08, "Distance": 0.3 * spacing_m})
    surface = nodes.principled((*WATER[name], 1.0), 0.08, bump.outputs[0])
    surface.inputs["IOR"].default_value = 1.333
    # The sea has no bed outside the region, and looks the same on both sides of the edge.
    surface.inputs["Alpha"].default_value = 1.0 if name == "sea" else 0.93
    if bpy.app.version < (4, 2, 0):
        # Later versions of EEVEE need not be told.
        material.blend_method = "HASHED"
    nodes.put(nodes.hazed(surface.outputs[0], extent), nodes.add("ShaderNodeOutputMaterial").inputs["Surface"])


def cut_sides(collection, land, extent, spacing_m):
    """Walls under the outer edges of the regions, so that they are blocks and not sheets; none where two of them meet."""
    near = 0.01 * spacing_m
    bpy.context.view_layer.update()
    # The vertices on each side of each region.
    found = {(number, side): [] for number in range(len(extent.regions)) for side in range(4)}
    for thing in land.all_objects:
        if thing.type != "MESH" or not thing.name.startswith("land_"):
            continue
        places = np.empty(3 * len(thing.data.vertices), dtype=np.float32)
        thing.data.vertices.foreach_get("co", places)
        matrix = np.array(thing.matrix_world)
        places = places.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        for (number, side), corners in found.items():
            # West and east lie at an x, south and north at a y.
            own, along, region = side // 2, 1 - side // 2, extent.regions[number]
            first, last = region[2 * along] - near, region[2 * along + 1] + near
            on_it = (abs(places[:, own] - region[side]) < near) & (places[:, along] > first) & (places[:, along] < last)
            corners.extend(places[on_it].tolist())
    vertices, faces = [], []
    for (number, side), corners in found.items():
        own, along = side // 2, 1 - side // 2
        outwards = near if side % 2 else -near
        corners.sort(key=lambda corner: corner[along])
        last = None
        for corner in corners:
            # Tiles share the corners that they meet at.
            if last is not None and corner[along] - last[along] < near:
                continue
            if last is not None:
                beside = [(a + b) / 2 for a, b in zip(last, corner)]
                beside[own] += outwards
                if not extent.covers(beside[0], beside[1]):
                    first = len(vertices)
                    for x, y, z in (last, corner):
                        vertices += [(x, y, z), (x, y, extent.foot_m)]
                    face = (first, first + 1, first + 3, first + 2)
                    # The front faces outwards.
                    faces.append(face[::-1] if side in (0, 3) else face)
            last = corner
    shape(collection, "sides", vertices, faces, sides_material(extent))


def sides_material(extent):
    for material in bpy.data.materials:
        if material.get(SHARED) == "sides":
            return material
    material = bpy.data.materials.new("sides")
    material[SHARED] = "sides"
    material.diffuse_color = (*SOLID["sides"], 1.0)
    nodes = nodes_of(material)
    surface = nodes.principled((0.080, 0.066, 0.055, 1.0), 0.95).outputs[0]
    nodes.put(nodes.hazed(surface, extent), nodes.add("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def shape(collection, name, vertices, faces, material):
    """An object of its own, or that of an earlier run with another shape."""
    thing = object_in(collection, name)
    if thing is None:
        thing = bpy.data.objects.new(name, bpy.data.meshes.new(name))
        thing.data.materials.append(material)
        thing.color = material.diffuse_color
        collection.objects.link(thing)
    thing.data.clear_geometry()
    thing.data.from_pydata(vertices, [], faces)


def open_sea(collection, level_m, extent, spacing_m, shared):
    """The sea around the regions, as far as the camera sees; that of the regions is in their tiles."""
    if "sea" not in shared:
        shared_material(bpy.data.materials.new("sea"), "sea", shared)
        water_material(shared["sea"], "sea", spacing_m, extent)
    far = 0.5 * extent.clip_m
    west, east, south, north, _, _ = zip(*extent.regions)
    xs = [extent.west - far, *sorted({*west, *east}), extent.east + far]
    ys = [extent.south - far, *sorted({*south, *north}), extent.north + far]
    vertices = [(x, y, level_m) for y in ys for x in xs]
    columns = len(xs)
    faces = []
    for row in range(len(ys) - 1):
        for column in range(columns - 1):
            if not extent.covers((xs[column] + xs[column + 1]) / 2, (ys[row] + ys[row + 1]) / 2):
                first = row * columns + column
                faces.append((first, first + 1, first + columns + 1, first + columns))
    shape(collection, "open sea", vertices, faces, shared["sea"])


def sun(collection):
    light = bpy.data.lights.new("sun", "SUN")
    light.energy, light.angle, light.color = 6.5, math.radians(0.6), (1.0, 0.92, 0.80)
    thing = bpy.data.objects.new("sun", light)
    # From the west-north-west, as maps are lit, and low enough for the relief to show.
    azimuth, altitude = math.radians(285.0), math.radians(32.0)
    towards = Vector((math.sin(azimuth) * math.cos(altitude), math.cos(azimuth) * math.cos(altitude), math.sin(altitude)))
    thing.rotation_euler = towards.to_track_quat("Z", "Y").to_euler()
    collection.objects.link(thing)


def sky(scene):
    world = bpy.data.worlds.new("terrane sky")
    scene.world = world
    nodes = nodes_of(world)
    up = nodes.add("ShaderNodeSeparateXYZ", {"Vector": nodes.add("ShaderNodeTexCoord").outputs["Generated"]}).outputs["Z"]
    ramp = nodes.add("ShaderNodeValToRGB", {0: nodes.add("ShaderNodeMapRange", {"Value": up, "From Min": -1.0}).outputs[0]})
    stops = ramp.color_ramp.elements
    for stop, position, colour in ((stops[0], 0.2, BELOW), (stops.new(0.5), 0.5, HORIZON), (stops[-1], 0.75, ZENITH)):
        stop.position, stop.color = position, (*colour, 1.0)
    light = nodes.add("ShaderNodeBackground", {"Color": ramp.outputs["Color"], "Strength": 0.7})
    nodes.put(light.outputs[0], nodes.add("ShaderNodeOutputWorld").inputs["Surface"])


def camera(scene, collection, extent):
    """A camera that sees all; one that somebody has moved stays there, and sees as far."""
    thing = object_in(collection, "camera")
    if thing is None:
        thing = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        thing.data.lens = 35.0
        collection.objects.link(thing)
        scene.camera = thing
        scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    elif list(thing.get("terrane_place", [])) != [*thing.location, *thing.rotation_euler]:
        thing.data.clip_end = max(thing.data.clip_end, extent.clip_m)
        return
    thing.data.clip_start, thing.data.clip_end = extent.clip_start_m, extent.clip_m
    # From the south, at the middle, as near as has all regions in the picture.
    azimuth, altitude = math.radians(192.0), math.radians(33.0)
    away = Vector((math.sin(azimuth) * math.cos(altitude), math.cos(azimuth) * math.cos(altitude), math.sin(altitude)))
    thing.rotation_euler = away.to_track_quat("Z", "Y").to_euler()
    corners = [value for x in (extent.west, extent.east) for y in (extent.south, extent.north)
               for z in (extent.foot_m, extent.high_m) for value in (x, y, z)]
    nearest, _ = thing.camera_fit_coords(bpy.context.evaluated_depsgraph_get(), corners)
    thing.location = nearest + 0.06 * extent.side_m * away
    thing["terrane_place"] = [*thing.location, *thing.rotation_euler]


def set_windows(scene, extent, is_first):
    """Lets the windows see all of it, in colours in the Solid view too: of the vertices, or else of the objects."""
    shadings = [scene.display.shading]
    for screen in bpy.data.screens:
        for area in screen.areas:
            for space in area.spaces:
                if space.type != "VIEW_3D":
                    continue
                space.clip_start = extent.clip_start_m
                space.clip_end = extent.clip_m if is_first else max(space.clip_end, extent.clip_m)
                shadings.append(space.shading)
                if is_first and space.region_3d is not None:
                    space.region_3d.view_location = ((extent.west + extent.east) / 2, (extent.south + extent.north) / 2,
                                                     (extent.low_m + extent.high_m) / 2)
                    space.region_3d.view_distance = 1.2 * extent.side_m
    for shading in shadings:
        shading.color_type = "VERTEX"


def render(scene, options):
    width, height = (int(number) for number in options.size.split("x"))
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    if bpy.app.background:
        # The other engine needs a graphics card and a window.
        scene.render.engine = "CYCLES"
        scene.cycles.samples = options.samples
        scene.cycles.use_denoising = True
        scene.cycles.max_bounces = 4
    # The first that this version knows.
    for transform in ("AgX", "Filmic"):
        try:
            scene.view_settings.view_transform = transform
            scene.view_settings.look = {"AgX": "AgX - Medium High Contrast", "Filmic": "Medium High Contrast"}[transform]
            break
        except TypeError:
            pass
    scene.view_settings.exposure = 0.4
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(Path(options.render).resolve())
    bpy.ops.render.render(write_still=True)
    print(f"terrane: {scene.render.filepath}")


if __name__ == "__main__":
    main()
