"""Reads maps with programs that we did not write: world files and pictures, documents, drawings.

    python3 tests/maps.py FOLDER

The folder holds what `.ci/run` draws: map.png and map.webp with world files; map.pdf, map.svg, text.svg and outlines.pdf of the
same sheet; large.svg and large.pdf; and an atlas. It needs the PyPI packages numpy, pillow, pymupdf and rasterio, and reads SVG
with rsvg-convert where that is installed. Prints one line a check, with a figure; exits with 1 if one has failed.
"""

import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pymupdf
import rasterio
from PIL import Image

from checks import Checks

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
LAYERS = ["paper", "relief", "signs", "contours", "houses", "waters", "roads", "places", "names", "furniture"]

# How far a pixel may be off where two programs draw the same lines, of 255 and after the mean with its neighbours: each has its own
# way of smoothing edges. And how many of 1,000 pixels may be further off.
TOLERANCE = 32
MOST_OFF = 0.5


def softened(pixels):
    """The mean of each pixel and the eight around it."""
    height, width = pixels.shape[:2]
    wide = np.pad(pixels.astype(float), ((1, 1), (1, 1), (0, 0)), mode="edge")
    return sum(wide[y : y + height, x : x + width] for y in range(3) for x in range(3)) / 9


def check_looks(checks, what, shown, pixels, most=MOST_OFF):
    """Checks that a page, drawn with the size of a picture, is the picture."""
    height, width = (min(a, b) for a, b in zip(shown.shape[:2], pixels.shape[:2]))
    off = np.abs(softened(shown[:height, :width]) - softened(pixels[:height, :width])).max(axis=2)
    share = 1000 * (off > TOLERANCE).mean()
    checks.check(share < most, f"{what} looks as the PNG does", f"{share:.3f} of 1000 pixels off, {off.max():.0f} at most")


def drawn_pdf(path, width, height):
    """A page as MuPDF draws it."""
    page = pymupdf.open(path)[0]
    drawn = page.get_pixmap(matrix=pymupdf.Matrix(width / page.rect.width, height / page.rect.height), alpha=False)
    return np.frombuffer(drawn.samples, np.uint8).reshape(drawn.height, drawn.width, 3)


def drawn_svg(path, width):
    """A page as librsvg draws it, or what it says instead."""
    done = subprocess.run(["rsvg-convert", "-w", str(width), path, "-o", path.with_suffix(".rsvg.png")], capture_output=True, text=True)
    return np.asarray(Image.open(path.with_suffix(".rsvg.png")).convert("RGB")) if done.returncode == 0 else done.stderr


def check_groups(checks, root):
    """Checks that layers have names, and that what is on them are things with names."""
    layers = {group.get("id"): group for group in root.iter(f"{SVG}g") if group.get(f"{INKSCAPE}groupmode") == "layer"}
    checks.check(list(layers)[:1] + list(layers)[2:] == LAYERS, "its layers are in order", list(layers))
    ids = [element.get("id") for element in root.iter() if element.get("id")]
    checks.check(len(ids) == len(set(ids)), "no id is there twice", len(ids))
    loose = [element.tag for name in ("waters", "roads", "names", "places") for element in layers[name] if element.tag != f"{SVG}g"]
    checks.check(not loose, "each river, road, name and place is a group", len(layers["waters"]) + len(layers["roads"]))
    titles = [group.findtext(f"{SVG}title") for group in layers["names"]]
    checks.check(len(titles) > 1 and all(titles), "each name has a title", titles[:3])
    twice = [len(group) for group in layers["names"] if len(group) > 2]
    checks.check(not twice, "letters and what is around them are one element", len(titles))
    return titles


