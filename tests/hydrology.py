"""Judges the drainage of a bake with programs that we did not write: pyflwdir fills it, routes it and orders it.

    python3 tests/hydrology.py [--roads] [--crop] [--table] FOLDER...

A folder must hold a bake of a world with rivers over its whole region: the exports exr and water, and of the vectors
rivers.geojson and lakes.geojson; with --roads also roads.geojson, crossings.geojson and sites.geojson. What is missing
is a failure and not a check less. It needs the PyPI packages numpy, numba, OpenEXR, pillow, pyflwdir, scipy and
shapely. With --crop, for fewer than some 2048 x 2048 vertices, Horton's and Hack's laws are left out, and the tool's
channels are those from a fixed number of vertices upstream. Prints one line a check, with a figure, and with --table a
row a folder at the end; exits with 1 if a check has failed.
"""

import argparse
import json
import sys
from functools import cached_property
from pathlib import Path

import numpy as np
import OpenEXR
import pyflwdir
import shapely
import shapely.errors
import shapely.geometry
from numba import njit
from PIL import Image
from pyflwdir.dem import fill_depressions
from scipy import ndimage

from checks import Checks

# The values of the water raster.
DRY, RIVER, LAKE, SEA = 0, 64, 128, 255
ENDINGS = ["river", "lake", "sea"]
# Shares of the land's vertices that may be pits, and how deep the filling of depressions may be where.
PITS_SHARE = 1e-4
FILLED_PERCENTILE, FILLED_M = 99.9, 0.1
# The share of the length of reaches of an order that must be as close, in vertices, to a channel of the tool.
FOUND_ORDER, FOUND_SHARE, FOUND_VERTICES = 3, 0.95, 2.0
# The tool's channels are as long in all as our reaches of this order and more. Not so in a crop: there a single reach,
# of a high order and yet with a small catchment, decides where this bound lies and falls below it.
DENSITY_ORDER = 2
# From this many vertices upstream on a vertex is a channel, where we do not choose it by density: for the laws, which
# need many streams to say anything, and to compare with.
LAW_VERTICES, OTHER_VERTICES = 100, 500
# An order with fewer streams has no say in the ratios.
LEAST_STREAMS = 3
# Hack's law is of rivers: nothing is said by a basin smaller than so many channel heads', most of which is hillslopes.
# Larger ones are put into classes, each so many times as large as the one before; one with fewer basins has no say.
LEAST_HEADS, CLASS_RATIO, LEAST_BASINS = 8, 2.0, 10
BIFURCATION, LENGTH, HACK = (3.3, 5.0), (1.6, 2.8), (0.53, 0.62)
# How far, in vertices, an end may lie from what it joins. The second is for ends that shall lie on a line.
JOIN_VERTICES, TOUCH_VERTICES = 1.0, 1e-3
GRADE_TOLERANCE = 1.001
# Past half of a crossing's length a road may be in the water for so many vertices.
CROSSING_VERTICES = 2.0
# Metres from a road's middle to where it cuts no more: the widest road's half, and its bank.
CUT_M = 4.5 + 32.0
NODATA = -9999.0
PIT, OUTSIDE = 0, 247  # in pyflwdir's D8
EIGHT = np.ones((3, 3), dtype=bool)
ROUNDING = 1e-6  # of a vertex, or of a width in metres: of numbers that were written as text


class River:
    """A river of the vectors: its points from upstream to downstream, in columns and rows of the raster and metres."""

    def __init__(self, world, feature):
        points = np.array(feature["geometry"]["coordinates"], dtype=np.float64)
        self.at, self.z = world.place(points), points[:, 2]
        properties = feature["properties"]
        self.id, self.order, self.width_m = properties["id"], properties["order"], properties["width_m"]
        self.ending, self.joins = properties["ending"], properties["joins"]
        self.line = shapely.LineString(self.at)


