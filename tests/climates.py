"""Reads the climates of a bake with rasterio, as GIS does: python tests/climates.py BAKE

BAKE must be of a whole world with the exports exr, climate, rock and uplift, and the GeoTIFFs of the last three.
Needs the PyPI packages numpy, OpenEXR and rasterio. Exits with 1 if one check has failed.
"""

import sys
import xml.etree.ElementTree
from pathlib import Path

import numpy as np
import OpenEXR
import rasterio

from checks import Checks

# Greys for each unit, and the grey of 0.
GREYS = {
    "climate/temperature": (2.0, 128.0),
    "climate/rain": (1 / 20, 0.0),
    "climate/season": (255.0, 0.0),
    "rock/strike": (256 / 180, 0.0),
    "rock/dip": (255 / 90, 0.0),
    "uplift/uplift": (255.0, 0.0),
}
# Of rasters of classes: the number of classes besides the sea, and one of them with its name and its colour, which is
# that of Peel et al. or of the U.S. Geological Survey.
CLASSES = {
    "climate/biome": (30, 4, "BWh hot desert", (255, 0, 0)),
    "rock/rock": (12, 4, "limestone", (67, 175, 249)),
}
# Degrees that it is colder for each metre up.
LAPSE = 0.0065


def check_greys(folder, checks):
    for path, (scale, zero) in GREYS.items():
        with rasterio.open(folder / f"{path}.tif") as tiff, rasterio.open(folder / f"{path}.png") as png:
            values, greys = tiff.read(1).astype(float), png.read(1).astype(float)
            expected = values * scale + zero
            if path == "rock/strike":
                # Strikes of 0 and of 180 degrees are the same.
                off = np.abs((greys - expected + 128) % 256 - 128).max()
            else:
                off = np.abs(greys - np.clip(expected, 0, 255)).max()
            checks.check(off < 0.51, f"{path}: largest distance of the picture's greys from the values", f"{off:.3f}")


def check_temperature(folder, checks):
    heights = next(iter(OpenEXR.File(str(folder / "height/height.exr")).channels().values())).pixels.astype(float)
    with rasterio.open(folder / "climate/temperature.tif") as tiff:
        at_the_sea = tiff.read(1) + LAPSE * np.maximum(heights, 0)
    # At the level of the sea it changes by some degrees in 1,000 km.
    off = max(np.abs(np.diff(at_the_sea, axis=axis)).max() for axis in (0, 1))
    checks.check(off < 1, "largest step in degrees from pixel to pixel of the temperature at the sea's level", f"{off:.3f}")


def check_classes(folder, checks):
    for path, (classes, known, name, colour) in CLASSES.items():
        with rasterio.open(folder / f"{path}.tif") as tiff, rasterio.open(folder / f"{path}.png") as png:
            numbers, same = tiff.read(1), png.read(1)
            found = sorted(np.unique(numbers))
            checks.check((numbers == same).all(), f"{path}: classes of TIFF and PNG are the same numbers", found)
            colours = [picture.colormap(1) for picture in (tiff, png)]
            # GDAL shows no data as transparent, so only red, green and blue can be compared.
            alike = all(colours[0][n][:3] == colours[1][n][:3] for n in range(classes + 1))
            checks.check(alike, f"{path}: and have the same colours", colours[0][1])
            checks.check(colours[0][known][:3] == colour, f"{path}: {name} has its colour", colours[0][known])
            checks.check(numbers.max() <= classes and tiff.nodata == 0, f"{path}: the sea has no data", tiff.nodata)
        categories = xml.etree.ElementTree.parse(folder / f"{path}.png.aux.xml").findall(".//CategoryNames/Category")
        named = len(categories) == classes + 1 and categories[known].text == name
        checks.check(named, f"{path}: categories", len(categories))


def main():
    folder, checks = Path(sys.argv[1]), Checks()
    for check in (check_greys, check_temperature, check_classes):
        check(folder, checks)
    print(f"{checks.done} checks of {folder}, {checks.failed} failed")
    return 1 if checks.failed or not checks.done else 0


if __name__ == "__main__":
    sys.exit(main())