def main():
    folder, checks = Path(sys.argv[1]), Checks()
    png = Image.open(folder / "map.png")
    webp = np.asarray(Image.open(folder / "map.webp").convert("RGB"))
    pixels = np.asarray(png.convert("RGB"))
    checks.check((pixels == webp).all(), "PNG and WebP show the same", f"{png.width} x {png.height}")
    checks.check("terrane map" in png.text.get("Description", ""), "the PNG says how to draw it again", png.text.get("Software"))

    with rasterio.open(folder / "map.png") as raster:
        world = [float(line) for line in (folder / "map.pgw").read_text().split()]
        expected = [world[0], 0.0, world[4] - world[0] / 2, 0.0, world[3], world[5] - world[3] / 2]
        checks.check(np.allclose(list(raster.transform)[:6], expected), "GDAL places it by its world file", raster.transform[0])
        planes = [raster.crs.to_wkt() if raster.crs else "none"]
    with rasterio.open(folder / "map.webp") as raster:
        planes.append(raster.crs.to_wkt() if raster.crs else "none")
    checks.check("terrane" in planes[0] and planes[0] == planes[1], "GDAL knows the plane of PNG and WebP", planes[0][:50])

    document = pymupdf.open(folder / "map.pdf")
    page = document[0]
    check_looks(checks, "the PDF", drawn_pdf(folder / "map.pdf", png.width, png.height), pixels)
    # The recipe at the foot of the page tells of the outlines, and is another one.
    check_looks(checks, "the PDF of outlines", drawn_pdf(folder / "outlines.pdf", png.width, png.height), pixels, 2 * MOST_OFF)
    words = pymupdf.open(folder / "outlines.pdf")[0].get_text().strip()
    checks.check(not words, "it has no text", repr(words))
    layers = [layer["name"] for layer in document.get_ocgs().values()]
    checks.check(layers == LAYERS, "its layers can be hidden", layers)
    text = page.get_text()
    title = document.metadata["title"]
    checks.check(title in text and "terrane map" in document.metadata["subject"], "its title and recipe are text", title)
    fonts = {font[3].split("+")[-1] for font in page.get_fonts()}
    checks.check(len(fonts) >= 2 and all("Libertinus" in font for font in fonts), "its fonts are in it", len(fonts))
    images = page.get_images()
    lines = page.get_drawings()
    checks.check(len(images) == 1 and len(lines) > 100, "its ground is one picture, its lines are none", len(lines))

    root = ElementTree.parse(folder / "map.svg").getroot()
    named = check_groups(checks, root)
    checks.check(not list(root.iter(f"{SVG}text")), "the SVG has outlines for letters", len(named))
    root = ElementTree.parse(folder / "text.svg").getroot()
    check_groups(checks, root)
    words = {element.text for element in root.iter(f"{SVG}text")}
    checks.check(title in words, "the SVG of text has the same title as text", len(words))
    fonts = [style.text for style in root.iter(f"{SVG}style")]
    checks.check(len(fonts) >= 2 and all("@font-face" in font for font in fonts), "its fonts are in it", len(fonts))
    # MuPDF breaks the line within names that are bent.
    letters = "".join(text.split())
    found = [name for name in named if "".join(name.split()) in letters]
    checks.check(len(found) == len(named) > 1, "names of the SVG are in the PDF", f"{len(found)} of {len(named)}")
    checks.check(len(list(root.iter(f"{SVG}path"))) > 50, "it has lines", len(list(root.iter(f"{SVG}path"))))
    if shutil.which("rsvg-convert"):
        check_looks(checks, "the SVG", drawn_svg(folder / "map.svg", png.width), pixels)
        large = drawn_svg(folder / "large.svg", 777)
        checks.check(not isinstance(large, str), "librsvg reads an SVG of more than 10 MB", (folder / "large.svg").stat().st_size)
    images = list(ElementTree.parse(folder / "large.svg").getroot().iter(f"{SVG}image"))
    most = max(len(value) for image in images for value in image.attrib.values())
    checks.check(len(images) > 1 and most < 8_000_000, "its ground is pictures of less than 8 MB", f"{len(images)}, {most}")
    large = pymupdf.open(folder / "large.pdf")[0]
    # MuPDF counts in points, whatever the unit of the page is.
    size_m = [side / 72 * 0.0254 for side in (large.rect.width, large.rect.height)]
    is_small = max(large.mediabox.width, large.mediabox.height) <= 14_400
    checks.check(is_small and all(abs(side - 6) < 0.01 for side in size_m), "a page of 6 m is one, in a larger unit", size_m)

    atlas = pymupdf.open(folder / "atlas" / "atlas.pdf")
    contents = [line[1] for line in atlas.get_toc()]
    sheets = [line for line in contents if line.startswith("Sheet ")]
    checks.check(contents[0] == "Index" and contents[-1] == "Gazetteer" and len(sheets) > 1, "the atlas has contents", contents)
    links = [link["page"] for link in atlas[0].get_links()]
    checks.check(links == list(range(1, len(sheets) + 1)), "its index leads to each sheet", links)
    gazetteer = atlas[len(sheets) + 1]
    links = [link["page"] for link in gazetteer.get_links()]
    checks.check(links and all(0 < page <= len(sheets) for page in links), "its gazetteer leads to sheets", len(links))
    # Names along rivers stand letter by letter; all others are found whole.
    told = re.findall(r"^(\S.*?)\s+(?:town|village|hamlet|lake|peak)\b", gazetteer.get_text(), re.MULTILINE)
    written = "\n".join(atlas[number].get_text() for number in range(1, len(sheets) + 1))
    seen = [name for name in told if name in written]
    checks.check(len(seen) == len(told) > 0, "names of the gazetteer are on sheets", f"{len(seen)} of {len(told)}")
    first = Image.open(folder / "atlas" / "A1.png")
    index = folder / "atlas" / "index.png"
    checks.check(first.width > 0 and index.exists(), "its pictures are there", f"{first.width} x {first.height}")
    print(f"{checks.done} checks, {checks.failed} failed")
    sys.exit(checks.failed > 0)


if __name__ == "__main__":
    main()
