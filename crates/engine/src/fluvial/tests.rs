//! Tests that each stage of fluvial land reads nothing beyond its declared input: everything else is replaced by
//! poison.
//!
//! Slow tests, which do the same for more presets, are marked `ignore` and run by `.ci/run` only.

use std::collections::BTreeSet;

use glam::DVec2;

use super::*;
use crate::geometry::{LineSegment, length};
use crate::grain_point::GRAINS;
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::preset::Preset;
use channel::{Channel, Knot};
use hillsides::{Hillsides, NodeValues};
use network::ShownChannels;
use plane::lines;
use segment::{Segment, Segments};
use segments_above::AsksAbove;
use survey::{RiverPiece, Survey};
use valley::Valleys;
use warp::Displaced;

const AREA: Area = Area { x0: -130, y0: 70, x1: -66, y1: 118 };

/// More vertices around an area than any stage reads.
const WIDE: usize = 40;

impl Fields {
    /// Makes the fields of a built-in preset whose settings `change` has changed.
    pub(super) fn of_preset(name: &str, seed: u64, change: impl FnOnce(&mut FluvialSettings)) -> Fields {
        let (_, preset) = Preset::load(name).unwrap();
        let mut settings = preset.fluvial.unwrap();
        change(&mut settings);
        Fields::new(&settings, None, preset.spacing_m, preset.sea_level_m, seed)
    }
}

impl Fluvial {
    /// Makes the relief of a built-in preset whose settings `change` has changed.
    pub(crate) fn of_preset(name: &str, seed: u64, change: impl FnOnce(&mut FluvialSettings)) -> Fluvial {
        let (_, preset) = Preset::load(name).unwrap();
        let mut settings = preset.fluvial.unwrap();
        change(&mut settings);
        Fluvial::new(&settings, None, (preset.spacing_m, Stride::ONE), preset.sea_level_m, seed, None)
    }
}

/// Makes the fields of the built-in world.
pub(super) fn fields_of_world(seed: u64) -> Fields {
    let (_, preset) = Preset::load("world").unwrap();
    let metres_a_grain = preset.spacing_m / GRAINS as f64;
    let geography = Arc::new(Geography::new(preset.geography.as_ref().unwrap(), metres_a_grain, seed));
    Fields::new(&preset.fluvial.unwrap(), Some(geography), preset.spacing_m, preset.sea_level_m, seed)
}

fn relief(name: &str) -> Fluvial {
    seeded(name, 4)
}

fn seeded(name: &str, seed: u64) -> Fluvial {
    Fluvial::of_preset(name, seed, |_| {})
}

/// Returns the hillsides of an area, with a value for each node even of what is the same everywhere.
fn hillsides_of(fluvial: &Fluvial, area: Area) -> Hillsides {
    let mut hillsides = Hillsides::new(&fluvial.fields, area, fluvial.detail, fluvial.reach(fluvial.detail));
    for values in node_values(&mut hillsides) {
        if let NodeValues::Same(value) = *values {
            *values = NodeValues::Each(vec![value; area.len()]);
        }
    }
    hillsides
}

fn node_values(hillsides: &mut Hillsides) -> [&mut NodeValues; 4] {
    let Hillsides { crest_m, gullies, rills, roughness, .. } = hillsides;
    [crest_m, gullies, rills, roughness]
}

/// All data before gullies and water, for an area much larger than `AREA`.
struct Known {
    segments: Segments,
    nodes: Displaced,
    hillsides: Hillsides,
    valleys: Valleys,
}

fn known(fluvial: &Fluvial) -> Known {
    known_around(fluvial, AREA)
}

/// A limit for the rise to the next-lowest side, so high that no segment is left out.
const ALL_M: f32 = 1e6;

fn known_around(fluvial: &Fluvial, area: Area) -> Known {
    let wide = valley::input(area.padded(WIDE));
    let segments = fluvial.segments(wide, fluvial.detail, &Clock::default()).unwrap();
    let nodes = fluvial.warp.fill(wide, 1);
    let hillsides = hillsides_of(fluvial, wide);
    let valleys = fluvial.valleys(&nodes, nodes.area, &hillsides, &segments, ALL_M, &Clock::default()).unwrap();
    Known { segments, nodes, hillsides, valleys }
}

/// Overwrites all values of an area that lie outside a part of it.
fn poison<T: Copy>(values: &mut [T], area: Area, part: Area, with: T) {
    let places = area.vertices();
    for (value, (x, y)) in values.iter_mut().zip(places) {
        if !part.has(x, y) {
            *value = with;
        }
    }
}

