//! The cross-sections of channels: how wide and how steep the land across a channel is at each of its knots.
//!
//! To judge the numbers chosen by eye, look at the bends of the large rivers of `plains`.

use glam::DVec2;

use super::channel::{Channel, CrossSection, Knot};
use super::fields::{Fields, across, river_depth_m};
use super::laws::Laws;
use super::meander::meander_width;
use super::segment::LEVEL;
use crate::geometry::smooth;
use crate::grain_point::Point;

/// Least slope of a valley's floor across the channel, as a multiple of the river's slope along it.
///
/// On a flatter floor, a vertex of the bed would belong to a place further downstream, whose floor is hardly higher
/// there: the vertex would count as land, and interrupt the brook.
const LEAN: f64 = 3.0;

/// Least ratio of a floor's cross slope to its bed's slope upstream. With a smaller one, a bed that rises in a step
/// would come to lie on the floor below the step. It is larger than the factor by which the sides of steep beds are
/// gentler across.
const ABOVE_OWN: f64 = 1.5;

/// Largest slope of a floor, as a share of its side's slope: beside steep brooks the floor is almost as steep as the
/// side.
pub const MOST_LEAN: f64 = 0.95;

/// Width of a river where it is straight, and in a sharp bend, as shares of the usual width for its discharge. Chosen
/// by eye.
const STRAIGHT: f64 = 0.9;
const BENT: f64 = 1.2;

/// Distance upstream and downstream of a place, in widths of the river, whose directions are compared to measure a
/// bend; and the sine of the angle between them in a sharp bend, one with a radius of three widths.
const BEND_WIDTHS: f64 = 1.25;
const SINE: f64 = 0.4;

/// Distance in widths of the river from each end of a trunk, from its lakes and from the sea within which it takes on
/// its usual width.
const END_WIDTHS: f64 = 4.0;

/// Returns a channel, whose knots are final, with the cross-sections at them.
pub fn measured(fields: &Fields, channel: Channel) -> Channel {
    let bends = bends(fields, &channel);
    // A trunk goes on from node to node: with the laws of its head alone, its floor would have a step at each node.
    let along = (channel.id.0 == 0).then(|| fields.all_laws(&channel.places()));
    let laws = |knot: usize| along.as_ref().map_or(&channel.laws, |along| &along[knot]);
    let section = |knot: usize| section(fields, laws(knot), &channel, knot, &bends[knot]);
    let sections = (0..channel.knots.len()).map(section).collect();
    channel.with_sections(sections)
}

/// Returns the cross-section at a knot of a channel, given the laws and the bend there.
fn section(fields: &Fields, laws: &Laws, channel: &Channel, knot: usize, bend: &Bend) -> CrossSection {
    let Knot { at, area, discharge_m3s, level_m, .. } = channel.knots[knot];
    let steep = steepness(fields, channel, knot);
    let trough = laws.trough(fields, channel.id.0, area, level_m);
    let upstream = steepest_upstream(fields, channel, knot, trough);
    let has_terraces = laws.terrace_depths > 0.0;
    let flood_plain = if has_terraces { fields.flood_plain(at) } else { 1.0 };
    // A lake has drowned its terraces.
    let is_lake = channel.knots[knot.max(1) - 1..=knot].iter().any(|knot| knot.pool_m > f64::NEG_INFINITY);
    let riser_m = match has_terraces && !is_lake {
        true => laws.terrace_depths * f64::from(river_depth_m(discharge_m3s)),
        false => 0.0,
    };
    CrossSection {
        cross: across(steep) as f32,
        lean: (LEAN * steep.abs()).max(ABOVE_OWN * upstream).min(MOST_LEAN) as f32,
        trough: trough as f32,
        river: (fields.river_width_m(discharge_m3s) / 2.0 / fields.metres_a_grain() * bend.broad) as f32,
        flood_plain: (flood_plain * LEVEL * trough) as f32,
        riser: (riser_m / (channel.laws.hill_slope * fields.metres_a_grain())) as f32,
        bend: bend.turn as f32,
    }
}

/// The effect of a bend on a river.
#[derive(Clone)]
struct Bend {
    /// Width of the river, as a share of the usual width for its discharge.
    broad: f64,
    /// Sharpness of the bend: 1 for the sharpest to the right, -1 for the sharpest to the left.
    turn: f64,
}

