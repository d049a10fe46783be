//! Built roads in the land: cuttings and embankments.
//!
//! Each piece of a road limits the heights around it. At a distance d beyond the road's edge the land lies at most d/2
//! below the road, which is the batter of a fill, and at most d/1.5 above it, which is the batter of a cut. Land that a
//! fill would bury too deeply, such as a gorge beside the road, stays as it is: the fill ends at a wall. Limits are
//! combined by maximum and minimum. Where they contradict each other, as between two roads, their mean holds. So the
//! order of roads and of pieces does not matter. Between two points of a bridge or of a tunnel the land stays as it is.
//!
//! To judge the numbers chosen by eye, look at hillshades of cuttings and embankments, as in `alps`.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::lines::{Bed, Line, StructureKind};

/// Run of a fill's batter in metres for each metre of height: loose earth stands at 27 degrees. Chosen by eye, like the
/// batter of cuts, within the usual 1:1.5 to 1:2.
const FILL: f32 = 2.0;
/// Run of a cut's batter in metres for each metre of height: firm ground stands at 34 degrees.
const CUT: f32 = 1.5;

/// Greatest height in metres of a fill beside the road: above this height a viaduct carries the road instead. A bank of
/// 12 m is 50 m wide at its foot, and the road's effect on the land ends before the batters of a higher bank would.
pub(crate) const HIGHEST_FILL_M: f32 = 12.0;

/// Share of the bank's width at which a road's effect begins to fade, to exactly nothing at the bank's end. Chosen by
/// eye.
const FADE: f32 = 0.6;

/// The effect of all built roads together on the vertices of an area.
#[derive(Clone, Debug)]
pub struct Built {
    limits: Grid<HeightLimits>,
    /// Share of road, 0 to 1. Bridges and tunnels have none: under or over them lies bare land.
    pub share: Grid<f32>,
    /// Share of road as seen from above, 0 to 1, with bridges and fords. Roads are at least a vertex wide.
    pub decks: Grid<f32>,
}

/// Limits that roads set to the height of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HeightLimits {
    /// Lower limit of the land in metres.
    low_m: f32,
    /// Upper limit of the land in metres.
    high_m: f32,
    /// Share of the change that is applied, 0 to 1.
    weight: f32,
    /// Greatest depth of a fill in metres: deeper land stays as it is.
    most_fill_m: f32,
}

/// No limits.
const FREE: HeightLimits =
    HeightLimits { low_m: f32::NEG_INFINITY, high_m: f32::INFINITY, weight: 0.0, most_fill_m: 0.0 };

impl HeightLimits {
    /// Combines two limits so that both hold.
    fn and(self, other: HeightLimits) -> HeightLimits {
        HeightLimits {
            low_m: self.low_m.max(other.low_m),
            high_m: self.high_m.min(other.high_m),
            weight: self.weight.max(other.weight),
            most_fill_m: self.most_fill_m.max(other.most_fill_m),
        }
    }

    /// Applies the limits to a height in metres.
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

/// Effect of one road on a vertex, by the pieces visited so far.
#[derive(Clone, Copy)]
struct Here {
    limits: HeightLimits,
    /// Metres to the middle of the nearest piece on the ground; infinite if none is in reach.
    ground_m: f32,
    /// Metres to the middle of the nearest piece on a bridge.
    bridge_m: f32,
    /// Metres to the middle of the nearest piece in a tunnel.
    tunnel_m: f32,
}

impl Here {
    /// The state of a vertex with no piece in reach.
    const UNTOUCHED: Here =
        Here { limits: FREE, ground_m: f32::INFINITY, bridge_m: f32::INFINITY, tunnel_m: f32::INFINITY };
}

impl Built {
    /// Creates the effect of no roads on `area`.
    pub(crate) fn blank(area: Area) -> Built {
        let grid = || Grid::filled(area, 0.0);
        Built { limits: Grid::filled(area, FREE), share: grid(), decks: grid() }
    }

    /// Adds the effect of a line, if it is a built road.
    pub(crate) fn add(&mut self, line: &Line) {
        let Bed::Built { bank_m } = line.bed else { return };
        // Lines that do not touch the area return here, so that they need no grid.
        let Some(part) = self.share.area().common(&line.bounds) else { return };
        // The nearest piece of a vertex is known only after all pieces, so these are gathered before anything changes.
        let gathered = gathered(line, part, bank_m as f32);
        let (half_m, spacing_m) = (half_width_m(line) as f32, line.spacing_m as f32);
        // A ramp one vertex wide, with 0.5 at the road's edge, so that a narrow road does not flicker between vertices.
        let covered = |half_m: f32, distance_m: f32| ((half_m - distance_m) / spacing_m + 0.5).clamp(0.0, 1.0);
        for y in part.y0..part.y1 {
            let here = gathered.row(y, part.x0, part.x1).iter();
            let limits = self.limits.row_mut(y, part.x0, part.x1).iter_mut();
            let shares = self.share.row_mut(y, part.x0, part.x1).iter_mut();
            let decks = self.decks.row_mut(y, part.x0, part.x1).iter_mut();
            for ((here, deck), (limits, share)) in here.zip(decks).zip(limits.zip(shares)) {
                *deck = deck.max(covered(half_m.max(spacing_m / 2.0), here.ground_m.min(here.bridge_m)));
                // A vertex nearest to a bridge or a tunnel belongs to it. On a tie, as at the structure's ends, the
                // ground wins.
                if here.bridge_m.min(here.tunnel_m) < here.ground_m || here.ground_m == f32::INFINITY {
                    continue;
                }
                *limits = limits.and(here.limits);
                *share = share.max(covered(half_m, here.ground_m));
            }
        }
    }

