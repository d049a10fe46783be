//! Building a road: a route is found, rounded and checked, carried over the waters and given its heights. Bridges then
//! carry it where it lies too high above the land, tunnels where it lies too deep under it.
//!
//! To judge the numbers chosen by eye, look at the bends of the roads of `alps`.

use std::collections::BTreeSet;

use crate::area::Area;
use crate::fluvial::survey::Surveyed;
use crate::land::WaterKind;
use crate::lines::{self, Bed, FIXED, Line, LineEnd, LineId, LineKind, LinePoint, RoadClass, Structure};
use crate::places::alignment::Alignment;
use crate::places::bridging::carry;
use crate::places::corridor::{CoarseGround, Corridor, Outlook};
use crate::places::ellipse::{Ellipse, apart};
use crate::places::levels::Levelled;
use crate::places::move_cost::MoveConditions;
use crate::places::plan_land::{PlanNode, Plans, Window};
use crate::places::route::route;
use crate::places::route_land::RouteLand;
use crate::places::settings::{PlacesSettings, Standard};
use crate::places::site::{Seat, SiteClass};
use crate::places::spans::spans;
use crate::places::way_by;
use crate::stop::Stopped;

/// Softness of the rounded corners, chosen by eye. The next value is tried if the rounder line would run into water.
const SOFTNESS: [f64; 3] = [1.0, 0.5, 0.0];

/// Number of routes that are tried, chosen by eye. After each one, the legs that failed are closed to the next.
const TRIES: usize = 8;

/// The inputs from which all roads of a world are built.
pub(super) struct RoadBuilder<'a> {
    pub settings: &'a PlacesSettings,
    pub seed: u64,
    pub plans: &'a Plans,
    pub land: Surveyed<'a>,
}

