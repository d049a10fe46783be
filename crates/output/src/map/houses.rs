//! Houses beside the roads of settlements, on maps large enough to show them.
//!
//! Each road has a place for a house on either side every few metres. Whether a house stands there depends on the
//! place, the nearest settlement, and the roads and places around it. Every map that shows the place knows all of
//! these.

use std::collections::HashMap;

use glam::DVec2;

use crate::geometry::LineSegment;
use crate::hash;
use crate::map::plotter::{Shape, bounds, widened};
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
    pub at: DVec2,
    pub population: u32,
}

/// A place for a house. Its order is the number of its road and its own number along that road.
struct HousePlot {
    order: (u64, i64),
    quad: Quad,
}

/// Returns the houses along roads, each road given by its number and its whole line in pixels.
pub(super) fn houses(roads: &[(u64, Vec<DVec2>)], towns: &[Town], metres_per_pixel: f64) -> Vec<Shape> {
    let px = |metres: f64| metres / metres_per_pixel;
    let radius = |town: &Town| px((RADIUS_M * f64::from(town.population).sqrt()).min(MOST_M));
    let mut places = Vec::new();
    for (number, road) in roads {
        let [west, north, east, south] = bounds(road.iter());
        let is_near = |town: &&Town| {
            let (DVec2 { x, y }, reach) = (town.at, radius(town));
            x + reach >= west && x - reach <= east && y + reach >= north && y - reach <= south
        };
        let near: Vec<&Town> = towns.iter().filter(is_near).collect();
        let Some(measured) = MeasuredLine::new(road).filter(|_| !near.is_empty()) else { continue };
        let count = (measured.length() / px(APART_M)) as i64;
        for step in 1..count {
            let middle = measured.place(step as f64 * px(APART_M));
            let off = |town: &&Town| town.at.distance(middle) / radius(town);
            let share = near.iter().map(|town| 1.0 - off(town)).fold(f64::NEG_INFINITY, f64::max);
            if share <= 0.0 {
                continue;
            }
            let before = measured.place((step as f64 - 0.5) * px(APART_M));
            let after = measured.place((step as f64 + 0.5) * px(APART_M));
            let way: DVec2 = after - before;
            let long = way.length();
            if long < 0.5 * px(APART_M) {
                continue;
            }
            let along = way / long;
            for side in [-1, 1] {
                let chance = hash::of([*number, (2 * step + i64::from(side > 0)) as u64]);
                let part = |by: u32| ((chance >> by) & 0xFFF) as f64 / 4096.0;
                if part(0) > FULL * share.min(0.6) / 0.6 {
                    continue;
                }
                let between = |[from, to]: [f64; 2], share: f64| px(from + (to - from) * share);
                let (wide, deep) = (between(LONG_M, part(12)), between(DEEP_M, part(24)));
                let away = f64::from(side) * (px(SETBACK_M) + 0.5 * deep + px(4.0) * part(36));
                let corner =
                    |u: f64, v: f64| middle + along * (u * 0.5 * wide) + along.perp() * (away + v * 0.5 * deep);
                let quad = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                places.push(HousePlot { order: (*number, 2 * step + i64::from(side > 0)), quad });
            }
        }
    }
    let clear = px(SETBACK_M - 3.0);
    let apart = px(LONG_M[1] + 1.0);
    let middle = |quad: &Quad| quad.iter().sum::<DVec2>() / 4.0;
    let around = |place: &HousePlot| widened(bounds([middle(&place.quad)].iter()), apart);
    let near_places = SpatialHash::new(places.iter().map(|place| (around(place), place)), px(60.0));
    let segments = roads
        .iter()
        .flat_map(|(_, road)| road.windows(2))
        .map(|pair| (widened(bounds(pair.iter()), clear), LineSegment::between(pair[0].into(), pair[1].into())));
    let near_roads = SpatialHash::new(segments, px(60.0));
    // Of places that touch, only the first may have a house, even if it then has none: so a house depends on near
    // places alone.
    let is_first = |place: &&HousePlot| {
        let at = middle(&place.quad);
        let is_apart = |other: &&HousePlot| other.order >= place.order || middle(&other.quad).distance(at) > apart;
        near_places.at(at).iter().all(is_apart)
    };
    let is_clear = |place: &&HousePlot| {
        let at = middle(&place.quad);
        near_roads.at(at).iter().all(|segment| segment.distance(at.into()) > clear)
    };
    let shape = |HousePlot { quad: [a, b, c, d], .. }: &HousePlot| Shape::new(vec![vec![*a, *b, *c, *d, *a]]);
    places.iter().filter(is_first).filter(is_clear).map(shape).collect()
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
    fn at(&self, place: DVec2) -> &[T] {
        self.squares.get(&(place / self.side).floor().to_array().map(|at| at as i64)).map_or(&[], Vec::as_slice)
    }
}