/// Poisons the warp outside `warp`, the area that a stage reads of it, and all other data outside `rest`.
fn poisoned(known: Known, warp: Area, rest: Area) -> Known {
    let Known { segments, mut nodes, mut hillsides, mut valleys } = known;
    let wide = nodes.area;
    for metres in &mut nodes.metres {
        poison(metres, wide, warp, f32::NAN);
    }
    poison(&mut hillsides.slope, wide, rest, f32::NAN);
    for values in node_values(&mut hillsides) {
        let NodeValues::Each(values) = values else { panic!("each node has its own") };
        poison(values, wide, rest, f32::NAN);
    }
    let Valleys { height_m, level_m, crest_m, steepness, distance_m, away: [east, south], segment, share } =
        &mut valleys;
    for values in [height_m, level_m, crest_m, steepness, distance_m, east, south, share] {
        poison(values, wide, rest, f32::NAN);
    }
    poison(segment, wide, rest, u32::MAX);
    Known { segments, nodes, hillsides, valleys }
}

#[test]
fn no_other_segments_matter() {
    no_other_segments_matter_in(&["archipelago"]);
}

#[test]
#[ignore = "slow for its own sake"]
fn no_other_segments_matter_elsewhere() {
    no_other_segments_matter_in(&["alps", "plains"]);
}

/// Poisons all segments beyond those that are asked for, warp included.
fn no_other_segments_matter_in(names: &[&str]) {
    for name in names {
        let fluvial = relief(name);
        let expected = fluvial.land(AREA, &Clock::default()).unwrap();
        let wide = fluvial.segments(AREA.padded(600), fluvial.detail, &Clock::default()).unwrap();
        let near = fluvial.segments(valley::input(AREA), fluvial.detail, &Clock::default()).unwrap();
        let key = |of: &Segments, segment: &Segment| (of.channels[segment.channel as usize].id, segment.knot);
        let known: BTreeSet<_> = near.all.iter().map(|segment| key(&near, segment)).collect();
        let mut poisoned = wide.all.clone();
        let mut beyond = 0;
        for segment in &mut poisoned {
            if !known.contains(&key(&wide, segment)) {
                segment.level_m = [f64::NAN; 2];
                segment.area = [f64::NAN; 2];
                segment.discharge_m3s = [f64::NAN; 2];
                beyond += 1;
            }
        }
        assert!(beyond > 1000, "{name}: {beyond} segments lie beyond the reach");
        let segments = Segments { origin: wide.origin, channels: wide.channels, all: poisoned };
        let land = fluvial.land_of(&segments, AREA, fluvial.detail, &Clock::default()).unwrap();
        assert_eq!(land.heights, expected.heights, "{name}");
    }
}

#[test]
fn what_is_told_of_crests_does_not_depend_on_patches() {
    what_is_told_of_crests(|name| name == "archipelago");
}

#[test]
#[ignore = "slow for its own sake"]
fn what_is_told_of_crests_does_not_depend_on_patches_elsewhere() {
    what_is_told_of_crests(|name| name != "archipelago");
}

/// Segments are left out of a patch only if nothing reads them: otherwise the land would have steps between patches.
fn what_is_told_of_crests(is_tried: fn(&str) -> bool) {
    for (name, text) in crate::preset::BUILT_IN.iter().filter(|(name, _)| is_tried(name)) {
        let mut preset = Preset::parse(name, text).unwrap();
        let Some(settings) = &mut preset.fluvial else { continue };
        settings.gullies = 1.0;
        for levels in 3..=settings.levels {
            preset.fluvial.as_mut().unwrap().levels = levels;
            let settings = preset.fluvial.as_ref().unwrap();
            let fluvial = Fluvial::new(settings, None, (preset.spacing_m, Stride::ONE), preset.sea_level_m, 4, None);
            let area = valley::input(AREA);
            let (nodes, hillsides) = (fluvial.warp.fill(area, 1), hillsides_of(&fluvial, area));
            let segments = fluvial.segments(area, fluvial.detail, &Clock::default()).unwrap();
            let read_m = fluvial.crest_read_m(fluvial.gullies.first());
            let told = fluvial.valleys(&nodes, nodes.area, &hillsides, &segments, read_m, &Clock::default()).unwrap();
            let whole = fluvial.valleys(&nodes, nodes.area, &hillsides, &segments, ALL_M, &Clock::default()).unwrap();
            assert_eq!(told.height_m, whole.height_m, "{name}, {levels} levels");
            let expected: Vec<f32> = whole.crest_m.iter().map(|crest_m| crest_m.min(read_m)).collect();
            assert_eq!(told.crest_m, expected, "{name}, {levels} levels");
        }
    }
}

#[test]
fn gullies_read_their_input_alone() {
    gullies_read_their_input_alone_in(&["alps"]);
}

