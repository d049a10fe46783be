//! Settlements, their names, and the roads between them: pure functions of the seed, the settings and lattice ids.
//!
//! ```text
//! Survey --> plan_land.rs heights, waters and rivers on the nodes of two plans, cached by blocks: fine nodes are about
//!             |           64 m apart, coarse nodes twice as far
//!             |
//!          site.rs     coarse: the best of 40 hashed positions of each site cell, by suitability.rs;
//!             |        crate::names gives each settlement its name
//!             |
//!          graph.rs    pairs of neighbours: the Gabriel graph, with edges of 2 site cells at most
//!             |
//!          corridor.rs coarse: where the road between two neighbours may go, and estimated costs from there to its end
//!             |
//!          route.rs    fine: the route of least cost within the corridor
//!             |          move_cost.rs, turn_cost.rs  its cost; route_land.rs  the land that the search sees
//!          build.rs    a line along that route:
//!             |          alignment.rs  rounded corners; spans.rs  bridges and fords; levels.rs, profile.rs  heights;
//!             |          bridging.rs   viaducts over dips and tunnels through ridges
//!          junction.rs the parts of the road: it is cut where it would lie on one that ranks above it
//! ```
//!
//! Nothing depends on the area that is asked for, on earlier queries, on threads or on the caches. A road is a function
//! of its two sites and of the land in the ellipse around them, of which its corridor is a part. Whether there is a
//! road depends on the sites within two cells. The parts that are left of a road depend on the uncut roads that rank
//! above it and whose ellipses it enters.

mod alignment;
mod bridging;
mod buckets;
mod build;
mod corridor;
mod ellipse;
mod fixed;
mod graph;
mod junction;
mod levels;
mod move_cost;
mod moves;
mod plan_land;
mod profile;
mod river_index;
mod route;
mod route_land;
mod spans;
mod suitability;
mod turn_cost;

pub mod settings;
pub mod site;

#[cfg(test)]
mod tests;

use std::cmp::Reverse;
use std::sync::Arc;

use crate::area::Area;
use crate::error::Error;
use crate::fluvial::survey::Surveyed;
use crate::lines::{Line, LineId, Lines, SiteId};
use crate::memory::{Memory, Remembers};
use crate::names::Names;
use crate::names::cultures::Cultures;
use crate::places::build::RoadBuilder;
use crate::places::corridor::Corridor;
use crate::places::ellipse::Ellipse;
use crate::places::plan_land::{PlanScale, Plans};
use crate::places::settings::PlacesSettings;
use crate::places::site::{Seat, Site, SiteClass};
use crate::recipe::fault::KeyPath;
use crate::stop::Stopped;

/// Number of the luckiest cells of a square in which its first town is looked for.
const CHIEFS: usize = 3;

/// Settlements and roads of a world. Results are cached, which changes nothing but time.
///
/// A value belongs to one land: all queries must pass the same one.
#[derive(Debug)]
pub struct Places {
    settings: PlacesSettings,
    seed: u64,
    names: Names,
    plans: Plans,
    seats: Memory<SiteId, Option<Seat>>,
    sites: Memory<SiteId, Option<Arc<Site>>>,
    edges: Memory<(SiteId, SiteId), bool>,
    corridors: Memory<(SiteId, SiteId), Option<Corridor>>,
    /// Roads before others cut them. `parts` are what is left of them.
    roads: Memory<(SiteId, SiteId), Option<Arc<Line>>>,
    parts: Memory<(SiteId, SiteId), Lines>,
}

