//! Branches of trunks: oxbows ("old arms") that a river has left, and side arms where it is braided.
//!
//! On a wide flood plain a river leaves loops behind. A loop that was cut off is a crescent of water beside the river,
//! silted up at its upper end and open where it returns to the river. Here and there the river runs in two or three
//! arms around low islands.
//!
//! For the rasters, and for planning on them, a branch is one more channel. The lines of rivers, and the tributaries
//! that join them, do not know branches, so a branch exists only where no other river crosses it.
//!
//! To judge the numbers chosen by eye, look at the oxbows and side arms of `plains`.

use std::sync::Arc;

use glam::DVec2;

use super::channel::{Channel, CrossSection, Knot};
use super::cross_section::measured;
use super::fields::Fields;
use super::lake::NO_LAKE;
use super::meander::meander_width;
use super::plane::{come_along, lines, unit};
use super::segment::LEVEL;
use super::trunk_lattice::NodeId;
use crate::geometry::{LineSegment, smooth};
use crate::grain_point::{GRAINS, Point, chance, padded};
use crate::hash::{self, Draw};
use crate::memory::{Memory, Remembers, heap_bytes};

/// Length of a slot, in which a trunk may have one branch, in widths of the river: about a meander, so that no two
/// branches meet.
const SLOT_WIDTHS: f64 = 18.0;

/// Places in each slot that are compared to find the one where the river bends most.
const LOOKS: u32 = 8;

/// Most slots of a trunk.
const MOST_SLOTS: usize = 200;

/// Widths from a trunk's ends within which it has no branches: other trunks join it there.
const END_WIDTHS: f64 = 8.0;

/// Width in vertices of the narrowest river that has branches: narrower rivers look like brooks.
const LEAST_VERTICES: f64 = 2.0;

/// Length in widths over which a direction is measured before and after a place to find the bend there.
const BEND_WIDTHS: f64 = 2.5;

/// Radius of an oxbow in widths, and distance of its centre from the river: the least value, and the range that chance
/// adds. Chosen by eye, so that the apex is two to four widths away from the river's banks.
const LOOP_RADIUS: (f64, f64) = (1.9, 0.9);
const LOOP_MIDDLE: (f64, f64) = (1.4, 0.5);

/// Angle in radians from an oxbow's apex to its lower end, where it turns back to the river, and to its upper end,
/// where it is silted up; and from one knot to the next.
const LOOP_DOWN: f64 = 1.9;
const LOOP_UP: (f64, f64) = (1.0, 0.6);
const LOOP_STEP: f64 = 0.16;

/// Least distance in widths between an oxbow and its river, except where the oxbow returns to the river; and greatest
/// distance from which it still returns.
const LOOP_CLEAR: f64 = 1.1;
const LOOP_OPENS: f64 = 1.8;

/// Width of an oxbow at its open end as a share of its river's width, and how much of that it loses towards its silted
/// end.
const LOOP_WIDTH: (f64, f64) = (0.85, 0.5);

/// Length of a side arm along the river in widths, and its distance from the river: the least value, and the range that
/// chance adds.
const BRAID_LENGTH: (f64, f64) = (7.0, 6.0);
const BRAID_ASIDE: (f64, f64) = (1.5, 0.8);

/// Width of a side arm as a share of its river's width. Share of braided reaches that have a second arm on the other
/// side, and how much further downstream that arm lies, as a share of its length.
const BRAID_WIDTH: f64 = 0.45;
const BRAID_PAIRS: f64 = 0.6;
const BRAID_SHIFT: f64 = 0.45;

/// Share of a side arm's length at each end over which it leaves the river, and least distance in widths from the river
/// between the ends.
const BRAID_ENDS: f64 = 0.45;
const BRAID_CLEAR: f64 = 0.9;

/// Number of segments of a side arm, which has one knot more.
const BRAID_KNOTS: usize = 24;

/// Least distance in widths between a branch and other channels with water.
const OTHERS_CLEAR: f64 = 0.8;

/// Greatest rise of an oxbow's water from its open end, in metres a metre: enough that heights in `f32` show it; and as
/// a share of the river's slope.
const MOST_RISE: f64 = 1e-4;
const RISE_SHARE: f64 = 0.5;

/// Greatest height in metres of the valley floor above the river where a branch lies: higher ground is no flood plain.
const MOST_BANK_M: f64 = 2.0;

