"""Reads a bake back with programs that we did not write, and compares what they see with what bake.json says.

    python3 tests/readback.py FOLDER

The folder must hold a bake with every export that its world has, those of water if it is fluvial: what is missing is a
failure and not a check less. It needs the PyPI packages blake3, numpy, OpenEXR and pillow. Prints one line a check, with a figure; exits with 1 if one has failed.
"""

import json
import sqlite3
import struct
import sys
from contextlib import closing
from pathlib import Path

import blake3
import numpy as np
import OpenEXR
from PIL import Image

from checks import Checks

REGION_EXPORTS = ["height", "exr", "r16", "blend", "normal", "map", "colour"]
# Those that only fluvial worlds have.
WATER_EXPORTS = ["water", "depth", "flow"]
DRY, RIVER, LAKE, SEA = 0, 64, 128, 255
# Half a step of the 8 bits that an axis of a normal has; the second figure is for the rounding of f32 heights.
NORMAL_STEP = 0.5 / 127.5
NORMAL_TOLERANCE = NORMAL_STEP + 2e-4
# An axis that is further from zero than this must have its sign right in the normal map.
NORMAL_CLEAR = 0.02
# PNG's numbers for colour types, as (colour type, bits a channel), by the number of channels; and Pillow's mode.
PNG_KINDS = {1: (0, 16, "I;16"), 3: (2, 8, "RGB"), 4: (6, 8, "RGBA")}
WATER_KIND = (0, 8, "L")
# The layers of the vectors with the names and Z flags of their geometries, besides the tiles.
PATH_LAYERS = {"rivers": ("LINESTRING", 0), "roads": ("LINESTRING", 0)}
FLUVIAL_LAYERS = {
    "rivers": ("LINESTRING", 1),
    "lakes": ("POLYGON", 0),
    "coast": ("LINESTRING", 0),
    "peaks": ("POINT", 0),
    "sites": ("POINT", 0),
    "roads": ("LINESTRING", 1),
    "crossings": ("POINT", 0),
}


# The number of the world's plane among the reference systems.
PLANE = 100000


class Bake:
    """A bake in a folder, with its rasters as numpy arrays: rows from north to south, columns from west to east."""

    def __init__(self, folder):
        self.folder = folder
        self.manifest = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
        self.files = self.manifest["files"]
        region = self.manifest["region"]
        self.at = (region["at"]["x"], region["at"]["y"])
        self.cells = region["tile_cells"]
        self.tiles = region["cols"] * region["rows"]
        self.size = (region["rows"] * self.cells + 1, region["cols"] * self.cells + 1)
        heights = self.manifest["height_range"]
        self.range_m = (heights["min_m"], heights["max_m"])
        self.fluvial = self.manifest["preset"].get("fluvial") is not None
        self.exports = REGION_EXPORTS + WATER_EXPORTS * self.fluvial
        self.tile_exports = [name + "-tiles" for name in self.exports]

    def of(self, export):
        """The rasters of an export, by their name without place and ending."""
        return [file for file in self.files if file["export"] == export and "width" in file]

    def read(self, file):
        """The samples of a raster, as its format's reader gives them."""
        path = self.folder / file["path"]
        if path.suffix == ".png":
            with Image.open(path) as image:
                return np.array(image)
        if path.suffix == ".exr":
            return OpenEXR.File(str(path), separate_channels=True).channels()["Y"].pixels
        if path.suffix == ".r16":
            # The shape comes from the sidecar, as it would for a program that knows nothing of the bake.
            sidecar = json.loads((self.folder / (file["path"] + ".json")).read_text(encoding="utf-8"))
            order = {"little-endian": "<u2"}[sidecar["byte_order"]]
            return np.fromfile(path, dtype=order).reshape(sidecar["height"], sidecar["width"])
        raise ValueError(f"no reader for {path}")

    def one(self, export):
        """The only raster of a region's export."""
        (file,) = self.of(export)
        return self.read(file)

    def place(self, file):
        """Column and row of a tile in the region."""
        return file["tile"]["x"] - self.at[0], file["tile"]["y"] - self.at[1]


