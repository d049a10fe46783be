"""Reads the archives of a web map with programs that we did not write, and compares them with its folder of tiles and with the
contours of the same bake.

    python3 tests/archives.py BAKE

The bake must have the export web, and GeoJSON in degrees.

It needs the PyPI packages numpy, pillow, pmtiles and rasterio, which brings GDAL. Prints one line a check, with a figure;
exits with 1 if one has failed.
"""

import json
import math
import sqlite3
import sys
from contextlib import closing
from io import BytesIO
from pathlib import Path

import blake3
import numpy as np
import rasterio
from PIL import Image
from rasterio.warp import transform
from pmtiles.reader import MmapSource, Reader, all_tiles
from pmtiles.tile import Compression, TileType

from checks import Checks

TILE_PX = 256
# The side of Web Mercator's square.
EARTH_M = 2 * math.pi * 6378137
TILE_TYPES = {"webp": TileType.WEBP, "png": TileType.PNG}


class Map:
    """A map's folder, with what its page is told."""

    def __init__(self, folder):
        self.folder = folder
        text = (folder / "map.js").read_text(encoding="utf-8")
        self.about = json.loads(text.removeprefix("terrane.map(").removesuffix(");\n"))
        self.zooms = (self.about["ground"]["min_zoom"], self.about["ground"]["max_zoom"])

    def tiles(self, stem):
        """Bytes by zoom, column and row."""
        layer, _, dense = stem.partition("@")
        mark = f"@{dense}" if dense else ""
        files = self.folder.glob(f"{layer}/*/*/*.{self.about['ending']}")
        found = {}
        for file in files:
            row, _, other = file.stem.partition("@")
            if (f"@{other}" if other else "") == mark:
                found[int(file.parent.parent.name), int(file.parent.name), int(row)] = file.read_bytes()
        return found

    def mosaic(self, stem, zoom):
        """All pixels of a zoom from the files of its tiles, and the metres of EPSG:3857 of the north-western corner."""
        tiles = {(x, y): data for (z, x, y), data in self.tiles(stem).items() if z == zoom}
        side = 2 * TILE_PX if "@2x" in stem else TILE_PX
        x0, y0 = min(x for x, _ in tiles), min(y for _, y in tiles)
        columns, rows = max(x for x, _ in tiles) - x0 + 1, max(y for _, y in tiles) - y0 + 1
        pixels = np.zeros((rows * side, columns * side, 3), np.uint8)
        for (x, y), data in tiles.items():
            at = slice((y - y0) * side, (y - y0 + 1) * side), slice((x - x0) * side, (x - x0 + 1) * side)
            pixels[at] = np.asarray(Image.open(BytesIO(data)).convert("RGB"))
        tile_m = EARTH_M / 2**zoom
        return pixels, (x0 * tile_m - EARTH_M / 2, EARTH_M / 2 - y0 * tile_m)


def further(stem):
    """The zoom levels from a tile to those that it is cut into for MBTiles."""
    return 1 if "@2x" in stem else 0


def cut(tiles, stem):
    """The pixels of tiles, of dense ones cut into four of the next zoom."""
    found = {}
    for (zoom, x, y), data in tiles.items():
        pixels = np.asarray(Image.open(BytesIO(data)).convert("RGB"))
        many = 2 ** further(stem)
        for dx, dy in np.ndindex(many, many):
            quarter = pixels[dy * TILE_PX : (dy + 1) * TILE_PX, dx * TILE_PX : (dx + 1) * TILE_PX]
            found[zoom + further(stem), many * x + dx, many * y + dy] = quarter
    return found


def mbtiles(web_map, stem, checks):
    path = web_map.folder / f"{stem}.mbtiles"
    with closing(sqlite3.connect(path)) as database:
        metadata = dict(database.execute("SELECT name, value FROM metadata"))
        rows = database.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles")
        tiles = {(zoom, x, (1 << zoom) - 1 - row): data for zoom, x, row, data in rows}
        whole = database.execute("PRAGMA integrity_check").fetchone()[0]
    checks.check(whole == "ok", f"{path.name} is whole", whole)
    if further(stem):
        own, theirs = cut(web_map.tiles(stem), stem), cut(tiles, "")
        same = own.keys() == theirs.keys() and all((own[at] == theirs[at]).all() for at in own)
    else:
        same = tiles == web_map.tiles(stem)
    checks.check(same, f"{path.name} holds what the folder holds", f"{len(tiles)} tiles")
    zooms = (int(metadata["minzoom"]) - further(stem), int(metadata["maxzoom"]) - further(stem))
    good = metadata["format"] == web_map.about["ending"] and zooms == web_map.zooms
    ground = json.loads(metadata["json"])["terrane"]
    checks.check(good and ground["bounds_m"] == web_map.about["ground"]["bounds_m"], "and says what they are", metadata["name"])
    return [float(edge) for edge in metadata["bounds"].split(",")]


def pmtiles(web_map, stem, degrees, checks):
    path = web_map.folder / f"{stem}.pmtiles"
    with open(path, "rb") as file:
        source = MmapSource(file)
        reader = Reader(source)
        header = reader.header()
        metadata = reader.metadata()
        tiles = dict(all_tiles(source))
        single = all(reader.get(*at) == data for at, data in tiles.items())
    checks.check(tiles == web_map.tiles(stem) and single, f"{path.name} holds the bytes of the folder", f"{len(tiles)} tiles")
    contents = len(set(tiles.values()))
    counts = (header["addressed_tiles_count"], header["tile_contents_count"])
    checks.check(counts == (len(tiles), contents), "and counts them, equal ones once", counts)
    kind = (header["tile_type"], header["tile_compression"], header["clustered"])
    good = kind == (TILE_TYPES[web_map.about["ending"]], Compression.NONE, True)
    checks.check(good and header["root_length"] <= 16257, "its header is right", f"root of {header['root_length']} bytes")
    edges = [header[f"{edge}_e7"] / 1e7 for edge in ("min_lon", "min_lat", "max_lon", "max_lat")]
    far = max(abs(a - b) for a, b in zip(edges, degrees))
    zooms = (header["min_zoom"], header["max_zoom"])
    checks.check(far <= 1e-7 and zooms == web_map.zooms, "and has the bounds of MBTiles", f"{far:.1e} degrees apart")
    checks.check(metadata["terrane"]["corner_m"] == web_map.about["ground"]["corner_m"], "and the place", metadata["name"])