#[test]
#[ignore = "slow for its own sake"]
fn gullies_read_their_input_alone_elsewhere() {
    gullies_read_their_input_alone_in(&["canyon"]);
}

fn gullies_read_their_input_alone_in(names: &[&str]) {
    for name in names {
        let fluvial = relief(name);
        let gullies = &fluvial.gullies[0];
        let carved = |mut known: Known| {
            gullies.carve(&known.nodes, &known.hillsides, &mut known.valleys, &Clock::default()).unwrap();
            let mut heights = Grid::filled(known.nodes.area, 0.0);
            heights.values_mut().copy_from_slice(&known.valleys.height_m);
            heights.part(AREA)
        };
        let bare = known(&fluvial);
        let expected = carved(known(&fluvial));
        assert_eq!(carved(poisoned(bare, gullies::input(AREA), gullies::input(AREA))), expected, "{name}");
    }
}

/// From one facet of a hillside to the next, directions and the height of the channel jump, but the depth of gullies
/// does not.
#[test]
fn gullies_are_whole_where_the_facets_of_a_hillside_meet() {
    let fluvial = relief("alps");
    let gullies = &fluvial.gullies[0];
    let area = valley::input(Area::new(-1200, 300, 640, 640));
    let (nodes, hillsides) = (fluvial.warp.fill(area, 1), hillsides_of(&fluvial, area));
    let segments = fluvial.segments(area, fluvial.detail, &Clock::default()).unwrap();
    let mut valleys = fluvial.valleys(&nodes, nodes.area, &hillsides, &segments, ALL_M, &Clock::default()).unwrap();
    let bare_m = valleys.height_m.clone();
    gullies.carve(&nodes, &hillsides, &mut valleys, &Clock::default()).unwrap();
    let step_m = |(x, y): (i64, i64)| {
        let [here, next] = [area.index(x, y), area.index(x + 1, y)];
        // Below a crest gullies deepen fast, which is no break.
        let on_crest = valleys.crest_m[here].min(valleys.crest_m[next]) < 50.0;
        let carved_m = |at: usize| bare_m[at] - valleys.height_m[at];
        if on_crest { 0.0 } else { (carved_m(next) - carved_m(here)).abs() }
    };
    let places = (area.y0 + 16..area.y1 - 16).flat_map(|y| (area.x0 + 16..area.x1 - 16).map(move |x| (x, y)));
    let largest_m = places.map(step_m).fold(0.0, f32::max);
    // At most, intact gullies make a step of 7 m, where the fall line turns about twice as much; broken ones make 26 m.
    assert!(largest_m < 15.0, "a step of {largest_m} m");
}

#[test]
fn water_reads_its_input_alone() {
    for name in ["alps", "archipelago"] {
        let fluvial = relief(name);
        let filled = |known: &Known| {
            fluvial.water(&known.segments, &known.nodes, &known.valleys, None).fill(AREA, &Clock::default()).unwrap()
        };
        let expected = filled(&known(&fluvial));
        let land = filled(&poisoned(known(&fluvial), water::input(AREA), AREA));
        assert_eq!(land.heights, expected.heights, "{name}");
        let [water, expected] = [land, expected].map(|land| land.water.unwrap());
        assert_eq!((water.kind, water.bed), (expected.kind, expected.bed), "{name}");
        assert_eq!((water.depth_m, water.flow_m3s), (expected.depth_m, expected.flow_m3s), "{name}");
    }
}

#[test]
fn channels_stay_within_their_reach() {
    channels_stay_within_their_reach_in(&["archipelago"]);
}

#[test]
#[ignore = "slow for its own sake"]
fn channels_stay_within_their_reach_elsewhere() {
    channels_stay_within_their_reach_in(&["alps", "plains"]);
}

/// All of a channel lies within the rectangle that is searched for its head.
fn channels_stay_within_their_reach_in(names: &[&str]) {
    for name in names {
        let fluvial = relief(name);
        let mut known = 0;
        for level in 0..fluvial.fields.levels() {
            let side = fluvial.fields.side(level);
            let place = Point { x: 1 << 40, y: -(1 << 39) };
            let around = place.square(8.0 * side as f64);
            fluvial.network.channels(level, around, |channel| {
                let (_, x, y) = channel.id;
                let head = [Point { x: x * side, y: y * side }, Point { x: (x + 1) * side, y: (y + 1) * side }];
                let [low, high] = fluvial.network.input(level, head);
                let [from, to] = channel.bounds();
                let inside = low.x <= from.x && low.y <= from.y && to.x <= high.x && to.y <= high.y;
                assert!(inside, "{name}: {:?} from {from:?} to {to:?}", channel.id);
                known += 1;
            });
        }
        assert!(known > 200, "{name}: {known} channels");
    }
}

