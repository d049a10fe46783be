//! Houses beside the roads of settlements, on maps large enough to show them.
//!
//! Each road has a place for a house on either side every few metres. Whether a house stands there depends on the
//! place, the nearest settlement, and the roads and places around it. Every map that shows the place knows all of
//! these.

use std::collections::HashMap;

use crate::geometry::{LineSegment, length};
use crate::hash;
use crate::map::plotter::{Shape, bounds};
use crate::map::text::{MeasuredLine, Quad};

/// Distance in metres between two places for houses along a road.
const APART_M: f64 = 18.0;

/// Range of a house's length along its road and of its depth away from the road, in metres.
const LONG_M: [f64; 2] = [9.0, 15.0];
const DEEP_M: [f64; 2] = [7.0, 11.0];

/// Distance in metres from a road's centre line to its houses.
const SETBACK_M: f64 = 11.0;

/// Houses fill a circle around a settlement: its radius in metres per square root of the population, its largest
/// radius, and the share of places that have houses in its middle.
const RADIUS_M: f64 = 9.0;
pub(super) const MOST_M: f64 = 900.0;
const FULL: f64 = 0.95;

/// Distance in metres within which roads decide whether a house stands.
pub(super) const REACH_M: f64 = 70.0;

/// A settlement, with what its houses depend on.
pub(super) struct Town {
    /// Position in pixels.
    pub at: [f64; 2],
    pub population: u32,
}

/// A place for a house. Its order is the number of its road and its own number along that road.
struct HousePlot {
    order: (u64, i64),
    quad: Quad,
}

/// Returns the houses along roads, each road given by its number and its whole line in pixels.
pub(super) fn houses(roads: &[(u64, Vec<[f64; 2]>)], towns: &[Town], metres_per_pixel: f64) -> Vec<Shape> {
    let px = |metres: f64| metres / metres_per_pixel;
    let radius = |town: &Town| px((RADIUS_M * f64::from(town.population).sqrt()).min(MOST_M));
    let mut places = Vec::new();
    for (number, road) in roads {
        let [west, north, east, south] = bounds(road.iter());
        let is_near = |town: &&Town| {
            let [x, y] = town.at;
            let reach = radius(town);
            x + reach >= west && x - reach <= east && y + reach >= north && y - reach <= south
        };
        let near: Vec<&Town> = towns.iter().filter(is_near).collect();
        let Some(measured) = MeasuredLine::new(road).filter(|_| !near.is_empty()) else { continue };
        let count = (measured.length() / px(APART_M)) as i64;
        for step in 1..count {
            let middle = measured.place(step as f64 * px(APART_M));
            let off = |town: &&Town| length([town.at[0] - middle[0], town.at[1] - middle[1]]) / radius(town);
            let share = near.iter().map(|town| 1.0 - off(town)).fold(f64::NEG_INFINITY, f64::max);
            if share <= 0.0 {
                continue;
            }
            let before = measured.place((step as f64 - 0.5) * px(APART_M));
            let after = measured.place((step as f64 + 0.5) * px(APART_M));
            let way = [after[0] - before[0], after[1] - before[1]];
            let long = length(way);
            if long < 0.5 * px(APART_M) {
                continue;
            }
            let along = way.map(|axis| axis / long);
            for side in [-1, 1] {
                let chance = hash::mix(hash::mix(*number) ^ (2 * step + i64::from(side > 0)) as u64);
                let part = |by: u32| ((chance >> by) & 0xFFF) as f64 / 4096.0;
                if part(0) > FULL * share.min(0.6) / 0.6 {
                    continue;
                }
                let between = |[from, to]: [f64; 2], share: f64| px(from + (to - from) * share);
                let (wide, deep) = (between(LONG_M, part(12)), between(DEEP_M, part(24)));
                let away = f64::from(side) * (px(SETBACK_M) + 0.5 * deep + px(4.0) * part(36));
                let corner = |u: f64, v: f64| {
                    let (u, v) = (u * 0.5 * wide, away + v * 0.5 * deep);
                    [middle[0] + along[0] * u - along[1] * v, middle[1] + along[1] * u + along[0] * v]
                };
                let quad = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                places.push(HousePlot { order: (*number, 2 * step + i64::from(side > 0)), quad });
            }
        }
    }
    let clear = px(SETBACK_M - 3.0);
    let apart = px(LONG_M[1] + 1.0);
    let middle = |quad: &Quad| [0, 1].map(|axis| quad.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0);
    let square = |[x, y]: [f64; 2], half: f64| [x - half, y - half, x + half, y + half];
    let near_places =
        SpatialHash::new(places.iter().map(|place| (square(middle(&place.quad), apart), place)), px(60.0));
    let segments = roads.iter().flat_map(|(_, road)| road.windows(2)).map(|pair| {
        let [west, north, east, south] = bounds(pair.iter());
        ([west - clear, north - clear, east + clear, south + clear], LineSegment::between(pair[0], pair[1]))
    });
    let near_roads = SpatialHash::new(segments, px(60.0));
    // Of places that touch, only the first may have a house, even if it then has none: so a house depends on near
    // places alone.
    let is_first = |place: &&HousePlot| {
        let at = middle(&place.quad);
        near_places.at(at).iter().all(|other| {
            let [x, y] = middle(&other.quad);
            other.order >= place.order || length([x - at[0], y - at[1]]) > apart
        })
    };
    let is_clear = |place: &&HousePlot| {
        let at = middle(&place.quad);
        near_roads.at(at).iter().all(|segment| segment.distance(at) > clear)
    };
    let standing = places.iter().filter(is_first).filter(is_clear);
    standing
        .map(|place| {
            let [a, b, c, d] = place.quad;
            Shape::new(vec![vec![a, b, c, d, a]])
        })
        .collect()
}

/// Items by the squares of a lattice that their bounding boxes meet.
struct SpatialHash<T> {
    side: f64,
    squares: HashMap<[i64; 2], Vec<T>>,
}

impl<T: Copy> SpatialHash<T> {
    /// Sorts items into squares of the given side, by their bounding boxes: west, north, east and south.
    fn new(things: impl Iterator<Item = ([f64; 4], T)>, side: f64) -> SpatialHash<T> {
        let mut squares: HashMap<[i64; 2], Vec<T>> = HashMap::new();
        for ([west, north, east, south], thing) in things {
            let [x0, y0, x1, y1] = [west, north, east, south].map(|at| (at / side).floor() as i64);
            for square in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| [x, y])) {
                squares.entry(square).or_default().push(thing);
            }
        }
        SpatialHash { side, squares }
    }

    /// Returns all items that reach into the square of a place.
    fn at(&self, place: [f64; 2]) -> &[T] {
        self.squares.get(&place.map(|at| (at / self.side).floor() as i64)).map_or(&[], Vec::as_slice)
    }
}
