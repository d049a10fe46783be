"""Reads the meshes of a bake back with programs that we did not write, and compares them with its heights.

    python3 tests/meshes.py FOLDER [--without-blender]

The folder must hold a bake with the exports gltf and exr, and may hold obj and obj-tiles. Needs the PyPI packages numpy,
OpenEXR and trimesh, and bpy (which is Blender 4.5) unless it is left out. Prints one line a check, with a figure; exits with
1 if one has failed.
"""

import contextlib
import json
import os
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import scipy.ndimage
import trimesh

from checks import Checks

# Points at which each level of detail is compared with the raster.
POINTS = 10_000
# Of points between the raster's vertices, those that must lie within the bound.
BETWEEN_PERCENTILE = 99.9


class Bake:
    """A bake in a folder: its manifest, and its heights in metres, rows from north to south."""

    def __init__(self, folder):
        self.folder = folder
        self.manifest = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
        self.region = self.manifest["region"]
        self.spacing_m = self.manifest["spacing_m"]
        self.heights = OpenEXR.File(str(folder / "height/height.exr")).channels()["Y"].pixels
        self.meshes = [file for file in self.manifest["files"] if file.get("mesh") and file["export"] != "collision"]

    def lods(self, ending):
        """The files of tiles with an ending, by level of detail."""
        lods = {}
        for file in self.meshes:
            if file["path"].endswith(ending):
                lods.setdefault(file["mesh"]["lod"], []).append(file)
        return dict(sorted(lods.items()))

    def corner(self):
        """Metres east and south of the meshes' origin at which the north-western vertex lies."""
        return np.array(self.region["origin_m"]) - np.array(self.region["mesh_origin_m"])


def land(path):
    """The land of a GLB as trimesh reads it: places in 32 bits, as a program that draws it has them, and triangles."""
    scene = trimesh.load(path, process=False)
    return part(scene, next(node for node in scene.graph.nodes_geometry if node.startswith("land")))