def check_files(bake, checks):
    """Every file is there, whole, and nothing else is."""
    listed = {file["path"] for file in bake.files}
    found = {path.relative_to(bake.folder).as_posix() for path in bake.folder.rglob("*") if path.is_file()}
    # The log of runs is of no bake: no two have the same.
    strangers = (listed | {"bake.json", "runs.jsonl"}) ^ found
    checks.check(not strangers and len(listed) == len(bake.files), "files in bake.json and in the folder", len(listed))
    wrong = [f["path"] for f in bake.files if (bake.folder / f["path"]).stat().st_size != f["bytes"]]
    checks.check(not wrong, "files of another size than in bake.json", wrong or f"0 of {len(bake.files)}")
    hashed = lambda file: blake3.blake3((bake.folder / file["path"]).read_bytes()).hexdigest()
    wrong = [file["path"] for file in bake.files if hashed(file) != file["blake3"]]
    checks.check(not wrong, "files of another BLAKE3 than in bake.json", wrong or f"0 of {len(bake.files)}")
    for export in bake.exports + bake.tile_exports:
        images = 2 if export.startswith("blend") else 1
        expected = images * (bake.tiles if export in bake.tile_exports else 1)
        checks.check(len(bake.of(export)) == expected, f"rasters of {export}", f"{len(bake.of(export))} of {expected}")


def check_forms(bake, checks):
    """Size, mode and bit depth of every raster are those of bake.json."""
    wrong, counts = [], {}
    for export in bake.exports + bake.tile_exports:
        for file in bake.of(export):
            kind = Path(file["path"]).suffix
            counts[kind] = counts.get(kind, 0) + 1
            side = bake.cells + 1
            expected = (side, side) if "tile" in file else bake.size
            good = (file["height"], file["width"]) == expected == bake.read(file).shape[:2]
            if kind == ".png":
                # The header as it stands in the file: Pillow would hide a wrong depth behind its modes.
                header = (bake.folder / file["path"]).read_bytes()[:29]
                width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header[16:29])
                known = WATER_KIND if export.startswith("water") else PNG_KINDS[len(file["channels"])]
                with Image.open(bake.folder / file["path"]) as image:
                    good &= (colour, depth, image.mode) == known and image.size == (width, height)
                good &= (height, width) == expected and interlaced == 0
            if kind == ".exr":
                channels = OpenEXR.File(str(bake.folder / file["path"]), separate_channels=True).channels()
                good &= list(channels) == ["Y"] and bake.read(file).dtype == np.float32
            if kind == ".r16":
                good &= file["bytes"] == 2 * file["width"] * file["height"]
            if not good:
                wrong.append(file["path"])
    for kind in [".png", ".exr", ".r16"]:
        bad = [path for path in wrong if path.endswith(kind)]
        good = counts.get(kind, 0) - len(bad)
        checks.check(good > 0 and not bad, f"{kind} with the size, mode and depth of bake.json", bad or good)


def check_heights(bake, checks):
    """PNG, R16 and EXR hold the same heights, in the range that bake.json states."""
    steps, metres = bake.one("height"), bake.one("exr").astype(np.float64)
    differing = np.count_nonzero(steps != bake.one("r16"))
    checks.check(differing == 0, "vertices at which height.png and height.r16 differ", f"{differing} of {steps.size}")
    low, high = bake.range_m
    checks.check(
        low <= metres.min() < metres.max() <= high,
        "heights within height_range",
        f"{metres.min():.3f} to {metres.max():.3f} m in {low:.3f} to {high:.3f} m",
    )
    expected = np.round((metres - low) / (high - low) * 65535)
    off = int(np.abs(expected - steps).max())
    checks.check(off <= 1, "largest distance of height.png from round((h - min) / (max - min) * 65535)", f"{off} steps")
    sidecars, wrong = bake.of("r16") + bake.of("r16-tiles"), []
    for file in sidecars:
        sidecar = json.loads((bake.folder / (file["path"] + ".json")).read_text(encoding="utf-8"))
        stated = [np.float32(sidecar["min_m"]), np.float32(sidecar["max_m"]), sidecar["spacing_m"], sidecar["tile"]]
        known = [np.float32(low), np.float32(high), bake.manifest["spacing_m"], file.get("tile")]
        if stated != known:
            wrong.append(file["path"])
    checks.check(not wrong, "sidecars of r16 that differ from bake.json", wrong or f"0 of {len(sidecars)}")