impl Places {
    /// Creates the places of a world with `spacing_m` metres between vertices, and with peoples if it has a geography.
    ///
    /// # Errors
    /// When a value of the settings is out of its range.
    pub fn new(
        settings: &PlacesSettings,
        spacing_m: f64,
        seed: u64,
        cultures: Option<Arc<Cultures>>,
    ) -> Result<Places, Error> {
        settings.check(&KeyPath::default(), spacing_m)?;
        let plans = Plans::new(PlanScale::new(settings.site_m, spacing_m));
        Ok(Places {
            settings: settings.clone(),
            seed,
            names: Names::new(seed, site_side(&plans), cultures),
            plans,
            // Room for about ten thousand cells and pairs, and for about three hundred roads of 500 points of 48 bytes:
            // more than one tile needs.
            seats: Memory::new(2 << 20),
            sites: Memory::new(1 << 20),
            edges: Memory::new(1 << 20),
            corridors: Memory::new(2 << 20),
            roads: Memory::new(8 << 20),
            parts: Memory::new(4 << 20),
        })
    }

    /// Returns the caches.
    pub(crate) fn memories(&self) -> Vec<&dyn Remembers> {
        let own: [&dyn Remembers; 6] =
            [&self.seats, &self.sites, &self.edges, &self.corridors, &self.roads, &self.parts];
        let cultures = self.names.cultures().map(|cultures| cultures.memories()).unwrap_or_default();
        [&self.plans.memories()[..], &own, &cultures].concat()
    }

    /// Returns the names of the world's features.
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// Side of a site cell in vertices.
    pub fn site_side(&self) -> i64 {
        site_side(&self.plans)
    }

    /// Returns the site cell that a vertex lies in. Names of things there are looked up by it.
    pub fn cell(&self, at: [i64; 2]) -> SiteId {
        let [i, j] = at.map(|at| at.div_euclid(self.site_side()));
        SiteId { i, j }
    }

    /// Largest distance in vertices from the midpoint of two neighbours to any vertex that their road may have an
    /// effect on.
    pub fn reach(&self) -> i64 {
        let PlanScale { step, spacing_m, .. } = self.plans.coarse.scale;
        let effect = (self.settings.effect_m() / spacing_m) as i64;
        self.widest_radius() * step + effect + 2 + junction::reach(&self.settings, spacing_m)
    }

    /// Returns the largest radius, in coarse nodes, of the ellipse of any road.
    fn widest_radius(&self) -> i64 {
        Ellipse::radius((graph::CELLS * self.plans.coarse.scale.side) as f64) as i64 + 1
    }
}

/// Returns the side of a site cell in vertices.
fn site_side(plans: &Plans) -> i64 {
    plans.fine.scale.side * plans.fine.scale.step
}

#[expect(clippy::missing_errors_doc, reason = "the only error of what takes a clock is that this stops it")]
impl Places {
    /// Returns all settlements that stand on a vertex of `area`, sorted by id.
    pub fn sites(&self, land: Surveyed<'_>, area: &Area) -> Result<Vec<Arc<Site>>, Stopped> {
        let mut sites: Vec<Arc<Site>> = Vec::new();
        for id in self.cells(area, 0) {
            if self.seat(land, id)?.is_some_and(|seat| area.contains(&seat.area())) {
                sites.extend(self.site(land, id)?);
            }
        }
        sites.sort_by_key(|site| site.id);
        Ok(sites)
    }

