"""Builds the scene of a terrane bake in Blender 3.6 or later.

In Blender: Scripting workspace, Open, this file, Run. Without a window:

    blender --background --python import_terrane.py -- --render still.png --save scene.blend

The script stands beside bake.json and reads mesh/*.glb. One unit is one metre, +X is east, +Y is north, +Z is up; the
origin is the middle of the region at height 0. What it makes:

    terrane           a collection, and in it one a tile, or one a row where there are many tiles
    land_x0_y0 ...    a material a tile: its blend map mixes the materials of the group "terrane ground"
    river, lake, sea  one material each, for all tiles
    sun, camera, sky  clip ends are set, in the windows too
"""

import argparse
import json
import math
import struct
import sys
import tempfile
from pathlib import Path

import bpy
from mathutils import Vector

MATERIALS = ["grass", "dirt", "rock", "sand", "snow", "forest", "scree", "wetland"]

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
BELOW, HORIZON, ZENITH = (0.10, 0.15, 0.22), (0.58, 0.72, 0.90), (0.08, 0.22, 0.60)

# More tiles than this share a collection by row: each collection is a line of the outliner.
MOST_TILE_COLLECTIONS = 256


def main():
    options = arguments()
    folder = bake_folder()
    bake = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
    meshes = finest_meshes(bake, options.lod)
    scene = empty_scene()
    extent = Extent(bake, meshes)
    # The land and its water, tile by tile.
    collection = collection_in(scene.collection, "terrane")
    ground = ground_group(bake["spacing_m"], extent)
    for record in meshes:
        place = Path(record["path"]).stem.split("_x")[-1]
        column, row = place.split("_y")
        of_tile = len(meshes) <= MOST_TILE_COLLECTIONS
        name = f"tile_x{column}_y{row}" if of_tile else f"row_y{row}"
        import_tile(folder / record["path"], collection_in(collection, name), ground)
    merge_materials()
    for name in WATER:
        if name in bpy.data.materials:
            water_material(bpy.data.materials[name], name, bake["spacing_m"], extent)
    # What surrounds them.
    surroundings = collection_in(collection, "surroundings")
    cut_sides(surroundings, collection, extent)
    if bake.get("sea_level_m") is not None:
        open_sea(surroundings, bake["sea_level_m"], extent, bake["spacing_m"])
    sun(surroundings)
    sky(scene)
    camera(scene, surroundings, extent)
    set_windows(extent)
    print(f"terrane: {len(meshes)} tiles, {extent.side_m:.0f} m a side, "
          f"{extent.low_m:.0f} to {extent.high_m:.0f} m high")
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
    records = [record for record in bake["files"] if record["path"].endswith(".glb") and "mesh" in record]
    there = sorted({record["mesh"]["lod"] for record in records})
    if not there:
        stop("the bake has no GLB; bake with --profile blender or --export gltf")
    if lod is None:
        lod = there[0]
    if lod not in there:
        stop(f"the bake has no LOD {lod}, only {', '.join(map(str, there))}")
    return [record for record in records if record["mesh"]["lod"] == lod]


class Extent:
    """Where the region lies, in metres of the scene."""

    def __init__(self, bake, meshes):
        low = [min(record["mesh"]["min_m"][axis] for record in meshes) for axis in range(3)]
        high = [max(record["mesh"]["max_m"][axis] for record in meshes) for axis in range(3)]
        # Bounds are east, up, south.
        self.west, self.east, self.south, self.north = low[0], high[0], -high[2], -low[2]
        self.low_m, self.high_m = low[1], high[1]
        self.side_m = max(self.east - self.west, self.north - self.south)
        self.middle = Vector(((self.west + self.east) / 2, (self.south + self.north) / 2, (low[1] + high[1]) / 2))
        # Where the walls of the block end, and where the camera sees no further.
        self.foot_m = self.low_m - 0.03 * self.side_m
        self.clip_m = 12.0 * self.side_m


def empty_scene():
    """A scene without anything: the only one when there is no window, else a new one if that in the window is in use."""
    import addon_utils
    if bpy.app.background:
        bpy.ops.wm.read_factory_settings(use_empty=True)
    elif bpy.context.scene.objects:
        bpy.context.window.scene = bpy.data.scenes.new("terrane")
    addon_utils.enable("io_scene_gltf2")
    return bpy.context.scene


def collection_in(parent, name, made={}):
    """A collection that this run has made; those of an earlier one stay as they are."""
    if (parent, name) not in made:
        made[parent, name] = bpy.data.collections.new(name)
        parent.children.link(made[parent, name])
    return made[parent, name]


def import_tile(path, collection, ground):
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(path))
    pictures = None
    for thing in set(bpy.data.objects) - before:
        for other in list(thing.users_collection):
            other.objects.unlink(thing)
        collection.objects.link(thing)
        if thing.type != "MESH":
            continue
        for material in thing.data.materials:
            if material is not None and material.name.startswith("land"):
                pictures = blend_images(path) if pictures is None else pictures
                land_material(material, pictures, ground)


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
        for name in MATERIALS:
            weight = nodes.add("ShaderNodeAttribute", attribute_name="_" + name.upper())
            nodes.put(weight.outputs[2], group.inputs[name])
    if normal_image is not None:
        normal_image.colorspace_settings.name = "Non-Color"
        colour = texture(normal_image).outputs["Color"]
        normal = nodes.add("ShaderNodeNormalMap", {"Color": colour}, uv_map="UVMap").outputs[0]
    else:
        normal = nodes.add("ShaderNodeNewGeometry").outputs["Normal"]
    nodes.put(normal, group.inputs["normal"])
    nodes.put(group.outputs[0], nodes.add("ShaderNodeOutputMaterial").inputs["Surface"])


