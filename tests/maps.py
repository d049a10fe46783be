"""Reads maps with programs that we did not write: world files and pictures, documents, drawings.

    python3 tests/maps.py FOLDER

The folder holds what `.ci/run` draws: map.png and map.webp with world files, map.pdf and map.svg of the same sheet, and an
atlas. It needs the PyPI packages numpy, pillow, pymupdf and rasterio. Prints one line a check, with a figure; exits with 1 if
one has failed.
"""

import re
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
    checks.check((pixels == webp).all(), "PNG and WebP show the same", f"{png.width} x {png.height}")
    checks.check("terrane map" in png.text.get("Description", ""), "the PNG says how to draw it again", png.text.get("Software"))

    with rasterio.open(folder / "map.png") as raster:
        world = [float(line) for line in (folder / "map.pgw").read_text().split()]
        expected = [world[0], 0.0, world[4] - world[0] / 2, 0.0, world[3], world[5] - world[3] / 2]
        checks.check(np.allclose(list(raster.transform)[:6], expected), "GDAL places it by its world file", raster.transform[0])

    document = pymupdf.open(folder / "map.pdf")
    page = document[0]
    # Points to pixels, so that page and picture are as large.
    drawn = page.get_pixmap(matrix=pymupdf.Matrix(png.width / page.rect.width, png.height / page.rect.height), alpha=False)
    shown = np.frombuffer(drawn.samples, np.uint8).reshape(drawn.height, drawn.width, 3)
    height, width = min(drawn.height, png.height), min(drawn.width, png.width)
    off = np.abs(shown[:height, :width].astype(int) - pixels[:height, :width]).mean()
    checks.check(off < 8, "the PDF looks as the PNG does", f"{off:.2f} of 255 off")
    text = page.get_text()
    title = document.metadata["title"]
    checks.check(title in text and "terrane map" in document.metadata["subject"], "its title and recipe are text", title)
    fonts = {font[3].split("+")[-1] for font in page.get_fonts()}
    checks.check(len(fonts) >= 2 and all("Libertinus" in font for font in fonts), "its fonts are in it", len(fonts))
    images = page.get_images()
    lines = page.get_drawings()
    checks.check(len(images) == 1 and len(lines) > 100, "its ground is one picture, its lines are none", len(lines))

    root = ElementTree.parse(folder / "map.svg").getroot()
    words = {element.text for element in root.iter(f"{SVG}text")}
    checks.check(title in words, "the SVG has the same title as text", len(words))
    names = [word for word in words if word and len(word) > 5 and word[0].isupper() and word.isalpha()]
    found = [name for name in names if name in text]
    # MuPDF reads no name that the edge of the map cuts off.
    checks.check(2 * len(found) > len(names) > 1, "names of the SVG are in the PDF", f"{len(found)} of {len(names)}")
    checks.check(len(list(root.iter(f"{SVG}path"))) > 50, "it has lines", len(list(root.iter(f"{SVG}path"))))

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