/// The land depends on the area alone, whatever else is made with it.
#[test]
fn whole_patches_read_the_same_as_their_parts() {
    let fluvial = relief("alps");
    let whole = fluvial.land(AREA.padded(WIDE), &Clock::default()).unwrap();
    assert_eq!(whole.heights.part(AREA), fluvial.land(AREA, &Clock::default()).unwrap().heights);
}

/// Returns the tributaries whose heads lie in a square of `vertices` vertices of the network's plane.
fn tributaries(fluvial: &Fluvial, vertices: i64) -> Vec<Arc<Channel>> {
    let segments = fluvial
        .segments(Area::new(0, 0, vertices as usize, vertices as usize), fluvial.detail, &Clock::default())
        .unwrap();
    let end = Point::at_vertex(vertices, vertices);
    let inside = |at: Point| at.x >= 0 && at.y >= 0 && at.x < end.x && at.y < end.y;
    let wanted = |channel: &&Arc<Channel>| channel.id.0 > 0 && inside(channel.knots[0].at);
    segments.channels.iter().filter(wanted).cloned().collect()
}

#[test]
fn brooks_come_down_most_hillsides() {
    for name in ["alps", "highlands"] {
        let fluvial = relief(name);
        let finest = fluvial.fields.levels() - 1;
        let cells = (1024 * GRAINS / fluvial.fields.side(finest)).pow(2) as usize;
        let brooks = tributaries(&fluvial, 1024).iter().filter(|channel| channel.id.0 == finest).count();
        // The other cells lie beside larger channels or on floors.
        assert!(brooks * 100 > cells * 42, "{name}: {brooks} brooks begin in {cells} cells");
    }
}

#[test]
fn no_two_tributaries_of_a_level_run_side_by_side() {
    let channels = tributaries(&relief("alps"), 1024);
    let line = |channel: &Channel| {
        let (head, foot) = (channel.knots[0].at, channel.knots[channel.knots.len() - 1].at);
        LineSegment { from: foot.from(Point::default()).into(), along: head.from(foot).into() }
    };
    let mut near = 0;
    for one in &channels {
        let line_of_one = line(one);
        let long = length(line_of_one.along);
        let head = [0, 1].map(|axis| line_of_one.from[axis] + line_of_one.along[axis]);
        let longer = |other: &&Arc<Channel>| other.id.0 == one.id.0 && length(line(other).along) > long;
        for other in channels.iter().filter(longer) {
            let apart = f64::midpoint(line(other).distance(line_of_one.from), line(other).distance(head));
            near += usize::from(apart < 0.3 * long);
            assert!(apart > 0.14 * long, "{:?} runs beside {:?}", one.id, other.id);
        }
    }
    assert!(near > 3, "{near} come near each other");
}

#[test]
fn trunks_go_through_nodes_in_one_direction_and_do_not_cross() {
    // Worlds that are hard to get right: trunks easily cross right before the node where they meet, or turn by up to 94
    // degrees at their nodes.
    for seed in [104, 111, 113, 119, 123, 128] {
        let fluvial = seeded("canyon", seed);
        let side = fluvial.fields.side(0);
        let corner = |x: i64, y: i64| Point { x: x * side, y: y * side };
        let (mut nodes, mut trunks) = (0, Vec::new());
        fluvial.network.channels(0, [corner(-4, 345), corner(4, 353)], |upper| {
            trunks.push(upper.clone());
            let Some((next, true)) = upper.next else { return };
            let Some(lower) = fluvial.network.channel((0, next.0, next.1)) else { return };
            let [a, b] =
                [&upper.knots[upper.knots.len() - 2..], &lower.knots[..2]].map(|pair| pair[1].at.from(pair[0].at));
            let straight = a.dot(b) / (a.length() * b.length());
            assert!(straight > 0.9, "seed {seed}: {:?} goes on into {:?}: {straight}", upper.id, lower.id);
            nodes += 1;
        });
        assert!(nodes > 30, "{nodes} nodes");
        let pieces: Vec<_> = trunks.iter().map(|trunk| lines(&trunk.course(corner(0, 349)), 1)).collect();
        for (index, trunk) in pieces.iter().enumerate() {
            for (other, id) in pieces[..index].iter().zip(&trunks) {
                let crosses = trunk.iter().any(|piece| other.iter().any(|other| piece.crosses(other)));
                assert!(!crosses, "seed {seed}: {:?} crosses {:?}", trunks[index].id, id.id);
            }
        }
    }
}

