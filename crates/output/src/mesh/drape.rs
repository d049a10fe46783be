//! Roads on the ground: each piece is cut along the triangles of the ground, so that its parts lie on them.

use std::collections::HashMap;

use super::footprint::{RoadPolygon, Squares};
use super::polygon::{TilePoint, UNITS, bounds, common, doubled_area, overlap};
use super::ribbon::{Ribbon, RibbonKind, RibbonVertex};
use super::{Ground, PARTS};

/// A triangle of the ground.
struct Slope {
    corners: [TilePoint; 3],
    heights_m: [f64; 3],
}

impl Slope {
    /// Returns the height in metres at a place.
    fn height_m(&self, place: TilePoint) -> f64 {
        let [a, b, c] = self.corners;
        let shares = [[place, b, c], [a, place, c], [a, b, place]].map(doubled_area);
        // On an edge use its two corners alone, in a fixed order: so both triangles agree, even if they are in two
        // tiles.
        if let Some(across) = shares.iter().position(|share| *share == 0) {
            let [mut from, mut to] = [(across + 1) % 3, (across + 2) % 3];
            if self.corners[from] > self.corners[to] {
                (from, to) = (to, from);
            }
            let way = |axis: usize| self.corners[to][axis] - self.corners[from][axis];
            let axis = usize::from(way(1).abs() > way(0).abs());
            let share = (place[axis] - self.corners[from][axis]) as f64 / way(axis) as f64;
            return self.heights_m[from] * (1.0 - share) + self.heights_m[to] * share;
        }
        let sum: f64 = shares.iter().zip(self.heights_m).map(|(share, height_m)| *share as f64 * height_m).sum();
        sum / doubled_area(self.corners) as f64
    }
}

/// Drapes pieces of roads over the ground: one ribbon, `lift_m` metres above it.
pub(super) fn draped(pieces: &[RoadPolygon<'_>], ground: &Ground, lift_m: f64) -> Ribbon {
    let mut ribbon = Ribbon { kind: RibbonKind::Road, vertices: Vec::new(), triangles: Vec::new() };
    let mut given: HashMap<(usize, TilePoint), u32> = HashMap::new();
    for (piece, slope) in touching(pieces, ground) {
        let outline = common(&piece.outline, &slope.corners);
        let corners: Vec<u32> = outline
            .into_iter()
            .map(|place| {
                *given.entry((piece.patch.road, place)).or_insert_with(|| {
                    let corner = piece.patch.at(place);
                    ribbon.vertices.push(RibbonVertex {
                        place: place.map(|at| at as f64 / UNITS as f64),
                        height_m: slope.height_m(place) + lift_m,
                        normal: corner.normal,
                        texture: corner.texture,
                    });
                    ribbon.vertices.len() as u32 - 1
                })
            })
            .collect();
        ribbon.triangles.extend((2..corners.len()).map(|at| [corners[0], corners[at - 1], corners[at]]));
    }
    ribbon
}

/// Pairs each piece with each triangle of the ground below it, in the order of the pieces.
fn touching<'a>(pieces: &'a [RoadPolygon<'a>], ground: &Ground) -> Vec<(&'a RoadPolygon<'a>, Slope)> {
    let mut squares = Squares::new(ground.cells);
    for (number, piece) in pieces.iter().enumerate() {
        squares.put(number, bounds(&piece.outline));
    }
    let corners_of = |triangle: &[u32; 3]| {
        triangle
            .map(|corner| ground.vertices[corner as usize].place.map(|at| i64::from(at) * (UNITS / i64::from(PARTS))))
    };
    let mut pairs = Vec::new();
    for (number, triangle) in ground.triangles.iter().enumerate() {
        let corners = corners_of(triangle);
        squares.for_each_near(bounds(&corners), |piece| {
            if overlap(&pieces[piece].outline, &corners) {
                pairs.push((piece, number));
            }
        });
    }
    // A piece and a triangle may share several squares.
    pairs.sort_unstable();
    pairs.dedup();
    let slope = |triangle: &[u32; 3]| Slope {
        corners: corners_of(triangle),
        heights_m: triangle.map(|corner| f64::from(ground.vertices[corner as usize].height_m)),
    };
    pairs.into_iter().map(|(piece, number)| (&pieces[piece], slope(&ground.triangles[number]))).collect()
}