/// Returns the bend of a channel's river at each of its knots. Only trunks have bends, and are broader in them.
fn bends(fields: &Fields, channel: &Channel) -> Vec<Bend> {
    let knots = &channel.knots;
    let none = Bend { broad: 1.0, turn: 0.0 };
    // A channel of two knots is straight. This is checked first, because finding the ends takes longer.
    if channel.id.0 > 0 || knots.len() == 2 {
        return vec![none; knots.len()];
    }
    // Lakes and the sea count as ends, too.
    let is_end = |knot: &Knot| knot.pool_m > f64::NEG_INFINITY || fields.is_drowned(knot.at, knot.level_m);
    let ends: Vec<bool> = knots.iter().map(is_end).collect();
    let bend = |knot: usize| {
        let Knot { at: here, discharge_m3s, .. } = knots[knot];
        if ends[knot] {
            return none.clone();
        }
        let width = meander_width(fields, discharge_m3s);
        let others = |number: usize| (&knots[number], ends[number]);
        let way_up = ahead(here, (0..knot).rev().map(others), width);
        let way_down = ahead(here, (knot + 1..knots.len()).map(others), width);
        let ([before, after], come) = ([way_up.0, way_down.0], way_up.1.min(way_down.1));
        // The vector `before` leads back upstream, so the cross product of a turn to the right has the opposite sign.
        let sine = -before.perp_dot(after) / (before.length() * after.length()).max(1e-9);
        let sharp = smooth((sine.abs() / SINE).min(1.0));
        // At its ends a trunk has the usual width and no bend, so that it matches the next trunk.
        let inner = smooth((come / (END_WIDTHS * width)).min(1.0));
        let broad = 1.0 + (STRAIGHT + (BENT - STRAIGHT) * sharp - 1.0) * inner;
        Bend { broad, turn: (sharp * inner).copysign(sine) }
    };
    (0..knots.len()).map(bend).collect()
}

/// Returns the offset from a place to the point of the channel one bend length ahead; and the distance to the next end,
/// as far as it matters. The channel runs through `knots`, each with a flag that is true for an end.
fn ahead<'a>(from: Point, knots: impl Iterator<Item = (&'a Knot, bool)>, width: f64) -> (DVec2, f64) {
    let (bend, most) = (BEND_WIDTHS * width, END_WIDTHS * width);
    let (mut come, mut last, mut place) = (0.0, from, DVec2::ZERO);
    for (knot, is_end) in knots {
        let way = knot.at.from(last);
        let long = way.length();
        place += way * ((bend - come) / long.max(1e-9)).clamp(0.0, 1.0);
        (come, last) = (come + long, knot.at);
        if come >= most || is_end {
            break;
        }
    }
    (place, come)
}

/// Returns the slope of a channel's bed at a knot, as a share of the hillside's slope. The hillside's slope is that of
/// the steepest line on it, of which the slope along the bed is one part and that across the channel the other.
fn steepness(fields: &Fields, channel: &Channel, knot: usize) -> f64 {
    let (above, below) = (&channel.knots[knot.max(1) - 1], &channel.knots[(knot + 1).min(channel.knots.len() - 1)]);
    let way_m = above.at.distance(below.at) * fields.metres_a_grain();
    (above.level_m - below.level_m) / (way_m * channel.laws.hill_slope).max(1e-9)
}

/// Returns the steepest slope from a knot to those upstream within the width of its floor, as a share of the hillside's
/// slope; near the mouth, also the slope towards the channel that this one joins.
///
/// Trunks are never so much steeper further up that it matters, except where they fall from a delta into the sea.
fn steepest_upstream(fields: &Fields, channel: &Channel, knot: usize, trough: f64) -> f64 {
    if channel.id.0 == 0 && channel.knots[knot].level_m >= fields.sea_level_m() {
        return 0.0;
    }
    let last = channel.knots.len() - 1;
    let (here, next, mouth) = (&channel.knots[knot], &channel.knots[last.min(knot + 1)], &channel.knots[last]);
    // If the floor comes to lie beside the joined channel before the next knot, that channel must not lie on the floor
    // either.
    let joined = if next.at.distance(mouth.at) < trough { channel.joined_slope } else { 0.0 };
    let (mut steepest, mut before) = (joined, [0.0; 2]);
    for above in channel.knots[..knot].iter().rev() {
        let beyond = [here.at.distance(above.at), above.level_m - here.level_m];
        // Of the step that leads out of the floor's width, only the part within it counts.
        let share = ((trough - before[0]) / (beyond[0] - before[0]).max(1e-9)).clamp(0.0, 1.0);
        let [way, rise_m] = [0, 1].map(|part| before[part] + (beyond[part] - before[part]) * share);
        steepest = steepest.max(rise_m / way.max(1e-9));
        if beyond[0] >= trough {
            break;
        }
        before = beyond;
    }
    steepest / (fields.metres_a_grain() * channel.laws.hill_slope)
}
