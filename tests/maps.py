"""Reads maps with programs that we did not write: world files and pictures, documents, drawings.

    python3 tests/maps.py FOLDER

The folder holds what `.ci/run` draws: map.png and map.webp with world files, map.pdf and map.svg of the same sheet, and an
atlas. It needs the PyPI packages numpy, pillow, pymupdf and rasterio. Prints one line a check, with a figure; exits with 1 if
one has failed.
"""

import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pymupdf
import rasterio
from PIL import Image

from checks import Checks

SVG = "{http://www.w3.org/2000/svg}"


def main():
    folder, checks = Path(sys.argv[1]), Checks()
    png = Image.open(folder / "map.png")
    webp = np.asarray(Image.open(folder / "map.webp").convert("RGB"))
    pixels = np.asarray(png.convert("RGB"))
    checks.check("PNG and WebP show the same", (pixels == webp).all(), f"{png.width} x {png.height}")
    checks.check("the PNG says how to draw it again", "terrane map" in png.text.get("Description", ""), png.text.get("Software"))

    with rasterio.open(folder / "map.png") as raster:
        world = [float(line) for line in (folder / "map.pgw").read_text().split()]
        expected = [world[0], 0.0, world[4] - world[0] / 2, 0.0, world[3], world[5] - world[3] / 2]
        checks.check("GDAL places it by its world file", np.allclose(list(raster.transform)[:6], expected), raster.transform[0])

    document = pymupdf.open(folder / "map.pdf")
    page = document[0]
    # Points to pixels, so that page and picture are as large.
    drawn = page.get_pixmap(matrix=pymupdf.Matrix(png.width / page.rect.width, png.height / page.rect.height), alpha=False)
    shown = np.frombuffer(drawn.samples, np.uint8).reshape(drawn.height, drawn.width, 3)
    height, width = min(drawn.height, png.height), min(drawn.width, png.width)
    off = np.abs(shown[:height, :width].astype(int) - pixels[:height, :width]).mean()
    checks.check("the PDF looks as the PNG does", off < 8, f"{off:.2f} of 255 off")
    text = page.get_text()
    title = document.metadata["title"]
    checks.check("its title and recipe are text", title in text and "terrane map" in document.metadata["subject"], title)
    fonts = {font[3].split("+")[-1] for font in page.get_fonts()}
    checks.check("its fonts are in it", len(fonts) >= 2 and all("Libertinus" in font for font in fonts), len(fonts))
    images = page.get_images()
    checks.check("its ground is one picture, its lines are none", len(images) == 1 and len(page.get_drawings()) > 100, len(page.get_drawings()))

    root = ElementTree.parse(folder / "map.svg").getroot()
    words = {element.text for element in root.iter(f"{SVG}text")}
    checks.check("the SVG has the same title as text", title in words, len(words))
    names = [word for word in words if word and len(word) > 5 and word[0].isupper() and word.isalpha()]
    found = [name for name in names if name in text]
    checks.check("names of the SVG are in the PDF", len(found) >= 0.9 * len(names) > 0, f"{len(found)} of {len(names)}")
    checks.check("it has lines", len(list(root.iter(f"{SVG}path"))) > 50, len(list(root.iter(f"{SVG}path"))))

    atlas = pymupdf.open(folder / "atlas" / "atlas.pdf")
    contents = [line[1] for line in atlas.get_toc()]
    sheets = [line for line in contents if line.startswith("Sheet ")]
    checks.check("the atlas has contents", contents[0] == "Index" and contents[-1] == "Gazetteer" and len(sheets) > 1, contents)
    links = [link["page"] for link in atlas[0].get_links()]
    checks.check("its index leads to each sheet", links == list(range(1, len(sheets) + 1)), links)
    gazetteer = atlas[len(sheets) + 1]
    checks.check("its gazetteer leads to sheets", all(0 < link["page"] <= len(sheets) for link in gazetteer.get_links()), len(gazetteer.get_links()))
    lines = gazetteer.get_text()
    first = Image.open(folder / "atlas" / "A1.png")
    checks.check("its pictures are there", first.width > 0 and (folder / "atlas" / "index.png").exists(), f"{first.width} x {first.height}")
    on_sheet = atlas[1].get_text()
    named = [line for line in lines.splitlines() if line.strip() and line.strip().isalpha() and line.strip()[0].isupper()]
    seen = [line for line in named if line.strip() in on_sheet or any(line.strip() in atlas[page].get_text() for page in range(1, len(sheets) + 1))]
    checks.check("names of the gazetteer are on sheets", len(seen) >= 0.9 * len(named) > 0, f"{len(seen)} of {len(named)}")
    print(f"{checks.done} checks, {checks.failed} failed")
    sys.exit(checks.failed > 0)


if __name__ == "__main__":
    main()