#[test]
fn glaciers_leave_wide_floors_and_cirques() {
    let fluvial = relief("alps");
    let fields = &fluvial.fields;
    let (high_m, low_m) = (1350.0, 500.0);
    let trough = |level_m: f64| fields.most_laws().trough(fields, 3, 0.01, level_m);
    let widened_m = (trough(high_m) - trough(low_m)) * fields.metres_a_grain();
    assert!(widened_m > 100.0, "{widened_m} m");
    // In a valley that held ice, the uppermost quarter is the floor of a cirque, and the quarter below it is a step.
    let (mut cirques, mut iced) = (0, 0);
    for channel in tributaries(&fluvial, 2048) {
        let knots = &channel.knots;
        if (2..=4).contains(&channel.id.0) && knots[knots.len() - 1].level_m > high_m {
            let slope = |from: &Knot, to: &Knot| (from.level_m - to.level_m) / from.at.distance(to.at);
            let quarter = knots.len() / 4;
            iced += 1;
            cirques += i32::from(slope(&knots[0], &knots[quarter]) < 0.5 * slope(&knots[quarter], &knots[2 * quarter]));
        }
    }
    assert!(iced > 10 && cirques * 2 > iced, "{cirques} cirques in {iced} valleys");
}

/// Returns the segments of larger valleys around a tributary.
fn larger(fluvial: &Fluvial, channel: &Channel) -> Segments {
    let [low, high] = channel.bounds();
    fluvial
        .network
        .segments(
            ShownChannels::whole(channel.id.0),
            [low, high],
            low,
            valley::reach(&fluvial.fields, fluvial.fields.levels()),
            &Clock::default(),
        )
        .unwrap()
}

#[test]
fn no_lake_is_dug_into_the_floor_of_a_larger_valley() {
    let mut lakes = 0;
    for name in ["alps", "highlands"] {
        let fluvial = relief(name);
        for channel in tributaries(&fluvial, 2048) {
            if channel.lake.is_some_and(|lake| lake.0 == channel.id) {
                let around = larger(&fluvial, &channel);
                for knot in channel.knots.iter().filter(|knot| knot.pool_m > f64::NEG_INFINITY) {
                    let at = knot.at.from(around.origin);
                    assert!(!around.all.iter().any(|segment| segment.has_on_floor(at)), "{name}: {:?}", channel.id);
                }
                lakes += 1;
            }
        }
    }
    assert!(lakes > 3, "{lakes} lakes");
}

#[test]
fn dry_brooks_leave_no_beds_on_the_floors_of_larger_valleys() {
    let fluvial = seeded("alps", 5);
    let fields = &fluvial.fields;
    let (mut on_floors, mut beds) = (0, 0);
    for channel in tributaries(&fluvial, 3072) {
        let mouth = channel.knots[channel.knots.len() - 1];
        if fields.holds_water(mouth.discharge_m3s) || mouth.pool_m > f64::NEG_INFINITY {
            continue;
        }
        let around = larger(&fluvial, &channel);
        let slope = fields.laws(mouth.at).hill_slope.min(channel.laws.hill_slope) * fields.metres_a_grain();
        for knot in &channel.knots[1..channel.knots.len() - 1] {
            let at = knot.at.from(around.origin);
            let lowest = around.all.iter().min_by(|a, b| a.side_m(at, slope).total_cmp(&b.side_m(at, slope)));
            let is_level = |lowest: &&Segment| lowest.has_on_floor(at) && lowest.lean[0] < 0.1;
            let Some(lowest) = lowest.filter(is_level) else { continue };
            on_floors += 1;
            beds += i32::from(knot.level_m < lowest.side_m(at, slope) - 0.5);
        }
    }
    assert!(on_floors > 200 && beds * 100 < on_floors, "{beds} of {on_floors} knots on floors lie in beds");
}

#[test]
fn trunks_on_wide_floors_meander() {
    let fluvial = relief("plains");
    let side = fluvial.fields.side(0);
    let corner = |x: i64, y: i64| Point { x: x * side, y: y * side };
    // Windows as long as four meanders, and the ratio of the river's length to the straight distance in each.
    let mut longer = Vec::new();
    fluvial.network.channels(0, [corner(-4, -4), corner(4, 4)], |trunk| {
        let window = 4.0 * 18.0 * 7.0 * GRAINS as f64;
        let (mut from, mut way) = (trunk.knots[0].at, 0.0);
        for pair in trunk.knots.windows(2) {
            way += pair[0].at.distance(pair[1].at);
            if way > window {
                longer.push(way / from.distance(pair[1].at));
                (from, way) = (pair[1].at, 0.0);
            }
        }
    });
    longer.sort_by(f64::total_cmp);
    let median = longer[longer.len() / 2];
    assert!(longer.len() > 50 && (1.1..2.0).contains(&median), "{median} in {} windows", longer.len());
}