def check_tiles(bake, checks):
    """A tile is the crop of the region at its place; neighbours have their shared edge twice."""
    for export in bake.exports:
        for whole in bake.of(export):
            region, name, equal, edges = bake.read(whole), Path(whole["path"]).name, 0, 0
            # A tile's name counts from the corner of the region, its number in bake.json from the world's origin.
            tiles = {}
            for file in bake.of(export + "-tiles"):
                col, row = bake.place(file)
                if Path(file["path"]).name == f"{Path(name).stem}_x{col}_y{row}{Path(name).suffix}":
                    tiles[col, row] = bake.read(file)
            for (col, row), tile in tiles.items():
                x, y, side = col * bake.cells, row * bake.cells, bake.cells + 1
                equal += np.array_equal(tile, region[y : y + side, x : x + side])
                east, south = tiles.get((col + 1, row)), tiles.get((col, row + 1))
                edges += east is not None and np.array_equal(tile[:, -1], east[:, 0])
                edges += south is not None and np.array_equal(tile[-1], south[0])
            cols, rows = (bake.size[1] - 1) // bake.cells, (bake.size[0] - 1) // bake.cells
            all_edges = (cols - 1) * rows + cols * (rows - 1)
            checks.check(equal == bake.tiles, f"tiles that are the crop of {name}", f"{equal} of {bake.tiles}")
            checks.check(edges == all_edges, f"shared edges that agree in tiles of {name}", f"{edges} of {all_edges}")


def check_blend(bake, checks):
    """The weights of a vertex sum to exactly 255; unused channels are empty."""
    files = bake.of("blend")
    weights = np.concatenate([bake.read(file) for file in files], axis=2).astype(np.int64)
    names = [channel for file in files for channel in file["channels"]]
    sums = weights.sum(axis=2)
    wrong = np.count_nonzero(sums != 255)
    checks.check(wrong == 0, "vertices whose blend weights do not sum to 255", f"{wrong} of {sums.size}")
    shares = {name: weights[:, :, index].mean() / 2.55 for index, name in enumerate(names) if name != "unused"}
    unused = weights[:, :, [index for index, name in enumerate(names) if name == "unused"]].max(initial=0)
    checks.check(unused == 0, "largest weight in an unused channel", unused)
    used = [name for name, share in shares.items() if share > 0]
    figure = ", ".join(f"{name} {share:.1f} %" for name, share in shares.items())
    checks.check(len(used) >= 2, "ground that is not all the same", figure)


def check_normals(bake, checks):
    """Normals are of unit length and lean down the slope of the EXR heights: green is north, the row before."""
    normals = bake.one("normal").astype(np.float64) / 127.5 - 1.0
    off = np.abs(np.sqrt((normals**2).sum(axis=2)) - 1.0).max()
    # Each axis may be half a step off.
    allowed = np.sqrt(3.0) * NORMAL_STEP
    checks.check(off <= allowed, "largest distance of a normal's length from 1", f"{off:.5f} of {allowed:.5f}")
    heights = bake.one("exr").astype(np.float64)
    per_metre = 0.5 / bake.manifest["spacing_m"]
    east = -(heights[1:-1, 2:] - heights[1:-1, :-2]) * per_metre
    north = -(heights[:-2, 1:-1] - heights[2:, 1:-1]) * per_metre
    expected = np.stack([east, north, np.ones_like(east)], axis=2)
    expected /= np.sqrt((expected**2).sum(axis=2, keepdims=True))
    inner = normals[1:-1, 1:-1]
    off = np.abs(inner - expected).max()
    checks.check(
        off <= NORMAL_TOLERANCE,
        "largest distance of a normal's axis from central differences",
        f"{off:.5f} of {NORMAL_TOLERANCE:.5f}",
    )
    for index, name in enumerate(["red is east", "green is north"]):
        clear = np.abs(expected[:, :, index]) > NORMAL_CLEAR
        right = np.count_nonzero((np.sign(inner) == np.sign(expected))[:, :, index] & clear)
        count = np.count_nonzero(clear)
        checks.check(count >= 100 and right == count, f"normals in which {name}", f"{right} of {count}")


