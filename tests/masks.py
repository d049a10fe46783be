"""Reads masks, what grows, and splines back with programs that we did not write, and holds them against the heights.

    python3 tests/masks.py FOLDER

The folder must hold a bake with the exports in EXPORTS of a fluvial world with roads. What is missing is a failure and not a
check less. It needs the PyPI packages numpy, OpenEXR, pillow, pyflwdir, rasterio and scipy. Prints one line a check, with a
figure; exits with 1 if one has failed.
"""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pyflwdir
import rasterio
from PIL import Image
from scipy import ndimage, spatial, stats

from checks import Checks

EXPORTS = "exr,water,slope,slope-geotiff,aspect,aspect-geotiff,steepness,steepness-geotiff,curvature,curvature-geotiff,accumulation,accumulation-geotiff,wetness,wetness-geotiff"
EXPORTS += ",scatter,instances,splines"
# Vertices for which accumulation follows water: what is nearer to the edge, the tool does not know as well as we do.
STEPS = 64
# Instances a hectare where there is as much of them as can be.
A_HECTARE = {"tree": 60, "shrub": 30, "grass": 30, "rock": 20}
# Half of a last digit of metres in a table.
DIGIT_M = 6e-4


class Bake:
    """A bake in a folder, with its rasters as numpy arrays: rows from north to south, columns from west to east."""

    def __init__(self, folder):
        self.folder = folder
        self.manifest = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
        self.spacing_m = self.manifest["spacing_m"]
        region = self.manifest["region"]
        # Metres east and south of the world's origin of the first vertex.
        self.corner_m = [region["at"][axis] * region["tile_cells"] * self.spacing_m for axis in "xy"]
        self.heights = OpenEXR.File(str(folder / "height/height.exr"), separate_channels=True).channels()["Y"].pixels
        self.heights = self.heights.astype(np.float64)
        self.water = self.png("water/water")

    def png(self, name):
        with Image.open(self.folder / f"{name}.png") as image:
            assert image.mode == "L", image.mode
            return np.array(image).astype(np.float64)

    def tif(self, name):
        with rasterio.open(self.folder / f"{name}.tif") as raster:
            assert raster.dtypes == ("float32",) and raster.transform.a == self.spacing_m, raster.profile
            return raster.read(1).astype(np.float64)

    def rows(self, name):
        with open(self.folder / name, newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def height_at(self, east_m, south_m):
        """Heights between vertices, and the steepest slope near each."""
        at = [(south_m - self.corner_m[1]) / self.spacing_m, (east_m - self.corner_m[0]) / self.spacing_m]
        return ndimage.map_coordinates(self.heights, at, order=1, mode="nearest"), at


def inner(raster):
    return raster[1:-1, 1:-1]


def differences(bake):
    """First and second differences of the heights, as textbooks have them, in metres a metre and a metre: east, south."""
    h, m = bake.heights, bake.spacing_m
    rise_south, rise_east = np.gradient(h, m)
    second = lambda back, here, on: (back - 2.0 * here + on) / m**2
    east = second(h[1:-1, :-2], inner(h), h[1:-1, 2:])
    south = second(h[:-2, 1:-1], inner(h), h[2:, 1:-1])
    mixed = (h[2:, 2:] - h[2:, :-2] - h[:-2, 2:] + h[:-2, :-2]) / (4.0 * m**2)
    return inner(rise_east), inner(rise_south), east, south, mixed


def check_slope(bake, checks):
    p, q, *_ = differences(bake)
    expected = np.degrees(np.arctan(np.hypot(p, q)))
    degrees, grey = bake.tif("slope/slope"), bake.png("slope/slope")
    off = np.abs(inner(degrees) - expected).max()
    checks.check(off < 0.02, "largest distance of the slope from numpy's gradient of the EXR", f"{off:.4f} degrees")
    off = np.abs(grey - degrees * 255.0 / 90.0).max()
    checks.check(off <= 0.501, "largest distance of its greys from 255 / 90 degrees", f"{off:.3f}")


def check_aspect(bake, checks):
    p, q, *_ = differences(bake)
    level = np.hypot(p, q) < 1e-6
    # Downhill, clockwise from north; rows run south.
    expected = np.degrees(np.arctan2(-p, q)) % 360
    aspect, grey = inner(bake.tif("aspect/aspect")), inner(bake.png("aspect/aspect")).astype(float)
    off = np.abs((aspect - expected + 180) % 360 - 180)[~level]
    checks.check(off.max() < 0.1, "largest distance of the aspect from numpy's gradient, degrees", f"{off.max():.4f}")
    off = np.abs((grey * 360 / 256 - aspect + 180) % 360 - 180)[~level]
    # Half a step of 360 / 256, and a whole one more at north, since 0 is level.
    checks.check(off.max() < 2.2, "largest distance of the picture of aspect from its values, degrees", f"{off.max():.4f}")


def check_steepness(bake, checks):
    p, q, *_ = differences(bake)
    scale = bake.manifest["preset"]["ground"]["slope_scale"]
    expected = np.minimum(scale * (1.0 - 1.0 / np.sqrt(1.0 + p**2 + q**2)), 1.0)
    factor, grey = bake.tif("steepness/steepness"), bake.png("steepness/steepness")
    off = np.abs(inner(factor) - expected).max()
    checks.check(off < 1e-4, "largest distance of the steepness from the normals of numpy's gradient", f"{off:.6f}")
    off = np.abs(grey - factor * 255.0).max()
    checks.check(off <= 0.501, "largest distance of its greys from 255 times it", f"{off:.3f}")


def check_curvature(bake, checks):
    p, q, r, t, s = differences(bake)
    bent = (1 + q**2) * r - 2 * p * q * s + (1 + p**2) * t
    expected = -bent / (2.0 * (1 + p**2 + q**2) ** 1.5)
    curvature, grey = bake.tif("curvature/curvature"), bake.png("curvature/curvature")
    # Heights of a kilometre have a step of a sixteen-thousandth of a metre.
    off = np.abs(inner(curvature) - expected).max() * bake.spacing_m
    checks.check(off < 2e-4, "largest distance of curvature times spacing from second differences", f"{off:.1e}")
    expected = 128.0 + np.clip(curvature * bake.spacing_m / 0.25, -1.0, 1.0) * 127.0
    off = np.abs(grey - expected).max()
    checks.check(off <= 0.501, "largest distance of its greys from what the manifest says", f"{off:.3f}")
    smooth = ndimage.gaussian_filter(bake.heights, 8.0)
    land = bake.water == 0
    ridge, hollow = (np.mean(curvature[land & side]) for side in (bake.heights > smooth + 5, bake.heights < smooth - 5))
    checks.check(ridge > 0 > hollow, "curvature of what is above its surroundings, and below", f"{ridge:.5f}, {hollow:.5f}")


def check_accumulation(bake, checks):
    drained, grey = bake.tif("accumulation/accumulation"), bake.png("accumulation/accumulation")
    square = bake.spacing_m**2
    expected = 255.0 / 7.0 * np.log10(np.maximum(drained / square, 1.0))
    off = np.abs(grey - np.minimum(expected, 255.0)).max()
    checks.check(off <= 0.51, "largest distance of the greys of accumulation from their formula", f"{off:.3f}")
    sea = bake.water == 255
    good = np.all(drained[sea] == 0) and np.all(drained[~sea] >= 0.999 * square)
    checks.check(good, "least accumulation of land in vertices' squares", f"{(drained[~sea] / square).min():.2f}")
    # The tool parts no water and follows it to its end: on hillsides it is the same land.
    routed = pyflwdir.from_dem(np.where(sea, -9999.0, bake.heights), nodata=-9999.0)
    found = routed.upstream_area("cell").astype(np.float64)
    # Of its lines and of ours what lies between them is not to the vertex: means of five by five.
    near = np.zeros_like(sea)
    near[STEPS:-STEPS, STEPS:-STEPS] = True
    hillside = near & (bake.water == 0) & (found > 0) & (found < 2000)
    smoothed = lambda logs: ndimage.uniform_filter(logs, 5)
    ours, tool = smoothed(np.log(np.maximum(drained, 1.0) / square)), smoothed(np.log(np.maximum(found, 1.0)))
    rank = stats.spearmanr(ours[hillside][::7], tool[hillside][::7]).statistic
    checks.check(rank > 0.6, "rank correlation of accumulation with pyflwdir's on hillsides", f"{rank:.3f}")
    # Of land that drains through many vertices nearly all is the tool's large streams too.
    river = near & (bake.water == 64)
    largest = ndimage.maximum_filter(found, 5)
    share = np.mean(largest[river] > 500) if river.any() else 0.0
    checks.check(share > 0.9, "share of rivers at which the tool has a stream of 500 vertices", f"{share:.3f} of {river.sum()}")


def check_wetness(bake, checks):
    wetness, drained = bake.tif("wetness/wetness"), bake.tif("accumulation/accumulation")
    slope = np.tan(np.radians(bake.tif("slope/slope")))
    dry = (bake.water == 0) | (bake.water == 64)
    expected = np.log(drained[dry] / bake.spacing_m / np.maximum(slope[dry], 1e-3))
    off = np.abs(wetness[dry] - expected).max()
    checks.check(off < 2e-3, "largest distance of wetness from ln(a / tan b)", f"{off:.1e}")
    open_water = bake.water >= 128
    checks.check(np.all(wetness[open_water] == 20.0), "vertices of lakes and sea that are as wet as can be", open_water.sum())
    off = np.abs(bake.png("wetness/wetness") - np.clip(wetness, 0, 20) * 255 / 20).max()
    checks.check(off <= 0.501, "largest distance of its greys from 255 / 20 of it", f"{off:.3f}")


def check_scatter(bake, checks):
    wet = bake.water != 0
    for kind in A_HECTARE:
        density = bake.png(f"scatter/{kind}")
        wrong = np.count_nonzero(density[wet])
        figure = f"{wrong} of {wet.sum()}; mean elsewhere {density[~wet].mean():.1f}"
        checks.check(wrong == 0 and density.max() > 0, f"vertices of water with {kind}", figure)


def check_instances(bake, checks):
    files = [file for file in bake.manifest["files"] if file["export"] == "instances"]
    splines = json.loads((bake.folder / "splines/splines.json").read_text(encoding="utf-8"))
    rows = [row for file in files for row in bake.rows(file["path"])]
    number = lambda name: np.array([float(row[name]) for row in rows])
    x, y, z, east, north = (number(name) for name in ("x_m", "y_m", "z_m", "east_m", "north_m"))
    origin = splines["origin"]
    off = max(np.abs(x + origin["east_m"] - east).max(), np.abs(origin["north_m"] - z - north).max())
    checks.check(off < 2 * DIGIT_M, "largest distance between both places of an instance", f"{off:.4f} m")
    height, at = bake.height_at(east, -north)
    corners = [np.clip(np.floor(place).astype(int), 0, limit - 2) for place, limit in zip(at, bake.heights.shape)]
    four = np.stack([bake.heights[corners[0] + row, corners[1] + column] for row in (0, 1) for column in (0, 1)])
    # Two triangles of a cell lie this much off its bilinear surface at most.
    bent = np.abs(four[0] - four[1] - four[2] + four[3]) / 4.0
    off = (np.abs(height - y) - bent).max()
    checks.check(off < 0.01, f"largest distance of {len(rows)} instances from the ground of the EXR, beside its bends", f"{off:.4f} m")
    near, _ = spatial.cKDTree(np.stack([east, north], axis=1)).query(np.stack([east, north], axis=1), k=2)
    checks.check(near[:, 1].min() > 2.0, "least distance of an instance from the next", f"{near[:, 1].min():.2f} m")
    wet = np.stack([bake.water[corners[0] + row, corners[1] + column] for row in (0, 1) for column in (0, 1)]).any(axis=0)
    checks.check(not wet.any(), "instances beside which there is water", wet.sum())
    kinds = np.array([row["kind"] for row in rows])
    for kind, most in A_HECTARE.items():
        density = bake.png(f"scatter/{kind}") / 255.0
        cells = (density[:-1, :-1] + density[1:, :-1] + density[:-1, 1:] + density[1:, 1:]) / 4.0
        expected = cells.sum() * bake.spacing_m**2 / 1e4 * most
        found = np.count_nonzero(kinds == kind)
        # Fewer stand beside water and roads than densities say.
        figure = f"{found} of {expected:.0f}"
        checks.check(0.85 * expected - 50 < found < 1.05 * expected + 50, f"instances of {kind} that densities ask for", figure)


def check_splines(bake, checks):
    origin = json.loads((bake.folder / "splines/splines.json").read_text(encoding="utf-8"))["origin"]
    for table in ("roads", "rivers"):
        rows = bake.rows(f"splines/{table}.csv")
        number = lambda name: np.array([float(row[name]) for row in rows])
        east, south = number("x_m") + origin["east_m"], number("z_m") - origin["north_m"]
        height, _ = bake.height_at(east, south)
        plain = np.array([not row.get("structure") for row in rows])
        off = np.percentile(np.abs(height - number("y_m"))[plain], 90)
        checks.check(off < 4.0, f"metres that nine of ten of {plain.sum()} knots of {table} lie at most off the ground", f"{off:.2f}")
        starts = number("index") == 0
        falls = np.diff(number("along_m"))[~starts[1:]]
        checks.check((falls >= 0).all() and len(falls) > 10, f"knots of {table} that follow each other", len(falls))
        if table == "rivers":
            rise = np.diff(number("y_m"))[~starts[1:]].max()
            checks.check(rise < 0.01, "most that a river rises from a knot to the next", f"{rise:.4f} m")


def main():
    bake, checks = Bake(Path(sys.argv[1])), Checks()
    exports = {file["export"] for file in bake.manifest["files"]}
    missing = set(EXPORTS.split(",")) - exports
    checks.check(not missing, "exports that are missing", sorted(missing) or 0)
    for check in (check_slope, check_aspect, check_steepness, check_curvature, check_accumulation, check_wetness, check_scatter, check_instances, check_splines):
        check(bake, checks)
    print(f"{checks.done} checks of {bake.folder}, {checks.failed} failed")
    return 1 if checks.failed or not checks.done else 0


if __name__ == "__main__":
    sys.exit(main())