#[test]
fn vertices_lie_on_the_terraces_of_their_valleys() {
    let fluvial = relief("plains");
    // Beside a river on a wide floor.
    let side = fluvial.fields.side(0);
    let mut rivers = Vec::new();
    fluvial.network.channels(0, [Point { x: -2 * side, y: -2 * side }, Point { x: 2 * side, y: 2 * side }], |trunk| {
        rivers.push(trunk.knots[trunk.knots.len() / 2]);
    });
    let widest = rivers.iter().max_by(|a, b| a.area.total_cmp(&b.area)).unwrap();
    let corner = fluvial.in_world(widest.at).moved(DVec2::splat(-(80 * GRAINS) as f64));
    let known = known_around(&fluvial, Area::new(corner.x / GRAINS, corner.y / GRAINS, 160, 160));
    let (metres, mut on_terraces) = (fluvial.fields.metres_a_grain(), 0);
    for (index, (x, y)) in known.nodes.area.vertices().enumerate() {
        // Skip rounded crests.
        let rounded_m = match &known.hillsides.crest_m {
            NodeValues::Same(value) => *value,
            NodeValues::Each(values) => values[index],
        };
        if known.valleys.crest_m[index] < rounded_m {
            continue;
        }
        let segment = &known.segments.all[known.valleys.segment[index] as usize];
        let vertex = Point::at_vertex(x, y).from(known.segments.origin);
        let at = vertex + known.nodes.displacement_m(index) / metres;
        let slope = known.hillsides.slope[index] as f64 * metres;
        let mut bare = segment.clone();
        bare.terraces = 0;
        on_terraces += usize::from(segment.side_m(at, slope) > bare.side_m(at, slope) + 0.5);
        // All floors lean a little, which the tolerance allows.
        let off_m = known.valleys.height_m[index] as f64 - segment.side_m(at, slope);
        assert!((-0.02..0.2).contains(&off_m), "{off_m} m at {x}, {y}");
    }
    assert!(on_terraces > 100, "{on_terraces} vertices");
}

#[test]
fn the_coast_cuts_no_pits_into_the_land() {
    // In this world the potential has hollows hardly above that of the sea, each around a few points of the lattice.
    let fluvial = seeded("archipelago", 73002);
    for (x0, y0, side) in [(-10_824, -366, 24), (-10_713, -457, 96)] {
        let area = Area::new(x0, y0, side, side);
        let land = fluvial.land(area, &Clock::default()).unwrap();
        let inner = Area::new(x0 + 1, y0 + 1, side - 2, side - 2);
        for (x, y) in inner.vertices() {
            let around = (-1..=1).flat_map(|v| (-1..=1).map(move |u| (x + u, y + v)));
            let is_pit = around.filter(|at| *at != (x, y)).all(|(u, v)| land.heights.at(u, v) > land.heights.at(x, y));
            assert!(!is_pit, "{x}, {y} is a pit");
        }
    }
}

#[test]
fn springs_lie_on_the_ground_and_in_their_water() {
    // Beside the first spring, dry brooks are cut down to the coast; the second lies on a bed so steep that the land
    // beside it is lower.
    for (preset, seed, [x, y], side) in [
        ("archipelago", 81002, [-777 * 256 + 1438, 4 * 256 + 1505], 80),
        ("alps", 101_001, [4321 * 256 + 1430, 765 * 256 + 149], 640),
    ] {
        let fluvial = seeded(preset, seed);
        let area = Area::new(x - side / 2, y - side / 2, side as usize, side as usize);
        let land = fluvial.land(area, &Clock::default()).unwrap();
        let water = land.water.as_ref().unwrap();
        let mut springs = 0;
        for river in fluvial.rivers(&area, &Clock::default()).unwrap() {
            let place = river.points[0].place;
            let vertex = |at: fn(f64) -> f64| [0, 1].map(|axis| river.origin[axis] + at(place[axis]) as i64);
            let [x, y] = vertex(f64::floor);
            if !area.contains(&Area::new(x, y, 2, 2)) {
                continue;
            }
            springs += 1;
            let corners = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| land.heights.at(x, y));
            let (level_m, height_m) = (river.points[0].level_m, corners.into_iter().fold(f32::NEG_INFINITY, f32::max));
            assert!(level_m - height_m as f64 <= 2.0, "{preset} {:?}: {level_m} m over {height_m} m", river.id);
            let [x, y] = vertex(f64::round);
            assert_ne!(water.kind.at(x, y), WaterKind::Dry, "{preset} {:?}", river.id);
        }
        assert!(springs > 0, "{preset}");
    }
}