def under_water(bake, files):
    """The vertices of the raster that lie under the water of the meshes, or beside one that does: the ground there is the bed's."""
    wet = np.zeros(bake.heights.shape, dtype=bool)
    for file in files:
        scene = trimesh.load(bake.folder / file["path"], process=False)
        for node in scene.graph.nodes_geometry:
            if not node.startswith(("river", "lake", "sea")):
                continue
            places, faces = part(scene, node)
            at = (places[:, [0, 2]].astype(float) - bake.corner()) / bake.spacing_m
            for a, b, c in at[faces]:
                low, high = np.floor(np.minimum(np.minimum(a, b), c)).astype(int), np.ceil(np.maximum(np.maximum(a, b), c)).astype(int)
                x, y = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
                side = lambda p, q: (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
                sides = np.array([side(a, b), side(b, c), side(c, a)])
                inside = (sides >= -1e-9).all(0) | (sides <= 1e-9).all(0)
                inside &= (x >= 0) & (y >= 0) & (x < wet.shape[1]) & (y < wet.shape[0])
                wet[y[inside], x[inside]] = True
    return scipy.ndimage.binary_dilation(wet, iterations=1, structure=np.ones((3, 3)))


def part(scene, node):
    matrix, geometry = scene.graph[node]
    mesh = scene.geometry[geometry]
    moved = matrix.astype(np.float32)
    places = np.asarray(mesh.vertices, dtype=np.float32) * np.diag(moved)[:3] + moved[:3, 3]
    return places.astype(np.float32), np.asarray(mesh.faces)


def check_lod(bake, checks, lod, files):
    places, faces, count = [], [], 0
    for file in files:
        vertices, triangles = land(bake.folder / file["path"])
        mesh = file["mesh"]
        same = len(vertices) == mesh["vertices"] and len(triangles) == mesh["triangles"]
        off_m = max(np.abs(vertices.min(0) - mesh["min_m"]).max(), np.abs(vertices.max(0) - mesh["max_m"]).max())
        if not same or off_m > mesh["error_m"] + 1e-3:
            checks.check(False, f"{file['path']} is as the manifest says", (len(vertices), len(triangles), off_m))
        places.append(vertices)
        faces.append(triangles + count)
        count += len(vertices)
    places, faces = np.concatenate(places), np.concatenate(faces)
    checks.check(True, f"LOD {lod}: vertices and triangles read", f"{len(places)}, {len(faces)}")

    # Welded by exact position.
    welded, number = np.unique(places, axis=0, return_inverse=True)
    faces = number.reshape(-1)[faces]
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, times = np.unique(edges, axis=0, return_counts=True)
    low, high = welded.min(0), welded.max(0)
    ends = welded[unique[times == 1]]
    outer = np.zeros(len(ends), dtype=bool)
    for axis in (0, 2):
        for side in (low[axis], high[axis]):
            outer |= (ends[:, :, axis] == side).all(1)
    checks.check(outer.all(), f"LOD {lod}: edges of one triangle lie on the region's border", f"{(~outer).sum()} do not")
    checks.check((times <= 2).all(), f"LOD {lod}: no edge has three triangles", f"{(times > 2).sum()} have")
    mesh = trimesh.Trimesh(welded, faces, process=False)
    checks.check(
        mesh.is_winding_consistent and (mesh.face_normals[:, 1] > 0).all(),
        f"LOD {lod}: all triangles face up",
        f"{(mesh.face_normals[:, 1] <= 0).sum()} do not",
    )
    area = np.abs(np.cross(*(np.diff(welded[faces][:, :, [0, 2]].astype(float), axis=1).transpose(1, 0, 2)))).sum() / 2
    sides = (np.array(bake.heights.shape) - 1) * bake.spacing_m
    checks.check(abs(area / sides.prod() - 1) < 1e-6, f"LOD {lod}: they cover the region once", f"{area / 1e6:.3f} km2")
    check_heights(bake, checks, lod, welded, faces, files[0]["mesh"]["error_m"], under_water(bake, files))


def check_heights(bake, checks, lod, places, faces, error_m, wet):
    chance = np.random.default_rng(lod)
    rows, cols = (chance.integers(0, side, POINTS) for side in bake.heights.shape)
    dry = ~wet[rows, cols]
    rows, cols = rows[dry], cols[dry]
    east, south = (bake.corner()[:, None] + np.array([cols, rows]) * bake.spacing_m)
    found = height_under(places, faces, east, south)
    off = np.abs(found - bake.heights[rows, cols])
    checks.check(off.max() <= error_m + 1e-4, f"LOD {lod}: heights at {POINTS} vertices of the raster", f"{off.max():.4f} m off, {error_m} allowed")
    # Between vertices the raster is what lies between the cell's corners there. The bound is for vertices: in a cell that an
    # edge of the mesh crosses, the edge itself may be further off than the corners on either side of it.
    # So many that a few of a thousand are a number to go by although most of the points lie in water.
    rows, cols = (chance.random(6 * POINTS) * (side - 1) for side in bake.heights.shape)
    i, j = rows.astype(int), cols.astype(int)
    dry = ~(wet[i, j] | wet[i + 1, j] | wet[i, j + 1] | wet[i + 1, j + 1])
    rows, cols, i, j = rows[dry], cols[dry], i[dry], j[dry]
    corners = np.array([bake.heights[i + down, j + right] for down in (0, 1) for right in (0, 1)])
    east, south = (bake.corner()[:, None] + np.array([cols, rows]) * bake.spacing_m)
    found = height_under(places, faces, east, south)
    off = np.maximum(corners.min(0) - found, found - corners.max(0))
    checks.check(
        np.percentile(off, BETWEEN_PERCENTILE) <= error_m + 1e-4,
        f"LOD {lod}: heights at {len(off)} random points, against the cell's corners",
        f"{np.percentile(off, BETWEEN_PERCENTILE):.4f} m outside at {BETWEEN_PERCENTILE} %, at most {off.max():.4f}, "
        f"{np.count_nonzero(off > error_m)} by more than {error_m}",
    )


def height_under(places, faces, east, south):
    """The mesh's height at places, which must all lie on it: the triangle of each by a grid of buckets."""
    corners = places[faces].astype(np.float64)
    low, high = corners.min(1), corners.max(1)
    size = max(np.sqrt((high[:, 0].max() - low[:, 0].min()) * (high[:, 2].max() - low[:, 2].min()) / len(faces)), 1e-6)
    tree = {}
    cell = lambda value: np.floor(value / size).astype(int)
    for index, (x0, z0, x1, z1) in enumerate(zip(cell(low[:, 0]), cell(low[:, 2]), cell(high[:, 0]), cell(high[:, 2]))):
        for x in range(x0, x1 + 1):
            for z in range(z0, z1 + 1):
                tree.setdefault((x, z), []).append(index)
    heights = np.full(len(east), np.nan)
    for number, (x, z) in enumerate(zip(east, south)):
        candidates = corners[tree[(int(np.floor(x / size)), int(np.floor(z / size)))]]
        a, b, c = candidates[:, 0], candidates[:, 1], candidates[:, 2]
        whole = (b[:, 2] - a[:, 2]) * (c[:, 0] - a[:, 0]) - (b[:, 0] - a[:, 0]) * (c[:, 2] - a[:, 2])
        whole[whole == 0] = np.inf
        u = ((b[:, 2] - z) * (c[:, 0] - x) - (b[:, 0] - x) * (c[:, 2] - z)) / whole
        v = ((c[:, 2] - z) * (a[:, 0] - x) - (c[:, 0] - x) * (a[:, 2] - z)) / whole
        best = np.argmax(np.minimum(np.minimum(u, v), 1 - u - v))
        shares = np.array([u[best], v[best], 1 - u[best] - v[best]])
        heights[number] = shares @ candidates[best, :, 1]
    return heights


@contextlib.contextmanager
def silence():
    """Keeps what a library prints by itself off the screen."""
    with open(os.devnull, "w") as nowhere:
        sys.stdout.flush()
        kept = os.dup(1)
        os.dup2(nowhere.fileno(), 1)
        try:
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)