def merge_materials():
    """Lets the tiles share what each GLB has brought of its own: water, roads, bridges."""
    for material in list(bpy.data.materials):
        name, dot, number = material.name.rpartition(".")
        first = bpy.data.materials.get(name) if dot and number.isdigit() else None
        if first is not None and not name.startswith("land"):
            material.user_remap(first)
            bpy.data.materials.remove(material)


def water_material(material, name, spacing_m, extent):
    material.use_nodes = True
    material.node_tree.nodes.clear()
    nodes = Nodes(material.node_tree)
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


def cut_sides(collection, land, extent):
    """Walls under the outer edges of the region, so that it is a block and not a sheet."""
    near = 1e-4 * extent.side_m
    sides = {"west": [], "east": [], "south": [], "north": []}
    bpy.context.view_layer.update()
    for thing in land.all_objects:
        if thing.type != "MESH" or not thing.name.startswith("land"):
            continue
        for corner in [thing.matrix_world @ vertex.co for vertex in thing.data.vertices]:
            for side, (own, along) in {"west": (0, 1), "east": (0, 1), "south": (1, 0), "north": (1, 0)}.items():
                if abs(corner[own] - getattr(extent, side)) < near:
                    sides[side].append((corner[along], corner))
    vertices, faces = [], []
    for side, corners in sides.items():
        corners.sort(key=lambda pair: pair[0])
        # The front faces outwards.
        turned = side in ("west", "north")
        for number, (_, corner) in enumerate(corners):
            first = len(vertices)
            vertices += [tuple(corner), (corner.x, corner.y, extent.foot_m)]
            if number > 0:
                face = (first - 2, first - 1, first + 1, first)
                faces.append(face[::-1] if turned else face)
    mesh = bpy.data.meshes.new("sides")
    mesh.from_pydata(vertices, [], faces)
    material = bpy.data.materials.new("sides")
    material.use_nodes = True
    material.node_tree.nodes.clear()
    nodes = Nodes(material.node_tree)
    surface = nodes.principled((0.080, 0.066, 0.055, 1.0), 0.95).outputs[0]
    nodes.put(nodes.hazed(surface, extent), nodes.add("ShaderNodeOutputMaterial").inputs["Surface"])
    mesh.materials.append(material)
    collection.objects.link(bpy.data.objects.new("sides", mesh))


def open_sea(collection, level_m, extent, spacing_m):
    """The sea around the region, as far as the camera sees; that of the region is in its tiles."""
    material = bpy.data.materials.get("sea")
    if material is None:
        material = bpy.data.materials.new("sea")
        water_material(material, "sea", spacing_m, extent)
    far = 0.5 * extent.clip_m
    xs = [extent.west - far, extent.west, extent.east, extent.east + far]
    ys = [extent.south - far, extent.south, extent.north, extent.north + far]
    vertices = [(x, y, level_m) for y in ys for x in xs]
    faces = [(4 * row + column, 4 * row + column + 1, 4 * row + column + 5, 4 * row + column + 4)
             for row in range(3) for column in range(3) if (row, column) != (1, 1)]
    mesh = bpy.data.meshes.new("open sea")
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    collection.objects.link(bpy.data.objects.new("open sea", mesh))


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
    world.use_nodes = True
    world.node_tree.nodes.clear()
    nodes = Nodes(world.node_tree)
    up = nodes.add("ShaderNodeSeparateXYZ", {"Vector": nodes.add("ShaderNodeTexCoord").outputs["Generated"]}).outputs["Z"]
    ramp = nodes.add("ShaderNodeValToRGB", {0: nodes.add("ShaderNodeMapRange", {"Value": up, "From Min": -1.0}).outputs[0]})
    stops = ramp.color_ramp.elements
    for stop, position, colour in ((stops[0], 0.2, BELOW), (stops.new(0.5), 0.5, HORIZON), (stops[-1], 0.75, ZENITH)):
        stop.position, stop.color = position, (*colour, 1.0)
    light = nodes.add("ShaderNodeBackground", {"Color": ramp.outputs["Color"], "Strength": 0.7})
    nodes.put(light.outputs[0], nodes.add("ShaderNodeOutputWorld").inputs["Surface"])


def camera(scene, collection, extent):
    data = bpy.data.cameras.new("camera")
    data.lens, data.clip_start, data.clip_end = 35.0, max(0.1, extent.side_m * 1e-4), extent.clip_m
    thing = bpy.data.objects.new("camera", data)
    # From the south, at the middle, as near as has the whole region in the picture.
    azimuth, altitude = math.radians(192.0), math.radians(33.0)
    away = Vector((math.sin(azimuth) * math.cos(altitude), math.cos(azimuth) * math.cos(altitude), math.sin(altitude)))
    thing.rotation_euler = away.to_track_quat("Z", "Y").to_euler()
    collection.objects.link(thing)
    scene.camera = thing
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    corners = [value for x in (extent.west, extent.east) for y in (extent.south, extent.north)
               for z in (extent.foot_m, extent.high_m) for value in (x, y, z)]
    nearest, _ = thing.camera_fit_coords(bpy.context.evaluated_depsgraph_get(), corners)
    thing.location = nearest + 0.06 * extent.side_m * away


def set_windows(extent):
    for screen in bpy.data.screens:
        for area in screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D":
                    space.clip_start, space.clip_end = max(0.1, extent.side_m * 1e-4), extent.clip_m


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
