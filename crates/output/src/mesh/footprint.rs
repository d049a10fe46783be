//! Roads on the ground in plan: strips, and round joins where several roads end, without any overlap.

use super::polygon::{TilePoint, UNITS, bounds, doubled_area, overlap, without};

/// A vertex of a road's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoadCorner {
    pub place: TilePoint,
    /// Unit normal: east, up, south.
    pub normal: [f32; 3],
    /// Texture coordinates: across the road from 0 at the left to 1 at the right, and along it, growing by 1 per road
    /// width.
    pub texture: [f32; 2],
}

/// A convex part of a road before overlaps with other roads are cut off.
#[derive(Clone, Debug)]
pub(super) struct RoadPatch {
    /// Number of the road or of the join that the patch belongs to.
    pub road: usize,
    pub outline: Vec<TilePoint>,
    /// Three corners from which normals and texture coordinates anywhere on the patch are interpolated.
    pub corners: [RoadCorner; 3],
}

/// A part of a patch that no road before it overlaps: a convex polygon.
#[derive(Clone, Debug)]
pub(super) struct RoadPolygon<'a> {
    pub patch: &'a RoadPatch,
    pub outline: Vec<TilePoint>,
}

impl RoadPatch {
    /// Creates a triangular patch from three corners.
    pub fn triangle(road: usize, corners: [RoadCorner; 3]) -> RoadPatch {
        RoadPatch { road, outline: corners.map(|corner| corner.place).to_vec(), corners }
    }

    /// Creates the round join of roads that end at a place, as a road of its own. It is as wide as the widest of the
    /// roads, and fills the gaps between their edges.
    pub fn join(road: usize, middle: TilePoint, radius: f64) -> RoadPatch {
        let corner = |share: [f64; 2]| RoadCorner {
            place: [0, 1].map(|axis| middle[axis] + (share[axis] * radius).round() as i64),
            normal: [0.0, 1.0, 0.0],
            texture: share.map(|axis| (0.5 + 0.5 * axis) as f32),
        };
        let around = |side: usize| {
            let angle = side as f64 / SIDES as f64 * std::f64::consts::TAU;
            corner([libm::cos(angle), -libm::sin(angle)]).place
        };
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, -1.0]].map(corner);
        RoadPatch { road, outline: (0..SIDES).map(around).collect(), corners }
    }

    /// Returns the corner that the patch has at a place, by interpolation.
    pub fn at(&self, place: TilePoint) -> RoadCorner {
        let [a, b, c] = self.corners.map(|corner| corner.place);
        let whole = doubled_area([a, b, c]) as f64;
        let shares = [[place, b, c], [a, place, c], [a, b, place]].map(|part| doubled_area(part) as f64 / whole);
        let mix = |value: &dyn Fn(&RoadCorner) -> f32| -> f64 {
            self.corners.iter().zip(shares).map(|(corner, share)| f64::from(value(corner)) * share).sum()
        };
        let normal = [0, 1, 2].map(|axis| mix(&|corner| corner.normal[axis]));
        let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
        RoadCorner {
            place,
            normal: normal.map(|axis| (axis / length) as f32),
            texture: [0, 1].map(|axis| mix(&|corner| corner.texture[axis]) as f32),
        }
    }
}

/// Number of sides of a round join.
const SIDES: usize = 12;

/// Returns the parts of the patches on a tile of `cells` cells a side. From each patch, the patches before it are cut
/// out.
pub(super) fn footprint(patches: &[RoadPatch], cells: u32) -> Vec<RoadPolygon<'_>> {
    let side = i64::from(cells) * UNITS;
    let tile = [[0, 0], [0, side], [side, side], [side, 0]];
    let mut squares = Squares::new(cells);
    let mut pieces = Vec::new();
    for (number, patch) in patches.iter().enumerate() {
        let extent = bounds(&patch.outline);
        if overlap(&patch.outline, &tile) {
            let mut above = Vec::new();
            squares.for_each_near(extent, |number| above.push(number));
            above.sort_unstable();
            above.dedup();
            let mut outlines = vec![patch.outline.clone()];
            for other in above.into_iter().map(|other| &patches[other].outline) {
                if overlap(&patch.outline, other) {
                    let left = |outline: Vec<TilePoint>| match overlap(&outline, other) {
                        true => without(&outline, other),
                        false => vec![outline],
                    };
                    outlines = outlines.into_iter().flat_map(left).collect();
                }
            }
            pieces.extend(outlines.into_iter().map(|outline| RoadPolygon { patch, outline }));
        }
        squares.put(number, extent);
    }
    pieces
}

/// An index of things on a tile: a lattice of squares of some cells. Things outside of the tile are counted at its
/// edge.
pub(super) struct Squares {
    side: i64,
    /// Numbers of the things that touch each square, row by row.
    numbers: Vec<Vec<usize>>,
}

impl Squares {
    /// Cells per side of a square.
    const CELLS: i64 = 4;

    pub fn new(cells: u32) -> Squares {
        let side = i64::from(cells) / Squares::CELLS + 1;
        Squares { side, numbers: vec![Vec::new(); (side * side) as usize] }
    }

    /// Calls with each square that a rectangle touches.
    fn for_each_touched(&self, [low, high]: [TilePoint; 2], mut call: impl FnMut(usize)) {
        let square = |at: i64| at.div_euclid(Squares::CELLS * UNITS).clamp(0, self.side - 1);
        for row in square(low[1])..=square(high[1]) {
            for column in square(low[0])..=square(high[0]) {
                call((row * self.side + column) as usize);
            }
        }
    }

    pub fn put(&mut self, number: usize, bounds: [TilePoint; 2]) {
        let mut touched = Vec::new();
        self.for_each_touched(bounds, |square| touched.push(square));
        for square in touched {
            self.numbers[square].push(number);
        }
    }

    /// Calls with the numbers of all things that may overlap a rectangle, with some of them more than once.
    pub fn for_each_near(&self, bounds: [TilePoint; 2], mut call: impl FnMut(usize)) {
        self.for_each_touched(bounds, |square| self.numbers[square].iter().for_each(|number| call(*number)));
    }
}