def in_blender(path):
    """The objects that Blender makes of a file: their names, and their vertices in its world."""
    import bpy

    with silence():
        bpy.ops.wm.read_factory_settings(use_empty=True)
        if path.suffix == ".obj":
            bpy.ops.wm.obj_import(filepath=str(path))
        else:
            bpy.ops.import_scene.gltf(filepath=str(path))
    for thing in bpy.data.objects:
        if thing.type == "MESH":
            places = np.empty(3 * len(thing.data.vertices), dtype=np.float32)
            thing.data.vertices.foreach_get("co", places)
            matrix = np.array(thing.matrix_world)
            yield thing, places.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def check_in_blender(bake, checks, file):
    mesh, level = file["mesh"], file["mesh"]["lod"]
    level = "" if level == min(bake.lods(".glb")) else f"_lod{level}"
    name = f"land_x{file['tile']['x']}_y{file['tile']['y']}{level}"
    found = [pair for pair in in_blender(bake.folder / file["path"]) if pair[0].name == name]
    checks.check(len(found) == 1, f"Blender finds {name} in {file['path']}", len(found))
    thing, places = found[0]
    same = (len(places), len(thing.data.polygons)) == (mesh["vertices"], mesh["triangles"])
    checks.check(same, "with the manifest's vertices and triangles", (len(places), len(thing.data.polygons)))
    checks.check([slot.name for slot in thing.data.materials] == [name], "with a material of its own", thing.data.materials[:])
    if file["path"].endswith(".glb"):
        missing = {"_GROUND", "_COVER"} - {attribute.name for attribute in thing.data.attributes}
        checks.check(not missing, "with the weights of all materials", sorted(missing) or "none is missing")
    # East is x, north is y, up is z: the glTF's z is south.
    low, high = np.array(mesh["min_m"]), np.array(mesh["max_m"])
    expected = np.array([[low[0], -high[2], low[1]], [high[0], -low[2], high[1]]])
    off_m = np.abs(np.array([places.min(0), places.max(0)]) - expected).max()
    checks.check(off_m <= mesh["error_m"] + 1e-3, "in the manifest's box, in metres", f"{off_m:.6f} m off")
    # The tile's highest vertex lies where the raster has it, away from water, under which the mesh has the bed.
    cells = bake.region["tile_cells"]
    column, row = (file["tile"][axis] - bake.region["at"][axis] for axis in ("x", "y"))
    reach = 4
    wet = scipy.ndimage.binary_dilation(under_water(bake, [file]), iterations=reach, structure=np.ones((3, 3)))
    dry = np.where(wet, -np.inf, bake.heights)[row * cells :, column * cells :][: cells + 1, : cells + 1]
    down, right = np.unravel_index(dry.argmax(), dry.shape)
    east, south = bake.corner() + (np.array([column, row]) * cells + [right, down]) * bake.spacing_m
    # Ground that is nearer to water may be higher there.
    away = lambda down_m, right_m: np.hypot(right_m - east, down_m - south) <= reach * bake.spacing_m
    grid = np.indices(dry.shape) + np.array([row, column])[:, None, None] * cells
    down_m, right_m = grid * bake.spacing_m + bake.corner()[::-1][:, None, None]
    heights = bake.heights[row * cells :, column * cells :][: cells + 1, : cells + 1]
    expected = heights[away(down_m, right_m)].max()
    near = away(-places[:, 1], places[:, 0])
    rise = places[near, 2].max() if near.any() else -np.inf
    checks.check(abs(rise - expected) <= mesh["error_m"] + 1e-3, f"its peak is {east:.0f} m east and {-south:.0f} m north", f"{rise:.2f} m")


