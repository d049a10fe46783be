//! The curves of trunks from node to node, before they meander: knots with level and area.
//!
//! To judge the numbers chosen by eye, look at the courses of the largest rivers, on a map of many trunk cells.

use glam::DVec2;

use super::channel::{Channel, Knot, Mouth};
use super::fields::Fields;
use super::lake::NO_LAKE;
use super::plane::{come_along, lines, unit};
use super::trunk_lattice::{Drained, Look, NodeId, neighbours};
use super::volcanoes::VolcanoKind;
use crate::geometry::LineSegment;
use crate::grain_point::Point;

/// Slope of a bed that goes on under the sea: just enough that it falls. Chosen by eye.
pub const DROWNED_SLOPE: f64 = 0.002;

/// Least number of straight segments of a trunk, so that the curve looks like a curve in a coarse network too. Chosen
/// by eye.
const LEAST_SEGMENTS: usize = 16;

/// Length of the curve's tangents at the nodes, as a share of those of Hermite's cubic: a little shorter, so that the
/// curve is straighter and a trunk bulges by less than its length. Chosen by eye.
const TANGENT: f64 = 0.8;

/// Area that drains through a spring, in cells of the trunk lattice: a quarter of the spring's own cell. Chosen by eye.
const SPRING_AREA: f64 = 0.25;

/// Greatest mean slope of the trunk that begins at a volcano: a little less than that of the land around.
pub const VOLCANO_FALL: f64 = 0.065;

/// Greatest sideways bulge of a trunk, as a share of its length: a bound for the cubic.
pub const BULGE: f64 = 0.2;

/// Least distance between two trunks that share a node, as a share of the distance from the node; and the share of the
/// trunk's length from which on it is kept. Closer trunks could cross where the warp draws them together. Chosen by
/// eye.
const APART: f64 = 0.1;
const APART_FROM: f64 = 0.25;

/// Tangent of the least angle at which a trunk joins another from the side: 14 degrees. Chosen by eye.
const LEAST_JOIN: f64 = 0.25;

/// Makes the trunk from a node to the next; `None` for a sink. `share` scales how much it bends.
pub fn curve(fields: &Fields, nodes: &Look, id: NodeId, share: f64) -> Option<Channel> {
    let drained = nodes.drained(id);
    let to = drained.to?;
    let below = nodes.drained(to);
    let (here, there) = (nodes.node(id), nodes.node(to));
    let straight = there.at.from(here.at);
    let [start, end] = directions(nodes, id, to);
    let is_main = below.main == Some(id);
    let segments = fields.segments_a_channel(0).max(LEAST_SEGMENTS);
    let bend = share * bend_share(fields, &drained, here.at, there.at);
    // Where the sea comes in between the two nodes, the trunk ends there.
    let dry = drained.sea_at.unwrap_or(1.0);
    let in_bay = drained.sea_at.is_some() && !there.sea;
    let below_m = if drained.sea_at.is_some() { fields.lowstand_level_m() } else { below.level_m };
    let length_m = straight.length() * fields.metres_a_grain();
    let head_m = head_m(fields, nodes, id, below_m + VOLCANO_FALL * length_m * drained.sea_at.unwrap_or(1.0));
    let fall_m = head_m - below_m;
    // The area of the node's own cell, and what runs off it, are added along the way.
    let laws = fields.laws(here.at);
    let area_above = (drained.area as f64 - 1.0).max(SPRING_AREA);
    let own_m3s = laws.discharge_m3s(fields, 1.0);
    let above_m3s = (drained.discharge_m3s - own_m3s).max(SPRING_AREA * own_m3s);
    let tangents = [start, end].map(|tangent| tangent * TANGENT * bend);
    let ways = even(segments, |t| hermite(straight, tangents, t));
    let volcano = fields.volcano_at(id).filter(|volcano| volcano.kind != VolcanoKind::Caldera);
    let knot = |step: usize| {
        let t = step as f64 / segments as f64;
        let fallen = (t / dry).min(1.0);
        // On the floor of the sea the bed goes on falling a little.
        let drowned_m = (t - dry).max(0.0) * length_m * DROWNED_SLOPE;
        let area = area_above + (drained.area as f64 - area_above) * t;
        let at = here.at.moved(ways[step]);
        // The rain sinks into the volcano at which this trunk begins, unless it comes from the floor of a caldera.
        let is_dried = volcano.as_ref().is_some_and(|volcano| volcano.is_porous(fields, at));
        let flows = if is_dried { 0.0 } else { 1.0 };
        Knot {
            at,
            level_m: head_m - fall_m * fallen - drowned_m,
            area,
            discharge_m3s: flows * (above_m3s + (drained.discharge_m3s - above_m3s) * t),
            pool_m: NO_LAKE,
        }
    };
    let knots: Vec<Knot> = (0..=segments).map(knot).collect();
    let mouth = match below.to {
        _ if drained.sea_at.is_some() => Mouth::Sea,
        Some(_) => Mouth::Channel((0, to.0, to.1)),
        None => Mouth::Sink(to),
    };
    let next = (!in_bay).then_some((to, is_main));
    let mut trunk = Channel::new((0, id.0, id.1), knots, mouth, laws);
    trunk.next = next;
    Some(trunk)
}

