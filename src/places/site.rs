//! Settlements: at most one a site cell, at the best of some hashed positions.

use crate::area::Area;
use crate::fluvial::survey::Survey;
use crate::geometry::length;
use crate::hash::{self, Stream};
use crate::land::WaterKind;
use crate::lines::{FIXED, SiteId};
use crate::memory::heap_bytes;
use crate::names;
use crate::places::fixed::FixedSegment;
use crate::places::plan_land::{PlanLand, PlanNode, Scale, Window};
use crate::places::river_index::RiverIndex;
use crate::places::settings::PlacesSettings;

/// How large a settlement is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SiteClass {
    /// Some farms.
    Hamlet,
    /// A church and an inn.
    Village,
    /// A market and walls.
    Town,
}

impl SiteClass {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            SiteClass::Hamlet => "hamlet",
            SiteClass::Village => "village",
            SiteClass::Town => "town",
        }
    }
}

/// A settlement.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// Its cell.
    pub id: SiteId,
    /// The vertex that it stands on, where its roads meet.
    pub at: [i64; 2],
    /// Height of the land there in metres.
    pub height_m: f32,
    /// How large it is.
    pub class: SiteClass,
    /// People who live there.
    pub population: u32,
    /// Its name.
    pub name: String,
}

heap_bytes!(Site: name);

impl Site {
    /// The vertex that it stands on.
    pub(super) fn area(&self) -> Area {
        Area::new(self.at[0], self.at[1], 1, 1)
    }
}

/// The vertices from the first to the last that a site of a cell may stand on.
pub(super) fn positions(id: SiteId, scale: &Scale) -> Area {
    let [first, count] = inner(scale);
    let [x0, y0] = [id.i, id.j].map(|number| (number * scale.side + first) * scale.step);
    let side = ((count - 1) * scale.step + 1) as usize;
    Area::new(x0, y0, side, side)
}

/// The first node of a cell that a site may stand on, along each side, and how many there are.
fn inner(scale: &Scale) -> [i64; 2] {
    [scale.side / EDGE, scale.side - 2 * (scale.side / EDGE)]
}

/// Positions that are looked at, and of those that could be lived on, how many are compared.
// A confluence is worth living at in some twentieth of a cell of 4 km: of 40 positions one is there in seven cells of eight.
// All 400 are looked at only where hardly any land is even and dry.
const POSITIONS: u64 = 400;
const COMPARED: usize = 40;

/// A settlement keeps off the edge of its cell by one part in so many of its side, and so off its neighbours. Chosen by eye.
const EDGE: i64 = 8;

/// Steepness that nobody builds on; the flatter, the better.
// 14 degrees: terraces begin there. Chosen by eye.
const STEEP: f64 = 0.25;

/// Metres above the surface of the nearest river below which land is flooded: about what a river of some metres' depth rises
/// by in the flood of a century. Chosen by eye.
const FLOOD_M: f64 = 2.0;

/// Metres above the lowest land around from which on a place is not on the floor of a valley any more. Chosen by eye.
const FLOOR_M: f64 = 150.0;

/// Width in metres of a river from which on a settlement gains all that it can from its confluences and mouths. Chosen by eye:
/// brooks meet everywhere, and few people live by that.
const WIDE_M: f64 = 5.0;

/// Shares of dry land around a shore: that of a headland, which has no harbour, and that of a bay, which shelters one.
// An even coast has a little more than a half, since settlements stand back from it.
const HEADLAND: f64 = 0.35;
const BAY: f64 = 0.65;

/// What the goods of a place weigh: even ground, water beside it, where waters meet, the floor of a valley, and not to be high.
/// Chosen by eye on maps; their sum is 1.
const WEIGHTS: [f64; 5] = [0.25, 0.3, 0.2, 0.15, 0.1];

/// Worth from which on land is good, and settled as often as the settings say; poorer land is as much less often. It is
/// that of level land on the floor of a valley without any water.
const GOOD: f64 = 0.5;

/// Metres that matter about waters, chosen by eye; in small site cells they are shorter.
#[derive(Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "the unit is a part of the name")]
struct WaterRange {
    /// From the edge of a water to the middle of a settlement, at least.
    dry_m: f64,
    /// From a water within which it is as good as at the door.
    near_m: f64,
    /// From where waters meet to a settlement that lives by that.
    meet_m: f64,
    /// From a water beyond which it is none.
    far_m: f64,
}