def check_water(bake, checks):
    """The mask has the values of its kinds; there is depth where it is water, and a discharge where it is river."""
    mask, depth, flow = (bake.one(export) for export in WATER_EXPORTS)
    names = {"dry": DRY, "river": RIVER, "lake": LAKE, "sea": SEA}
    strange = sorted(set(np.unique(mask)) - set(names.values()))
    figure = ", ".join(f"{name} {100 * np.mean(mask == value):.2f} %" for name, value in names.items())
    checks.check(not strange, "water of a kind that is known", strange or figure)
    wrong = np.count_nonzero((depth > 0) != (mask != DRY)) + np.count_nonzero(~np.isfinite(depth) | (depth < 0))
    figure = f"{wrong} of {depth.size}; up to {depth.max():.2f} m"
    checks.check(wrong == 0, "vertices at which there is depth without water, or water without depth", figure)
    wrong = np.count_nonzero(~(flow[mask == RIVER] > 0)) + np.count_nonzero(~np.isfinite(flow) | (flow < 0))
    figure = f"{wrong} of {np.count_nonzero(mask == RIVER)}; up to {flow.max():.2f} m3/s"
    checks.check(wrong == 0, "vertices of rivers without a discharge", figure)


def check_picture(bake, checks, name):
    """The map, or the colour of the ground, is a picture and not one colour."""
    picture = bake.one(name)
    colours = len(np.unique(picture.reshape(-1, 3), axis=0))
    size = f"{picture.shape[1]} x {picture.shape[0]}"
    checks.check(picture.shape == (*bake.size, 3) and colours >= 100, f"colours of the {name} of {size}", colours)


