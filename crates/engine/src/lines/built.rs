//! What built roads do to an area: cutting and filling.
//!
//! Each piece of a road limits the heights around it: at a distance d beyond the road's edge they lie at most d/2 under
//! it, which is the batter of a fill, and at most d/1.5 above it, that of a cut. What a fill would bury too deeply, as a gorge
//! beside the road, it leaves as it is: it ends at a wall. Limits are combined by maximum and
//! minimum, and where they contradict each other, as between two roads, their mean holds: so the order of roads and of
//! pieces does not matter. Between two points of a bridge, or of a tunnel, the land stays as it is.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::lines::{Bed, Line, StructureKind};

/// Metres along for a metre of height of a fill: loose earth stands at 27 degrees. Chosen by eye, as that of cuts, among the
/// 1:1.5 to 1:2 that are usual.
const FILL: f32 = 2.0;
/// Metres along for a metre of height of a cut: firm ground stands at 34 degrees.
const CUT: f32 = 1.5;

/// Metres that a fill is high at most beside the road: on a higher one no road is built, but on a viaduct.
const WALL_M: f32 = 12.0;

/// Share of the bank from which on a road's effect fades, to exactly nothing at the bank's end; chosen by eye.
const FADE: f32 = 0.6;

/// What all built roads together do to the vertices of an area.
#[derive(Clone, Debug)]
pub struct Built {
    limits: Grid<HeightLimits>,
    /// Share of road, 0 to 1. Bridges and tunnels have none: what lies under or over them is the land.
    pub share: Grid<f32>,
    /// Share of road as it is seen from above, 0 to 1, with bridges and fords, and at least a vertex wide.
    pub decks: Grid<f32>,
}

/// What roads demand of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeightLimits {
    /// The land must not be under this, in metres.
    low_m: f32,
    /// The land must not be above this, in metres.
    high_m: f32,
    /// How much of that is done, 0 to 1.
    weight: f32,
    /// Metres that the land is filled at most: what lies deeper stays as it is.
    most_fill_m: f32,
}

/// Nothing is demanded.
const FREE: HeightLimits =
    HeightLimits { low_m: f32::NEG_INFINITY, high_m: f32::INFINITY, weight: 0.0, most_fill_m: 0.0 };

impl HeightLimits {
    /// Both at once: what either demands.
    fn and(self, other: HeightLimits) -> HeightLimits {
        HeightLimits {
            low_m: self.low_m.max(other.low_m),
            high_m: self.high_m.min(other.high_m),
            weight: self.weight.max(other.weight),
            most_fill_m: self.most_fill_m.max(other.most_fill_m),
        }
    }

    /// A height in metres as it is demanded.
    fn applied(self, height_m: f32) -> f32 {
        if self.weight <= 0.0 || self.low_m - height_m > self.most_fill_m {
            return height_m;
        }
        let limit_m = match self.low_m > self.high_m {
            true => f32::midpoint(self.low_m, self.high_m),
            false => height_m.max(self.low_m).min(self.high_m),
        };
        height_m + (limit_m - height_m) * self.weight
    }
}

/// What one road does to a vertex, by the pieces of it that have been looked at.
#[derive(Clone, Copy)]
struct Here {
    limits: HeightLimits,
    /// Metres to the middle of the nearest piece on the ground; infinite where none is in reach.
    ground_m: f32,
    /// Metres to the middle of the nearest piece on a bridge.
    bridge_m: f32,
    /// Metres to the middle of the nearest piece in a tunnel.
    tunnel_m: f32,
}

impl Here {
    /// Nothing is in reach.
    const UNTOUCHED: Here =
        Here { limits: FREE, ground_m: f32::INFINITY, bridge_m: f32::INFINITY, tunnel_m: f32::INFINITY };
}

impl Built {
    /// Nothing done to `area`.
    pub(crate) fn blank(area: Area) -> Built {
        let grid = || Grid::filled(area, 0.0);
        Built { limits: Grid::filled(area, FREE), share: grid(), decks: grid() }
    }