impl WaterRange {
    fn new(site_m: f64) -> WaterRange {
        let part = (site_m / 4000.0).min(1.0);
        WaterRange { dry_m: 60.0 * part, near_m: 300.0 * part, meet_m: 500.0 * part, far_m: 1000.0 * part }
    }

    /// How good it is to have a water so far off, 0 to 1.
    fn beside(&self, water_m: f64) -> f64 {
        ((self.far_m - water_m) / (self.far_m - self.near_m)).clamp(0.0, 1.0)
    }
}

/// The settlement of a cell, if it has one.
pub(super) fn site(
    settings: &PlacesSettings,
    seed: u64,
    plan: &PlanLand,
    land: &dyn Survey,
    id: SiteId,
) -> Option<Site> {
    // Many cells are empty however good they are; of those nothing needs to be known.
    let luck = hash::share(id.hash(seed, Stream::Settled));
    if luck >= settings.density {
        return None;
    }
    let scale = &plan.scale;
    let range = WaterRange::new(settings.site_m);
    let [edge, inner] = inner(scale);
    // So far from the cell waters matter to a position that keeps off its edge.
    let around = ((range.far_m / scale.step_m()) as i64 + 2 - edge).max(2);
    let first = [id.i * scale.side, id.j * scale.side];
    let nodes = (scale.side + 2 * around + 1) as usize;
    let window = plan.window(land, first.map(|at| at - around), (nodes, nodes), |_| true);
    let rivers = RiverIndex::new(&window, scale, range.far_m);
    let positions = (0..POSITIONS).map(|number| {
        let hash = id.hash(seed, Stream::SitePosition.of(number));
        [hash & 0xFFFF_FFFF, hash >> 32].map(|bits| edge + (bits % inner as u64) as i64)
    });
    let worth = |at: [i64; 2]| Some((suitability(settings, scale, &window, &rivers, at.map(|at| at + around))?, at));
    let mut compared: Vec<(f64, [i64; 2])> = positions.filter_map(worth).take(COMPARED).collect();
    // Of equals the first is the best, since this keeps their order.
    compared.sort_by(|a, b| b.0.total_cmp(&a.0));
    let vertex = |at: PlanNode| scale.vertex([first[0] + at[0], first[1] + at[1]]);
    let (worth, at) = compared.into_iter().find(|(_, at)| is_dry(land, scale, vertex(*at), range.dry_m))?;
    if luck >= settings.density * (worth / GOOD).min(1.0) {
        return None;
    }
    // Good land and luck make a town; how many of each class there are and how many live there is chosen by eye.
    let rank = 0.5 * worth + 0.5 * hash::share(id.hash(seed, Stream::SiteClass));
    let (class, people) = match rank {
        ..0.55 => (SiteClass::Hamlet, 20.0 + 200.0 * rank),
        0.55..0.78 => (SiteClass::Village, 200.0 + 6000.0 * (rank - 0.55)),
        _ => (SiteClass::Town, 2000.0 + 80_000.0 * (rank - 0.78)),
    };
    let vertex = vertex(at);
    Some(Site {
        id,
        at: vertex,
        // The plan's nodes may know the land less finely.
        height_m: land.heights_m(vertex[0], vertex[1], 1, 1, 1)[0],
        class,
        population: people as u32,
        name: names::settlement(seed, id),
    })
}

/// How good a node is to live on, 0 to 1, or `None` where nobody could.
fn suitability(
    settings: &PlacesSettings,
    scale: &Scale,
    window: &Window,
    rivers: &RiverIndex,
    at: PlanNode,
) -> Option<f64> {
    let height_m = window.height_m(at);
    if height_m > settings.max_height_m {
        return None;
    }
    // That of the place and its four neighbours, so that a settlement of some hundred metres finds room.
    let around = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)].map(|(dx, dy)| [at[0] + dx, at[1] + dy]);
    let sum: f64 = around.iter().map(|node| length(window.gradient(*node, scale.step_m()))).sum();
    let steepness = sum / around.len() as f64;
    if steepness > STEEP {
        return None;
    }
    let range = WaterRange::new(settings.site_m);
    let near = Surroundings::new(window, rivers, scale, at, &range);
    if near.shore_m.min(near.river_m) < range.dry_m.max(scale.step_m()) || height_m < near.flood_m {
        return None;
    }
    let share = |value: f64| value.clamp(0.0, 1.0);
    let sheltered = share((near.dry - HEADLAND) / (BAY - HEADLAND));
    let goods = [
        1.0 - steepness / STEEP,
        range.beside(near.river_m).max(range.beside(near.shore_m) * sheltered),
        share(near.meet_m / WIDE_M),
        share(1.0 - (height_m - near.lowest_m) / FLOOR_M),
        // High land is worth less from half of the highest on.
        share(2.0 - 2.0 * height_m / settings.max_height_m.max(1.0)),
    ];
    Some(goods.iter().zip(WEIGHTS).map(|(good, weight)| good * weight).sum())
}