def gdal(web_map, stem, checks):
    """GDAL's picture of the finest zoom and of the one before it, against the folder's tiles, and where it lies."""
    path = web_map.folder / f"{stem}.mbtiles"
    for zoom in (web_map.zooms[1], web_map.zooms[1] - 1):
        with rasterio.open(path, zoom_level=zoom + further(stem)) as dataset:
            pixels = np.moveaxis(dataset.read([1, 2, 3]), 0, 2)
            (pixel_m, _), bounds, plane = dataset.res, dataset.bounds, dataset.crs.to_epsg()
        own, (west_m, north_m) = web_map.mosaic(stem, zoom)
        # The bounds lie on edges of the finest pixels; of coarser ones GDAL takes the nearest, of two as near either.
        near = lambda at: sorted({math.ceil(at - 0.51), math.floor(at + 0.51)})
        part = lambda row, column: own[row : row + pixels.shape[0], column : column + pixels.shape[1]]
        rows, columns = near((north_m - bounds.top) / pixel_m), near((bounds.left - west_m) / pixel_m)
        same = any(np.array_equal(part(row, column), pixels) for row in rows for column in columns)
        checks.check(same, f"GDAL sees zoom {zoom} of {path.name} as it is", f"{pixels.shape[1]} x {pixels.shape[0]}")
        off = max(abs(a - b) for a, b in zip(bounds, web_map.about["ground"]["bounds_m"]))
        least_m = max(pixel_m, web_map.about["ground"]["finest_m"])
        checks.check(plane == 3857 and off <= least_m, "at its metres of EPSG:3857", f"{off:.3f} m off of pixels of {pixel_m:.2f} m")


def contours(web_map, vectors, checks):
    """The contours in degrees, on the heights of terrain-RGB as GDAL has them."""
    with rasterio.open(web_map.folder / "terrain.mbtiles") as dataset:
        red, green, blue = dataset.read([1, 2, 3]).astype("f8")
        (pixel_m, _), bounds = dataset.res, dataset.bounds
    heights = -10000 + (red * 65536 + green * 256 + blue) * 0.1
    features = json.loads((vectors / "contours.geojson").read_text(encoding="utf-8"))["features"]
    points = np.array([(*point, it["properties"]["height_m"]) for it in features for point in it["geometry"]["coordinates"]])
    east, north = (np.array(axis) for axis in transform("EPSG:4326", "EPSG:3857", points[:, 0], points[:, 1]))
    column, row = (east - bounds.left) / pixel_m - 0.5, (bounds.top - north) / pixel_m - 0.5
    inside = (column >= 0) & (row >= 0) & (column < heights.shape[1] - 1) & (row < heights.shape[0] - 1)
    column, row, metres = column[inside], row[inside], points[inside, 2]
    x, y = column.astype(int), row.astype(int)
    u, v = column - x, row - y
    corners = [heights[y + dy, x + dx] for dy in (0, 1) for dx in (0, 1)]
    there = (corners[0] * (1 - u) + corners[1] * u) * (1 - v) + (corners[2] * (1 - u) + corners[3] * u) * v
    # Of heights of another grid: less than the land rises within a pixel.
    rise = np.max(corners, axis=0) - np.min(corners, axis=0)
    off = np.abs(there - metres) / (rise + 0.2)
    good = inside.mean() > 0.9 and np.median(off) < 0.1 and np.quantile(off, 0.99) < 1
    figure = f"{inside.sum()} points, {np.median(np.abs(there - metres)):.2f} m off in the median"
    checks.check(good, "contours in degrees lie on the heights of the tiles", figure)


def listing(web_map, checks):
    """The list of tiles has all files of tiles with their hashes, and nothing else."""
    lines = (web_map.folder / "tiles.b3").read_text(encoding="utf-8").splitlines()
    listed = {name: digest for digest, name in (line.split("  ") for line in lines)}
    found = {path.relative_to(web_map.folder).as_posix() for path in web_map.folder.glob("*/*/*/*") if path.is_file()}
    hashed = lambda name: blake3.blake3((web_map.folder / name).read_bytes()).hexdigest()
    good = sum(hashed(name) == digest for name, digest in listed.items())
    checks.check(found == set(listed) and good == len(lines), "tiles in tiles.b3 with their hashes", f"{good} of {len(found)}")


def main():
    Image.MAX_IMAGE_PIXELS = None
    checks = Checks()
    bake = Path(sys.argv[1])
    web_map = Map(bake / "web")
    stems = sorted(path.stem for path in web_map.folder.glob("*.mbtiles"))
    checks.check({"terrain", web_map.about["layers"][0]["name"]} <= set(stems), "the archives are there", ", ".join(stems))
    listing(web_map, checks)
    for stem in stems:
        degrees = mbtiles(web_map, stem, checks)
        pmtiles(web_map, stem, degrees, checks)
        gdal(web_map, stem, checks)
    contours(web_map, bake / "vector", checks)
    print(f"{checks.done} checks, {checks.failed} failed")
    sys.exit(checks.failed > 0)


main()