/// With a delta, a bed that would pass under the sea runs on above it, and ends in the same place.
#[test]
fn deltas_carry_rivers_on_above_the_sea() {
    for (name, side) in [("archipelago", 24), ("fjords", 32)] {
        let [bare, built] =
            [0.0, 0.1].map(|deltas| Fluvial::of_preset(name, 4, |settings| settings.coast.deltas = deltas));
        let (mut longer, mut shorter) = (0, 0);
        for id in (0..side * side).map(|n| (0, n % side, n / side)) {
            let [Some(bare), Some(built)] = [&bare, &built].map(|fluvial| fluvial.network.channel(id)) else {
                continue;
            };
            assert_eq!(bare.knots.last(), built.knots.last(), "{name}: {id:?} ends elsewhere");
            let falls = |pair: &[Knot]| pair[1].level_m <= pair[0].level_m || pair[0].pool_m > lake::NO_LAKE;
            assert!(built.knots.windows(2).all(falls), "{name}: {id:?} rises");
            let dry = |channel: &Channel| {
                let dry = channel.knots.windows(2).take_while(|pair| pair[1].level_m > 0.0);
                dry.map(|pair| pair[0].at.distance(pair[1].at)).sum::<f64>()
            };
            let more = (dry(&built) - dry(&bare)) / GRAINS as f64;
            longer += usize::from(more > 16.0);
            shorter += usize::from(more < -16.0);
        }
        // A few trunks join the side of another one's valley where that valley falls from its delta, and so cut in
        // deeper.
        assert!(longer >= 8 && 20 * shorter <= longer, "{name}: {longer} longer and {shorter} shorter");
    }
}

#[test]
fn bare_land_ends_without_steps_where_the_reach_of_its_channel_does() {
    // Below a ridge, a hillside without a brook falls to the coast for more than a kilometre.
    let fluvial = seeded("archipelago", 151_002);
    let area = Area::new(1_085_952, -2_843_360, 96, 72);
    let heights = fluvial.land(area, &Clock::default()).unwrap().heights;
    let inner = Area { x0: area.x0 + 1, y0: area.y0 + 1, ..area };
    for (x, y) in inner.vertices() {
        for beside in [heights.at(x - 1, y), heights.at(x, y - 1)] {
            let step_m = (heights.at(x, y) - beside).abs();
            assert!(step_m < 1.4 * fluvial.node_m() as f32, "a step of {step_m} m at {x},{y}");
        }
    }
}

#[test]
fn rills_furrow_some_hillsides_and_no_rivers() {
    let [bare, furrowed] =
        [0.05, 1.0].map(|rills| Fluvial::of_preset("alps", 4, |settings| settings.rills = Some(rills)));
    let area = Area::new(-300, 1000, 192, 192);
    let [bare, furrowed] = [&bare, &furrowed].map(|fluvial| fluvial.land(area, &Clock::default()).unwrap());
    let deeper_m = |x, y| bare.heights.at(x, y) - furrowed.heights.at(x, y);
    for (x, y) in area.vertices() {
        let is_river = bare.water.as_ref().unwrap().kind.at(x, y) == WaterKind::River;
        assert!(!is_river || deeper_m(x, y).abs() < 0.5, "a river is {} m lower at {x},{y}", deeper_m(x, y));
    }
    // On steep land, squares as wide as a rill: some contain a deep rill, and some contain none.
    let (mut steep, mut deep, mut same) = (0, 0, 0);
    for corner in (0..16 * 16).map(|n| [area.x0 + 12 * (n % 16), area.y0 + 12 * (n / 16)]) {
        let square = Area::new(corner[0], corner[1], 12, 12);
        let heights_m = || square.vertices().map(|(x, y)| bare.heights.at(x, y));
        if heights_m().fold(0.0, f32::max) - heights_m().fold(f32::INFINITY, f32::min) < 50.0 {
            continue;
        }
        let most_m = square.vertices().map(|(x, y)| deeper_m(x, y).abs()).fold(0.0, f32::max);
        steep += 1;
        deep += usize::from(most_m > 3.0);
        same += usize::from(most_m < 0.3);
    }
    assert!(deep > steep / 10 && same > steep / 20, "{deep} of {steep} have a deep rill, and {same} none");
}