def highest(files):
    """The file of the highest tile: the others may be sea."""
    return max(files, key=lambda file: file["mesh"]["max_m"][1])


def check_region_in_blender(bake, checks):
    path = next((bake.folder / "mesh").glob("region*.gltf"))
    lands = [places for thing, places in in_blender(path) if thing.name.startswith("land")]
    tiles = bake.region["cols"] * bake.region["rows"]
    checks.check(len(lands) == tiles, f"Blender places all tiles of {path.name}", f"{len(lands)} of {tiles}")
    places = np.concatenate(lands)
    sides = (np.array(bake.heights.shape)[::-1] - 1) * bake.spacing_m
    off_m = np.abs(np.ptp(places, axis=0)[:2] - sides).max()
    checks.check(off_m < 1e-2, "at their size", f"{sides[0]:.0f} x {sides[1]:.0f} m, {off_m:.6f} m off")


def check_obj(bake, checks, path):
    mesh = trimesh.load(path, process=False, split_objects=False, group_material=False, force="mesh", skip_materials=True)
    corner, sides = bake.corner(), (np.array(bake.heights.shape)[::-1] - 1) * bake.spacing_m
    box = mesh.bounds[:, [0, 2]]
    # Roads may stick out by half their width.
    off_m = max(np.abs(box[0] - corner).max(), np.abs(box[1] - corner - sides).max())
    checks.check(off_m < 20, f"trimesh reads {path.name}: {len(mesh.faces)} triangles, in the region's box", f"{off_m:.3f} m off")


def main():
    arguments = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    folder = Path(arguments[0])
    bake, checks = Bake(folder), Checks()
    lods = bake.lods(".glb")
    checks.check(bool(lods), "levels of detail", list(lods))
    for lod, files in lods.items():
        check_lod(bake, checks, lod, files)
    for path in sorted((folder / "mesh").glob("region*.obj")):
        check_obj(bake, checks, path)
    if "--without-blender" not in sys.argv:
        for lod, files in lods.items():
            check_in_blender(bake, checks, highest(files))
        for files in bake.lods(".obj").values():
            check_in_blender(bake, checks, highest(files))
        check_region_in_blender(bake, checks)
    print(f"{checks.done} checks, {checks.failed} failed")
    sys.exit(checks.failed > 0)


main()
