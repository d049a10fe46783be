//! Junctions: where several roads would lie on each other, only the one that ranks highest stays, and the others end on
//! it.
//!
//! Roads are cut in the order of their ranks: each one where it meets a road above it that has been cut already. The
//! parts that are left reach from one junction to the next, and end on the middle of the road that they join, at its
//! level. They are a function of the road and of the roads above it that may come near it, whatever area is asked for.
//!
//! To judge the numbers chosen by eye, look where roads of one settlement part, on maps at 1:10,000.

use std::cmp::Reverse;
use std::ops::{Range, RangeInclusive};
use std::sync::Arc;

use crate::area::Area;
use crate::geometry::{LineSegment, come_along, lerp};
use crate::lines::{self, Bed, FIXED, Line, LineEnd, LineId, LinePoint, RoadClass, Structure, StructureKind};
use crate::places::buckets::Buckets;
use crate::places::fixed::fixed;
use crate::places::plan_land::PlanScale;
use crate::places::profile::pinned_at_ends;
use crate::places::settings::PlacesSettings;

/// Distance between the edges of two roads, in metres and in vertices, within which they become one. The smaller holds.
// Chosen by eye. Roads on both banks of a river are further apart, however narrow it is.
const BESIDE_M: f64 = 12.0;
const BESIDE_VERTICES: f64 = 1.2;

/// Largest detour that is left out, where a road leaves another one and comes back to it: distance from the other road,
/// and length, both in steps of the plan. A second road there would serve nobody. Chosen by eye.
const ASIDE: f64 = 1.0;
const ASIDE_LENGTH: f64 = 8.0;

/// Number of points that a road goes on beside the one that it joins before it ends there, so that it merges with the
/// other instead of ending across it. Chosen by eye.
const AHEAD: usize = 3;

/// Least height in metres between two roads of which one is carried over the other: vehicles are up to 4 m high
/// (Council Directive 96/53/EC), and need some headroom.
const OVER_M: f64 = 4.5;

/// Returns the rank of a road in its world, by class and then by id. The smallest value ranks highest.
pub(super) fn rank(road: &Line) -> (Reverse<RoadClass>, LineId) {
    (Reverse(class(road)), road.id)
}

fn class(road: &Line) -> RoadClass {
    road.class.expect("places make roads only")
}

/// Vertices by which a part may reach beyond the bounds of its road, since it ends on the middle of another one.
pub(super) fn reach(settings: &PlacesSettings, spacing_m: f64) -> i64 {
    (touch_m([settings.widest_m() / 2.0; 2], spacing_m) / spacing_m) as i64 + 2
}

/// Vertices around a road within which others are looked for: as far as a detour may stray, or as wide roads touch.
fn aside(scale: &PlanScale, settings: &PlacesSettings) -> i64 {
    ((ASIDE * scale.step as f64) as i64).max(reach(settings, scale.spacing_m))
}

/// Returns the areas around a road's pieces in which other roads matter to its parts.
pub(super) fn areas(road: &Line, scale: &PlanScale, settings: &PlacesSettings) -> Vec<Area> {
    let pad = 2 * aside(scale, settings) as usize;
    road.points.chunks(CHUNK).map(|points| lines::bounds(road.origin, points, 0.0).padded(pad)).collect()
}

/// Returns the parts of a road, given the roads that rank above it, in order from the highest rank on.
pub(super) fn parts(road: &Line, above: &[Arc<Line>], scale: &PlanScale, settings: &PlacesSettings) -> Vec<Line> {
    let hull =
        areas(road, scale, settings).into_iter().reduce(|hull, area| hull.hull(&area)).expect("a road has points");
    let mut network = RoadNetwork::new(hull, scale, settings);
    for other in above {
        for part in network.parts(other) {
            network.add(&part);
        }
    }
    network.parts(road)
}

/// Returns the distance in metres between the middles of two roads within which they are one.
fn touch_m(half_widths_m: [f64; 2], spacing_m: f64) -> f64 {
    half_widths_m[0] + half_widths_m[1] + BESIDE_M.min(BESIDE_VERTICES * spacing_m)
}

/// The roads of an area that have been cut already.
struct RoadNetwork<'a> {
    scale: &'a PlanScale,
    settings: &'a PlacesSettings,
    area: Area,
    pieces: Vec<Piece>,
    /// Spatial index of the pieces.
    buckets: Buckets,
}

/// A piece of a road. Places are in metres from the network's corner.
struct Piece {
    line: LineSegment,
    /// Level in metres at the start of the piece, and its change to the end.
    level_m: [f64; 2],
    half_width_m: f64,
    carrier: Option<StructureKind>,
    /// The road that the piece belongs to.
    course: LineId,
}

/// The point of a road that is nearest to a given place.
#[derive(Clone, Copy)]
struct Foot {
    at: [f64; 2],
    level_m: f64,
    distance_m: f64,
    carrier: Option<StructureKind>,
    course: LineId,
}