    /// Returns the first town of a square of `side` x `side` site cells, given by its column and row. Only the luckiest
    /// cells of the square are looked at, and the luckiest that has a town wins.
    ///
    /// Only the land around these cells is computed, so even a map of a continent can have towns.
    pub fn chief(&self, land: Surveyed<'_>, [x, y]: [i64; 2], side: i64) -> Result<Option<Arc<Site>>, Stopped> {
        let cells = (y * side..(y + 1) * side).flat_map(|j| (x * side..(x + 1) * side).map(move |i| SiteId { i, j }));
        let luck = |id| site::town_luck(&self.settings, self.seed, id).map(|luck| (luck, id));
        let mut lucky: Vec<(f64, SiteId)> = cells.filter_map(luck).collect();
        lucky.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, id) in lucky.into_iter().take(CHIEFS) {
            if self.seat(land, id)?.is_some_and(|seat| seat.class == SiteClass::Town) {
                return self.site(land, id);
            }
        }
        Ok(None)
    }

    /// Returns all roads whose effect may touch a vertex of `area`, whole, sorted by id.
    pub fn roads(&self, land: Surveyed<'_>, area: &Area) -> Result<Lines, Stopped> {
        if area.is_empty() {
            return Ok(Vec::new());
        }
        // The parts of a road may reach a little beyond its bounds.
        let wide = area.padded(junction::reach(&self.settings, self.plans.fine.scale.spacing_m) as usize);
        let mut roads = Vec::new();
        for (a, b) in self.edges(land, &[wide])? {
            let Some(road) = self.road(land, &a, &b, &[wide])?.filter(|road| road.concerns(&wide)) else { continue };
            let parts = self.parts.try_get((a.id, b.id), || self.parts(land, &road))?;
            roads.extend(parts.iter().filter(|part| part.concerns(area)).cloned());
        }
        roads.sort_by_key(|road| road.id);
        Ok(roads)
    }

    /// Returns the parts of a road that are left once the roads that rank above it have cut it.
    fn parts(&self, land: Surveyed<'_>, road: &Line) -> Result<Lines, Stopped> {
        let rank = junction::rank(road);
        let may_rank_above = |(a, b): &(Seat, Seat)| {
            let id = LineId::Road { from: a.id, to: b.id, part: 0 };
            (Reverse(build::class_between(a, b)), id) < rank
        };
        let near = junction::areas(road, &self.plans.fine.scale, &self.settings);
        let mut above = Lines::new();
        for (a, b) in self.edges(land, &near)?.into_iter().filter(may_rank_above) {
            above.extend(self.road(land, &a, &b, &near)?);
        }
        above.retain(|other| junction::rank(other) < rank && near.iter().any(|area| other.concerns(area)));
        above.sort_by_key(|other| junction::rank(other));
        let parts = junction::parts(road, &above, &self.plans.fine.scale, &self.settings);
        Ok(parts.into_iter().map(Arc::new).collect())
    }

    /// Returns the pairs of neighbours whose uncut road may have an effect on a vertex of any of the areas, each with
    /// the smaller id first.
    fn edges(&self, land: Surveyed<'_>, areas: &[Area]) -> Result<Vec<(Seat, Seat)>, Stopped> {
        let Some(hull) = areas.iter().copied().reduce(|hull, area| hull.hull(&area)) else { return Ok(Vec::new()) };
        // No place in the ellipse of a road is more cells than this away from either of its sites.
        let side = self.plans.coarse.scale.side;
        let cells = self.widest_radius() / side + 1 + graph::CELLS;
        let mut edges = Vec::new();
        for first in self.cells(&hull, cells) {
            for second in self.cells_around(first, graph::CELLS).filter(|second| first < *second) {
                // Most pairs of cells are too far apart wherever their sites stand. This test is cheaper than finding
                // the sites.
                let [a, b] = [first, second].map(|id| self.positions(id));
                if !self.may_touch([a, b], areas) {
                    continue;
                }
                let nearer = if nearest2(a, hull) <= nearest2(b, hull) { [first, second] } else { [second, first] };
                let Some(near) = self.seat(land, nearer[0])? else { continue };
                let there = self.positions(nearer[1]);
                if !self.may_touch([near.area(), there], areas) || self.is_separated(land, &near, there, hull)? {
                    continue;
                }
                let Some(far) = self.seat(land, nearer[1])? else { continue };
                let (a, b) = if near.id < far.id { (near, far) } else { (far, near) };
                if graph::within_cap(&a, &b, self.site_side())
                    && self.may_touch([a.area(), b.area()], areas)
                    && self.are_neighbours(land, &a, &b)?
                {
                    edges.push((a, b));
                }
            }
        }
        Ok(edges)
    }

    /// True if a third site, in a cell nearer to `hull` than `cell`, separates `site` from any site in `cell`. That
    /// holds for most cells that are far off, so that their sites need not be found.
    fn is_separated(&self, land: Surveyed<'_>, site: &Seat, cell: Area, hull: Area) -> Result<bool, Stopped> {
        let is_nearer = |id: &SiteId| {
            let own = self.positions(*id);
            own != cell && nearest2(own, hull) <= nearest2(cell, hull)
        };
        let between = self.cells_around(site.id, 1).filter(is_nearer);
        self.any_seat(land, between, |third| graph::separates_all(third, site, cell))
    }

    /// Returns the settlement of a site cell, if it has one.
    pub fn site(&self, land: Surveyed<'_>, id: SiteId) -> Result<Option<Arc<Site>>, Stopped> {
        let settled = |seat: Seat| Arc::new(seat.settled(&self.names, &self.plans.fine.scale, land.survey));
        let site = self.sites.try_get(id, || Ok(self.seat(land, id)?.map(settled)))?;
        Ok(site.as_ref().clone())
    }

    /// Returns the smallest area with all vertices that the site of a cell may stand on.
    fn positions(&self, id: SiteId) -> Area {
        site::positions(id, &self.plans)
    }

    fn seat(&self, land: Surveyed<'_>, id: SiteId) -> Result<Option<Seat>, Stopped> {
        Ok(*self.seats.try_get(id, || site::seat(&self.settings, self.seed, &self.plans, land, id))?)
    }

    /// Returns the vertices of all nodes of the coarse plan through which the road between two settlements may go, row
    /// by row: for whoever wants to see why a road runs where it does. None if there is no such settlement or no route.
    pub fn corridor(&self, land: Surveyed<'_>, [from, to]: [SiteId; 2]) -> Result<Vec<[i64; 2]>, Stopped> {
        let seats = self.seat(land, from.min(to))?.zip(self.seat(land, from.max(to))?);
        let corridor = seats.map(|(a, b)| self.builder(land).corridor(&a, &b)).transpose()?.flatten();
        let nodes = corridor.iter().flat_map(Corridor::nodes);
        Ok(nodes.map(|node| self.plans.coarse.scale.vertex(node)).collect())
    }

    /// Returns the uncut road between two neighbours, if there is a route and if the road may touch any of the areas.
    fn road(&self, land: Surveyed<'_>, a: &Seat, b: &Seat, areas: &[Area]) -> Result<Option<Arc<Line>>, Stopped> {
        let builder = self.builder(land);
        let corridor = self.corridors.try_get((a.id, b.id), || builder.corridor(a, b))?;
        let Some(corridor) = corridor.as_ref() else { return Ok(None) };
        let PlanScale { step, spacing_m, .. } = self.plans.fine.scale;
        // The bounds of a road are a rectangle with a margin of a few vertices.
        let beside = (self.settings.effect_m() / spacing_m) as i64 / step + 2;
        let may_touch = |area: &Area| {
            let [low, high] = [[area.x0, area.y0], [area.x1 - 1, area.y1 - 1]].map(|at| self.plans.fine.scale.node(at));
            corridor.may_touch(low, high.map(|at| at + 1), beside)
        };
        if !areas.iter().any(may_touch) {
            return Ok(None);
        }
        let road = self.roads.try_get((a.id, b.id), || Ok(builder.road(a, b, corridor)?.map(Arc::new)))?;
        Ok(road.as_ref().clone())
    }

    fn builder<'a>(&'a self, land: Surveyed<'a>) -> RoadBuilder<'a> {
        RoadBuilder { settings: &self.settings, seed: self.seed, plans: &self.plans, land }
    }

    /// True if the ellipse of a road from a vertex of `a` to one of `b`, widened by the road's effect, may touch any of
    /// the areas.
    fn may_touch(&self, [a, b]: [Area; 2], areas: &[Area]) -> bool {
        let PlanScale { step, spacing_m, .. } = self.plans.coarse.scale;
        let cap = (graph::CELLS * self.site_side()) as f64;
        let apart = [nearest2(a, b), furthest2(a, b)].map(|square| (square as f64).sqrt());
        if apart[0] > cap {
            return false;
        }
        // The bounds of a road are a rectangle with a margin of a few vertices.
        let reach = self.settings.effect_m() / spacing_m + 8.0;
        let axis = Ellipse::axis(apart[1].min(cap) / step as f64) * step as f64;
        // The two distances may be measured to different vertices of the area, so their sum may be too small but never
        // too large: no road is missed, though some are looked at in vain. The reach counts four times: for both
        // distances, each to a corner of the road's bounds.
        areas.iter().any(|area| way_by(*area, [a, b]) <= axis + 4.0 * reach)
    }

    /// True if two sites within the cap are neighbours in the graph.
    fn are_neighbours(&self, land: Surveyed<'_>, a: &Seat, b: &Seat) -> Result<bool, Stopped> {
        let are_neighbours = self.edges.try_get((a.id.min(b.id), a.id.max(b.id)), || {
            // The circle over the edge lies within half an edge of its middle.
            let middle = [0, 1].map(|axis| (a.at[axis] + b.at[axis]).div_euclid(2));
            let half = (a.at[0] - b.at[0]).abs().max((a.at[1] - b.at[1]).abs()) * 3 / 4 + 2;
            let circle = Area::new(middle[0], middle[1], 1, 1).padded(half as usize);
            Ok(!self.any_seat(land, self.cells(&circle, 0), |third| graph::separates(third, a, b))?)
        })?;
        Ok(*are_neighbours)
    }

    /// Tells whether a condition holds for the seat of any of some cells.
    fn any_seat(
        &self,
        land: Surveyed<'_>,
        cells: impl Iterator<Item = SiteId>,
        holds: impl Fn(&Seat) -> bool,
    ) -> Result<bool, Stopped> {
        for id in cells {
            if self.seat(land, id)?.as_ref().is_some_and(&holds) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Returns the site cells that hold a vertex of `area`, and `more` cells around them, row by row.
    fn cells(&self, area: &Area, more: i64) -> impl Iterator<Item = SiteId> + use<> {
        let side = self.site_side();
        let span = |from: i64, to: i64| from.div_euclid(side) - more..(to - 1).div_euclid(side) + 1 + more;
        let columns = span(area.x0, area.x1);
        span(area.y0, area.y1).flat_map(move |j| columns.clone().map(move |i| SiteId { i, j }))
    }

    /// Returns the site cells at most `more` columns and rows from one, row by row.
    fn cells_around(&self, id: SiteId, more: i64) -> impl Iterator<Item = SiteId> + use<> {
        self.cells(&Area::new(id.i * self.site_side(), id.j * self.site_side(), 1, 1), more)
    }
}

/// Returns a lower bound, in vertices, of the way from one of two areas by `area` to the other.
fn way_by(area: Area, ends: [Area; 2]) -> f64 {
    ends.map(|end| (nearest2(end, area) as f64).sqrt()).iter().sum()
}

/// Returns the square of the least distance, in vertices, between a vertex of one area and one of another; 0 where they
/// overlap.
fn nearest2(a: Area, b: Area) -> i128 {
    graph::length2([(b.x0 - a.x1 + 1).max(a.x0 - b.x1 + 1).max(0), (b.y0 - a.y1 + 1).max(a.y0 - b.y1 + 1).max(0)])
}

/// Returns the square of the greatest distance, in vertices, between a vertex of one area and one of another.
fn furthest2(a: Area, b: Area) -> i128 {
    graph::length2([(b.x1 - 1 - a.x0).max(a.x1 - 1 - b.x0), (b.y1 - 1 - a.y0).max(a.y1 - 1 - b.y0)])
}
