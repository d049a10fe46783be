//! Settlements, their names, and the roads between them: each a pure function of the seed, the settings and lattice ids.
//!
//! ```text
//! Survey --> plan_land.rs heights, waters and rivers on the nodes of the plan, about 64 m apart; remembered by blocks
//!             |
//!          site.rs     the best of 12 hashed positions of each site cell      crate::names  what it is called
//!             |
//!          graph.rs    which sites are neighbours: the Gabriel graph, 2 site cells at most
//!             |
//!          route.rs    the way of least cost between two neighbours, within an ellipse
//!             |
//!          alignment.rs  rounded, build.rs  carried over rivers, profile.rs  given heights,
//!                      bridging.rs   and carried over dips and bored through ridges: a line
//!             |
//!          junction.rs   cut where it would lie on a road that ranks above it
//! ```
//!
//! Nothing depends on the area that is asked for, on what was asked before, on threads or on what is remembered. A road
//! is a function of its two sites and of the land in the ellipse around them; whether it is there at all, of the sites
//! within two cells; and what is left of it, of those above it whose ellipses it enters, as they are before they are cut.

mod alignment;
mod build;
mod graph;
mod junction;
mod plan_land;
mod profile;
mod route;
mod bridging;

pub mod settings;
pub mod site;

#[cfg(test)]
mod tests;

use std::cmp::Reverse;
use std::sync::Arc;

use crate::area::Area;
use crate::error::Error;
use crate::fluvial::survey::Survey;
use crate::lines::{Line, LineId, Lines, SiteId};
use crate::memory::{Memory, Usage};
use crate::places::build::Builder;
use crate::places::plan_land::{PlanLand, Scale};
use crate::places::route::Domain;
use crate::places::settings::PlacesSettings;
use crate::places::site::Site;
use crate::recipe::fault::KeyPath;

/// Settlements and roads of a world. What has been found is remembered for a while, which changes nothing but time.
///
/// One land belongs to it: all questions must be asked with the same.
#[derive(Debug)]
pub struct Places {
    settings: PlacesSettings,
    seed: u64,
    plan: PlanLand,
    sites: Memory<SiteId, Option<Arc<Site>>>,
    edges: Memory<(SiteId, SiteId), bool>,
    /// Roads as they are before others cut them, and what is left of them.
    roads: Memory<(SiteId, SiteId), Option<Arc<Line>>>,
    parts: Memory<(SiteId, SiteId), Lines>,
}

impl Places {
    /// The places of a world with `spacing_m` metres between vertices.
    ///
    /// # Errors
    /// When a value of the settings is out of its range.
    pub fn new(settings: &PlacesSettings, spacing_m: f64, seed: u64) -> Result<Places, Error> {
        settings.check(&KeyPath::default(), spacing_m)?;
        Ok(Places {
            settings: settings.clone(),
            seed,
            plan: PlanLand::new(Scale::new(settings.site_m, spacing_m)),
            sites: Memory::new(2 << 20),
            edges: Memory::new(1 << 20),
            roads: Memory::new(8 << 20),
            parts: Memory::new(4 << 20),
        })
    }

    /// How full its memories are.
    pub(crate) fn usages(&self) -> Vec<Usage> {
        [self.plan.usages(), vec![self.sites.usage(), self.edges.usage(), self.roads.usage(), self.parts.usage()]].concat()
    }

    /// Side of a site cell in vertices.
    pub fn site_side(&self) -> i64 {
        self.plan.scale.side * self.plan.scale.step
    }

    /// The site cell that a vertex lies in, which names of things there are asked for with.
    pub fn cell(&self, at: [i64; 2]) -> SiteId {
        let [i, j] = at.map(|at| at.div_euclid(self.site_side()));
        SiteId { i, j }
    }

    /// Vertices from a site to the furthest vertex that a road of it may have an effect on, at most.
    pub fn reach(&self) -> i64 {
        self.road_reach() + junction::reach(&self.settings, self.plan.scale.spacing_m)
    }

    /// Vertices from a site to the furthest that a road of it may have an effect on before it is cut, at most.
    fn road_reach(&self) -> i64 {
        let Scale { side, step, spacing_m, .. } = self.plan.scale;
        let widest_m = self.settings.width_m.iter().fold(0.0_f64, |most, width_m| most.max(*width_m));
        let nodes = Domain::radius((graph::CELLS * side) as f64) as i64 + 1;
        nodes * step + ((widest_m / 2.0 + self.settings.bank_m) / spacing_m) as i64 + 2
    }

    /// All settlements that stand on a vertex of `area`, sorted by id.
    pub fn sites(&self, land: &dyn Survey, area: &Area) -> Vec<Arc<Site>> {
        let inside = |site: &Arc<Site>| area.contains(&Area::new(site.at[0], site.at[1], 1, 1));
        let mut sites: Vec<Arc<Site>> = self.sites_of_cells(land, self.cells(area, 0)).filter(inside).collect();
        sites.sort_by_key(|site| site.id);
        sites
    }

    /// All roads whose effect may touch a vertex of `area`, whole, sorted by id.
    pub fn roads(&self, land: &dyn Survey, area: &Area) -> Lines {
        if area.is_empty() {
            return Vec::new();
        }
        // What is left of a road may lie a little beside it.
        let wide = area.padded(junction::reach(&self.settings, self.plan.scale.spacing_m) as usize);
        let mut roads = Vec::new();
        for (a, b) in self.edges(land, &wide) {
            let Some(road) = self.road(land, &a, &b).filter(|road| road.concerns(&wide)) else { continue };
            let parts = self.parts.get((a.id, b.id), || self.parts(land, &road));
            roads.extend(parts.iter().filter(|part| part.concerns(area)).cloned());
        }
        roads.sort_by_key(|road| road.id);
        roads
    }