class World:
    """A bake in a folder. Rasters have rows from north to south; places are columns and rows, also between vertices."""

    def __init__(self, folder, crop=False):
        self.folder, self.crop = folder, crop
        self.manifest = json.loads((folder / "bake.json").read_text(encoding="utf-8"))
        region = self.manifest["region"]
        self.spacing_m = self.manifest["spacing_m"]
        self.corner = np.array([region["at"]["x"], region["at"]["y"]]) * region["tile_cells"]
        self.size = (region["rows"] * region["tile_cells"] + 1, region["cols"] * region["tile_cells"] + 1)
        self.figures = {}

    def one(self, export):
        """The path of the only raster of a region's export."""
        files = [file for file in self.manifest["files"] if file["export"] == export and "width" in file]
        if len(files) != 1:
            raise ValueError(f"{len(files)} rasters of {export} in bake.json")
        return self.folder / files[0]["path"]

    def features(self, layer):
        """The features of a layer of the vectors."""
        text = json.loads((self.folder / "vector" / f"{layer}.geojson").read_text(encoding="utf-8"))
        return text["features"]

    def place(self, points):
        """Columns and rows of points that are metres to the east and to the north."""
        points = np.asarray(points, dtype=np.float64)
        return points[..., :2] * [1, -1] / self.spacing_m - self.corner

    def inside(self, at, margin=0.0):
        """Whether places lie in the region, and by a margin from its border."""
        high = np.array(self.size[::-1]) - 1
        return ((at >= margin - ROUNDING) & (at <= high - margin + ROUNDING)).all(axis=-1)

    def sample(self, raster, at):
        """What a raster has at the vertices next to places in the region."""
        column, row = np.rint(at).astype(np.int64).T
        return raster[row, column]

    def near(self, mask, at, vertices):
        """Whether a mask has a vertex as close to a place."""
        column, row = at
        rows = np.arange(max(0, int(row - vertices)), min(self.size[0], int(row + vertices) + 2))
        columns = np.arange(max(0, int(column - vertices)), min(self.size[1], int(column + vertices) + 2))
        away = np.hypot(rows[:, None] - row, columns[None, :] - column) <= vertices + ROUNDING
        return bool((mask[np.ix_(rows, columns)] & away).any())

    @cached_property
    def heights(self):
        heights = OpenEXR.File(str(self.one("exr")), separate_channels=True).channels()["Y"].pixels
        if heights.shape != self.size or heights.dtype != np.float32 or not np.isfinite(heights).all():
            raise ValueError(f"heights of {heights.dtype} and {heights.shape}, or not all of them finite")
        return heights

    @cached_property
    def water(self):
        with Image.open(self.one("water")) as image:
            water = np.array(image)
        if water.shape != self.size or water.dtype != np.uint8:
            raise ValueError(f"water of {water.dtype} and {water.shape}")
        return water

    @cached_property
    def border(self):
        border = np.ones(self.size, dtype=bool)
        border[1:-1, 1:-1] = False
        return border

    @cached_property
    def land(self):
        return (self.water != LAKE) & (self.water != SEA)

    @cached_property
    def rivers(self):
        return [River(self, feature) for feature in self.features("rivers")]

    @cached_property
    def lakes(self):
        placed = lambda feature: shapely.transform(shapely.geometry.shape(feature["geometry"]), self.place)
        return {feature["properties"]["id"]: placed(feature) for feature in self.features("lakes")}

    @cached_property
    def closed_lakes(self):
        """Lakes from which no river starts: water goes into these, and none out of them."""
        labels, count = ndimage.label(self.water == LAKE, structure=EIGHT)
        starts = [river.at[0] for river in self.rivers if self.inside(river.at[0])]
        closed = np.zeros(count + 1, dtype=bool)
        closed[1:] = True
        closed[labels[self.border]] = False
        for column, row in np.rint(starts).astype(np.int64).reshape(-1, 2):
            closed[labels[max(0, row - 1) : row + 2, max(0, column - 1) : column + 2]] = False
        return closed[labels]

    @cached_property
    def network(self):
        """The way of the water to the sea, to closed lakes and out of the region, through all other lakes."""
        away = (self.water == SEA) | self.closed_lakes
        _, d8 = fill_depressions(np.where(away, np.float32(NODATA), self.heights), nodata=NODATA)
        # Along the border and along a shore the tool lets water flow from one outlet to the next.
        d8[~away & (self.border | ndimage.binary_dilation(away, structure=EIGHT))] = PIT
        d8[away] = OUTSIDE
        return Network(d8, self.land, self.border, self.spacing_m)


