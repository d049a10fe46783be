"""Reads the archives of a web map with programs that we did not write, and compares them with its folder of tiles.

    python3 tests/archives.py MAP-FOLDER

It needs the PyPI packages numpy, pillow, pmtiles and rasterio, which brings GDAL. Prints one line a check, with a figure;
exits with 1 if one has failed.
"""

import json
import sqlite3
import sys
from contextlib import closing
from io import BytesIO
from pathlib import Path

import blake3
import numpy as np
import rasterio
from PIL import Image
from pmtiles.reader import MmapSource, Reader, all_tiles
from pmtiles.tile import Compression, TileType

from checks import Checks

TILE_PX = 256
TILE_TYPES = {"webp": TileType.WEBP, "png": TileType.PNG}


class Map:
    """A map's folder, with what its page is told."""

    def __init__(self, folder):
        self.folder = folder
        text = (folder / "map.js").read_text(encoding="utf-8")
        self.about = json.loads(text.removeprefix("terrane.map(").removesuffix(");\n"))
        self.max_zoom = self.about["ground"]["max_zoom"]

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
        """The pixels inside of the bounds, from the files of the tiles."""
        tiles = {(x, y): data for (z, x, y), data in self.tiles(stem).items() if z == zoom}
        side = 2 * TILE_PX if "@2x" in stem else TILE_PX
        ground = self.about["ground"]
        west, south, east, north = ground["bounds_m"]
        pixel_m = ground["finest_m"] * 2 ** (self.max_zoom - zoom) * TILE_PX / side
        left, right = (round((edge - ground["corner_m"][0]) / pixel_m) for edge in (west, east))
        top, bottom = (round((ground["corner_m"][1] - edge) / pixel_m) for edge in (north, south))
        x0, y0 = min(x for x, _ in tiles), min(y for _, y in tiles)
        columns, rows = max(x for x, _ in tiles) - x0 + 1, max(y for _, y in tiles) - y0 + 1
        pixels = np.zeros((rows * side, columns * side, 3), np.uint8)
        for (x, y), data in tiles.items():
            at = slice((y - y0) * side, (y - y0 + 1) * side), slice((x - x0) * side, (x - x0 + 1) * side)
            pixels[at] = np.asarray(Image.open(BytesIO(data)).convert("RGB"))
        return pixels[top - y0 * side : bottom - y0 * side, left - x0 * side : right - x0 * side]


def mbtiles(web_map, stem, checks):
    path = web_map.folder / f"{stem}.mbtiles"
    with closing(sqlite3.connect(path)) as database:
        metadata = dict(database.execute("SELECT name, value FROM metadata"))
        rows = database.execute("SELECT zoom_level, tile_column, tile_row, tile_data FROM tiles")
        tiles = {(zoom, x, (1 << zoom) - 1 - row): data for zoom, x, row, data in rows}
        whole = database.execute("PRAGMA integrity_check").fetchone()[0]
    checks.check(whole == "ok", f"{path.name} is whole", whole)
    checks.check(tiles == web_map.tiles(stem), f"{path.name} holds the bytes of the folder", f"{len(tiles)} tiles")
    good = metadata["format"] == web_map.about["ending"] and int(metadata["maxzoom"]) == web_map.max_zoom
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
    checks.check(far <= 1e-7 and zooms == (0, web_map.max_zoom), "and has the bounds of MBTiles", f"{far:.1e} degrees apart")
    checks.check(metadata["terrane"]["corner_m"] == web_map.about["ground"]["corner_m"], "and the place", metadata["name"])


def gdal(web_map, stem, checks):
    """GDAL's picture of the finest zoom and of the one before it, against the folder's tiles."""
    path = web_map.folder / f"{stem}.mbtiles"
    for zoom in (web_map.max_zoom, web_map.max_zoom - 1):
        with rasterio.open(path, zoom_level=zoom) as dataset:
            pixels = np.moveaxis(dataset.read([1, 2, 3]), 0, 2)
        own = web_map.mosaic(stem, zoom)
        same = pixels.shape == own.shape and (pixels == own).all()
        checks.check(same, f"GDAL sees zoom {zoom} of {path.name} as it is", f"{pixels.shape[1]} x {pixels.shape[0]}")


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
    web_map = Map(Path(sys.argv[1]))
    stems = sorted(path.stem for path in web_map.folder.glob("*.mbtiles"))
    checks.check({"terrain", web_map.about["layers"][0]["name"]} <= set(stems), "the archives are there", ", ".join(stems))
    listing(web_map, checks)
    for stem in stems:
        degrees = mbtiles(web_map, stem, checks)
        pmtiles(web_map, stem, degrees, checks)
        gdal(web_map, stem, checks)
    print(f"{checks.done} checks, {checks.failed} failed")
    sys.exit(checks.failed > 0)


main()
