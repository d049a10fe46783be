//! Settlements: at most one in each site cell, at the best of some hashed positions.
//!
//! Far more settlements are looked for than roads are built, so they stand on the nodes of the coarse plan, which knows
//! dry brooks only by their average effect. That is enough: settlements favour the floors of larger valleys.
//!
//! To judge the numbers chosen by eye, look at the spread and the sizes of settlements, on maps of all presets with
//! places.

use crate::area::Area;
use crate::fluvial::survey::{Sampling, Survey, Surveyed};
use crate::hash::{self, Stream};
use crate::land::WaterKind;
use crate::lines::SiteId;
use crate::memory::heap_bytes;
use crate::names::Names;
use crate::places::plan_land::{PlanNode, PlanScale, Plans};
use crate::places::river_index::RiverIndex;
use crate::places::settings::PlacesSettings;
use crate::places::suitability::{WaterRange, suitability};
use crate::stop::Stopped;

/// Number of positions that are tried, and number of habitable ones among them that are compared.
// About a twentieth of a cell of 4 km is so near to a confluence that it adds to a settlement's worth: one of 40
// positions lies there in seven cells of eight. All 400 are tried only where hardly any land is even and dry.
const POSITIONS: u64 = 400;
const COMPARED: usize = 40;

/// Share of a cell's side, as 1 / `EDGE`, that settlements keep off the cell's edge, and so off their neighbours.
/// Chosen by eye.
const EDGE: i64 = 8;

/// Worth above which land is good, and settled as often as the settings say; poorer land is settled proportionally less
/// often. This is the worth of level land on a valley floor without any water.
const GOOD: f64 = 0.5;

/// Size class of a settlement.
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
    /// Returns the name in files.
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
    /// The site cell of the settlement.
    pub id: SiteId,
    /// The vertex that the settlement stands on, where its roads meet.
    pub at: [i64; 2],
    /// Height of the land at that vertex in metres.
    pub height_m: f32,
    /// Size class.
    pub class: SiteClass,
    /// Number of people who live there.
    pub population: u32,
    /// Name of the settlement.
    pub name: String,
}

heap_bytes!(Site: name);

/// A settlement as the planning of roads knows it: all but its name and the height of its ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seat {
    pub id: SiteId,
    /// The vertex that the settlement stands on.
    pub at: [i64; 2],
    pub class: SiteClass,
    population: u32,
}

heap_bytes!(Seat);

impl Seat {
    pub fn new(id: SiteId, at: [i64; 2], class: SiteClass, population: u32) -> Seat {
        Seat { id, at, class, population }
    }

    /// Returns the area of the one vertex that the settlement stands on.
    pub fn area(&self) -> Area {
        Area::new(self.at[0], self.at[1], 1, 1)
    }

    /// Returns the height of the land there in metres, sampled as for its roads.
    pub fn height_m(&self, scale: &PlanScale, land: &dyn Survey) -> f32 {
        land.heights_m(self.at[0], self.at[1], Sampling::whole(scale.fine), 1, 1)[0]
    }

    /// Completes the seat to the settlement with its height and name.
    pub fn settled(&self, names: &Names, scale: &PlanScale, land: &dyn Survey) -> Site {
        let &Seat { id, at, class, population } = self;
        Site { id, at, height_m: self.height_m(scale, land), class, population, name: names.settlement(id) }
    }
}

/// Returns the smallest area with all vertices that a site of a cell may stand on: nodes of the coarse plan, on which
/// [`seat`] chooses.
pub(super) fn positions(id: SiteId, plans: &Plans) -> Area {
    let scale = &plans.coarse.scale;
    let [first, count] = settled_nodes(scale);
    let [x0, y0] = scale.vertex([id.i, id.j].map(|number| number * scale.side + first));
    let side = ((count - 1) * scale.step + 1) as usize;
    Area::new(x0, y0, side, side)
}

/// Returns the first node of a cell, along each axis, that a site may stand on, and the number of such nodes.
fn settled_nodes(scale: &PlanScale) -> [i64; 2] {
    [scale.side / EDGE, scale.side - 2 * (scale.side / EDGE)]
}