@njit
def follow(downstream, upwards, steps, channel, order):
    """The longest ways to a vertex from its divide and from a channel's head, the head of its stream, and the length of
    streams at their heads."""
    longest = np.zeros(downstream.size)
    river = np.zeros(downstream.size)
    head = np.full(downstream.size, -1, dtype=np.int64)
    length = np.zeros(downstream.size)
    for at in upwards[::-1]:
        to = downstream[at]
        if channel[at]:
            if head[at] < 0:
                head[at] = at
            length[head[at]] += steps[at]
        if to == at:
            continue
        longest[to] = max(longest[to], longest[at] + steps[at])
        if channel[at]:
            river[to] = max(river[to], river[at] + steps[at])
        # Of what flows into a vertex at most one has its order: with two, it would have one more.
        if channel[at] and order[to] == order[at]:
            head[to] = head[at]
    return longest, river, head, length


def hack(area, length):
    """The exponent of Hack's law: the slope of a line through the means of the logarithms of classes of area."""
    x, y = np.log(area), np.log(length)
    number = ((x - x.min(initial=np.inf)) / np.log(CLASS_RATIO)).astype(np.int64)
    count = np.bincount(number)
    good = count >= LEAST_BASINS
    if good.sum() < 2:
        return float("nan")
    mean = lambda values: np.bincount(number, weights=values)[good] / count[good]
    return float(np.polyfit(mean(x), mean(y), 1)[0])