    /// Leaves all wet vertices alone, and fills no bed of a channel: a fill would dam the channel, and a cut in a
    /// river's bank would let the river out. A dry bed shows the road and is cut by it; otherwise the bed would lie
    /// across the cutting as a dam.
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

    /// Cuts and fills the bare land, given its heights in metres.
    pub(crate) fn shape(&self, heights: &mut Grid<f32>) {
        assert_eq!(heights.area(), self.limits.area(), "heights are shaped where the roads are");
        for (height_m, limits) in heights.values_mut().iter_mut().zip(self.limits.values()) {
            *height_m = limits.applied(*height_m);
        }
    }

    /// Returns the effect on a part of the area, which must lie within it.
    pub(super) fn part(&self, area: Area) -> Built {
        Built { limits: self.limits.part(area), share: self.share.part(area), decks: self.decks.part(area) }
    }
}

/// Returns the distance in metres from the middle of a built road to its edge, the same all along the road.
fn half_width_m(line: &Line) -> f64 {
    line.points[0].half_width_m
}

/// Gathers the effects of a road's pieces on the vertices of an area.
fn gathered(line: &Line, area: Area, bank_m: f32) -> Grid<Here> {
    let mut gathered = Grid::filled(area, Here::UNTOUCHED);
    let half_m = half_width_m(line) as f32;
    // One vertex more, since the conversion to a whole number rounds down.
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
                // A hard end: beyond it the effect is exactly nothing, so an area need not know of roads further off.
                if beyond_m >= bank_m {
                    continue;
                }
                // Only pieces on the ground cut and fill. The others are measured too, since they claim the vertices
                // nearest to them.
                match carrier {
                    Some(StructureKind::Bridge) => here.bridge_m = here.bridge_m.min(distance_m),
                    Some(StructureKind::Tunnel) => here.tunnel_m = here.tunnel_m.min(distance_m),
                    Some(StructureKind::Ford) | None => {
                        here.ground_m = here.ground_m.min(distance_m);
                        let level_m = from_m + rise_m * along;
                        let weight = ((1.0 - beyond_m / bank_m) / (1.0 - FADE)).min(1.0);
                        let (low_m, high_m) = (level_m - beyond_m / FILL, level_m + beyond_m / CUT);
                        // The road itself always lies on its fill, however deep, and so do the vertices next to its
                        // edge.
                        let most_fill_m = if beyond_m < line.spacing_m as f32 { f32::INFINITY } else { HIGHEST_FILL_M };
                        here.limits = here.limits.and(HeightLimits { low_m, high_m, weight, most_fill_m });
                    }
                }
            }
        }
    }
    gathered
}

/// A straight piece of a road. Vertices are taken relative to its ends, by exact differences, so that the result does
/// not depend on the area that is asked for.
struct RoadPiece {
    /// Vertex from which the ends are counted: the road's origin.
    origin: [i64; 2],
    /// Both ends, in vertices from the origin.
    ends: [[f64; 2]; 2],
    /// Vector from the start to the end, in vertices.
    way: [f32; 2],
    /// The same vector, divided by the square of its length.
    per_square: [f32; 2],
    spacing_m: f32,
}

impl RoadPiece {
    fn new(line: &Line, ends: [[f64; 2]; 2]) -> RoadPiece {
        let way = [0, 1].map(|axis| (ends[1][axis] - ends[0][axis]) as f32);
        let square = way[0] * way[0] + way[1] * way[1];
        // A piece without length, between two points in the same place, is treated as its start.
        let per_square = way.map(|part| if square > 0.0 { part / square } else { 0.0 });
        RoadPiece { origin: line.origin, ends, way, per_square, spacing_m: line.spacing_m as f32 }
    }

    /// Returns the vertices within `reach` vertices of the piece, and a few more.
    fn around(&self, reach: i64) -> Area {
        let [from, to] = self.ends;
        let low = |axis: usize| self.origin[axis] + from[axis].min(to[axis]).floor() as i64 - reach;
        // One more since the end was rounded down, and one since an area ends past its last vertex.
        let high = |axis: usize| self.origin[axis] + from[axis].max(to[axis]).floor() as i64 + reach + 2;
        Area { x0: low(0), y0: low(1), x1: high(0), y1: high(1) }
    }

    /// Finds the point of the piece that is nearest to a vertex. Returns the point's share of the length, 0 to 1, and
    /// its distance in metres.
    fn nearest(&self, x: i64, y: i64) -> (f32, f32) {
        // Only the small difference is rounded to `f32`: far from the world's origin a place itself would lose its
        // digits.
        let vertex = [(x - self.origin[0]) as f64, (y - self.origin[1]) as f64];
        let off = |end: [f64; 2]| [(vertex[0] - end[0]) as f32, (vertex[1] - end[1]) as f32];
        let start = off(self.ends[0]);
        let along = start[0] * self.per_square[0] + start[1] * self.per_square[1];
        // Beyond an end the distance is measured to that end itself, so that two pieces that meet there agree to the
        // bit.
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
            let mut heights = Grid::of(area, |_, y| land_m(y));
            built.shape(&mut heights);
            assert_eq!((heights.at(15, 10), heights.at(15, 9)), (50.0, heights.at(15, 11)));
            assert!(heights.at(15, 11) > 45.0);
            assert_eq!(heights.at(15, 12) > gorge_m, is_filled, "{gorge_m}");
        }
    }

    #[test]
    fn under_viaducts_and_over_tunnels_the_land_stays_as_it_is() {
        // 8 m between vertices and between points. A road level at 50 m, in land level at 30 m or at 80 m.
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