/// Returns the height in metres of a trunk's bed at its upper node. A volcano stands as high as all nodes around it,
/// but no higher than `most_m`: nothing flows to it, so this concerns its own trunk alone.
pub fn head_m(fields: &Fields, nodes: &Look, id: NodeId, most_m: f64) -> f64 {
    let own_m = nodes.drained(id).level_m;
    if fields.volcano_at(id).is_none() {
        return own_m;
    }
    let around = neighbours(id).filter(|other| !nodes.node(*other).sea);
    let highest_m = around.map(|other| nodes.drained(other).level_m).fold(own_m, f64::max);
    highest_m.min(most_m).max(own_m)
}

/// Returns the directions in which the trunk from `id` to `to` leaves the one and arrives at the other, each as long as
/// the way between them.
pub fn directions(nodes: &Look, id: NodeId, to: NodeId) -> [DVec2; 2] {
    let straight = way(nodes, id, to);
    let start = through(nodes, id).unwrap_or_else(|| unit(straight));
    let end = match through(nodes, to) {
        Some(through) if nodes.drained(to).main == Some(id) => through,
        Some(through) => joining(nodes, id, to, through),
        None => unit(straight),
    };
    [start, end].map(|direction| direction * straight.length())
}

/// Returns the direction of the river that passes through a node; `None` at a sink.
///
/// It bisects the ways before and after the node, whatever their lengths. A mean of the ways would follow the longer
/// one, and the river on the shorter one would have to turn back.
fn through(nodes: &Look, id: NodeId) -> Option<DVec2> {
    let drained = nodes.drained(id);
    let after = way(nodes, id, drained.to?);
    let mut through = drained.main.map_or(unit(after), |main| between(way(nodes, main, id), after, 1.0));
    // The river must leave before it reaches the way of a trunk that joins from ahead; otherwise it would cross that
    // trunk.
    let joins = |other: &NodeId| Some(*other) != drained.main && nodes.drained(*other).to == Some(id);
    for other in neighbours(id).filter(joins) {
        let middle = between(after, way(nodes, id, other), 1.0);
        let side = after.perp_dot(through);
        if after.perp_dot(middle) * side > 0.0 && middle.perp_dot(through) * side > 0.0 {
            through = middle;
        }
    }
    Some(through)
}

/// Returns the direction in which a trunk joins the main river at a node, given the direction `through` of that river.
/// The trunk joins at an acute angle and from its own bank, even where the main river swings to that side; it joins
/// straight if it comes from ahead.
fn joining(nodes: &Look, id: NodeId, to: NodeId, through: DVec2) -> DVec2 {
    let below = nodes.drained(to);
    let straight = way(nodes, id, to);
    let main = below.main.map_or(-through, |main| way(nodes, to, main));
    let after = below.to.map_or(through, |next| way(nodes, to, next));
    // To tell the bank, turn round the node from the outgoing way: the trunk lies on one bank if it comes before the
    // main river, and on the other bank if after.
    let is_right = |from: DVec2, to: DVec2| from.perp_dot(to) > 0.0;
    let back = -straight;
    let (right, main_right) = (is_right(after, back), is_right(after, main));
    let before = if right == main_right { is_right(back, main) } else { right };
    let side = if before { -1.0 } else { 1.0 };
    let forward = unit(straight).dot(through).max(0.0);
    let aslant = between(straight, through, forward);
    if forward > 0.0 && side * through.perp_dot(aslant) < LEAST_JOIN {
        between(through, through.perp(), side * LEAST_JOIN)
    } else {
        aslant
    }
}