/// What lies around a position.
struct Surroundings {
    /// Metres to the nearest lake or sea, and to the edge of the nearest river, as far as they matter.
    shore_m: f64,
    river_m: f64,
    /// Height in metres that the nearest river rises to in a flood.
    flood_m: f64,
    /// Width in metres of the river that a confluence adds, or that flows into or out of a lake or the sea; 0 where there is
    /// none.
    meet_m: f64,
    /// Share of the nodes around that are dry, and the lowest of those.
    dry: f64,
    lowest_m: f64,
}

impl Surroundings {
    fn new(window: &Window, rivers: &RiverIndex, scale: &Scale, at: PlanNode, range: &WaterRange) -> Surroundings {
        let sample_m = scale.step_m();
        let far = (range.far_m / sample_m) as i64;
        // By nodes, since lakes and the sea are no lines; rivers, which may pass between nodes, by their pieces.
        let (mut shore2, mut lowest_m, mut dry, mut all) = ((far * far) as f64, f64::INFINITY, 0, 0);
        for (dx, dy) in (-far..=far).flat_map(|dy| (-far..=far).map(move |dx| (dx, dy))) {
            let (square, node) = (dx * dx + dy * dy, [at[0] + dx, at[1] + dy]);
            if square > far * far || !window.holds(node) {
                continue;
            }
            all += 1;
            match window.water(node) {
                WaterKind::Dry => {
                    dry += 1;
                    lowest_m = f64::min(lowest_m, window.height_m(node));
                }
                WaterKind::River => {}
                WaterKind::Lake | WaterKind::Sea => shore2 = shore2.min(square as f64),
            }
        }
        let place = scale.fixed(at);
        let fixed_m = scale.spacing_m / FIXED as f64;
        let mut near = Vec::new();
        let (mut river_m, mut flood_m) = (range.far_m, f64::NEG_INFINITY);
        // Those that come within the circle of a meeting, by the pieces that cross it: one that flows by does so twice.
        let mut arms_m = Vec::new();
        for piece in rivers.around(place, &mut near) {
            let edge_m = piece.middle.distance2(place).sqrt() * fixed_m - piece.width_m / 2.0;
            if edge_m < river_m {
                (river_m, flood_m) = (edge_m, piece.surface_m(place) + FLOOD_M);
            }
            let is_inside = [piece.middle.from, piece.middle.to]
                .map(|end| FixedSegment { from: place, to: end }.length_m(scale.spacing_m) < range.meet_m);
            if is_inside[0] != is_inside[1] {
                arms_m.push(piece.width_m);
            }
        }
        arms_m.sort_by(|a, b| b.total_cmp(a));
        let shore_m = shore2.sqrt() * sample_m;
        let meeting = if shore_m < range.meet_m { 0 } else { 2 };
        let meet_m = arms_m.get(meeting).copied().unwrap_or(0.0);
        Surroundings { shore_m, river_m, flood_m, meet_m, dry: f64::from(dry) / f64::from(all), lowest_m }
    }
}

/// Whether there is no water within so many metres of a vertex: the plan's nodes know less of it than the land does.
fn is_dry(land: &dyn Survey, scale: &Scale, at: [i64; 2], dry_m: f64) -> bool {
    let reach = (dry_m / (scale.fine as f64 * scale.spacing_m)) as i64;
    let [x0, y0] = at.map(|at| at - reach * scale.fine);
    let side = (2 * reach + 1) as usize;
    land.waters(x0, y0, scale.fine, side, side).iter().all(|water| *water == WaterKind::Dry)
}