def check_registry(bake, checks):
    """A row a tile, with the hashes of what its files hold and the names of these files."""
    with closing(sqlite3.connect(bake.folder / "registry.sqlite")) as database:
        sound = database.execute("PRAGMA integrity_check").fetchone()[0]
        version = database.execute("PRAGMA user_version").fetchone()[0]
        tiles = [(x, y, json.loads(files)) for x, y, files in database.execute("SELECT x, y, files FROM tiles")]
        hashes = lambda name: [digest for (digest,) in database.execute(f"SELECT {name}_hash FROM tiles")]
        hashes = {name: hashes(name) for name in ["heights", "blend", "water", "depth", "flow"]}
        starts = database.execute("SELECT x, y, river_x, river_y FROM tiles WHERE river_x IS NOT NULL").fetchall()
        lines = [json.loads(ids) for (ids,) in database.execute("SELECT lines FROM tiles")]
        states = set(database.execute("SELECT state, stride FROM tiles"))
        files = set(database.execute("SELECT path, export, x, y, bytes, lower(hex(blake3)) FROM files"))
        plan = json.loads(database.execute("SELECT plan FROM bake").fetchone()[0])
    place = lambda file: (file["tile"]["x"], file["tile"]["y"]) if "tile" in file else (None, None)
    row = lambda file: (file["path"], file["export"], *place(file), file["bytes"], file["blake3"])
    expected = {row(file) for file in bake.files if file["export"] != "registry"}
    checks.check(files == expected, "files of the registry that are those of bake.json", len(files))
    checks.check(states == {("baked", bake.manifest["stride"])}, "states and strides of the tiles", len(states))
    planned = {**bake.manifest, "files": [], "blake3": plan["blake3"]}
    checks.check(plan == planned, "the registry tells what was to be baked", plan["preset_name"])
    checks.check(sound == "ok" and version == 3, "schema version of registry.sqlite, which SQLite finds sound", version)
    cols, count = (bake.size[1] - 1) // bake.cells, bake.tiles
    expected = [(bake.at[0] + index % cols, bake.at[1] + index // cols) for index in range(count)]
    checks.check([row[:2] for row in tiles] == expected, "rows of the registry that are the tiles in order", len(tiles))
    rasters = [file for file in bake.files if "tile" in file or "width" in file or file["path"].endswith(".r16.json")]
    of_tile = lambda x, y: {file["path"] for file in rasters if file.get("tile", {"x": x, "y": y}) == {"x": x, "y": y}}
    right = sum(set(files) == of_tile(x, y) for x, y, files in tiles)
    checks.check(right == count, "tiles whose files the registry names", f"{right} of {count}")
    samples = lambda export, x, y: b"".join(
        bake.read(file).tobytes() for file in bake.of(export) if file["tile"] == {"x": x, "y": y}
    )
    # Of the blend maps, the cover comes before the ground in the list of files.
    ground_first = lambda raw: raw[len(raw) // 2 :] + raw[: len(raw) // 2]
    kinds = bytes.maketrans(bytes([DRY, RIVER, LAKE, SEA]), bytes(range(4)))
    channels = {
        "heights": lambda x, y: samples("exr-tiles", x, y),
        "blend": lambda x, y: ground_first(samples("blend-tiles", x, y)),
        "water": lambda x, y: samples("water-tiles", x, y).translate(kinds),
        "depth": lambda x, y: samples("depth-tiles", x, y),
        "flow": lambda x, y: samples("flow-tiles", x, y),
    }
    for name, raw in channels.items():
        if name in ["heights", "blend"] or bake.of("water-tiles"):
            right = sum(blake3.blake3(raw(x, y)).digest() == digest for (x, y, _), digest in zip(tiles, hashes[name]))
            checks.check(right == count, f"tiles whose files have the registry's hash of {name}", f"{right} of {count}")
        else:
            checks.check(hashes[name] == [None] * count, f"hashes of {name} where there is no water", 0)
    through = sum(bool(ids) for ids in lines)
    if bake.of("water-tiles"):
        checks.check(through > 0, "tiles whose lines the registry names", f"{through} of {count}")
    inside = lambda tile, start: tile * bake.cells <= start <= (tile + 1) * bake.cells
    right = sum(inside(x, river_x) and inside(y, river_y) for x, y, river_x, river_y in starts)
    checks.check(right == len(starts), "rivers that start in their tile", f"{right} of {len(starts)}")


def parse_geometry(raw):
    """The lines of a GeoPackage geometry (a point alone, a line, or the rings of a polygon), and whether its envelope
    is theirs."""
    magic, version, flags, srs, west, east, south, north = struct.unpack("<2sBBi4d", raw[:40])
    order, kind = struct.unpack("<BI", raw[40:45])
    numbers, shape, at, lines = 2 + kind // 1000, kind % 1000, 45, []
    count = 1
    if shape == 3:
        (count,), at = struct.unpack("<I", raw[at : at + 4]), at + 4
    for _ in range(count):
        points = 1
        if shape != 1:
            (points,), at = struct.unpack("<I", raw[at : at + 4]), at + 4
        end = at + 8 * numbers * points
        lines.append(np.frombuffer(raw[at:end], dtype="<f8").reshape(points, numbers))
        at = end
    every = np.concatenate(lines)[:, :2]
    low, high = every.min(axis=0), every.max(axis=0)
    header = (magic, version, flags, srs, order, at) == (b"GP", 0, 3, PLANE, 1, len(raw))
    return lines, header and [west, south, east, north] == [*low, *high]


def flattened(values):
    """Values, with those of lists among them in their places."""
    return [inner for value in values for inner in (value if isinstance(value, list) else [value])]


# Half of the last digit that GeoJSON has, and what rounding adds.
LEAST_DIGIT = 0.51e-6


def same_values(row, properties):
    """Whether a row has the values of a feature's properties: of 32-bit floats, the text has as many digits as those
    need, and of others six after the point."""
    near = lambda a, b: a == np.float32(b) or abs(a - b) <= LEAST_DIGIT
    same = lambda a, b: a == b or (isinstance(a, float) and isinstance(b, (int, float)) and near(a, b))
    return len(row) == len(properties) and all(map(same, row, properties))


def check_vectors(bake, checks):
    """The GeoPackage is one, its tiles are those of the region, and the GeoJSON has the same features."""
    layers = FLUVIAL_LAYERS if bake.fluvial else PATH_LAYERS
    with closing(sqlite3.connect(bake.folder / "vector" / "vector.gpkg")) as database:
        header = [database.execute(f"PRAGMA {name}").fetchone()[0] for name in ["application_id", "user_version"]]
        sound = database.execute("PRAGMA integrity_check").fetchone()[0]
        broken = database.execute("PRAGMA foreign_key_check").fetchall()
        systems = {row[0] for row in database.execute("SELECT srs_id FROM gpkg_spatial_ref_sys")}
        query = f"SELECT table_name, min_x, min_y, max_x, max_y FROM gpkg_contents WHERE srs_id = {PLANE}"
        bounds = {row[0]: row[1:] for row in database.execute(query)}
        query = "SELECT table_name, geometry_type_name, z FROM gpkg_geometry_columns"
        shapes = {name: (shape, z) for name, shape, z in database.execute(query)}
        tiles = database.execute("SELECT x, y, geom FROM tiles ORDER BY fid").fetchall()
        columns, tables = {}, {}
        for layer in layers:
            cursor = database.execute(f"SELECT * FROM {layer} ORDER BY fid")
            # After the row's number and its geometry.
            columns[layer] = [column[0] for column in cursor.description][2:]
            tables[layer] = [(raw, row) for _, raw, *row in cursor]
    good = header == [0x47504B47, 10300] and (sound, broken) == ("ok", []) and systems == {-1, 0, 4326, PLANE}
    checks.check(good, "version of the GeoPackage, which SQLite finds sound", header[1])
    # What contours are is for gis.py to see.
    expected = {**layers, "contours": ("LINESTRING", 0), "tiles": ("POLYGON", 0)}
    checks.check(shapes == expected and set(bounds) == set(expected), "layers of the GeoPackage", len(shapes))
    side_m, right = bake.cells * bake.manifest["spacing_m"], 0
    for x, y, raw in tiles:
        (points,), whole = parse_geometry(raw)
        west, north = x * side_m, -y * side_m
        corners = {(west, north), (west + side_m, north), (west, north - side_m), (west + side_m, north - side_m)}
        right += whole and len(points) == 5 and {tuple(point) for point in points} == corners
    checks.check(right == bake.tiles == len(tiles), "footprints that are their tile's", f"{right} of {bake.tiles}")
    for layer, rows in tables.items():
        # A path is named by the tile that owns it, and everything else by its id.
        ids = [tuple(row[: 1 if bake.fluvial else 2]) for _, row in rows]
        checks.check(ids == sorted(set(ids)), f"{layer} of the GeoPackage, sorted and each once", len(rows))
        parsed = [parse_geometry(raw) for raw, _ in rows]
        # Without a feature a layer has no bounds.
        everything = np.concatenate([line[:, :2] for lines, _ in parsed for line in lines]) if parsed else None
        around = (*everything.min(axis=0), *everything.max(axis=0)) if parsed else (None,) * 4
        right = sum(whole for _, whole in parsed)
        good = right == len(rows) and bounds[layer] == around
        checks.check(good, f"envelopes of {layer} that are those of their points", f"{right} of {len(rows)}")
        if layers[layer][0] == "LINESTRING":
            at = columns[layer].index("length_m")
            lengths = [np.hypot(*np.diff(lines[0][:, :2], axis=0).T).sum() for lines, _ in parsed]
            off = max((abs(length - row[at]) for length, (_, row) in zip(lengths, rows)), default=0.0)
            checks.check(off < 1e-6, f"largest distance of length_m from the points of {layer}", f"{off:.1e} m")
        text = json.loads((bake.folder / "vector" / f"{layer}.geojson").read_text(encoding="utf-8"))
        good, same = text["type"] == "FeatureCollection" and "crs" not in text, 0
        for (_, row), (lines, _), feature in zip(rows, parsed, text["features"]):
            geometry, properties = feature["geometry"], flattened(feature["properties"].values())
            drawn = {"Point": lambda it: [[it]], "LineString": lambda it: [it], "Polygon": lambda it: it}
            found = drawn[geometry["type"]](geometry["coordinates"])
            equal = geometry["type"].upper() == layers[layer][0] and len(found) == len(lines)
            equal = equal and all(
                np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=0, atol=LEAST_DIGIT) for a, b in zip(found, lines)
            )
            same += equal and same_values(row, properties)
        good = good and same == len(rows) == len(text["features"])
        checks.check(good, f"features of {layer}.geojson that are the GeoPackage's", f"{same} of {len(rows)}")


def main():
    bake, checks = Bake(Path(sys.argv[1])), Checks()
    check_files(bake, checks)
    check_forms(bake, checks)
    check_heights(bake, checks)
    check_tiles(bake, checks)
    check_blend(bake, checks)
    check_normals(bake, checks)
    if bake.fluvial:
        check_water(bake, checks)
    check_picture(bake, checks, "map")
    check_picture(bake, checks, "colour")
    check_registry(bake, checks)
    check_vectors(bake, checks)
    print(f"{checks.done} checks of {bake.folder}, {checks.failed} failed")
    return 1 if checks.failed or not checks.done else 0


if __name__ == "__main__":
    sys.exit(main())