class Network:
    """The way of the water by the tool: the direction from each vertex, where it goes no further, and what it drains."""

    def __init__(self, d8, land, border, spacing_m):
        away = d8 == OUTSIDE
        self.land, self.border, self.spacing_m, self.routed = land, border, spacing_m, ~away
        # With its cache, the tool has one and the same order for every choice of channels.
        self.flow = pyflwdir.from_array(d8, ftype="d8", cache=False)
        self.downstream = self.flow.idxs_ds.astype(np.int64)
        own = np.arange(d8.size)
        self.downstream[away.ravel()] = own[away.ravel()]
        width = d8.shape[1]
        across = np.abs(self.downstream % width - own % width)
        self.steps = np.hypot(across, np.abs(self.downstream // width - own // width))
        # A lake's own surface makes no channel on it.
        own_area = np.where(away, 0.0, land.astype(np.float64))
        self.area = np.maximum(self.flow.accuflux(own_area, nodata=-1.0), 0.0)
        # Of a vertex that has the region's border upstream we do not know the area; the border itself only ends a way.
        ring = ndimage.binary_dilation(border, structure=EIGHT) & ~away
        self.whole = self.flow.accuflux(ring.astype(np.float64), nodata=-1.0) <= 0.0

    def channel(self, vertices):
        """The vertices that have as many upstream."""
        return self.routed & (self.area >= vertices)

    def below(self, places):
        """Where the tool's way leads from places in the region."""
        column, row = np.rint(np.reshape(places, (-1, 2))).astype(np.int64).T
        starts = np.zeros(self.area.shape)
        starts[row, column] = 1.0
        return (self.flow.accuflux(starts, nodata=-1.0) > 0.0) & self.routed

    def vertices_for(self, length, known):
        """From how many vertices upstream on the channels outside lakes are as long in all, with those we know of."""
        counted = self.routed & self.land
        area, steps = np.where(known, np.inf, self.area)[counted], self.steps.reshape(self.area.shape)[counted]
        order = np.argsort(-area, kind="stable")
        sums = np.cumsum(steps[order])
        least = area[order][min(np.searchsorted(sums, length), sums.size - 1)]
        return float(np.clip(least, 1.0, self.area.max()))

    def density(self, channel):
        """Kilometres of channels outside lakes in a square kilometre of land."""
        length = self.steps.reshape(self.area.shape)[channel & self.land].sum()
        return 1000.0 * length / (self.land.sum() * self.spacing_m)

    def statistics(self, vertices):
        """What Horton's and Hack's laws say of the channels from as many vertices upstream on."""
        channel = self.channel(vertices)
        order = self.flow.stream_order(type="strahler", mask=channel)
        flat = channel.ravel()
        longest, river, head, length = follow(self.downstream, self.flow.idxs_seq, self.steps, flat, order.ravel())
        whole, orders = self.whole.ravel(), order.ravel().astype(np.int64)
        heads = np.flatnonzero(flat & (head == np.arange(head.size)))
        last = np.flatnonzero(flat & ((head[self.downstream] != head) | (self.downstream == np.arange(head.size))))
        # All streams count: without those that have the region's border upstream we would lack most of the high orders,
        # and the ratios would be too high. What leaves the region has no length, as we do not know where it ends.
        left = np.zeros(head.size, dtype=bool)
        left[head[last[self.border.ravel()[last]]]] = True
        measured = heads[~left[heads]]
        top = int(orders.max())
        numbers = np.bincount(orders[heads], minlength=top + 1)[1:]
        measures = np.bincount(orders[measured], minlength=top + 1)[1:]
        metres = np.bincount(orders[measured], weights=length[measured], minlength=top + 1)[1:] * self.spacing_m
        ratio = lambda good, values, sign: (
            float(np.exp(sign * np.polyfit(np.flatnonzero(good), np.log(values[good]), 1)[0]))
            if good.sum() >= 2
            else float("nan")
        )
        result = {"numbers": numbers.tolist(), "whole": np.count_nonzero(whole[flat]) / max(1, np.count_nonzero(flat))}
        result["bifurcation"] = ratio(numbers >= LEAST_STREAMS, numbers, -1)
        result["length"] = ratio(measures >= LEAST_STREAMS, metres / np.maximum(measures, 1), 1)
        # Hack's law over sub-basins that are all in the region: where a link ends in the next one or in an outlet. Rivers
        # are measured from their heads, as on maps. From the divide the hillslope behind the head is in it too, and most
        # of the length of a small basin: by that the exponent comes out too low, as `check_method` shows.
        into = np.bincount(self.downstream[flat & (self.steps > 0)], minlength=head.size)
        ends = flat & whole & ((into[self.downstream] >= 2) | (self.downstream == np.arange(head.size)))
        area = self.area.ravel()
        chosen = ends & (area >= LEAST_HEADS * vertices)
        result["basins"] = int(chosen.sum())
        result["hack"] = hack(area[chosen], river[chosen])
        result["hack from divides"] = hack(area[chosen], longest[chosen])
        return result


@njit
def spanning_tree(size, seed):
    """Of the vertices of a square, the next ones on their ways to its border in a tree that is drawn from all alike.

    Based on: D. B. Wilson, Generating random spanning trees more quickly than the cover time, 1996.
    """
    np.random.seed(seed)
    to = np.arange(size * size)
    done = np.zeros(size * size, dtype=np.bool_)
    for n in range(size):
        for at in (n, n + (size - 1) * size, n * size, n * size + size - 1):
            done[at] = True
    steps = np.array([1, -1, size, -size])
    for start in range(size * size):
        at = start
        while not done[at]:
            to[at] = at + steps[np.random.randint(4)]
            at = to[at]
        # What is left of the walk once its loops are cut.
        at = start
        while not done[at]:
            done[at] = True
            at = to[at]
    return to


def check_method(checks):
    """Hack's exponent of a drainage of which it is known.

    Ways in a spanning tree have the dimension 5/4, and its exponent is half of that (S. S. Manna, D. Dhar, S. N. Majumdar,
    Spanning trees in two dimensions, 1992).
    """
    size, known, tolerance = 1025, 0.625, 0.03
    way = spanning_tree(size, 1) - np.arange(size * size)
    d8 = np.full(size * size, PIT, dtype=np.uint8)
    for step, code in [(1, 1), (size, 4), (-1, 16), (-size, 64)]:
        d8[way == step] = code
    everywhere = np.ones((size, size), dtype=bool)
    result = Network(d8.reshape(size, size), everywhere, ~everywhere, 1.0).statistics(LAW_VERTICES)
    what = f"Hack's exponent of a spanning tree, which is {known}, within {tolerance}"
    figure = f"{result['hack']:.3f}; {result['hack from divides']:.3f} by lengths from the divide"
    checks.check(abs(result["hack"] - known) <= tolerance, what, figure)


def check_forms(world, checks):
    """The rasters are of the region's size, and the water has no other values than its four."""
    strange = sorted(set(np.unique(world.water).tolist()) - {DRY, RIVER, LAKE, SEA})
    names = {"dry": DRY, "river": RIVER, "lake": LAKE, "sea": SEA}
    shares = ", ".join(f"{name} {100 * np.mean(world.water == value):.2f} %" for name, value in names.items())
    checks.check(not strange and world.heights.size > 0, "values of the water raster", strange or shares)
    world.figures["km²"] = f"{world.land.sum() * world.spacing_m**2 / 1e6:.1f}"


def check_pits(world, checks):
    """Of every vertex of the land the water has a way down."""
    around = EIGHT.copy()
    around[1, 1] = False
    lowest = ndimage.minimum_filter(world.heights, footprint=around, mode="nearest")
    inner = world.land & ~world.border
    pits, count = np.count_nonzero(inner & (lowest >= world.heights)), np.count_nonzero(inner)
    figure = f"{pits} of {count}, {100 * pits / max(count, 1):.4f} %"
    checks.check(count > 0 and pits < PITS_SHARE * count, "vertices of the land without a lower neighbour", figure)
    world.figures["pits"] = f"{100 * pits / max(count, 1):.4f} %"


def check_filling(world, checks):
    """Where water may go to lakes, to the sea and out of the region, there is next to nothing to fill."""
    nodata = np.where(world.land, world.heights, np.float32(NODATA))
    filled, _ = fill_depressions(nodata, nodata=NODATA)
    depths = (filled - nodata)[world.land]
    depth = float(np.percentile(depths, FILLED_PERCENTILE)) if depths.size else float("nan")
    figure = f"{depth:.3f} m, at most {depths.max(initial=0.0):.3f} m, {100 * np.mean(depths > 0):.3f} % of the land"
    checks.check(depth < FILLED_M, f"depth of filling at {FILLED_PERCENTILE} % of the land", figure)
    world.figures["filled"] = f"{depth:.3f} m"


def reach_orders(world, river, tributaries):
    """Strahler's order of each piece between two points of a river, of which the vectors have only the last."""
    orders_at = {}
    for other in tributaries:
        at = int(np.argmin(np.hypot(*(river.at - other.at[-1]).T)))
        orders_at.setdefault(at, []).append(other.order)

    def along(start):
        orders, order = [], start
        for at in range(len(river.at) - 1):
            meeting = sorted([order, *orders_at.get(at, [])])
            order = meeting[-1] + (len(meeting) > 1 and meeting[-2] == meeting[-1])
            orders.append(order)
        return orders

    # At its end it has the order of the vectors. What comes out of a lake starts as high as this allows.
    lake = any(lake.distance(shapely.Point(river.at[0])) <= JOIN_VERTICES for lake in world.lakes.values())
    starts = range(river.order, 0, -1) if lake else range(1, river.order + 1)
    fitting = [orders for orders in map(along, starts) if orders[-1] == river.order]
    return fitting[0] if fitting else [river.order] * (len(river.at) - 1)


def reaches(world):
    """Places along our rivers that are in the region and in no lake, with the length that each stands for, the order
    of its reach and half of the river's width, all in vertices; and the places where rivers come into the region."""
    tributaries = {}
    for river in world.rivers:
        tributaries.setdefault(river.joins, []).append(river)
    places, lengths, orders, halves, entries = [], [], [], [], []
    for river in world.rivers:
        pieces = np.diff(river.at, axis=0)
        piece_lengths = np.hypot(*pieces.T)
        ends = np.cumsum(piece_lengths)
        inner = world.inside(river.at, 1.0)
        for at, order in enumerate(reach_orders(world, river, tributaries.get(river.id, []))):
            if inner[at + 1] and not inner[at] and order >= DENSITY_ORDER:
                entries.append(river.at[at + 1])
            count = max(1, int(np.ceil(2 * piece_lengths[at])))
            share = (np.arange(count) + 0.5) / count
            places.append(river.at[at] + share[:, None] * pieces[at])
            lengths.append(np.full(count, piece_lengths[at] / count))
            orders.append(np.full(count, order))
            along = (ends[at] - (1 - share) * piece_lengths[at]) / max(ends[-1], 1e-9)
            halves.append(np.interp(along, [0, 1], river.width_m) / 2 / world.spacing_m)
    if not places:
        raise ValueError("no rivers")
    places, lengths, orders, halves = map(np.concatenate, [places, lengths, orders, halves])
    kept = world.inside(places)
    kept[kept] = world.sample(world.land, places[kept])
    return places[kept], lengths[kept], orders[kept], halves[kept], entries


def check_channels(world, checks):
    """Where the vectors have a river, the tool finds a channel."""
    places, lengths, orders, halves, entries = reaches(world)
    network = world.network
    # The tool cannot know what comes in from outside: it is told where, but not where it goes from there.
    entered = network.below(entries)
    chosen = network.vertices_for(lengths[orders >= DENSITY_ORDER].sum(), entered)
    large = orders >= FOUND_ORDER
    for vertices, gate in [(chosen, not world.crop), (OTHER_VERTICES, world.crop)]:
        channel = network.channel(vertices) | entered
        away = ndimage.distance_transform_edt(~channel)
        distances = ndimage.map_coordinates(away, places[large].T[::-1], order=1, mode="nearest")
        part = lambda close: float(lengths[large][close].sum() / max(lengths[large].sum(), 1e-9))
        found = part(distances <= FOUND_VERTICES)
        wide = part(distances <= np.maximum(FOUND_VERTICES, halves[large]))
        figure = f"{100 * found:.2f} % of {lengths[large].sum() * world.spacing_m / 1000:.1f} km, "
        figure += f"{100 * wide:.2f} % within half the river's width too; {network.density(channel):.2f} km/km²"
        what = f"reaches from order {FOUND_ORDER} within {FOUND_VERTICES:g} vertices of channels"
        what += f" from {vertices:.0f} vertices"
        figure += f"; {len(entries)} come in from outside" if entries else ""
        if gate:
            checks.check(found >= FOUND_SHARE, what, figure)
            world.figures["found"] = f"{100 * found:.2f} %"
            world.figures["channels from"] = f"{vertices:.0f}"
            world.figures["km/km²"] = f"{network.density(channel):.2f}"
        else:
            print(f"       {what}: {figure}")


def check_laws(world, checks):
    """The tool's channels have the ratios of Horton and Strahler and the exponent of Hack that rivers have."""
    network = world.network
    laws = [
        ("bifurcation", "bifurcation ratio", BIFURCATION, "R_B"),
        ("length", "length ratio of streams", LENGTH, "R_L"),
        ("hack", "Hack's exponent", HACK, "h"),
    ]
    for vertices, gate in [(LAW_VERTICES, True), (OTHER_VERTICES, False)]:
        result = network.statistics(vertices)
        numbers = ", ".join(map(str, result["numbers"]))
        divides = f"{result['hack from divides']:.3f} by lengths from the divide"
        of = {"hack": f"{result['basins']} sub-basins, rivers from their heads; {divides}"}
        for name, what, (low, high), column in laws:
            value = result[name]
            what = f"{what} with channels from {vertices} vertices, {low} to {high}"
            figure = f"{value:.3f}; {of.get(name, f'streams by order {numbers}')}"
            if gate:
                checks.check(low <= value <= high, what, figure)
                world.figures[column] = f"{value:.3f}"
            else:
                print(f"       {what}: {figure}")
        if gate:
            world.figures["streams"] = numbers
            print(f"       channels of which the whole basin is in the region: {100 * result['whole']:.1f} %")
            closed = ndimage.label(world.closed_lakes, structure=EIGHT)[1]
            print(f"       lakes from which no river starts, and where the tool's ways end: {closed}")


def check_rivers(world, checks):
    """Rivers fall, end where they say, do not cross and do not become narrower."""
    rivers = world.rivers
    count = len(rivers)
    by_id = {river.id: river for river in rivers}
    checks.check(count > 0 and len(by_id) == count, "rivers with an id of their own", f"{len(by_id)} of {count}")
    told = lambda wrong: f"{len(wrong)} of {count}" + (f", such as {', '.join(map(str, wrong[:5]))}" if wrong else "")
    wrong = [river.id for river in rivers if not (np.diff(river.z) < 0).all()]
    checks.check(not wrong, "rivers that do not fall from point to point", told(wrong))
    wrong, unseen = [], 0
    for river in rivers:
        end = river.at[-1]
        if not world.inside(end, JOIN_VERTICES):
            # What it joins may be out of the region; the end of a river on the border is none of the river's.
            unseen += 1
        elif river.ending == "river":
            other = by_id.get(river.joins)
            if other is None or other is river or other.line.distance(shapely.Point(end)) > JOIN_VERTICES:
                wrong.append(river.id)
        elif river.ending == "lake":
            lake = world.lakes.get(river.joins)
            if lake is None or lake.distance(shapely.Point(end)) > JOIN_VERTICES:
                wrong.append(river.id)
        elif river.ending != "sea" or not world.near(world.water == SEA, end, JOIN_VERTICES):
            wrong.append(river.id)
    kinds = ", ".join(f"{kind} {sum(river.ending == kind for river in rivers)}" for kind in [*ENDINGS, "sink"])
    figure = f"{told(wrong)}; {kinds}; {unseen} at the border"
    checks.check(not wrong, "rivers that do not end in the river, lake or sea that they say", figure)
    wrong = crossings(rivers)
    checks.check(not wrong, "rivers that cross another or themselves", told(wrong))
    world.figures["rivers"], world.figures["crossing"] = str(count), str(len(wrong))
    wrong = []
    for river in rivers:
        narrower = river.width_m[1] < river.width_m[0] - ROUNDING
        other = by_id.get(river.joins) if river.ending == "river" else None
        if other is not None:
            # Between its ends a river's width is not known, but that at its own end is not less.
            first = np.hypot(*(other.at[0] - river.at[-1])) <= TOUCH_VERTICES
            narrower |= other.width_m[0 if first else 1] < river.width_m[1] - ROUNDING
        if narrower:
            wrong.append(river.id)
    checks.check(not wrong, "rivers that become narrower, or join a narrower one", told(wrong))


def crossings(rivers):
    """The rivers of which the inside meets that of another, or of themselves, away from where either starts or ends."""
    lines = np.array([river.line for river in rivers], dtype=object)
    first, second = shapely.STRtree(lines).query(lines, predicate="intersects")
    pairs = first < second
    found = [river.id for river in rivers if not river.line.is_simple]
    for a, b in zip(first[pairs], second[pairs]):
        if not shapely.relate_pattern(lines[a], lines[b], "T********"):
            continue
        ends = shapely.MultiPoint([lines[i].coords[end] for i in (a, b) for end in (0, -1)])
        if not shapely.intersection(lines[a], lines[b]).within(ends.buffer(TOUCH_VERTICES)):
            found.append(f"{rivers[a].id} and {rivers[b].id}")
    return found


def check_roads(world, checks):
    """Roads join sites or other roads, are no steeper than they say and are in the water only where they cross it."""
    roads = world.features("roads")
    sites = {site["properties"]["id"]: world.place(site["geometry"]["coordinates"]) for site in world.features("sites")}
    crossed = {}
    for crossing in world.features("crossings"):
        properties = crossing["properties"]
        reach = properties["length_m"] / 2 / world.spacing_m + CROSSING_VERTICES
        place = world.place(crossing["geometry"]["coordinates"])
        crossed.setdefault(properties["road"], []).append((place, reach, properties["kind"]))
    kinds = [kind for places in crossed.values() for _, _, kind in places]
    # As keys: each road once, and in their order.
    drawn = lambda road: shapely.LineString(world.place(road["geometry"]["coordinates"]))
    lines = {road["properties"]["id"]: drawn(road) for road in roads}
    loose, steep, wet, bare, opened, steepest = {}, {}, {}, {}, 0, 0.0
    for road in roads:
        points, properties = np.array(road["geometry"]["coordinates"], dtype=np.float64), road["properties"]
        at, id = world.place(points), properties["id"]
        for end, site in [(at[0], properties["from"]), (at[-1], properties["to"])]:
            # A road ends where it comes upon another one, which of those outside of the region is not told.
            ends = site in sites and np.hypot(*(sites[site] - end)) <= JOIN_VERTICES + ROUNDING
            others = (other.distance(shapely.Point(end)) for key, other in lines.items() if key != id)
            if site not in sites or not ends and world.inside(end) and min(others, default=np.inf) > JOIN_VERTICES:
                loose[id] = True
        if properties["from"] == properties["to"]:
            loose[id] = True
        lengths = np.hypot(*np.diff(points[:, :2], axis=0).T)
        grades = np.abs(np.diff(points[:, 2])) / np.maximum(lengths, 1e-9)
        steepest = max(steepest, grades.max(initial=0.0) / properties["max_grade"])
        if not (grades <= properties["max_grade"] * GRADE_TOLERANCE).all():
            steep[id] = True
        in_water = world.inside(at)
        in_water[in_water] = world.sample(world.water, at[in_water]) != DRY
        for place, reach, _ in (crossing for crossing in crossed.get(id, []) if crossing[2] != "tunnel"):
            in_water &= np.hypot(*(at - place).T) > reach
        if in_water.any():
            wet[id] = True
        line = shapely.LineString(np.column_stack([at, points[:, 2]]))
        for place, _, kind in crossed.get(id, []):
            if kind == "tunnel" and world.inside(place):
                level = line.interpolate(line.project(shapely.Point(place))).z
                if world.sample(world.heights, place[None])[0] > level:
                    continue
                # Where two roads run together the cut of one may open the tunnel of the other.
                beside = (other.distance(shapely.Point(place)) for key, other in lines.items() if key != id)
                if min(beside, default=np.inf) * world.spacing_m <= CUT_M:
                    opened += 1
                else:
                    bare[id] = True
    told = lambda wrong: f"{len(wrong)} of {len(roads)}" + (f", such as {', '.join(list(wrong)[:5])}" if wrong else "")
    checks.check(len(roads) > 0 and not loose, "roads that do not lead from site to site", told(loose))
    checks.check(len(roads) > 0 and not steep, "roads steeper than max_grade", f"{told(steep)}; {steepest:.4f} of it")
    kinds_told = ", ".join(f"{kind} {kinds.count(kind)}" for kind in sorted(set(kinds))) or "no crossings"
    strange = (set(kinds) - {"bridge", "ford", "tunnel"}) or (set(crossed) - set(lines))
    checks.check(not strange, "crossings that are a bridge, a ford or a tunnel of a road", strange or kinds_told)
    figure = f"{told(bare)}; {opened} tunnels opened by another road"
    checks.check(not bare, "roads with tunnels above the land", figure)
    checks.check(len(roads) > 0 and not wet, "roads in the water away from their crossings", told(wet))
    world.figures["roads"] = str(len(roads))


def judge(folder, with_roads, crop, checks):
    """All checks of a bake; gives back its row of the table."""
    before = checks.failed
    print(f"{folder}")
    try:
        world = World(folder, crop)
    except (OSError, KeyError, ValueError) as error:
        checks.check(False, "bake.json", repr(error))
        return {"bake": folder.name, "failed": str(checks.failed - before)}
    every = [check_forms, check_pits, check_filling, check_channels, check_rivers]
    for check in every + [check_laws] * (not crop) + [check_roads] * with_roads:
        # What a check cannot read is a failure of this check, and the others go on.
        try:
            check(world, checks)
        except (OSError, LookupError, RuntimeError, TypeError, ValueError, shapely.errors.ShapelyError) as error:
            checks.check(False, f"what {check.__name__} needs", repr(error))
    size = f"{world.size[1]} x {world.size[0]}"
    return {"bake": folder.name, "vertices": size, **world.figures, "failed": str(checks.failed - before)}


def print_table(rows):
    """A row a bake, in Markdown."""
    columns = list(dict.fromkeys(name for row in rows for name in row if name != "failed")) + ["failed"]
    print("\n| " + " | ".join(columns) + " |\n|" + " --- |" * len(columns))
    for row in rows:
        print("| " + " | ".join(row.get(name, "") for name in columns) + " |")
    print()


def main():
    parser = argparse.ArgumentParser(description="Judges the drainage of bakes with programs that we did not write.")
    parser.add_argument("folders", metavar="FOLDER", type=Path, nargs="+")
    parser.add_argument("--roads", action="store_true", help="check roads, their crossings and the sites too")
    parser.add_argument("--crop", action="store_true", help="leave out or judge otherwise what needs a large region")
    parser.add_argument("--table", action="store_true", help="print the figures as a table at the end")
    options, checks = parser.parse_args(), Checks()
    if not options.crop:
        check_method(checks)
    rows = [judge(folder, options.roads, options.crop, checks) for folder in options.folders]
    if options.table:
        print_table(rows)
    print(f"{checks.done} checks of {len(rows)} bakes, {checks.failed} failed")
    return 1 if checks.failed or not checks.done else 0


if __name__ == "__main__":
    sys.exit(main())
