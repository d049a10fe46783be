"""Reads what a bake has for GIS with GDAL, as GIS does: python tests/gis.py BAKE [--validator | --qgis FILE]

BAKE must be of a fluvial world with the exports height, exr, map, water, vector and geojson, and the GeoTIFFs of height, blend,
normal, map, colour, water, depth and flow. Needs the PyPI packages numpy, OpenEXR, pyogrio, rasterio, rio-cogeo and shapely.
With --validator, under a Python that has GDAL's own package (Debian's python3-gdal), GDAL's validator of cloud-optimised GeoTIFFs
reads those alone. With --qgis, under a Python that has QGIS, the bake's project is opened instead and drawn to a picture. Exits with 1 if one check has failed.
"""

import json
import sys
import xml.etree.ElementTree
import zipfile
from pathlib import Path

from checks import Checks

LAYERS = ["rivers", "lakes", "coast", "peaks", "sites", "roads", "crossings", "contours", "tiles"]
TIFFS = {
    "height/height": ("float32", 1), "blend/blend_ground": ("uint8", 4), "blend/blend_cover": ("uint8", 4),
    "normal/normal": ("uint8", 3), "map/map": ("uint8", 3), "colour/colour": ("uint8", 3), "water/water": ("uint8", 1),
    "water/depth": ("float32", 1), "water/flow": ("float32", 1),
}


def check_rasters(folder, bake, checks):
    import numpy as np
    import OpenEXR
    import rasterio
    from rio_cogeo.cogeo import cog_validate

    region, spacing = bake["region"], bake["spacing_m"]
    east, south = region["origin_m"]
    plane = f"terrane {bake['preset_name']}, seed {bake['seed']}"
    for path, (kind, bands) in TIFFS.items():
        valid, errors, warnings = cog_validate(folder / f"{path}.tif", strict=True)
        with rasterio.open(folder / f"{path}.tif") as tiff:
            # The middle of the first pixel is the north-western vertex.
            first = tiff.transform * (0.5, 0.5)
            good = (tiff.dtypes == (kind,) * bands and tiff.shape == (region["height"], region["width"])
                    and first == (east, -south) and tiff.res == (spacing, spacing) and plane in tiff.crs.to_wkt()
                    and tiff.tags()["seed"] == str(bake["seed"]) and all(tiff.descriptions))
        checks.check(valid and good and not errors + warnings, f"{path}.tif is cloud-optimised and says what it is", errors)
    # The same samples as in the other files.
    metres = OpenEXR.File(str(folder / "height/height.exr"), separate_channels=True).channels()["Y"].pixels
    with rasterio.open(folder / "height/height.tif") as tiff, rasterio.open(folder / "height/height.png") as png:
        heights, steps = tiff.read(1), png.read(1)
        checks.check((heights.view("u4") == metres.view("u4")).all(), "heights of TIFF and EXR", heights.shape)
        off = np.abs(steps * png.scales[0] + png.offsets[0] - heights).max()
        checks.check(off < 0.51 * png.scales[0] and png.units == ("m",), "metres of the PNG by its .aux.xml", off)
        checks.check(png.transform == tiff.transform and plane in png.crs.to_wkt(), "PNG and TIFF lie on each other", tuple(png.transform)[:6])
        told = [float(tiff.tags(1)["STATISTICS_" + name]) for name in ("MINIMUM", "MAXIMUM", "MEAN", "STDDEV")]
        wide = heights.astype("f8")
        found = [wide.min(), wide.max(), wide.mean(), wide.std()]
        checks.check(np.allclose(told, found, rtol=1e-9), "statistics", told)
        # Each copy is the mean of the one before it.
        for level in range(len(tiff.overviews(1))):
            with rasterio.open(folder / "height/height.tif", overview_level=level) as copy:
                even = np.pad(heights, [(0, side % 2) for side in heights.shape], mode="edge")
                heights = ((even[::2, ::2] + even[::2, 1::2]) + (even[1::2, ::2] + even[1::2, 1::2])) * np.float32(0.25)
                checks.check((copy.read(1) == heights).all(), f"overview {level}", heights.shape)
    for path in ("map/map", "water/water"):
        with rasterio.open(folder / f"{path}.tif") as tiff, rasterio.open(folder / f"{path}.png") as png:
            checks.check((tiff.read() == png.read()).all(), f"{path}: TIFF and PNG", tiff.shape)
    pngs = [file["path"] for file in bake["files"] if file["path"].endswith(".png") and "tile" not in file]
    lone = [path for path in pngs if not all((folder / path).with_suffix(it).exists() for it in (".pgw", ".png.aux.xml"))]
    checks.check(pngs and not lone, "world file and .aux.xml beside every PNG of the region", lone or len(pngs))


def validate(folder):
    """What GDAL's own validator says of the GeoTIFFs."""
    from osgeo_utils.samples.validate_cloud_optimized_geotiff import ValidateCloudOptimizedGeoTIFFException
    from osgeo_utils.samples.validate_cloud_optimized_geotiff import validate as validate_tiff

    checks = Checks()
    for path in TIFFS:
        try:
            warnings, errors, _ = validate_tiff(str(folder / f"{path}.tif"), full_check=True)
        except ValidateCloudOptimizedGeoTIFFException as error:
            warnings, errors = [], [str(error)]
        checks.check(not warnings + errors, f"{path}.tif is cloud-optimised for GDAL's validator", warnings + errors or "nothing amiss")
    finish(checks)