    /// Adds what a line does, if it is built.
    pub(crate) fn add(&mut self, line: &Line) {
        let Bed::Built { bank_m } = line.bed else { return };
        // What does not touch the area costs no grid.
        let Some(part) = self.share.area().common(&line.bounds) else { return };
        // What a vertex is nearest to is known after all pieces only, so they are gathered before anything is changed.
        let gathered = gathered(line, part, bank_m as f32);
        let (half_m, spacing_m) = (half_width_m(line) as f32, line.spacing_m as f32);
        // A ramp one vertex wide, half done at the road's edge: a narrow road does not come and go.
        let covered = |half_m: f32, distance_m: f32| ((half_m - distance_m) / spacing_m + 0.5).clamp(0.0, 1.0);
        for y in part.y0..part.y1 {
            let here = gathered.row(y, part.x0, part.x1).iter();
            let limits = self.limits.row_mut(y, part.x0, part.x1).iter_mut();
            let shares = self.share.row_mut(y, part.x0, part.x1).iter_mut();
            let decks = self.decks.row_mut(y, part.x0, part.x1).iter_mut();
            for ((here, deck), (limits, share)) in here.zip(decks).zip(limits.zip(shares)) {
                *deck = deck.max(covered(half_m.max(spacing_m / 2.0), here.ground_m.min(here.bridge_m)));
                // What is nearest to a bridge or a tunnel belongs to it; at its ends the ground has the last word.
                if here.bridge_m.min(here.tunnel_m) < here.ground_m || here.ground_m == f32::INFINITY {
                    continue;
                }
                *limits = limits.and(here.limits);
                *share = share.max(covered(half_m, here.ground_m));
            }
        }
    }

    /// Leaves alone all vertices that are wet, and fills no bed of a channel: that would dam it, and what would cut a river's
    /// bank would let it out. A dry bed shows the road, and is cut by it: else it would lie across the cut as a dam.
    pub(super) fn spare(&mut self, water: &Water) {
        assert_eq!(water.kind.area(), self.share.area(), "waters are spared where the roads are");
        let vertices = self.limits.values_mut().iter_mut().zip(self.share.values_mut());
        for ((limits, share), (kind, bed)) in vertices.zip(water.kind.values().iter().zip(water.bed.values())) {
            let is_wet = *kind != WaterKind::Dry;
            if is_wet {
                *limits = FREE;
                *share = 0.0;
            } else if *bed {
                limits.low_m = f32::NEG_INFINITY;
            }
        }
    }

    /// Cuts and fills heights in metres of the bare land.
    pub(crate) fn shape(&self, heights: &mut Grid<f32>) {
        assert_eq!(heights.area(), self.limits.area(), "heights are shaped where the roads are");
        for (height_m, limits) in heights.values_mut().iter_mut().zip(self.limits.values()) {
            *height_m = limits.applied(*height_m);
        }
    }

    /// What is done to a part of the area, which must be within it.
    pub(super) fn part(&self, area: Area) -> Built {
        Built { limits: self.limits.part(area), share: self.share.part(area), decks: self.decks.part(area) }
    }
}

/// Metres from the middle of a built road to its edge, which is as far everywhere.
fn half_width_m(line: &Line) -> f64 {
    line.points[0].half_width_m
}

/// What the pieces of a road do to the vertices of an area.
fn gathered(line: &Line, area: Area, bank_m: f32) -> Grid<Here> {
    let mut gathered = Grid::filled(area, Here::UNTOUCHED);
    let half_m = half_width_m(line) as f32;
    // One more for what the whole number leaves off.
    let reach = ((half_width_m(line) + bank_m as f64) / line.spacing_m) as i64 + 1;
    for ([from, to], carrier) in line.pieces().zip(line.carriers()) {
        let piece = RoadPiece::new(line, [from.place, to.place]);
        let Some(around) = piece.around(reach).common(&area) else { continue };
        let (from_m, rise_m) = (from.level_m as f32, to.level_m as f32 - from.level_m as f32);
        for y in around.y0..around.y1 {
            let row = gathered.row_mut(y, around.x0, around.x1);
            for (x, here) in (around.x0..around.x1).zip(row) {
                let (along, distance_m) = piece.nearest(x, y);
                let beyond_m = (distance_m - half_m).max(0.0);
                // A hard end: past it there is exactly nothing, so an area need not know of roads further off.
                if beyond_m >= bank_m {
                    continue;
                }
                // Only what lies on the ground cuts and fills; the others are measured to claim their vertices.
                match carrier {
                    Some(StructureKind::Bridge) => here.bridge_m = here.bridge_m.min(distance_m),
                    Some(StructureKind::Tunnel) => here.tunnel_m = here.tunnel_m.min(distance_m),
                    Some(StructureKind::Ford) | None => {
                        here.ground_m = here.ground_m.min(distance_m);
                        let level_m = from_m + rise_m * along;
                        let weight = ((1.0 - beyond_m / bank_m) / (1.0 - FADE)).min(1.0);
                        let (low_m, high_m) = (level_m - beyond_m / FILL, level_m + beyond_m / CUT);
                        // The road itself lies on its fill, however deep, as far as the vertices next to its edge.
                        let most_fill_m = if beyond_m < line.spacing_m as f32 { f32::INFINITY } else { WALL_M };
                        here.limits = here.limits.and(HeightLimits { low_m, high_m, weight, most_fill_m });
                    }
                }
            }
        }
    }
    gathered
}

