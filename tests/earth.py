#!/usr/bin/env python3
"""Compares whole worlds from afar with Earth.

    terrane bake world --seed N --stride 1024 --around=0,-1820,10000 --export height,climate --out world-N
    python3 tests/earth.py world-1 world-2 ...

Prints a row of measures a bake and their means, with the range that Earth's geography asks for, and fails if a mean lies
outside. A bake consists of whole tiles; only what lies between the equator and the north pole is measured. Needs numpy,
Pillow, scipy and pyflwdir. Sources: NOAA ETOPO1 (hypsometry), B. B. Mandelbrot 1967 (coasts), J. Korcak 1938 (islands),
J. T. Hack 1957 (rivers), M. C. Peel et al. 2007 (climates).
"""

import json
import pathlib
import sys

import numpy as np
import pyflwdir
from PIL import Image
from scipy import ndimage

Image.MAX_IMAGE_PIXELS = None

# The least and the greatest mean of each measure. Shares of land are those of the preset, +- .05.
RANGES = {
    "below 200 m": (0.15, 0.35),
    "below 500 m": (0.40, 0.60),
    "below 1000 m": (0.63, 0.83),
    "below 2000 m": (0.81, 1.00),
    "coast dimension": (1.15, 1.35),
    "islands": (-0.8, -0.5),
    "Hack": (0.54, 0.62),
    "A": (0.10, 0.30),
    "B": (0.20, 0.40),
    "C": (0.08, 0.20),
    "D": (0.15, 0.35),
    "E": (0.05, 0.25),
}


# Kilometres north of the origin of the equator and of the pole, where `pole_km` is 10,000.
EQUATOR_KM, POLE_KM = -6820, 3180


def hemisphere(folder, bake):
    """Returns the rows of a raster between equator and pole, and its columns up to half as far east and west of the origin."""
    share = bake["preset"]["geography"]["pole_km"] / 10_000
    step, _, _, _, west, north = map(float, (folder / "height" / "height.pgw").read_text().split())
    rows = [int((north / 1000 - km * share) / (step / 1000)) for km in (POLE_KM, EQUATOR_KM)]
    columns = [int((km * share - west / 1000) / (step / 1000)) for km in (-5000, 5000)]
    return slice(*rows), slice(*columns)


def heights_m(folder, bake):
    levels = np.asarray(Image.open(folder / "height" / "height.png"), dtype=np.float64)
    low, high = bake["height_range"]["min_m"], bake["height_range"]["max_m"]
    return low + levels / 65535 * (high - low)


def coast_dimension(land):
    """Slope of the number of boxes that hold a piece of shore, by the size of the box: 10 to 300 km."""
    shore = land & ~ndimage.binary_erosion(land, border_value=1)
    sizes, counts = [1, 2, 4, 8, 16, 32], []
    for size in sizes:
        rows, columns = (length // size * size for length in shore.shape)
        boxes = shore[:rows, :columns].reshape(rows // size, size, columns // size, size)
        counts.append(boxes.any(axis=(1, 3)).sum())
    return -np.polyfit(np.log(sizes), np.log(counts), 1)[0]


def island_exponent(land, cell_km2):
    """Exponent of the number of islands larger than an area, for islands of four cells and more; not of continents."""
    labels, _ = ndimage.label(land)
    areas = np.sort(np.bincount(labels.ravel())[1:] * cell_km2)[::-1]
    areas = areas[(areas >= 4 * cell_km2) & (areas < 3e6)]
    if len(areas) < 8:
        return np.nan
    return np.polyfit(np.log(areas), np.log(np.arange(1, len(areas) + 1)), 1)[0]


def hack(height_m, land, spacing_km):
    """Exponent and longest length in km of rivers, by the basins of all places: 10^3 to 10^6 km2."""
    flow = pyflwdir.from_dem(np.where(land, height_m, -9999.0).astype(np.float32), nodata=-9999.0, latlon=False)
    area_km2 = flow.upstream_area("cell") * spacing_km**2
    # The longest way upstream of each cell, in the order of the water.
    length = np.zeros(area_km2.size)
    below = flow.idxs_ds
    rows, columns = np.divmod(np.arange(below.size), area_km2.shape[1])
    step = np.hypot(rows - rows[below], columns - columns[below]) * spacing_km
    for cell in flow.idxs_seq[::-1]:
        length[below[cell]] = max(length[below[cell]], length[cell] + step[cell]) if below[cell] != cell else length[cell]
    area, length = area_km2.ravel(), length
    # Medians of bins, since small basins are many.
    bins = np.logspace(3, 6, 13)
    which = np.digitize(area, bins)
    middles = [
        (np.median(area[which == n]), np.median(length[which == n])) for n in range(1, 13) if (which == n).sum() > 20
    ]
    areas, lengths = np.log(np.array(middles)).T
    return np.polyfit(areas, lengths, 1)[0], length.max()


def measures(folder):
    bake = json.loads((folder / "bake.json").read_text())
    spacing_km = bake["spacing_m"] / 1000
    window = hemisphere(folder, bake)
    height_m = heights_m(folder, bake)[window]
    land = height_m > (bake["sea_level_m"] or 0.0)
    found = {"land": land.mean()}
    found.update({f"below {limit} m": (height_m[land] < limit).mean() for limit in (200, 500, 1000, 2000)})
    found["coast dimension"] = coast_dimension(land)
    found["islands"] = island_exponent(land, spacing_km**2)
    found["Hack"], found["longest river km"] = hack(height_m, land, spacing_km)
    biomes = folder / "climate" / "biome.png"
    if biomes.exists():
        numbers = np.asarray(Image.open(biomes))[window][land]
        # Classes are numbered in the order of Peel et al.: A 1 to 3, B 4 to 7, C 8 to 16, D 17 to 28, E 29 and 30.
        for name, first, last in (("A", 1, 3), ("B", 4, 7), ("C", 8, 16), ("D", 17, 28), ("E", 29, 30)):
            found[name] = ((numbers >= first) & (numbers <= last)).mean()
    wanted = bake["preset"]["geography"]["land"]
    return found, wanted


def main():
    rows, wanted = [], None
    for folder in map(pathlib.Path, sys.argv[1:]):
        found, wanted = measures(folder)
        rows.append(found)
        print(folder.name, " ".join(f"{name} {value:.3f}" for name, value in found.items()), flush=True)
    if not rows:
        sys.exit(__doc__)
    ranges = {"land": (wanted - 0.05, wanted + 0.05), **RANGES}
    failed = 0
    for name in rows[0]:
        mean = np.nanmean([row[name] for row in rows])
        low, high = ranges.get(name, (-np.inf, np.inf))
        is_good = low <= mean <= high
        failed += not is_good
        print(f"{name:>18} {mean:9.3f}   {low:g} to {high:g}   {'' if is_good else 'OUTSIDE'}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