fn way(nodes: &Look, from: NodeId, to: NodeId) -> DVec2 {
    nodes.node(to).at.from(nodes.node(from).at)
}

/// Returns the direction of a way turned towards another: with a share of 1, by half of the angle between them.
fn between(way: DVec2, other: DVec2, share: f64) -> DVec2 {
    unit(unit(way) + share * unit(other))
}

/// Evaluates Hermite's cubic from the origin to a place, with tangents at both ends. Shorter tangents make it
/// straighter, but keep its directions at the ends.
fn hermite(to: DVec2, [start, end]: [DVec2; 2], t: f64) -> DVec2 {
    let (t2, t3) = (t * t, t * t * t);
    let (leave, go, arrive) = (t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2);
    start * leave + to * go + end * arrive
}

/// Returns places of a curve that are equally far apart along it, both ends included. The curve's parameter runs from 0
/// to 1.
fn even(segments: usize, curve: impl Fn(f64) -> DVec2) -> Vec<DVec2> {
    // Straight pieces a segment that approximate the curve to measure its length.
    const PIECES: usize = 4;
    let pieces = PIECES * segments;
    let places: Vec<DVec2> = (0..=pieces).map(|piece| curve(piece as f64 / pieces as f64)).collect();
    let come = come_along(&places);
    let mut piece = 0;
    let inner = (1..segments).map(|step| {
        let wanted = come[pieces] * step as f64 / segments as f64;
        while piece + 2 < come.len() && come[piece + 1] < wanted {
            piece += 1;
        }
        let share = (wanted - come[piece]) / (come[piece + 1] - come[piece]).max(1e-9);
        places[piece].lerp_monotonic(places[piece + 1], share)
    });
    std::iter::once(places[0]).chain(inner).chain([places[pieces]]).collect()
}

/// Returns how much a trunk may bend, 0 to 1. The closer its straight way comes to the sea, the less it may bend: the
/// lattice finds the place where the trunk meets the sea on the straight way.
pub fn bend_share(fields: &Fields, drained: &Drained, from: Point, to: Point) -> f64 {
    // The places at which the lattice looks for the sea.
    const PLACES: u32 = 16;
    let way = to.from(from);
    if !fields.has_sea() {
        return 1.0;
    }
    if drained.sea_at.is_some() && fields.potential(to) >= fields.sea_potential() {
        // The trunk ends in a bay, whose shores are closer to each other than a curve is to its chord.
        return 0.0;
    }
    let bulge_m = BULGE * way.length() * fields.metres_a_grain();
    let shares = || (1..PLACES).map(|place| place as f64 / PLACES as f64);
    let place = |share: f64| from.moved(way * share * drained.sea_at.unwrap_or(1.0));
    let inlands_m = fields.inlands_m(&shares().map(place).collect::<Vec<_>>());
    // The room at a place relative to the bulge of a parabola there.
    let room = |(share, inland_m): (f64, f64)| inland_m / (4.0 * share * (1.0 - share) * bulge_m);
    shares().zip(inlands_m).map(room).fold(1.0, f64::min).max(0.0)
}

/// True if two trunks that share a node cross, or run side by side for long.
pub fn too_close(trunk: &[Knot], other: &[Knot], joint: Point) -> bool {
    // Every second knot is enough: a curve turns little from one knot to the next.
    const STEP: usize = 2;
    let places = |knots: &[Knot]| knots.iter().map(|knot| knot.at.from(joint)).collect::<Vec<_>>();
    let (trunk, other) = (places(trunk), places(other));
    let (trunk_lines, other_lines) = (lines(&trunk, STEP), lines(&other, STEP));
    let crosses = |line: &LineSegment| other_lines.iter().any(|other| line.crosses(other));
    let whole = trunk[0].length().max(trunk[trunk.len() - 1].length());
    // Near the node all trunks are close together, so the least distance grows with the distance from the node.
    let beside = |place: &DVec2| {
        let (at, way) = (place.to_array(), place.length());
        let is_near = |line: &LineSegment| line.touches(at, APART * way) && line.distance(at) < APART * way;
        way > APART_FROM * whole && other_lines.iter().any(is_near)
    };
    trunk_lines.iter().any(crosses) || trunk.iter().step_by(STEP).any(beside)
}