/// Half width of a branch's own floor, as a share of that of its water: just enough to round its banks.
const OWN_FLOOR: f64 = 1.5;

/// A branch of a trunk.
#[derive(Debug)]
pub struct Branch {
    /// The branch as a channel, with the id of its trunk.
    pub channel: Arc<Channel>,
    /// Least distance in grains between the branch and other channels.
    clear: f64,
}

heap_bytes!(Branch);

/// A trunk and the number of one of its branches.
type BranchId = (NodeId, usize);

/// The branches of a world's trunks.
#[derive(Debug)]
pub struct Branches {
    seed: u64,
    fields: Arc<Fields>,
    of_trunks: Memory<NodeId, Vec<Branch>>,
    free: Memory<BranchId, bool>,
}

impl Branches {
    /// The branches of a world with these fields.
    pub fn new(fields: Arc<Fields>, seed: u64) -> Branches {
        Branches { seed, fields, of_trunks: Memory::new(4 << 20), free: Memory::new(1 << 20) }
    }

    /// Returns the caches of the branches.
    pub fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.of_trunks, &self.free]
    }

    /// Returns the branches of a trunk that `wanted` accepts and that no other channel comes near, in their order.
    /// `channels` visits all channels in a rectangle.
    pub fn of(
        &self,
        trunk: &Channel,
        wanted: impl Fn(&Channel) -> bool,
        channels: impl Fn([Point; 2], &mut dyn FnMut(&Arc<Channel>)),
    ) -> Vec<Arc<Channel>> {
        if trunk.laws.old_arms + trunk.laws.braids <= 0.0 {
            return Vec::new();
        }
        let id = (trunk.id.1, trunk.id.2);
        let all = self.of_trunks.get(id, || Trunk::new(&self.fields, trunk).branches(self.seed));
        let is_free = |number: usize, branch: &Branch| {
            *self.free.get((id, number), || {
                let around = padded(branch.channel.bounds(), branch.clear);
                let mut is_free = true;
                channels(around, &mut |other| is_free = is_free && !branch.meets(other));
                is_free
            })
        };
        let free =
            all.iter().enumerate().filter(|(number, branch)| wanted(&branch.channel) && is_free(*number, branch));
        free.map(|(_, branch)| Arc::clone(&branch.channel)).collect()
    }
}

impl Branch {
    /// True if a channel other than its trunk comes near the branch.
    fn meets(&self, other: &Channel) -> bool {
        let origin = self.channel.knots[0].at;
        let own = self.channel.course(origin);
        let own_lines = lines(&own, 1);
        let is_near = |line: &LineSegment| {
            let to = DVec2::from(line.from) + DVec2::from(line.along);
            let crosses = || own_lines.iter().any(|own| own.crosses(line));
            let is_beside = |place: &DVec2| line.distance((*place).into()) < self.clear;
            own.iter().any(is_beside) || own_lines.iter().any(|own| own.distance(to.into()) < self.clear) || crosses()
        };
        other.id != self.channel.id && lines(&other.course(origin), 1).iter().any(is_near)
    }
}

/// A trunk in search of its branches. Places are in grains from its first knot.
struct Trunk<'a> {
    fields: &'a Fields,
    channel: &'a Channel,
    course: Vec<DVec2>,
    /// Grains along the trunk to each of its knots.
    come: Vec<f64>,
}

/// The side of the river on which a branch lies: 1 for the right and -1 for the left.
type Side = f64;