/// Returns the seat of a cell's settlement, if the cell has one.
pub(super) fn seat(
    settings: &PlacesSettings,
    seed: u64,
    plans: &Plans,
    land: Surveyed<'_>,
    id: SiteId,
) -> Result<Option<Seat>, Stopped> {
    // Many cells are empty however good their land is. The land of those need not be known.
    let luck = hash::share(id.hash(seed, Stream::Settled));
    if luck >= settings.density {
        return Ok(None);
    }
    let scale = &plans.coarse.scale;
    let middle = [id.i, id.j].map(|cell| cell * scale.side + scale.side / 2).map(|node| node * scale.step);
    if luck >= settings.density * land.survey.habitability(middle) {
        return Ok(None);
    }
    let range = WaterRange::new(settings.site_m);
    let [edge, count] = settled_nodes(scale);
    // A margin around the cell as wide as waters matter to a position, less the distance that positions keep off the
    // edge.
    let around = ((range.far_m / scale.step_m()) as i64 + 2 - edge).max(2);
    let first = [id.i * scale.side, id.j * scale.side];
    let nodes = (scale.side + 2 * around + 1) as usize;
    let window = plans.coarse.window(land, &plans.rivers, first.map(|at| at - around), (nodes, nodes), |_| true)?;
    let rivers = RiverIndex::new(&window, scale, range.far_m);
    let positions = (0..POSITIONS).map(|number| {
        let hash = id.hash(seed, Stream::SitePosition.of(number));
        [hash & 0xFFFF_FFFF, hash >> 32].map(|bits| edge + (bits % count as u64) as i64)
    });
    let worth =
        |at: [i64; 2]| Some((suitability(settings, &range, scale, &window, &rivers, at.map(|at| at + around))?, at));
    let mut compared: Vec<(f64, [i64; 2])> = positions.filter_map(worth).take(COMPARED).collect();
    // The sort is stable, so of equal positions the first one wins.
    compared.sort_by(|a, b| b.0.total_cmp(&a.0));
    let vertex = |at: PlanNode| scale.vertex([first[0] + at[0], first[1] + at[1]]);
    let best = compared.into_iter().find(|(_, at)| is_dry(land.survey, scale, vertex(*at), range.dry_m));
    let Some((worth, at)) = best.filter(|(worth, _)| luck < settings.density * (worth / GOOD).min(1.0)) else {
        return Ok(None);
    };
    // Good land and luck make a town.
    let (class, population) = class_and_people(0.5 * worth + 0.5 * hash::share(id.hash(seed, Stream::SiteClass)));
    Ok(Some(Seat::new(id, vertex(at), class, population)))
}

/// Rank above which a settlement is a town.
const TOWN: f64 = 0.78;

/// Returns the class and the number of people of a settlement of a rank, 0 to 1. Chosen by eye.
fn class_and_people(rank: f64) -> (SiteClass, u32) {
    let (class, people) = match rank {
        ..0.55 => (SiteClass::Hamlet, 20.0 + 200.0 * rank),
        0.55..TOWN => (SiteClass::Village, 200.0 + 6000.0 * (rank - 0.55)),
        _ => (SiteClass::Town, 2000.0 + 80_000.0 * (rank - TOWN)),
    };
    (class, people as u32)
}

/// Returns the luck of a cell, 0 to 1, which makes its settlement larger than others on equal land. `None` if the cell
/// has no settlement or too little luck for a town.
pub(super) fn town_luck(settings: &PlacesSettings, seed: u64, id: SiteId) -> Option<f64> {
    let luck = hash::share(id.hash(seed, Stream::SiteClass));
    // Land is worth 1 at most, and luck is half of the rank.
    let is_settled = hash::share(id.hash(seed, Stream::Settled)) < settings.density;
    (is_settled && 0.5 + 0.5 * luck >= TOWN).then_some(luck)
}

/// True if no water lies within `dry_m` metres of a vertex. The land is queried between the nodes of the plan, which
/// miss some water, but without dry brooks, as for these nodes: what brooks cut into a shore matters little here.
fn is_dry(land: &dyn Survey, scale: &PlanScale, at: [i64; 2], dry_m: f64) -> bool {
    let reach = (dry_m / (scale.fine as f64 * scale.spacing_m)) as i64;
    let [x0, y0] = at.map(|at| at - reach * scale.fine);
    let side = (2 * reach + 1) as usize;
    land.waters(x0, y0, Sampling { step: scale.fine, dry_brooks: false }, side, side)
        .iter()
        .all(|water| *water == WaterKind::Dry)
}