/// A straight piece of a road. Vertices are taken relative to its ends, in exact differences, so that nothing depends on the
/// area that is asked for.
struct RoadPiece {
    /// The road's origin.
    origin: [i64; 2],
    /// In vertices from the origin.
    ends: [[f64; 2]; 2],
    /// From its start to its end, in vertices.
    way: [f32; 2],
    /// The way from its start to its end, over the square of its length.
    per_square: [f32; 2],
    spacing_m: f32,
}

impl RoadPiece {
    fn new(line: &Line, ends: [[f64; 2]; 2]) -> RoadPiece {
        let way = [0, 1].map(|axis| (ends[1][axis] - ends[0][axis]) as f32);
        let square = way[0] * way[0] + way[1] * way[1];
        // A piece without a length, as between two points in the same place, is its start.
        let per_square = way.map(|part| if square > 0.0 { part / square } else { 0.0 });
        RoadPiece { origin: line.origin, ends, way, per_square, spacing_m: line.spacing_m as f32 }
    }

    /// The vertices within so many of the piece, and a few more.
    fn around(&self, reach: i64) -> Area {
        let [from, to] = self.ends;
        let low = |axis: usize| self.origin[axis] + from[axis].min(to[axis]).floor() as i64 - reach;
        // One more since the end was rounded down, and one since an area ends before its last.
        let high = |axis: usize| self.origin[axis] + from[axis].max(to[axis]).floor() as i64 + reach + 2;
        Area { x0: low(0), y0: low(1), x1: high(0), y1: high(1) }
    }

    /// How far along the piece its point nearest to a vertex lies, 0 to 1, and the metres to there.
    fn nearest(&self, x: i64, y: i64) -> (f32, f32) {
        // Rounded to f32 only as a small difference: far from the world's origin a place itself would not fit.
        let vertex = [(x - self.origin[0]) as f64, (y - self.origin[1]) as f64];
        let off = |end: [f64; 2]| [(vertex[0] - end[0]) as f32, (vertex[1] - end[1]) as f32];
        let start = off(self.ends[0]);
        let along = start[0] * self.per_square[0] + start[1] * self.per_square[1];
        // At an end the distance is to the end itself: two pieces that meet there agree to the bit.
        let (along, [dx, dy]) = match along {
            ..=0.0 => (0.0, start),
            1.0.. => (1.0, off(self.ends[1])),
            _ => (along, [start[0] - along * self.way[0], start[1] - along * self.way[1]]),
        };
        (along, (dx * dx + dy * dy).sqrt() * self.spacing_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lines::testing::road;

    #[test]
    fn a_fill_ends_at_a_wall_where_it_would_bury_a_gorge() {
        // A road at 50 m in land at 45 m, with a gorge beside it.
        let line = road((0..=30).map(|x| ([x as f64, 10.0], 50.0, None)), 8.0);
        let area = Area::new(0, 0, 31, 21);
        for (gorge_m, is_filled) in [(36.0, true), (20.0, false)] {
            let mut built = Built::blank(area);
            built.add(&line);
            let land_m = |y: i64| if (12..=13).contains(&y) { gorge_m } else { 45.0 };
            let mut heights = Grid::filled(area, 45.0);
            for (x, y) in area.vertices() {
                heights.row_mut(y, x, x + 1)[0] = land_m(y);
            }
            built.shape(&mut heights);
            assert_eq!((heights.at(15, 10), heights.at(15, 9)), (50.0, heights.at(15, 11)));
            assert!(heights.at(15, 11) > 45.0);
            assert_eq!(heights.at(15, 12) > gorge_m, is_filled, "{gorge_m}");
        }
    }

    #[test]
    fn under_viaducts_and_over_tunnels_the_land_stays_as_it_is() {
        // 8 m between vertices and from point to point, level at 50 m in land that is level at 30 m or 80 m.
        for (kind, land_m) in [(StructureKind::Bridge, 30.0), (StructureKind::Tunnel, 80.0)] {
            let carrier = |x: i64| (10..=20).contains(&x).then_some(kind);
            let line = road((0..=30).map(|x| ([x as f64, 10.0], 50.0, carrier(x))), 8.0);
            let area = Area::new(0, 0, 31, 21);
            let mut built = Built::blank(area);
            built.add(&line);
            let mut heights = Grid::filled(area, land_m);
            built.shape(&mut heights);
            for x in 0..31 {
                let is_carried = (11..20).contains(&x);
                assert_eq!(heights.at(x, 10), if is_carried { land_m } else { 50.0 }, "{kind:?} {x}");
                assert_eq!(built.share.at(x, 10) > 0.5, !is_carried, "{kind:?} {x}");
                assert_eq!(built.decks.at(x, 10) > 0.5, !is_carried || kind == StructureKind::Bridge, "{kind:?} {x}");
            }
        }
    }
}