impl<'a> Trunk<'a> {
    fn new(fields: &'a Fields, channel: &'a Channel) -> Trunk<'a> {
        let course = channel.course(channel.knots[0].at);
        let come = come_along(&course);
        Trunk { fields, channel, course, come }
    }

    /// Returns all branches for which the trunk has room.
    fn branches(&self, seed: u64) -> Vec<Branch> {
        let laws = &self.channel.laws;
        let id = (self.channel.id.1, self.channel.id.2);
        let whole = self.come[self.come.len() - 1];
        let widest = meander_width(self.fields, self.channel.knots[self.channel.knots.len() - 1].discharge_m3s);
        let slot = SLOT_WIDTHS * widest;
        let slots = ((whole / slot) as usize).min(MOST_SLOTS);
        let mut branches = Vec::new();
        for number in 0..slots {
            let luck = |part| chance(hash::network_knot(seed, number), id, Draw::Branch, part);
            let from = number as f64 * slot;
            let kind = luck(0);
            if kind < laws.old_arms {
                // At the sharpest bend of the slot that has room: rivers cut off their sharpest bends.
                let looks = (0..LOOKS).map(|look| from + slot * (f64::from(look) + luck(1)) / f64::from(LOOKS));
                let mut bends: Vec<(f64, f64)> = looks.map(|at| (self.bend(at, widest), at)).collect();
                bends.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
                let shape = [luck(2), luck(3)];
                branches.extend(bends.iter().find_map(|(bend, at)| self.old_arm(*at, outside(*bend), shape)));
            } else if kind >= 1.0 - laws.braids {
                let at = from + slot * (0.35 + 0.3 * luck(1));
                let side = outside(self.bend(at, widest));
                let (by, length_widths) = (BRAID_ASIDE.0 + BRAID_ASIDE.1 * luck(3), luck(2));
                branches.extend(self.side_arm(at, side, length_widths, by));
                if luck(3) < BRAID_PAIRS {
                    let shift = BRAID_SHIFT * (BRAID_LENGTH.0 + BRAID_LENGTH.1 * length_widths) * widest;
                    branches.extend(self.side_arm(at + shift, -side, length_widths, by));
                }
            }
        }
        branches
    }

    /// Returns the knot before a place `along` grains down the trunk, and the share of the way to the next knot.
    fn place(&self, along: f64) -> (usize, f64) {
        let knot = self.come.partition_point(|come| *come <= along).clamp(1, self.come.len() - 1) - 1;
        let step = self.come[knot + 1] - self.come[knot];
        (knot, ((along - self.come[knot]) / step.max(1e-9)).clamp(0.0, 1.0))
    }

    fn at(&self, along: f64) -> DVec2 {
        let (knot, share) = self.place(along);
        self.course[knot].lerp_monotonic(self.course[knot + 1], share)
    }

    fn knot(&self, along: f64) -> Knot {
        self.channel.at(self.place(along))
    }

    /// Returns the unit vector of the trunk's mean direction over a length around a place.
    fn direction(&self, along: f64, over: f64) -> DVec2 {
        unit(self.at(along + over / 2.0) - self.at(along - over / 2.0))
    }

    /// Returns the sine of the angle by which the trunk turns around a place, above 0 to the right.
    fn bend(&self, along: f64, width: f64) -> f64 {
        let over = BEND_WIDTHS * width;
        self.direction(along - over / 2.0, over).perp_dot(self.direction(along + over / 2.0, over))
    }

    /// Returns the distance in grains from a place to the trunk, and how far along the trunk the nearest point lies,
    /// within a part of the trunk.
    fn nearest(&self, place: DVec2, [from, to]: [f64; 2]) -> (f64, f64) {
        let (first, last) = (self.place(from).0, self.place(to).0);
        let of = |knot: usize| {
            let line = LineSegment::between(self.course[knot].into(), self.course[knot + 1].into());
            let (share, square) = line.nearest(place.into());
            (square.sqrt(), self.come[knot] + (self.come[knot + 1] - self.come[knot]) * share)
        };
        (first..=last).map(of).min_by(|a, b| a.0.total_cmp(&b.0)).expect("a part has a segment")
    }

    /// True if a part of the trunk has room beside it for branches up to `away` grains from it, and for their own
    /// floors of half width `floor`.
    fn has_room(&self, [from, to]: [f64; 2], away: f64, floor: f64) -> bool {
        let (fields, metres) = (self.fields, self.fields.metres_a_grain());
        let least = LEAST_VERTICES * GRAINS as f64;
        let is_wide = |section: &CrossSection| {
            let riser = f64::from(section.riser) * f64::from(fields.terraces());
            let bank_m = f64::from(section.lean) * away * self.channel.laws.hill_slope * metres;
            away - floor <= f64::from(section.flood_plain)
                && away + floor + riser <= LEVEL * f64::from(section.trough)
                && 2.0 * f64::from(section.river) >= least
                && bank_m <= MOST_BANK_M
        };
        let (first, last) = (self.place(from).0, self.place(to).0 + 1);
        let is_land = |knot: &Knot| knot.pool_m == NO_LAKE && !fields.is_drowned(knot.at, knot.level_m);
        self.channel.sections[first..=last].iter().all(is_wide) && self.channel.knots[first..=last].iter().all(is_land)
    }

    /// Returns an oxbow beside a bend, on that side; `None` where there is no room.
    fn old_arm(&self, along: f64, side: Side, [size, shape]: [f64; 2]) -> Option<Branch> {
        let width = meander_width(self.fields, self.knot(along).discharge_m3s);
        let radius = width * (LOOP_RADIUS.0 + LOOP_RADIUS.1 * size);
        let middle = width * (LOOP_MIDDLE.0 + LOOP_MIDDLE.1 * shape);
        let whole = self.come[self.come.len() - 1];
        let part = [along - radius - 3.0 * width, along + radius + 3.0 * width];
        let end = END_WIDTHS * width;
        if part[0] < end || part[1] > whole - end {
            return None;
        }
        let (river, forward) = (self.at(along), self.direction(along, 2.0 * BEND_WIDTHS * width));
        let aside = side * forward.perp();
        // From the silted end, round the apex, to where the oxbow turns back to the river.
        let up = LOOP_UP.0 + LOOP_UP.1 * shape;
        let steps = ((LOOP_DOWN + up) / LOOP_STEP).ceil();
        let place = |step: usize| {
            let angle = -up + (LOOP_DOWN + up) * step as f64 / steps;
            let (on, off) = (radius * libm::sin(angle), middle + radius * libm::cos(angle));
            river + forward * on + aside * off
        };
        let mut places: Vec<DVec2> = (0..=steps as usize).map(place).collect();
        let open = places[places.len() - 1];
        let (off, beside) = self.nearest(open, part);
        let clear = |place: &DVec2| self.nearest(*place, [0.0, whole]).0;
        let rounds = places.len() - (0.6 / LOOP_STEP) as usize;
        if off > LOOP_OPENS * width || places[..rounds].iter().map(clear).any(|off| off < LOOP_CLEAR * width) {
            return None;
        }
        // It returns to the river a little downstream, without a corner.
        let mouth = beside + 0.6 * width;
        let (end_at, tangent) = (self.at(mouth), [libm::cos(LOOP_DOWN), -libm::sin(LOOP_DOWN)]);
        let ahead = open + 0.5 * off * (forward * tangent[0] + aside * tangent[1]);
        for part in 1..=4 {
            let t = f64::from(part) / 4.0;
            let [a, b, c] = [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
            places.push(a * open + b * ahead + c * end_at);
        }
        let away = places.iter().map(clear).fold(0.0, f64::max) + width;
        let river = self.knot(mouth);
        let slope = (self.knot(part[0]).level_m - self.knot(part[1]).level_m)
            / ((part[1] - part[0]) * self.fields.metres_a_grain());
        let rise = (RISE_SHARE * slope).clamp(0.0, MOST_RISE) * self.fields.metres_a_grain();
        let lengths = come_along(&places);
        let long = lengths[lengths.len() - 1];
        let knots = places.iter().zip(&lengths).map(|(place, come)| {
            let up = long - come;
            let share = LOOP_WIDTH.0 * (1.0 - LOOP_WIDTH.1 * (up / long) * (up / long));
            self.knot_at(*place, river.level_m + rise * up, &river, share)
        });
        self.branch(knots.collect(), part, away, width)
    }

    /// Returns a side arm around a place, on that side, `by` widths from the river; `None` where there is no room.
    fn side_arm(&self, along: f64, side: Side, long: f64, by: f64) -> Option<Branch> {
        let width = meander_width(self.fields, self.knot(along).discharge_m3s);
        let long = width * (BRAID_LENGTH.0 + BRAID_LENGTH.1 * long);
        let part = [along - long / 2.0, along + long / 2.0];
        let whole = self.come[self.come.len() - 1];
        let end = END_WIDTHS * width;
        if part[0] < end || part[1] > whole - end {
            return None;
        }
        let place = |knot: usize| {
            let share = knot as f64 / BRAID_KNOTS as f64;
            let along = part[0] + long * share;
            let (at, forward) = (self.at(along), self.direction(along, BEND_WIDTHS * width));
            let off = by * width * smooth((share.min(1.0 - share) / BRAID_ENDS).min(1.0)) * side;
            at + forward.perp() * off
        };
        let places: Vec<DVec2> = (0..=BRAID_KNOTS).map(place).collect();
        let clear = |place: &DVec2| self.nearest(*place, [0.0, whole]).0;
        let beside = (BRAID_ENDS * BRAID_KNOTS as f64).ceil() as usize;
        if places[beside..=BRAID_KNOTS - beside].iter().map(clear).any(|off| off < BRAID_CLEAR * width) {
            return None;
        }
        // Reject an arm that folds where its river bends to the same side.
        let turns_back = |three: &[DVec2]| (three[1] - three[0]).dot(three[2] - three[1]) < 0.0;
        if places.windows(3).any(turns_back) {
            return None;
        }
        let (upper, lower) = (self.knot(part[0]), self.knot(part[1]));
        let lengths = come_along(&places);
        let whole = lengths[lengths.len() - 1];
        let knots = places.iter().zip(&lengths).map(|(place, come)| {
            let level_m = upper.level_m + (lower.level_m - upper.level_m) * (come / whole);
            self.knot_at(*place, level_m, &upper, BRAID_WIDTH)
        });
        self.branch(knots.collect(), part, (by + 1.0) * width, width)
    }

    /// Returns a knot of a branch that has this share of the width of the river at a knot.
    fn knot_at(&self, place: DVec2, level_m: f64, river: &Knot, share: f64) -> Knot {
        let [area, discharge_m3s] = [river.area, river.discharge_m3s].map(|whole| whole * share * share);
        Knot { at: self.channel.knots[0].at.moved(place), level_m, area, discharge_m3s, pool_m: NO_LAKE }
    }

    /// Makes a branch of knots beside a part of the trunk. No knot is further than `away` from the trunk.
    fn branch(&self, knots: Vec<Knot>, part: [f64; 2], away: f64, width: f64) -> Option<Branch> {
        let middle = self.channel.sections[self.place(f64::midpoint(part[0], part[1])).0];
        let floor = OWN_FLOOR * f64::from(middle.river);
        if !self.has_room(part, away, floor) || knots.windows(2).any(|pair| pair[0].at == pair[1].at) {
            return None;
        }
        let mut channel = Channel::new(self.channel.id, knots, self.channel.mouth, self.channel.laws);
        // Beyond this distance, the sides of the branch's narrow floor have risen above the floor of the river and
        // above the sides that rise from it.
        let risers = f64::from(middle.riser) * f64::from(self.fields.terraces());
        channel.near = 2.0 * (away + floor + risers);
        let channel = measured(self.fields, channel);
        let narrow = |section: &CrossSection| CrossSection {
            lean: middle.lean,
            trough: (OWN_FLOOR * f64::from(section.river)) as f32,
            flood_plain: section.river,
            riser: 0.0,
            bend: 0.0,
            ..*section
        };
        let sections = channel.sections.iter().map(narrow).collect();
        Some(Branch { channel: Arc::new(channel.with_sections(sections)), clear: OTHERS_CLEAR * width })
    }
}

