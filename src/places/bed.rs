//! The beds of roads in the land: what cutting and filling does to the heights of an area.
//!
//! Each piece of a road bounds the heights around it: at a distance d beyond the road's edge they lie at most d/2 under
//! it, which is the batter of a fill, and at most d/1.5 above it, that of a cut. Bounds are combined by maximum and
//! minimum, and where they contradict each other, as between two roads, their mean holds: so the order of roads and of
//! pieces does not matter. Between two points of a bridge, or of a tunnel, the land stays as it is.

use crate::area::Area;
use crate::grid::Grid;
use crate::places::land::FIXED;
use crate::places::road::{Road, RoadKind};

/// Metres along for a metre of height, of a fill and of a cut.
const FILL: f32 = 2.0;
const CUT: f32 = 1.5;

/// Share of the bank from which on a road's effect fades, to exactly nothing at the bank's end.
const FADE: f32 = 0.6;

/// What all roads together do to the vertices of an area.
#[derive(Debug)]
pub struct Beds {
    bounds: Grid<Bounds>,
    share: Grid<f32>,
    decks: Grid<f32>,
}

/// What roads demand of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    /// The land must not be under this, in metres.
    low_m: f32,
    /// The land must not be above this, in metres.
    high_m: f32,
    /// How much of that is done, 0 to 1.
    weight: f32,
}

/// Nothing is demanded.
const FREE: Bounds = Bounds { low_m: f32::NEG_INFINITY, high_m: f32::INFINITY, weight: 0.0 };

impl Bounds {
    fn and(self, other: Bounds) -> Bounds {
        Bounds {
            low_m: self.low_m.max(other.low_m),
            high_m: self.high_m.min(other.high_m),
            weight: self.weight.max(other.weight),
        }
    }

    fn applied(self, height_m: f32) -> f32 {
        if self.weight <= 0.0 {
            return height_m;
        }
        let bound_m = match self.low_m > self.high_m {
            true => f32::midpoint(self.low_m, self.high_m),
            false => height_m.max(self.low_m).min(self.high_m),
        };
        height_m + (bound_m - height_m) * self.weight
    }
}

/// What one road does to a vertex, as far as it has been seen.
#[derive(Clone, Copy)]
struct Here {
    bounds: Bounds,
    /// Metres to the middle of the nearest piece on the ground, of the nearest on a bridge and of that in a tunnel.
    ground_m: f32,
    bridge_m: f32,
    tunnel_m: f32,
}