/// Number of a road's points that share one area in which other roads are looked for.
const CHUNK: usize = 64;

/// Side of a bucket in vertices.
const BUCKET: i64 = 16;

impl<'a> RoadNetwork<'a> {
    fn new(area: Area, scale: &'a PlanScale, settings: &'a PlacesSettings) -> RoadNetwork<'a> {
        let count = |vertices: usize| vertices as i64 / BUCKET + 1;
        let buckets = Buckets::new(count(area.width()), count(area.height()));
        RoadNetwork { scale, settings, area, pieces: Vec::new(), buckets }
    }

    /// Returns a road's point in metres from the network's corner. The difference of the whole numbers is exact, so
    /// that the result has the same precision anywhere in the world.
    fn place_m(&self, fixed: [i64; 2]) -> [f64; 2] {
        let corner = [self.area.x0, self.area.y0];
        [0, 1].map(|axis| (fixed[axis] - corner[axis] * FIXED) as f64 * (self.scale.spacing_m / FIXED as f64))
    }

    fn places_m(&self, road: &Line) -> Vec<[f64; 2]> {
        road.points.iter().map(|point| self.place_m(road.fixed(point))).collect()
    }

    /// Returns the distance in metres within which pieces are found.
    fn aside_m(&self) -> f64 {
        aside(self.scale, self.settings) as f64 * self.scale.spacing_m
    }

    /// Returns the column and row of the bucket that a place in metres lies in.
    fn bucket(&self, at_m: [f64; 2]) -> [i64; 2] {
        at_m.map(|at_m| (at_m / (BUCKET as f64 * self.scale.spacing_m)).floor() as i64)
    }

    /// Adds the pieces of a road, or of a part of one.
    fn add(&mut self, road: &Line) {
        let (places, aside_m) = (self.places_m(road), self.aside_m());
        for ((ends, places), carrier) in road.points.windows(2).zip(places.windows(2)).zip(road.carriers()) {
            let low_m = [0, 1].map(|axis| places[0][axis].min(places[1][axis]) - aside_m);
            let high_m = [0, 1].map(|axis| places[0][axis].max(places[1][axis]) + aside_m);
            self.buckets.put(self.pieces.len() as u32, self.bucket(low_m), self.bucket(high_m));
            self.pieces.push(Piece {
                line: LineSegment::between(places[0], places[1]),
                level_m: [ends[0].level_m, ends[1].level_m - ends[0].level_m],
                half_width_m: ends[0].half_width_m,
                carrier,
                course: road.course,
            });
        }
    }

    /// Finds the nearest point on any piece that `will_do` accepts. On a tie the piece of the road with the highest
    /// rank wins.
    fn foot(&self, at: [f64; 2], will_do: impl Fn(&Piece, &Foot) -> bool) -> Option<Foot> {
        // No piece outside the network's area matters.
        let near = self.buckets.at(self.bucket(at)).iter();
        let feet = near.map(|number| &self.pieces[*number as usize]).map(|piece| {
            let (share, square) = piece.line.nearest(at);
            let place = [0, 1].map(|axis| lerp([piece.line.from[axis], piece.line.along[axis]], share));
            let level_m = lerp(piece.level_m, share);
            let (distance_m, carrier, course) = (square.sqrt(), piece.carrier, piece.course);
            (piece, Foot { at: place, level_m, distance_m, carrier, course })
        });
        let feet = feet.filter(|(piece, foot)| will_do(piece, foot)).map(|(_, foot)| foot);
        feet.reduce(|best, foot| if foot.distance_m < best.distance_m { foot } else { best })
    }

    /// Returns the parts of a road that do not lie on roads of the network, in the order of the road's points.
    fn parts(&self, road: &Line) -> Vec<Line> {
        let places = self.places_m(road);
        let feet: Vec<Option<Foot>> = (0..places.len()).map(|index| self.touched(road, index, places[index])).collect();
        let mut parts = Vec::new();
        let mut first = 0;
        for run in feet.chunk_by(|a, b| a.is_none() == b.is_none()) {
            let (start, last) = (first, first + run.len() - 1);
            first = last + 1;
            let ends = [joint(feet[..start].iter().rev()), joint(feet[first..].iter())];
            if run[0].is_none() && !self.is_detour(&places[start..=last], ends) {
                parts.push(self.part(road, start..=last, ends, parts.len() as u32));
            }
        }
        parts
    }

    /// Finds the point of the network that a road's point lies on. `None` if the road keeps clear of all others there.
    fn touched(&self, road: &Line, index: usize, at: [f64; 2]) -> Option<Foot> {
        let (point, carrier) = (&road.points[index], road.carrier(index));
        let is_off = |carrier| matches!(carrier, Some(StructureKind::Bridge | StructureKind::Tunnel));
        self.foot(at, |piece, foot| {
            let is_over = is_off(carrier) || is_off(piece.carrier);
            foot.distance_m <= touch_m([point.half_width_m, piece.half_width_m], self.scale.spacing_m)
                && !(is_over && (foot.level_m - point.level_m).abs() > OVER_M)
        })
    }

    /// True if a stretch leaves a road only to come back to the same road soon, without going far from it.
    fn is_detour(&self, places: &[[f64; 2]], ends: [Option<Foot>; 2]) -> bool {
        let [Some(before), Some(after)] = ends else { return false };
        let length_m = come_along(places)[places.len() - 1];
        let is_near =
            |at: &[f64; 2]| self.foot(*at, |_, foot| foot.distance_m <= ASIDE * self.scale.step_m()).is_some();
        before.course == after.course && length_m <= ASIDE_LENGTH * self.scale.step_m() && places.iter().all(is_near)
    }

    /// Makes the part of a road that keeps the points `own` and ends on other roads at `ends`.
    fn part(&self, road: &Line, own: RangeInclusive<usize>, ends: [Option<Foot>; 2], part: u32) -> Line {
        let LineId::Road { from, to, .. } = road.id else { unreachable!("places make roads only") };
        let (first, last) = (*own.start(), *own.end());
        let start = ends[0].and_then(|foot| self.end_on(foot, road, first, first.saturating_sub(AHEAD)..first));
        let end = ends[1].and_then(|foot| self.end_on(foot, road, last, last + 1..last + 1 + AHEAD));
        let mut own: Vec<_> = own.map(|index| (road.points[index], road.carrier(index))).collect();
        // A structure carries the pieces between two of its points, so the point beside an end needs the end's carrier
        // too.
        for (beside, joined) in [(0, &start), (own.len() - 1, &end)] {
            own[beside].1 = carrier_at_joint(own[beside].1, joined.and_then(|(_, carrier)| carrier));
        }
        let (mut points, carriers): (Vec<LinePoint>, Vec<_>) = start.into_iter().chain(own).chain(end).unzip();
        let lengths_m: Vec<f64> = points.windows(2).map(|pair| lines::piece_m(pair, road.spacing_m)).collect();
        let levels_m: Vec<f64> = points.iter().map(|point| point.level_m).collect();
        let grade = self.settings.standard(class(road)).profile_grade();
        for (point, level_m) in points.iter_mut().zip(pinned_at_ends(&lengths_m, &levels_m, grade)) {
            // Rounded to `f32`, the precision of heights in tiles.
            point.level_m = f64::from(level_m as f32);
            point.floor_m = point.level_m;
        }
        let Bed::Built { bank_m } = road.bed else { unreachable!("places build their roads") };
        let reach = (points[0].half_width_m + bank_m) / road.spacing_m;
        let is_end = points[points.len() - 1].place == road.points[road.points.len() - 1].place;
        Line {
            id: LineId::Road { from, to, part },
            course: road.course,
            name: road.name.clone(),
            bounds: lines::bounds(road.origin, &points, reach),
            structures: Structure::of_points(&carriers),
            end: if is_end { road.end } else { ends[1].map_or(road.end, |foot| LineEnd::Line(foot.course)) },
            points,
            ..*road
        }
    }

    /// Returns the point at which a part of a road ends on another road, past the part's point `beside`, and what
    /// carries that point; `None` if it is `beside` itself. `next` are the points with which the uncut road goes on.
    fn end_on(
        &self,
        foot: Foot,
        road: &Line,
        beside: usize,
        mut next: Range<usize>,
    ) -> Option<(LinePoint, Option<StructureKind>)> {
        let corner = [self.area.x0 - road.origin[0], self.area.y0 - road.origin[1]];
        let from_corner = fixed(foot.at.map(|at_m| at_m / self.scale.spacing_m).into());
        let place = [0, 1].map(|axis| corner[axis] as f64 + from_corner[axis] as f64 / FIXED as f64);
        let point = LinePoint { place, level_m: foot.level_m, floor_m: foot.level_m, ..road.points[beside] };
        // A structure goes on as far as the joint: that of this road here or just ahead, or that of the other road.
        let carrier = road.carrier(beside).or_else(|| next.find_map(|index| road.carrier(index)));
        (place != road.points[beside].place).then(|| (point, carrier_at_joint(carrier, foot.carrier)))
    }
}

/// Returns what carries a road where it joins another one, given what would carry each of the two there.
fn carrier_at_joint(own: Option<StructureKind>, joined: Option<StructureKind>) -> Option<StructureKind> {
    match (own, joined) {
        // The ford's water lies in the way of both roads, so the tunnel begins beyond it.
        (Some(StructureKind::Tunnel), Some(StructureKind::Ford)) => joined,
        _ => own.or(joined),
    }
}

/// Returns the joint of a road with the road that its `next` points lie on: a few points ahead, but not past the middle
/// of those points, since the road may only cross the other one.
fn joint<'a>(next: impl Iterator<Item = &'a Option<Foot>>) -> Option<Foot> {
    let beside: Vec<Foot> = next.map_while(|foot| *foot).collect();
    beside.get((beside.len().saturating_sub(1) / 2).min(AHEAD - 1)).copied()
}
