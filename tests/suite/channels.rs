//! The laws of the network: channels fall, grow, keep apart and end in what they name.
//!
//! The suite looks at one seed of some presets, in its long form at all else.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use terrane::fluvial::channel::{Channel, Knot, Mouth};
use terrane::grain_point::Point;
use terrane::lines::{ChannelId, LakeId};
use terrane::world::World;

use crate::is_long;
use crate::worlds::{fluvial, fluvial_names, is_tried, shared};

fn worlds() -> impl Iterator<Item = (&'static str, u64, &'static World)> {
    let seeds = if is_long() { 1..=4 } else { 1..=1 };
    let all = seeds.flat_map(|seed| fluvial_names().map(move |name| (name, seed)));
    all.filter(|(name, seed)| *seed > 1 || is_tried(name)).map(|(name, seed)| (name, seed, shared(name, seed)))
}

type Channels = BTreeMap<ChannelId, Arc<Channel>>;

/// All channels of some levels whose bounds touch a square at the origin of some vertices a side.
fn channels_of(world: &World, levels: u32, side: i64) -> Channels {
    let mut all = BTreeMap::new();
    let network = fluvial(world).network();
    for level in 0..levels {
        network.channels(level, [Point::at_vertex(0, 0), Point::at_vertex(side, side)], |channel| {
            all.insert(channel.id, Arc::clone(channel));
        });
    }
    all
}

/// All channels near the origin of each world, found once.
fn channels() -> impl Iterator<Item = (&'static str, u64, &'static Channels)> {
    static FOUND: OnceLock<Vec<(&str, u64, Channels)>> = OnceLock::new();
    let found = FOUND.get_or_init(|| {
        let worlds: Vec<_> = worlds().collect();
        let find = |(name, seed, world)| (name, seed, channels_of(world, fluvial(world).fields().levels(), SIDE));
        worlds.into_par_iter().map(find).collect()
    });
    found.iter().map(|(name, seed, channels)| (*name, *seed, channels))
}

/// Vertices a side of the square in which channels are looked at.
const SIDE: i64 = 1000;

#[test]
fn channels_fall_grow_and_end_in_what_they_name() {
    let mut count = 0;
    for (name, seed, all) in channels() {
        count += all.len();
        for channel in all.values() {
            let id = channel.id;
            for pair in channel.knots.windows(2) {
                // To the sill of a lake its floor rises.
                let is_lake = pair[0].level_m < pair[0].pool_m;
                assert!(is_lake || pair[0].level_m > pair[1].level_m, "{name}, seed {seed}: {id:?} does not fall");
                assert!(pair[0].area <= pair[1].area, "{name}, seed {seed}: {id:?} shrinks");
            }
            let end = channel.knots[channel.knots.len() - 1];
            let Mouth::Channel(other) = channel.mouth else { continue };
            let Some(other) = all.get(&other) else { continue };
            let on_line = |pair: &[Knot]| {
                let (way, off) = (pair[1].at.from(pair[0].at), end.at.from(pair[0].at));
                let t = (off.dot(way) / way.length_squared()).clamp(0.0, 1.0);
                (off - way * t).length() < 2.0
            };
            let joined = other.knots.windows(2).find(|pair| on_line(pair));
            let joined = joined.unwrap_or_else(|| panic!("{name}, seed {seed}: {id:?} ends beside {:?}", other.id));
            assert!(joined[1].area >= end.area, "{name}, seed {seed}: {id:?} joins what is smaller");
        }
    }
    // There may be nothing but sea where one of the worlds is looked at.
    assert!(count > if is_long() { 1000 } else { 500 }, "there are {count} channels");
}