impl Beds {
    /// What `roads` do to `area`, in any order; `None` where they do nothing.
    pub fn new<'a>(area: Area, roads: impl IntoIterator<Item = &'a Road>, spacing_m: f64) -> Option<Beds> {
        let mut beds: Option<Beds> = None;
        for road in roads {
            if let Some(part) = area.common(&road.bounds) {
                let beds = beds.get_or_insert_with(|| Beds {
                    bounds: Grid::filled(area, FREE),
                    share: Grid::filled(area, 0.0),
                    decks: Grid::filled(area, 0.0),
                });
                beds.add(road, part, spacing_m as f32);
            }
        }
        beds
    }

    /// Cuts and fills heights in metres of the bare land.
    ///
    /// # Panics
    /// When the heights are those of another area.
    pub fn shape(&self, heights: &mut Grid<f32>) {
        assert_eq!(heights.area(), self.bounds.area(), "heights are shaped where the beds were made");
        for (height_m, bounds) in heights.values_mut().iter_mut().zip(self.bounds.values()) {
            *height_m = bounds.applied(*height_m);
        }
    }

    /// Leaves alone all vertices that are wet, or in the bed of a channel (two truths a vertex, row by row): what would
    /// fill a bed would dam it, and what would cut a river's bank would let it out. A dry bed still shows the road.
    ///
    /// # Panics
    /// When there are more or fewer vertices.
    pub fn spare(&mut self, wet: impl ExactSizeIterator<Item = (bool, bool)>) {
        assert_eq!(wet.len(), self.bounds.values().len(), "every vertex is wet or not");
        let vertices = self.bounds.values_mut().iter_mut().zip(self.share.values_mut());
        for ((bounds, share), (wet, bed)) in vertices.zip(wet) {
            if wet || bed {
                *bounds = FREE;
            }
            if wet {
                *share = 0.0;
            }
        }
    }

    /// The beds in a part of the area, which must be within it.
    #[must_use]
    pub fn part(&self, area: Area) -> Beds {
        Beds { bounds: self.bounds.part(area), share: self.share.part(area), decks: self.decks.part(area) }
    }

    /// Share of road at each vertex, 0 to 1. Bridges and tunnels have none: what lies under or over them is the land.
    pub fn share(&self) -> &Grid<f32> {
        &self.share
    }

    /// Share of road at each vertex as it is seen from above, 0 to 1, with bridges and fords, and at least a vertex wide.
    pub fn decks(&self) -> &Grid<f32> {
        &self.decks
    }

    fn add(&mut self, road: &Road, part: Area, spacing_m: f32) {
        let unseen = Here { bounds: FREE, ground_m: f32::INFINITY, bridge_m: f32::INFINITY, tunnel_m: f32::INFINITY };
        let mut seen = Grid::filled(part, unseen);
        let half_m = (road.width_m / 2.0) as f32;
        let bank_m = road.bank_m as f32;
        let reach = (road.reach_m() / spacing_m as f64) as i64 + 1;
        for pair in road.points.windows(2) {
            let carrier = if pair[0].kind == pair[1].kind { pair[0].kind } else { RoadKind::Ground };
            let low = |axis: usize| pair[0].at[axis].min(pair[1].at[axis]).div_euclid(FIXED) - reach;
            let high = |axis: usize| pair[0].at[axis].max(pair[1].at[axis]).div_euclid(FIXED) + reach + 2;
            let around = Area { x0: low(0), y0: low(1), x1: high(0), y1: high(1) };
            let Some(around) = around.common(&part) else { continue };
            let piece = Piece::new(pair[0].at, pair[1].at, spacing_m);
            let rise_m = pair[1].level_m - pair[0].level_m;
            for y in around.y0..around.y1 {
                let row = seen.row_mut(y, around.x0, around.x1);
                for (x, here) in (around.x0..around.x1).zip(row) {
                    let (along, distance_m) = piece.nearest(x, y);
                    let beyond_m = (distance_m - half_m).max(0.0);
                    if beyond_m >= bank_m {
                        continue;
                    }
                    let nearest_m = match carrier {
                        RoadKind::Bridge => &mut here.bridge_m,
                        RoadKind::Tunnel => &mut here.tunnel_m,
                        RoadKind::Ground | RoadKind::Ford => &mut here.ground_m,
                    };
                    *nearest_m = nearest_m.min(distance_m);
                    if matches!(carrier, RoadKind::Bridge | RoadKind::Tunnel) {
                        continue;
                    }
                    let level_m = pair[0].level_m + rise_m * along;
                    let weight = ((1.0 - beyond_m / bank_m) / (1.0 - FADE)).min(1.0);
                    let bounds = Bounds { low_m: level_m - beyond_m / FILL, high_m: level_m + beyond_m / CUT, weight };
                    here.bounds = here.bounds.and(bounds);
                }
            }
        }
        for y in part.y0..part.y1 {
            let rows = self.bounds.row_mut(y, part.x0, part.x1).iter_mut();
            let shares = self.share.row_mut(y, part.x0, part.x1).iter_mut();
            let decks = self.decks.row_mut(y, part.x0, part.x1).iter_mut();
            for ((here, deck), (bounds, share)) in seen.row(y, part.x0, part.x1).iter().zip(decks).zip(rows.zip(shares))
            {
                let covered = |half_m: f32, distance_m: f32| ((half_m - distance_m) / spacing_m + 0.5).clamp(0.0, 1.0);
                *deck = deck.max(covered(half_m.max(spacing_m / 2.0), here.ground_m.min(here.bridge_m)));
                // What is nearest to a bridge or a tunnel belongs to it; at its ends the ground has the last word.
                if here.bridge_m.min(here.tunnel_m) < here.ground_m || here.ground_m == f32::INFINITY {
                    continue;
                }
                *bounds = bounds.and(here.bounds);
                *share = share.max(covered(half_m, here.ground_m));
            }
        }
    }
}

