//! Settlements: at most one a site cell, at the best of some hashed positions.

use crate::area::Area;
use crate::fluvial::survey::Survey;
use crate::hash::{self, Stream};
use crate::land::WaterKind;
use crate::lines::{FIXED, SiteId};
use crate::memory::heap_bytes;
use crate::names;
use crate::places::plan_land::{PlanLand, RiverIndex, Scale, Window};
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
const POSITIONS: u64 = 400;
const COMPARED: usize = 12;

/// A settlement keeps off the edge of its cell by one part in so many of its side, and so off its neighbours.
const EDGE: i64 = 8;

/// Steepness that nobody builds on; the flatter, the better.
const STEEP: f64 = 0.25;

/// Metres that matter about waters; in small site cells they are shorter.
#[derive(Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "the unit is a part of the name")]
struct WaterRange {
    /// From the edge of a water to the middle of a settlement, at least.
    dry_m: f64,
    /// From a water within which it is as good as at the door.
    near_m: f64,
    /// From a water beyond which it is none.
    far_m: f64,
}

impl WaterRange {
    fn new(site_m: f64) -> WaterRange {
        let part = (site_m / 4000.0).min(1.0);
        WaterRange { dry_m: 60.0 * part, near_m: 300.0 * part, far_m: 1000.0 * part }
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
    // The best of all; of equals the first.
    let positions = (0..POSITIONS).map(|number| {
        let hash = id.hash(seed, Stream::SitePosition.of(number));
        [hash & 0xFFFF_FFFF, hash >> 32].map(|bits| edge + (bits % inner as u64) as i64)
    });
    let worth = |at: [i64; 2]| Some((suitability(settings, plan, &window, &rivers, at.map(|at| at + around))?, at));
    let (worth, at) =
        positions.filter_map(worth).take(COMPARED).reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    if luck >= settings.density * (0.3 + worth).min(1.0) {
        return None;
    }
    // Good land and luck make a town.
    let rank = 0.5 * worth + 0.5 * hash::share(id.hash(seed, Stream::SiteClass));
    let (class, people) = match rank {
        ..0.55 => (SiteClass::Hamlet, 20.0 + 200.0 * rank),
        0.55..0.78 => (SiteClass::Village, 200.0 + 6000.0 * (rank - 0.55)),
        _ => (SiteClass::Town, 2000.0 + 80_000.0 * (rank - 0.78)),
    };
    let vertex = [(first[0] + at[0]) * scale.step, (first[1] + at[1]) * scale.step];
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
    plan: &PlanLand,
    window: &Window,
    rivers: &RiverIndex,
    at: [i64; 2],
) -> Option<f64> {
    let scale = &plan.scale;
    let height_m = window.height_m(at[0], at[1]);
    if height_m > settings.max_height_m {
        return None;
    }
    // That of the place and its four neighbours, so that a settlement of some hundred metres finds room.
    let steepness = |col: i64, row: i64| {
        let [east, south] = window.gradient(col, row, scale.step_m());
        (east * east + south * south).sqrt()
    };
    let around = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)];
    let sum: f64 = around.iter().map(|(dx, dy)| steepness(at[0] + dx, at[1] + dy)).sum();
    let steepness = sum / around.len() as f64;
    if steepness > STEEP {
        return None;
    }
    let range = WaterRange::new(settings.site_m);
    let water_m = water_m(plan, window, rivers, at, range.far_m);
    if water_m < range.dry_m.max(scale.step_m()) {
        return None;
    }
    let flat = 1.0 - steepness / STEEP;
    let near = ((range.far_m - water_m) / (range.far_m - range.near_m)).clamp(0.0, 1.0);
    // High land is worth less from half of the highest on.
    let low = (2.0 - 2.0 * height_m / settings.max_height_m.max(1.0)).clamp(0.0, 1.0);
    Some(0.45 * flat + 0.4 * near + 0.15 * low)
}

/// Metres to the edge of the nearest water, `far_m` at most.
fn water_m(plan: &PlanLand, window: &Window, rivers: &RiverIndex, at: [i64; 2], far_m: f64) -> f64 {
    let scale = &plan.scale;
    let sample_m = scale.step_m();
    // By nodes, since lakes and the sea are no lines; rivers, which may pass between nodes, by their pieces.
    let far = (far_m / sample_m) as i64;
    let mut nearest2 = (far * far) as f64;
    for (dx, dy) in (-far..=far).flat_map(|dy| (-far..=far).map(move |dx| (dx, dy))) {
        let distance2 = (dx * dx + dy * dy) as f64;
        if distance2 < nearest2 && window.water(at[0] + dx, at[1] + dy) != WaterKind::Dry {
            nearest2 = distance2;
        }
    }
    let place = at.map(|at| at * scale.step * FIXED);
    let fixed_m = scale.spacing_m / FIXED as f64;
    let mut near = Vec::new();
    rivers.near(place, place, &mut near);
    let to_river = |piece: &u32| {
        let piece = &rivers.pieces[*piece as usize];
        piece.distance2(place).sqrt() * fixed_m - piece.width_m / 2.0
    };
    near.iter().map(to_river).fold(nearest2.sqrt() * sample_m, f64::min)
}