#[test]
fn steep_land_is_rough_and_rivers_are_not() {
    let [smooth, rough] =
        [0.0, 1.0].map(|roughness| Fluvial::of_preset("alps", 4, |settings| settings.roughness = roughness));
    let area = Area::new(-300, 1000, 192, 192);
    let [smooth, rough] = [&smooth, &rough].map(|fluvial| fluvial.land(area, &Clock::default()).unwrap());
    let (mut steep, mut rougher) = (0, 0);
    let inside = Area { x0: area.x0, y0: area.y0, x1: area.x1 - 1, y1: area.y1 - 1 };
    for (x, y) in inside.vertices() {
        let off_m = (rough.heights.at(x, y) - smooth.heights.at(x, y)).abs();
        let step_m = (smooth.heights.at(x + 1, y) - smooth.heights.at(x, y)).abs()
            + (smooth.heights.at(x, y + 1) - smooth.heights.at(x, y)).abs();
        let is_river = smooth.water.as_ref().unwrap().kind.at(x, y) == WaterKind::River;
        assert!(!is_river || off_m < 0.5, "a river is {off_m} m off at {x},{y}");
        if step_m > 5.0 {
            steep += 1;
            rougher += usize::from(off_m > 1.0);
        }
    }
    assert!(rougher > steep / 3, "{rougher} of {steep} steep places are rougher");
}

#[test]
fn meanders_do_not_cross_themselves_in_tight_bends() {
    let fluvial = seeded("badlands", 170_047);
    let trunk = fluvial.network.channel((0, -1400, 1077)).unwrap();
    let course = trunk.course(trunk.knots[0].at);
    let lines = lines(&course, 1);
    for (index, line) in lines.iter().enumerate() {
        let crosses = lines[index + 1..].iter().skip(1).any(|other| other.crosses(line));
        assert!(!crosses, "it crosses itself after knot {index}");
    }
}

/// Queries for rivers block by block find each piece in all blocks that it touches, always in the same form.
#[test]
fn pieces_of_rivers_are_the_same_in_every_area() {
    for name in ["alps", "archipelago"] {
        let fluvial = relief(name);
        let whole = Area::new(-700, 300, 1024, 1024);
        let touches = |piece: &RiverPiece, area: &Area| {
            let span = |axis: usize| [piece.from[axis].min(piece.to[axis]), piece.from[axis].max(piece.to[axis])];
            let is_within = |[low, high]: [i64; 2], first: i64, past: i64| low < past * FIXED && high >= first * FIXED;
            is_within(span(0), area.x0, area.x1) && is_within(span(1), area.y0, area.y1)
        };
        let all = Survey::rivers(&fluvial, &whole);
        assert!(all.len() > 100, "{name}: {} pieces", all.len());
        for (column, row) in (0..16).map(|n| (n % 4, n / 4)) {
            let part = Area::new(whole.x0 + 256 * column, whole.y0 + 256 * row, 256, 256);
            let keys = |pieces: &[RiverPiece]| {
                let own = pieces.iter().filter(|piece| touches(piece, &part));
                own.map(RiverPiece::key).collect::<BTreeSet<_>>()
            };
            assert_eq!(keys(&Survey::rivers(&fluvial, &part)), keys(&all), "{name}: {part:?}");
        }
    }
}

#[test]
fn a_survey_without_dry_brooks_knows_the_land_in_the_mean() {
    use survey::Sampling;
    for (name, step) in [("alps", 16), ("plains", 16)] {
        let fluvial = relief(name);
        let (first, side) = (-64 * step, 128);
        let heights_m = |sampling| fluvial.heights_m(first, first, sampling, side, side);
        let (whole_m, mean_m) = (heights_m(Sampling::whole(step)), heights_m(Sampling { step, dry_brooks: false }));
        let off_m: Vec<f64> = whole_m.iter().zip(&mean_m).map(|(a, b)| f64::from(a - b)).collect();
        let (count, relief_m) = (off_m.len() as f64, f64::from(whole_m.iter().copied().fold(0.0, f32::max)));
        let bias_m = off_m.iter().sum::<f64>() / count;
        let cut_m = off_m.iter().map(|off_m| off_m.abs()).sum::<f64>() / count;
        assert!(cut_m > 0.002 * relief_m, "{name}: brooks cut {cut_m} m into {relief_m} m");
        assert!(bias_m.abs() < 0.02 * relief_m, "{name}: {bias_m} m too high of {relief_m} m");
    }
}

#[test]
fn the_segments_near_a_part_are_those_that_it_would_ask_for() {
    for name in ["alps", "archipelago"] {
        let fluvial = relief(name);
        let (part, detail) = (Area::new(-40, 70, 32, 32), fluvial.detail);
        let all = fluvial.segments(part.padded(400), detail, &Clock::default()).unwrap();
        let near = all.near(fluvial.warp.input(part, 1), fluvial.reach(detail));
        let names = |segments: &Segments| {
            let name = |segment: &Segment| (segments.channels[segment.channel as usize].id, segment.knot);
            segments.all.iter().map(name).collect::<BTreeSet<_>>()
        };
        assert_eq!(names(&near), names(&fluvial.segments(part, detail, &Clock::default()).unwrap()), "{name}");
        assert!(near.all.len() < all.all.len(), "{name}: {} segments", near.all.len());
    }
}