/// A straight piece of a road: vertices are taken relative to its ends, in whole parts, so that nothing depends on the
/// area that is asked for.
struct Piece {
    from: [i64; 2],
    to: [i64; 2],
    /// The way from its start to its end, over the square of its length.
    per_part: [f32; 2],
    parts: [f32; 2],
    part_m: f32,
}

impl Piece {
    fn new(from: [i64; 2], to: [i64; 2], spacing_m: f32) -> Piece {
        let parts = [(to[0] - from[0]) as f32, (to[1] - from[1]) as f32];
        let length2 = parts[0] * parts[0] + parts[1] * parts[1];
        let per_part = parts.map(|part| if length2 > 0.0 { part / length2 } else { 0.0 });
        Piece { from, to, per_part, parts, part_m: spacing_m / FIXED as f32 }
    }

    /// How far along the piece its point nearest to a vertex lies, 0 to 1, and the metres to there.
    fn nearest(&self, x: i64, y: i64) -> (f32, f32) {
        let from = |at: [i64; 2]| [(x * FIXED - at[0]) as f32, (y * FIXED - at[1]) as f32];
        let start = from(self.from);
        let along = start[0] * self.per_part[0] + start[1] * self.per_part[1];
        // At an end the distance is to the end itself, in whole parts: two pieces that meet there agree to the bit.
        let (along, [dx, dy]) = match along {
            ..=0.0 => (0.0, start),
            1.0.. => (1.0, from(self.to)),
            _ => (along, [start[0] - along * self.parts[0], start[1] - along * self.parts[1]]),
        };
        (along, (dx * dx + dy * dy).sqrt() * self.part_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::places::road::{RoadClass, RoadPoint, bounds};
    use crate::places::site::SiteId;

    #[test]
    fn under_viaducts_and_over_tunnels_the_land_stays_as_it_is() {
        // 8 m between vertices and from point to point, level at 50 m in land that is level at 30 m or 80 m.
        for (kind, land_m) in [(RoadKind::Bridge, 30.0), (RoadKind::Tunnel, 80.0)] {
            let carrier = |x: i64| if (10..=20).contains(&x) { kind } else { RoadKind::Ground };
            let point = |x: i64| RoadPoint { at: [x * FIXED, 10 * FIXED], level_m: 50.0, kind: carrier(x) };
            let points: Vec<RoadPoint> = (0..=30).map(point).collect();
            let places: Vec<[i64; 2]> = points.iter().map(|point| point.at).collect();
            let road = Road {
                id: (SiteId { i: 0, j: 0 }, SiteId { i: 1, j: 0 }),
                class: RoadClass::Highway,
                points,
                width_m: 9.0,
                length_m: 240.0,
                max_grade: 0.0,
                bank_m: 32.0,
                bounds: bounds(&places, 36.5, 8.0),
            };
            let area = Area::new(0, 0, 31, 21);
            let beds = Beds::new(area, [&road], 8.0).expect("the road is here");
            let mut heights = Grid::filled(area, land_m);
            beds.shape(&mut heights);
            for x in 0..31 {
                let is_carried = (11..20).contains(&x);
                assert_eq!(heights.at(x, 10), if is_carried { land_m } else { 50.0 }, "{kind:?} {x}");
                assert_eq!(beds.share().at(x, 10) > 0.5, !is_carried, "{kind:?} {x}");
                assert_eq!(beds.decks().at(x, 10) > 0.5, !is_carried || kind == RoadKind::Bridge, "{kind:?} {x}");
            }
        }
    }
}
