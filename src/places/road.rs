//! Roads, whole: what a tile, a map and a file of vectors need of them.

use serde::Serialize;

use crate::area::Area;
use crate::fluvial::rivers::crosses;
use crate::memory::heap_bytes;
use crate::places::land::FIXED;
use crate::places::site::{Site, SiteClass, SiteId};

/// How well a road is built. The numbers index the lists of [`PlacesSettings`](super::PlacesSettings).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RoadClass {
    /// Steep and narrow, through fords.
    Track = 0,
    /// What joins villages.
    Road = 1,
    /// What leads to towns: wide, even, on bridges.
    Highway = 2,
}

impl RoadClass {
    /// The class of the road between two sites.
    pub(super) fn between(a: &Site, b: &Site) -> RoadClass {
        match (a.class.min(b.class), a.class.max(b.class)) {
            (SiteClass::Village | SiteClass::Town, SiteClass::Town) => RoadClass::Highway,
            (SiteClass::Village, SiteClass::Village) | (SiteClass::Hamlet, SiteClass::Town) => RoadClass::Road,
            _ => RoadClass::Track,
        }
    }
}

/// What carries a road.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RoadKind {
    /// The land, cut or filled.
    Ground,
    /// A bridge, over water or over a dip; between two neighbouring points of this kind the land stays as it is.
    Bridge,
    /// A tunnel, likewise.
    Tunnel,
    /// A river's bed, which wheels and hooves go through.
    Ford,
}

/// A point of a road's middle line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoadPoint {
    /// Where, in 1/256 vertex.
    pub at: [i64; 2],
    /// Height of the road's surface in metres.
    pub level_m: f32,
    /// What carries it.
    pub kind: RoadKind,
}

heap_bytes!(RoadPoint);

/// A road from one site to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Road {
    /// The sites that it joins, the smaller first.
    pub id: (SiteId, SiteId),
    /// How well it is built.
    pub class: RoadClass,
    /// Its middle line from the first site to the second, at least two points.
    pub points: Vec<RoadPoint>,
    /// Metres from edge to edge.
    pub width_m: f64,
    /// Metres from end to end along the middle line, seen from above.
    pub length_m: f64,
    /// The steepest grade anywhere on it, metres up a metre ahead; at most what the settings allow its class.
    pub max_grade: f64,
    /// Metres from its edge to where nothing of its cuts and fills is left.
    pub bank_m: f64,
    /// All vertices that it can have an effect on, and then some.
    pub bounds: Area,
}

heap_bytes!(Road: points);

/// A place where a road crosses water, or leaves the land.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// A ford, a bridge or a tunnel.
    pub kind: RoadKind,
    /// Its first and last point in [`Road::points`].
    pub points: (usize, usize),
    /// The point of the road half of the crossing's length from its first, in 1/256 vertex.
    pub at: [i64; 2],
}

impl Road {
    /// Metres from the middle line to the end of the road's effect on the land.
    pub fn reach_m(&self) -> f64 {
        self.width_m / 2.0 + self.bank_m
    }

    /// Whether the road can have an effect on a vertex of `area`.
    pub fn overlaps(&self, area: &Area) -> bool {
        self.bounds.common(area).is_some()
    }

    /// Whether a part of its middle line lies in the rectangle that the outer vertices of an area span.
    pub fn touches(&self, area: &Area) -> bool {
        let from = |at: [i64; 2]| [(at[0] - area.x0 * FIXED) as f64, (at[1] - area.y0 * FIXED) as f64];
        let corner = from([area.x1 - 1, area.y1 - 1].map(|side| side * FIXED));
        self.points.windows(2).any(|pair| crosses(from(pair[0].at), from(pair[1].at), corner))
    }

    /// Its fords, bridges and tunnels, from its start on.
    pub fn crossings(&self) -> Vec<Crossing> {
        let mut crossings = Vec::new();
        let mut first = 0;
        for run in self.points.chunk_by(|a, b| a.kind == b.kind) {
            let last = first + run.len() - 1;
            if run[0].kind != RoadKind::Ground {
                crossings.push(Crossing { kind: run[0].kind, points: (first, last), at: halfway(run) });
            }
            first = last + 1;
        }
        crossings
    }
}

/// The place half of the length along some points.
fn halfway(points: &[RoadPoint]) -> [i64; 2] {
    let way = |pair: &[RoadPoint]| [0, 1].map(|axis| (pair[1].at[axis] - pair[0].at[axis]) as f64);
    let length = |pair: &[RoadPoint]| {
        let [x, y] = way(pair);
        (x * x + y * y).sqrt()
    };
    let mut left = points.windows(2).map(length).sum::<f64>() / 2.0;
    for pair in points.windows(2) {
        let own = length(pair);
        if left <= own {
            let share = if own > 0.0 { left / own } else { 0.0 };
            let [x, y] = way(pair).map(|part| (part * share).round() as i64);
            return [pair[0].at[0] + x, pair[0].at[1] + y];
        }
        left -= own;
    }
    points[points.len() - 1].at
}

/// The vertices within `reach_m` of any of the points.
pub(super) fn bounds(points: &[[i64; 2]], reach_m: f64, spacing_m: f64) -> Area {
    let reach = (reach_m / spacing_m) as i64 + 2;
    let least = |axis: usize| points.iter().map(|at| at[axis]).min().expect("a road has points").div_euclid(FIXED);
    let most = |axis: usize| points.iter().map(|at| at[axis]).max().expect("a road has points").div_euclid(FIXED);
    Area { x0: least(0) - reach, y0: least(1) - reach, x1: most(0) + reach + 2, y1: most(1) + reach + 2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_crossing_lies_on_the_road_also_where_it_bends() {
        let point = |x: i64, y: i64| RoadPoint { at: [x, y], level_m: 0.0, kind: RoadKind::Tunnel };
        assert_eq!(halfway(&[point(0, 0), point(100, 0), point(100, 300)]), [100, 100]);
        assert_eq!(halfway(&[point(7, -9)]), [7, -9]);
        assert_eq!(halfway(&[point(7, -9), point(7, -9)]), [7, -9]);
    }
}
