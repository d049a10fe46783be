//! Settlements: at most one a site cell, at the best of some hashed positions.
//!
//! Far more of them are looked for than roads are built, so they are on the nodes of a coarser plan, and dry brooks are known
//! there in the mean only: what is good to live on is the floors of larger valleys.

use crate::area::Area;
use crate::fluvial::survey::{Sampling, Survey};
use crate::hash::{self, Stream};
use crate::land::WaterKind;
use crate::lines::SiteId;
use crate::memory::heap_bytes;
use crate::names;
use crate::places::plan_land::{PlanNode, Plans, Scale};
use crate::places::river_index::RiverIndex;
use crate::places::settings::PlacesSettings;
use crate::places::suitability::{WaterRange, suitability};

/// Positions that are looked at, and of those that could be lived on, how many are compared.
// A confluence is worth living at in some twentieth of a cell of 4 km: of 40 positions one is there in seven cells of eight.
// All 400 are looked at only where hardly any land is even and dry.
const POSITIONS: u64 = 400;
const COMPARED: usize = 40;

/// A settlement keeps off the edge of its cell by one part in so many of its side, and so off its neighbours. Chosen by eye.
const EDGE: i64 = 8;

/// Worth from which on land is good, and settled as often as the settings say; poorer land is as much less often. It is
/// that of level land on the floor of a valley without any water.
const GOOD: f64 = 0.5;

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

/// A settlement as roads are planned between them: what is known of it before its ground is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seat {
    pub id: SiteId,
    /// The vertex that it stands on.
    pub at: [i64; 2],
    pub class: SiteClass,
    population: u32,
}

heap_bytes!(Seat);

impl Seat {
    pub fn new(id: SiteId, at: [i64; 2], class: SiteClass, population: u32) -> Seat {
        Seat { id, at, class, population }
    }

    /// The vertex that it stands on.
    pub fn area(&self) -> Area {
        Area::new(self.at[0], self.at[1], 1, 1)
    }

    /// The height of the land there in metres, as its roads know it.
    pub fn height_m(&self, scale: &Scale, land: &dyn Survey) -> f32 {
        land.heights_m(self.at[0], self.at[1], Sampling::whole(scale.fine), 1, 1)[0]
    }

    /// The settlement, all told.
    pub fn settled(&self, seed: u64, scale: &Scale, land: &dyn Survey) -> Site {
        let &Seat { id, at, class, population } = self;
        Site { id, at, height_m: self.height_m(scale, land), class, population, name: names::settlement(seed, id) }
    }
}

/// The vertices from the first to the last that a site of a cell may stand on.
pub(super) fn positions(id: SiteId, scale: &Scale) -> Area {
    let [first, count] = settled_nodes(scale);
    let [x0, y0] = scale.vertex([id.i, id.j].map(|number| number * scale.side + first));
    let side = ((count - 1) * scale.step + 1) as usize;
    Area::new(x0, y0, side, side)
}

/// The first node of a cell that a site may stand on, along each side, and how many there are.
fn settled_nodes(scale: &Scale) -> [i64; 2] {
    [scale.side / EDGE, scale.side - 2 * (scale.side / EDGE)]
}

/// The seat of a cell's settlement, if it has one.
pub(super) fn seat(settings: &PlacesSettings, seed: u64, plans: &Plans, land: &dyn Survey, id: SiteId) -> Option<Seat> {
    // Many cells are empty however good they are; of those nothing needs to be known.
    let luck = hash::share(id.hash(seed, Stream::Settled));
    if luck >= settings.density {
        return None;
    }
    let scale = &plans.coarse.scale;
    let range = WaterRange::new(settings.site_m);
    let [edge, count] = settled_nodes(scale);
    // So far from the cell waters matter to a position that keeps off its edge.
    let around = ((range.far_m / scale.step_m()) as i64 + 2 - edge).max(2);
    let first = [id.i * scale.side, id.j * scale.side];
    let nodes = (scale.side + 2 * around + 1) as usize;
    let window = plans.coarse.window(land, &plans.rivers, first.map(|at| at - around), (nodes, nodes), |_| true);
    let rivers = RiverIndex::new(&window, scale, range.far_m);
    let positions = (0..POSITIONS).map(|number| {
        let hash = id.hash(seed, Stream::SitePosition.of(number));
        [hash & 0xFFFF_FFFF, hash >> 32].map(|bits| edge + (bits % count as u64) as i64)
    });
    let worth =
        |at: [i64; 2]| Some((suitability(settings, &range, scale, &window, &rivers, at.map(|at| at + around))?, at));
    let mut compared: Vec<(f64, [i64; 2])> = positions.filter_map(worth).take(COMPARED).collect();
    // Of equals the first is the best, since this keeps their order.
    compared.sort_by(|a, b| b.0.total_cmp(&a.0));
    let vertex = |at: PlanNode| scale.vertex([first[0] + at[0], first[1] + at[1]]);
    let (worth, at) = compared.into_iter().find(|(_, at)| is_dry(land, scale, vertex(*at), range.dry_m))?;
    if luck >= settings.density * (worth / GOOD).min(1.0) {
        return None;
    }
    // Good land and luck make a town.
    let (class, population) = class_and_people(0.5 * worth + 0.5 * hash::share(id.hash(seed, Stream::SiteClass)));
    Some(Seat::new(id, vertex(at), class, population))
}

/// The rank from which on a settlement is a town.
const TOWN: f64 = 0.78;

/// The class of a settlement of a rank, 0 to 1, and how many people live there. Chosen by eye.
fn class_and_people(rank: f64) -> (SiteClass, u32) {
    let (class, people) = match rank {
        ..0.55 => (SiteClass::Hamlet, 20.0 + 200.0 * rank),
        0.55..TOWN => (SiteClass::Village, 200.0 + 6000.0 * (rank - 0.55)),
        _ => (SiteClass::Town, 2000.0 + 80_000.0 * (rank - TOWN)),
    };
    (class, people as u32)
}

/// How lucky a cell is, by which its settlement is larger than that of others as good; none that is not lucky enough for a
/// town, or that has no settlement.
pub(super) fn town_luck(settings: &PlacesSettings, seed: u64, id: SiteId) -> Option<f64> {
    let luck = hash::share(id.hash(seed, Stream::SiteClass));
    // Land is worth 1 at most, and half of the rank is luck.
    let is_settled = hash::share(id.hash(seed, Stream::Settled)) < settings.density;
    (is_settled && 0.5 + 0.5 * luck >= TOWN).then_some(luck)
}

/// Whether there is no water within so many metres of a vertex: the plan's nodes know less of it than the land does. That is
/// asked without dry brooks, as these nodes were: what they cut into a shore matters little here.
fn is_dry(land: &dyn Survey, scale: &Scale, at: [i64; 2], dry_m: f64) -> bool {
    let reach = (dry_m / (scale.fine as f64 * scale.spacing_m)) as i64;
    let [x0, y0] = at.map(|at| at - reach * scale.fine);
    let side = (2 * reach + 1) as usize;
    land.waters(x0, y0, Sampling { step: scale.fine, dry_brooks: false }, side, side)
        .iter()
        .all(|water| *water == WaterKind::Dry)
}