/// Returns the side on which the outside of a bend lies.
fn outside(bend: f64) -> Side {
    if bend > 0.0 { -1.0 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::Area;
    use crate::clock::Clock;
    use crate::fluvial::Fluvial;
    use crate::land::WaterKind;

    fn plains(old_arms: f64, braids: f64) -> Fluvial {
        Fluvial::of_preset("plains", 5, |settings| (settings.old_arms, settings.braids) = (old_arms, braids))
    }

    /// Returns the trunks around the origin, each with its branches.
    fn branches(fluvial: &Fluvial) -> Vec<(Arc<Channel>, Vec<Arc<Channel>>)> {
        let side = 4 * fluvial.fields().side(0);
        let mut all = Vec::new();
        fluvial.network().channels(0, [Point { x: -side, y: -side }, Point { x: side, y: side }], |trunk| {
            all.push((Arc::clone(trunk), fluvial.network().branches(trunk, |_| true)));
        });
        all
    }

    #[test]
    fn branches_fall_to_their_rivers_and_meet_no_others() {
        for (old_arms, braids) in [(1.0, 0.0), (0.0, 1.0)] {
            let fluvial = plains(old_arms, braids);
            let mut count = 0;
            for (trunk, branches) in branches(&fluvial) {
                let shape = Trunk::new(fluvial.fields(), &trunk);
                let whole = [0.0, shape.come[shape.come.len() - 1]];
                for branch in branches {
                    count += 1;
                    let (first, last) = (&branch.knots[0], &branch.knots[branch.knots.len() - 1]);
                    assert!(branch.knots.windows(2).all(|pair| pair[0].level_m > pair[1].level_m));
                    assert!(
                        branch.knots.windows(2).all(|pair| pair[0].discharge_m3s <= pair[1].discharge_m3s),
                        "its bed would be a pit"
                    );
                    let off = |knot: &Knot| shape.nearest(knot.at.from(trunk.knots[0].at), whole);
                    let (mouth, along) = off(last);
                    assert!(mouth < 2.0 && (shape.knot(along).level_m - last.level_m).abs() < 0.01, "{mouth} grains");
                    // A side arm's water lies above the river beside it only by as much as the arm is longer.
                    let above = |knot: &Knot| knot.level_m - shape.knot(off(knot).1).level_m;
                    assert!(branch.knots.iter().map(above).fold(0.0, f64::max) < 0.3);
                    assert_eq!(off(first).0 < 2.0, braids > 0.0, "old arms are silted up, side arms are not");
                    fluvial.network().wet_channels(branch.bounds(), &mut |other| {
                        let crosses = other.knots.windows(2).any(|pair| {
                            let other = LineSegment::between([0.0; 2], pair[1].at.from(pair[0].at).into());
                            lines(&branch.course(pair[0].at), 1).iter().any(|own| own.crosses(&other))
                        });
                        assert!(
                            other.id == branch.id || !crosses,
                            "{:?} crosses a branch of {:?}",
                            other.id,
                            branch.id
                        );
                    });
                }
            }
            assert!(count > 10, "{count} branches");
        }
    }

    #[test]
    fn a_branch_is_water_and_nothing_is_changed_beyond_its_reach() {
        let (fluvial, bare) = (plains(1.0, 0.0), plains(0.0, 0.0));
        assert!(branches(&bare).iter().all(|(_, branches)| branches.is_empty()));
        let all: Vec<Arc<Channel>> = branches(&fluvial).into_iter().flat_map(|(_, branches)| branches).collect();
        let (mut wetter, mut same) = (0, 0);
        for branch in all.iter().step_by(all.len() / 4) {
            let apex = fluvial.in_world(branch.knots[branch.knots.len() / 2].at);
            let [x, y] = [apex.x, apex.y].map(|grains| grains.div_euclid(GRAINS));
            let area = Area::new(x - 24, y - 24, 48, 48);
            let [land, before] = [&fluvial, &bare].map(|fluvial| fluvial.land(area, &Clock::default()).unwrap());
            let [water, dry] = [&land, &before].map(|land| land.water.as_ref().unwrap());
            let is_wet = |x, y| water.kind.at(x, y) == WaterKind::River && dry.kind.at(x, y) == WaterKind::Dry;
            wetter += usize::from(area.vertices().any(|(x, y)| is_wet(x, y)));
            let nodes = fluvial.warp.fill(area, 1);
            for (index, (x, y)) in area.vertices().enumerate() {
                let displaced = nodes.displacement_m(index) / fluvial.fields().metres_a_grain();
                let place = Point::at_vertex(x, y).moved(displaced);
                let reaches = |branch: &Arc<Channel>| {
                    // Segments are chosen for whole patches, so allow the width of a patch.
                    let most = branch.near + 16.0 * GRAINS as f64;
                    branch.knots.iter().any(|knot| knot.at.distance(place) < most)
                };
                if !all.iter().any(reaches) {
                    same += 1;
                    assert_eq!(land.heights.at(x, y), before.heights.at(x, y), "at {x}, {y}");
                }
            }
        }
        assert!(wetter >= 3, "{wetter} of four branches are seen");
        // Land far from all branches is the same too.
        let far = Area::new(0, 0, 256, 256);
        let [land, before] = [&fluvial, &bare].map(|fluvial| fluvial.land(far, &Clock::default()).unwrap());
        same += land.heights.values().iter().zip(before.heights.values()).filter(|(a, b)| a == b).count();
        assert!(same > 1000, "{same} vertices are as they were");
    }
}