/// The pairs of channels that cross.
fn crossings<'a>(channels: impl Iterator<Item = &'a Arc<Channel>>) -> Vec<(ChannelId, ChannelId)> {
    let mut pieces: Vec<_> = channels
        .flat_map(|channel| channel.knots.windows(2).map(move |pair| (channel.id, pair[0].at, pair[1].at)))
        .collect();
    let west = |(_, a, b): &(ChannelId, Point, Point)| a.x.min(b.x);
    pieces.sort_by_key(west);
    let mut crossings = Vec::new();
    for (index, (id, a, b)) in pieces.iter().enumerate() {
        let near = pieces[index + 1..].iter().take_while(|piece| west(piece) <= a.x.max(b.x));
        for (other, c, d) in near {
            let apart = |u: fn(&Point) -> i64| u(a).max(u(b)) < u(c).min(u(d)) || u(c).max(u(d)) < u(a).min(u(b));
            if id == other || apart(|p| p.x) || apart(|p| p.y) {
                continue;
            }
            let side = |p: &Point, q: &Point, r: &Point| q.from(*p).perp_dot(r.from(*p));
            // A foot lies on its piece but for a grain, so a crossing is one by more than that.
            let grain = |p: &Point, q: &Point| 2.0 * p.distance(*q);
            let apart = |p: f64, q: f64, least: f64| (p > least && q < -least) || (p < -least && q > least);
            if apart(side(a, b, c), side(a, b, d), grain(a, b)) && apart(side(c, d, a), side(c, d, b), grain(c, d)) {
                crossings.push((*id, *other));
            }
        }
    }
    crossings
}

#[test]
fn channels_do_not_cross() {
    for (name, seed, all) in channels() {
        let crossings = crossings(all.values());
        assert!(crossings.is_empty(), "{name}, seed {seed}: of {} channels cross {crossings:?}", all.len());
    }
}

#[test]
fn trunks_that_come_and_go_close_together_do_not_cross() {
    // Here one comes to a lake from where the lake's own outlet goes.
    let crossings = crossings(channels_of(shared("highlands", 4), 1, 3000).values());
    assert!(crossings.is_empty(), "trunks cross: {crossings:?}");
}

#[test]
fn lakes_end_at_sills_as_high_as_their_water() {
    let mut count = 0;
    for (name, seed, world) in worlds() {
        let all = channels_of(world, 4, 3000);
        for channel in all.values().filter(|channel| channel.lake == Some(LakeId(channel.id))) {
            let first = channel.knots.iter().position(|knot| knot.pool_m.is_finite()).expect("its lake is in it");
            let sill = first + channel.knots[first..].iter().take_while(|knot| knot.pool_m.is_finite()).count();
            let level_m = channel.knots[sill - 1].pool_m;
            assert_eq!(channel.knots[sill].level_m, level_m, "{name}, seed {seed}: {:?}", channel.id);
            assert!(channel.knots[first].level_m > level_m, "{name}, seed {seed}: the inlet of {:?}", channel.id);
            assert!(channel.knots[first..sill].iter().any(|knot| knot.level_m < level_m - 0.1));
            count += 1;
        }
    }
    assert!(count > 3, "there are {count} lakes");
}

#[test]
fn channels_keep_away_from_what_they_run_to_until_they_end() {
    for (name, seed, all) in channels() {
        for channel in all.values().filter(|channel| channel.id.0 > 0) {
            let Mouth::Channel(other) = channel.mouth else { continue };
            let Some(other) = all.get(&other) else { continue };
            let (end, above) = channel.knots.split_last().unwrap();
            for knot in above {
                let off = other.knots.windows(2).map(|pair| {
                    let (way, off) = (pair[1].at.from(pair[0].at), knot.at.from(pair[0].at));
                    let t = (off.dot(way) / way.length_squared().max(1.0)).clamp(0.0, 1.0);
                    (off - way * t).length()
                });
                let (off, left) = (off.fold(f64::INFINITY, f64::min), knot.at.distance(end.at));
                assert!(
                    off > 0.05 * left,
                    "{name}, seed {seed}: {:?} lies {off:.1} grains beside {:?}, {left:.0} above its mouth",
                    channel.id,
                    other.id,
                );
            }
        }
    }
}