impl RoadBuilder<'_> {
    /// Finds the corridor of the road from one site to another. `None` if no road is possible.
    pub fn corridor(&self, a: &Seat, b: &Seat) -> Result<Option<Corridor>, Stopped> {
        let ends = [a, b].map(|site| self.plans.coarse.scale.node(site.at));
        let window = self.coarse_window(ends)?;
        let standard = self.settings.standard(class_between(a, b));
        let ground = CoarseGround::new(&window, &self.plans.coarse.scale, &standard, self.seed);
        Corridor::new(&ground, ends.map(|end| window.inner(end)), self.land.clock)
    }

    /// Builds the road from one site to another along their corridor, if there is a route: where the land has none for
    /// the class that the two sites ask for, the road is of a lower class.
    pub fn road(&self, a: &Seat, b: &Seat, corridor: &Corridor) -> Result<Option<Line>, Stopped> {
        let scale = &self.plans.fine.scale;
        let coarse = self.coarse_window([a, b].map(|site| self.plans.coarse.scale.node(site.at)))?;
        let [first, past] = corridor.fine_bounds();
        let [cols, rows] = [0, 1].map(|axis| (past[axis] - first[axis]) as usize);
        let is_looked_at = |nodes: Area| corridor.looks_at([nodes.x0, nodes.y0], [nodes.x1 - 1, nodes.y1 - 1]);
        let window = self.plans.fine.window(self.land, &self.plans.rivers, first, (cols, rows), is_looked_at)?;
        // The same land for all classes, so it is made once.
        let land = RouteLand::new(window, corridor, scale, self.seed);
        let asked = class_between(a, b);
        let classes = [RoadClass::Highway, RoadClass::Road, RoadClass::Track];
        for class in classes.into_iter().filter(|class| *class <= asked) {
            let standard = self.settings.standard(class);
            let ground = CoarseGround::new(&coarse, &self.plans.coarse.scale, &standard, self.seed);
            let end = coarse.inner(self.plans.coarse.scale.node(b.at));
            let outlook = Outlook::new(&ground, corridor, end, self.land.clock)?;
            if let Some(road) = self.of_class(class, &land, &outlook, [a, b])? {
                return Ok(Some(road));
            }
        }
        Ok(None)
    }

    /// Returns the coarse land under all routes between two coarse nodes.
    fn coarse_window(&self, ends: [PlanNode; 2]) -> Result<Window, Stopped> {
        let [a, b] = ends;
        // A function of the two nodes alone, so the road is the same whatever area is asked for. Two nodes more than
        // the ellipse, since its radius and its middle are rounded down.
        let radius = Ellipse::radius(apart(a, b)) as i64 + 2;
        let middle = [0, 1].map(|axis| (a[axis] + b[axis]).div_euclid(2));
        let side = (2 * radius + 1) as usize;
        // A margin as for the radius: a search looks at the ellipse and at the nodes next to it.
        let axis = Ellipse::axis(apart(a, b)) + 4.0;
        let ends = ends.map(|[x, y]| Area::new(x, y, 1, 1));
        let is_looked_at = |nodes: Area| way_by(nodes, ends) <= axis;
        let at = middle.map(|at| at - radius);
        self.plans.coarse.window(self.land, &self.plans.rivers, at, (side, side), is_looked_at)
    }

    /// Builds the road of a class from one site to another, if there is a route for it.
    fn of_class(
        &self,
        class: RoadClass,
        land: &RouteLand,
        outlook: &Outlook,
        sites: [&Seat; 2],
    ) -> Result<Option<Line>, Stopped> {
        let standard = self.settings.standard(class);
        let ends = sites.map(|site| land.window.inner(land.scale.node(site.at)));
        // Each class starts without closed legs: a narrow road may go where a wide one does not.
        let mut closed = BTreeSet::new();
        for _ in 0..TRIES {
            let conditions = MoveConditions { land, standard: &standard, closed: &closed };
            let Some(route) = route(&conditions, outlook, ends, self.land.clock)? else { break };
            let mut culprits = BTreeSet::new();
            for softness in SOFTNESS {
                let line = Alignment::along(&route, &land.scale, standard.radius_m, softness);
                match self.on_line(&line, land, &standard, sites) {
                    Ok(points) => return Ok(Some(self.finished(class, &standard, points, sites))),
                    // Only the failures of the last softness count: that line keeps closest to the legs, which are then
                    // closed.
                    Err(points) => {
                        self.land.clock.check()?;
                        culprits = points.iter().map(|point| line.leg(*point, &route)).collect();
                    }
                }
            }
            closed.extend(culprits.iter().map(|leg| (route.nodes[*leg], route.nodes[leg + 1])));
        }
        Ok(None)
    }

    /// Returns the points of a road along a line and the structures that carry them. The error lists the points of the
    /// line where no road can be built; none if the clock stops the work.
    fn on_line(
        &self,
        line: &Alignment,
        land: &RouteLand,
        standard: &Standard,
        [a, b]: [&Seat; 2],
    ) -> Result<(Vec<LinePoint>, Vec<Structure>), Vec<usize>> {
        let origin = land.scale.vertex(land.window.at);
        // Cheap checks first: crossings need no land. Then the waters: a line that runs into water needs no heights.
        if let Some([first, second]) = line.crosses_itself() {
            return Err(vec![first, first + 1, second, second + 1]);
        }
        if !land.has_open_water() {
            // Most lines that fail run in a river, and the river index tells that without a query of the land.
            spans(line, &land.rivers, &vec![WaterKind::Dry; line.points.len()], standard)?;
        }
        let waters = line.waters(self.land, origin);
        if self.land.clock.check().is_err() {
            return Err(Vec::new());
        }
        let is_drowned = |point: &usize| waters[*point].is_open() && !line.bridged[*point];
        let drowned: Vec<usize> = (0..waters.len()).filter(is_drowned).collect();
        if !drowned.is_empty() {
            return Err(drowned);
        }
        let mut spans = spans(line, &land.rivers, &waters, standard)?;
        let heights_m = line.heights_m(self.land, origin);
        if self.land.clock.check().is_err() {
            return Err(Vec::new());
        }
        let ends_m = [a, b].map(|seat| f64::from(seat.height_m(&self.plans.fine.scale, self.land.survey)));
        let levelled = Levelled { line, heights_m: &heights_m, rivers: &land.rivers, standard, ends_m };
        let Some(levels_m) = levelled.levels_m(&mut spans, self.settings.clearance_m) else {
            return Err(spans.iter().flat_map(|span| [span.first, span.last]).collect());
        };
        let mut carriers = vec![None; levels_m.len()];
        for span in &spans {
            carriers[span.first..=span.last].fill(Some(span.kind));
        }
        // After the spans over water: points that already have a carrier keep it.
        carry(&mut carriers, &levels_m, &heights_m);
        let half_width_m = standard.width_m / 2.0;
        let point = |(at, level_m): (&[i64; 2], &f64)| {
            // Rounded to `f32`, the precision of heights in tiles.
            let level_m = f64::from(*level_m as f32);
            // Relative to the site, since other windows have other origins; in 1/256 vertex, so the quotient is exact.
            let place = [0, 1].map(|axis| (at[axis] + (origin[axis] - a.at[axis]) * FIXED) as f64 / FIXED as f64);
            LinePoint { place, level_m, floor_m: level_m, half_width_m, discharge_m3s: 0.0, basin_m2: 0.0 }
        };
        Ok((line.points.iter().zip(&levels_m).map(point).collect(), Structure::of_points(&carriers)))
    }

    /// Assembles the road of a class from its points and structures.
    fn finished(
        &self,
        class: RoadClass,
        standard: &Standard,
        (points, structures): (Vec<LinePoint>, Vec<Structure>),
        [a, b]: [&Seat; 2],
    ) -> Line {
        let (spacing_m, bank_m) = (self.plans.fine.scale.spacing_m, self.settings.bank_m);
        let id = LineId::Road { from: a.id, to: b.id, part: 0 };
        Line {
            id,
            kind: LineKind::Road,
            class: Some(class),
            name: None,
            course: id,
            origin: a.at,
            // The bounds reach as far as cuts and fills do: nothing looks for a line outside its bounds.
            bounds: lines::bounds(a.at, &points, (standard.width_m / 2.0 + bank_m) / spacing_m),
            points,
            structures,
            end: LineEnd::Site(b.id),
            bed: Bed::Built { bank_m },
            spacing_m,
        }
    }
}

/// Returns the class of the road that two settlements ask for.
pub(super) fn class_between(a: &Seat, b: &Seat) -> RoadClass {
    match (a.class.min(b.class), a.class.max(b.class)) {
        (SiteClass::Village | SiteClass::Town, SiteClass::Town) => RoadClass::Highway,
        (SiteClass::Village, SiteClass::Village) | (SiteClass::Hamlet, SiteClass::Town) => RoadClass::Road,
        _ => RoadClass::Track,
    }
}