def check_vectors(folder, bake, checks):
    import numpy as np
    import pyogrio
    import rasterio
    import shapely

    package = folder / "vector/vector.gpkg"
    listed = [name for name, _ in pyogrio.list_layers(package)]
    checks.check([name for name in LAYERS if name not in listed] == [], "layers of the GeoPackage", listed)
    with rasterio.open(folder / "height/height.tif") as tiff:
        bounds, heights, plane = tiff.bounds, tiff.read(1), tiff.crs.to_wkt()
    for name in LAYERS:
        info = pyogrio.read_info(package, layer=name)
        _, _, geometry, _ = pyogrio.raw.read(package, layer=name)
        shapes = shapely.from_wkb(geometry)
        good = shapely.is_valid(shapes).all() and info["crs"].split('"')[1] == plane.split('"')[1]
        if len(shapes):
            middle = [float(x) for x in shapely.centroid(shapes[0]).coords[0]]
            box = (middle[0] - 50, middle[1] - 50, middle[0] + 50, middle[1] + 50)
            found = len(pyogrio.raw.read(package, layer=name, bbox=box)[2])
            good &= found == sum(shapely.intersects(shapes, shapely.box(*box)))
        checks.check(good and info["capabilities"]["fast_spatial_filter"], f"{name}: valid, placed, and found by its index", len(shapes))
    # Contours are where the heights say.
    _, _, geometry, (metres,) = pyogrio.raw.read(package, layer="contours", columns=["height_m"])
    shapes = shapely.from_wkb(geometry)
    points, owner = shapely.get_coordinates(shapes, return_index=True)
    column = (points[:, 0] - bounds.left) / bake["spacing_m"] - 0.5
    row = (bounds.top - points[:, 1]) / bake["spacing_m"] - 0.5
    x0, y0 = np.clip(np.floor(column).astype(int), 0, heights.shape[1] - 2), np.clip(np.floor(row).astype(int), 0, heights.shape[0] - 2)
    u, v = column - x0, row - y0
    corner = lambda dx, dy: heights[y0 + dy, x0 + dx].astype("f8")
    there = (corner(0, 0) * (1 - u) + corner(1, 0) * u) * (1 - v) + (corner(0, 1) * (1 - u) + corner(1, 1) * u) * v
    off = np.abs(there - metres[owner])
    checks.check(len(points) > 1000 and off.max() < 0.02, "metres that contours are off the heights", off.max())
    ends = [(line.coords[0], line.coords[-1]) for line in shapes]
    edge = lambda x, y: min(abs(x - bounds.left - 0.5 * bake["spacing_m"]), abs(bounds.right - 0.5 * bake["spacing_m"] - x),
                            abs(y - bounds.bottom - 0.5 * bake["spacing_m"]), abs(bounds.top - 0.5 * bake["spacing_m"] - y))
    loose = [pair for pair in ends if pair[0] != pair[1] and max(edge(*pair[0]), edge(*pair[1])) > 1e-6]
    checks.check(not loose, "contours that end within the region", f"{len(loose)} of {len(ends)}")
    texts = [len(json.loads((folder / f"vector/{name}.geojson").read_text())["features"]) for name in LAYERS[:-1]]
    counts = [pyogrio.read_info(package, layer=name)["features"] for name in LAYERS[:-1]]
    checks.check(texts == counts, "features of GeoJSON and of the GeoPackage", counts)


def check_project(folder, checks):
    with zipfile.ZipFile(folder / "region.qgz") as archive:
        project = xml.etree.ElementTree.fromstring(archive.read("region.qgs"))
    sources = [layer.findtext("datasource").split("|")[0] for layer in project.iter("maplayer")]
    lost = [source for source in sources if not (folder / source).is_file()]
    checks.check(sources and not lost, "sources of the project", lost or len(sources))


def draw(folder, picture):
    """What QGIS shows when the project is opened."""
    from qgis.core import QgsApplication, QgsMapRendererSequentialJob, QgsMapSettings, QgsProject
    from qgis.PyQt.QtCore import QSize

    checks = Checks()
    application = QgsApplication([], False)
    application.initQgis()
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    project = QgsProject.instance()
    checks.check(project.read(str(folder / "region.qgz")), "the project opens", project.error())
    layers = project.mapLayers().values()
    checks.check(all(layer.isValid() and layer.crs().description() == project.crs().description() for layer in layers),
                 "all layers are valid and on the project's plane", len(layers))
    shown = [layer for layer in project.layerTreeRoot().checkedLayers() if layer]
    checks.check(len(shown) >= 9, "layers that are shown", [layer.name() for layer in shown])
    settings = QgsMapSettings()
    settings.setLayers(shown)
    settings.setDestinationCrs(project.crs())
    extent = shown[-1].extent()
    settings.setExtent(extent)
    settings.setOutputSize(QSize(1400, int(1400 * extent.height() / extent.width())))
    settings.setOutputDpi(150)
    job = QgsMapRendererSequentialJob(settings)
    job.start()
    job.waitForFinished()
    checks.check(not job.errors() and job.renderedImage().save(picture), "it is drawn", picture)
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    changed = [str(path) for path in after if before.get(path) != after[path]]
    print("files that QGIS has written beside:", [path for path in changed if Path(path) not in before])
    checks.check(not [path for path in changed if Path(path) in before], "QGIS changes no file of the bake", changed)
    finish(checks)


def finish(checks):
    print(f"{checks.done} checks, {checks.failed} failed")
    sys.exit(checks.failed > 0)


def main():
    folder = Path(sys.argv[1])
    if "--qgis" in sys.argv:
        return draw(folder, sys.argv[sys.argv.index("--qgis") + 1])
    if "--validator" in sys.argv:
        return validate(folder)
    bake = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
    checks = Checks()
    check_rasters(folder, bake, checks)
    check_vectors(folder, bake, checks)
    check_project(folder, checks)
    finish(checks)


main()