    /// What is left of a road beside those that rank above it.
    fn parts(&self, land: &dyn Survey, road: &Line) -> Lines {
        let rank = junction::rank(road);
        let input = junction::input(road, &self.plan.scale);
        let may_rank_above = |(a, b): &(Arc<Site>, Arc<Site>)| {
            let id = LineId::Road { from: a.id, to: b.id, part: 0 };
            (Reverse(build::class_between(a, b)), id) < rank
        };
        let edges = self.edges(land, &input).into_iter().filter(may_rank_above);
        let mut above: Lines = edges.filter_map(|(a, b)| self.road(land, &a, &b)).collect();
        above.retain(|other| junction::rank(other) < rank && other.concerns(&input));
        above.sort_by_key(|other| junction::rank(other));
        junction::parts(road, &above, &self.plan.scale, &self.settings).into_iter().map(Arc::new).collect()
    }

    /// The neighbours whose road may have an effect on a vertex of `area` before it is cut, the smaller first.
    fn edges(&self, land: &dyn Survey, area: &Area) -> Vec<(Arc<Site>, Arc<Site>)> {
        // Of each edge at least one end lies within reach.
        let near = area.padded(self.road_reach() as usize);
        let first: Vec<Arc<Site>> = self.sites_of_cells(land, self.cells(&near, 0)).collect();
        let mut edges = Vec::new();
        for a in &first {
            for b in self.sites_of_cells(land, self.cells_around(a.id, graph::CELLS)) {
                let known = |site: &Site| first.binary_search_by_key(&key(site.id), |other| key(other.id)).is_ok();
                // An edge is looked at once: from its smaller end, or from the other one if the smaller is not here.
                if (a.id < b.id || a.id > b.id && !known(&b))
                    && self.may_touch(a, &b, area)
                    && self.are_neighbours(land, a, &b)
                {
                    edges.push(if a.id < b.id { (Arc::clone(a), b) } else { (b, Arc::clone(a)) });
                }
            }
        }
        edges
    }

    /// The settlement of a site cell, if it has one.
    pub fn site(&self, land: &dyn Survey, id: SiteId) -> Option<Arc<Site>> {
        let site = self.sites.get(id, || site::site(&self.settings, self.seed, &self.plan, land, id).map(Arc::new));
        site.as_ref().clone()
    }

    /// The road between two neighbours before others cut it, if there is a way.
    fn road(&self, land: &dyn Survey, a: &Site, b: &Site) -> Option<Arc<Line>> {
        let road = self.roads.get((a.id, b.id), || {
            let builder = Builder { settings: &self.settings, seed: self.seed, plan: &self.plan, land };
            builder.road(a, b).map(Arc::new)
        });
        road.as_ref().clone()
    }

    /// Whether the ellipse of a road, and its effect, may touch an area.
    fn may_touch(&self, a: &Site, b: &Site, area: &Area) -> bool {
        let Scale { side, step, spacing_m, .. } = self.plan.scale;
        if !graph::within_cap(a, b, side * step) {
            return false;
        }
        // From a's place, so that numbers stay small.
        let nodes = |at: i64, axis: usize| (at - a.at[axis]) as f64 / step as f64;
        let domain = Domain::new([0, 0], [0, 1].map(|axis| (b.at[axis] - a.at[axis]) / step));
        let widest_m = self.settings.width_m.iter().fold(0.0_f64, |most, width_m| most.max(*width_m));
        // The bounds of a road are a rectangle with a few vertices to spare.
        let reach = (widest_m / 2.0 + self.settings.bank_m) / (step as f64 * spacing_m) + 8.0 / step as f64;
        domain.may_touch([nodes(area.x0, 0), nodes(area.y0, 1)], [nodes(area.x1, 0), nodes(area.y1, 1)], 2.0 * reach)
    }

    /// Whether two sites within the cap are neighbours in the graph.
    fn are_neighbours(&self, land: &dyn Survey, a: &Site, b: &Site) -> bool {
        *self.edges.get((a.id.min(b.id), a.id.max(b.id)), || {
            // The circle over the edge lies within half an edge of its middle.
            let middle = [0, 1].map(|axis| (a.at[axis] + b.at[axis]).div_euclid(2));
            let half = (a.at[0] - b.at[0]).abs().max((a.at[1] - b.at[1]).abs()) * 3 / 4 + 2;
            let circle = Area::new(middle[0], middle[1], 1, 1).padded(half as usize);
            !self.sites_of_cells(land, self.cells(&circle, 0)).any(|third| graph::parts(&third, a, b))
        })
    }

    fn sites_of_cells(
        &self,
        land: &dyn Survey,
        cells: impl Iterator<Item = SiteId>,
    ) -> impl Iterator<Item = Arc<Site>> {
        cells.filter_map(move |id| self.site(land, id))
    }

    /// The site cells that hold a vertex of `area`, and `more` around them, row by row.
    fn cells(&self, area: &Area, more: i64) -> impl Iterator<Item = SiteId> + use<> {
        let side = self.site_side();
        let span = |from: i64, to: i64| from.div_euclid(side) - more..(to - 1).div_euclid(side) + 1 + more;
        let columns = span(area.x0, area.x1);
        span(area.y0, area.y1).flat_map(move |j| columns.clone().map(move |i| SiteId { i, j }))
    }

    /// The site cells up to `more` from one, row by row.
    fn cells_around(&self, id: SiteId, more: i64) -> impl Iterator<Item = SiteId> + use<> {
        self.cells(&Area::new(id.i * self.site_side(), id.j * self.site_side(), 1, 1), more)
    }
}

/// Ids row by row, as cells are listed.
fn key(id: SiteId) -> (i64, i64) {
    (id.j, id.i)
}
