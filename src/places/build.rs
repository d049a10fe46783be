//! A road is built: a way is found, rounded, checked, carried over the waters, given its heights and carried over what
//! these are too high above, or bored through what they are too deep under.

use std::collections::BTreeSet;

use crate::area::Area;
use crate::fluvial::survey::Survey;
use crate::geometry::length;
use crate::land::WaterKind;
use crate::lines::{
    self, Bed, FIXED, Line, LineClass, LineEnd, LineId, LineKind, LinePoint, RoadClass, Structure, StructureKind,
};
use crate::places::alignment::Alignment;
use crate::places::bridging::{carry, wished_m};
use crate::places::distance2;
use crate::places::plan_land::{PlanLand, RiverIndex, Window};
use crate::places::profile::Demands;
use crate::places::route::{Domain, PlanNode, PlanNodes, Route, Search, shore_m};
use crate::places::settings::{PlacesSettings, Standard};
use crate::places::site::{Site, SiteClass};

/// How far corners are rounded, chosen by eye; the next is tried where a rounder line would run into water.
const SOFTNESS: [f64; 3] = [1.0, 0.5, 0.0];

/// Ways that are tried, chosen by eye; after each, the legs that did not do are closed to the next.
const TRIES: usize = 8;

/// Vertices from a river's middle that are wet in rasters, however narrow it is: of 32,159 wet vertices of rivers narrower than
/// 1.2 vertices in a bake of `alps`, 996 in 1000 lie as near, and 985 within 1.4.
const DRAWN_VERTICES: f64 = 1.8;

/// Metres from a narrow river that a road keeps because of it at most: on a coarse lattice valleys would be closed to roads.
/// Chosen by eye.
const DRAWN_MOST_M: f64 = 40.0;

/// Metres from a river's edge to where a bridge rests. Chosen by eye.
const REST_M: f64 = 1.0;

/// How many times longer than straight across a crossing is at most: what is longer goes along the river, in its bed.
// A way crosses at 30 degrees at the flattest, which makes it twice as long; its rounded line may turn there.
const SLANTING: f64 = 2.5;

/// Metres from the water's surface down to a ford, at least, and more that a ford may lie lower. Chosen by eye: half a metre is
/// about the hub of a cart's wheel.
const FORD_M: [f64; 2] = [0.2, 0.3];

/// The least clearance of a bridge in metres where its full one would be too steep to climb to. Chosen by eye.
const LEAST_CLEARANCE_M: f64 = 0.3;

/// What a road is built with.
pub(super) struct Builder<'a> {
    pub settings: &'a PlacesSettings,
    pub seed: u64,
    pub plan: &'a PlanLand,
    pub land: &'a dyn Survey,
}

/// Points of a line that are carried over water.
#[derive(Clone, Copy, Debug)]
struct Span {
    first: usize,
    last: usize,
    kind: StructureKind,
    /// Height of the water's surface; of lakes and the sea it is not known before the heights of their shores are.
    level_m: Option<f64>,
}

impl Builder<'_> {
    /// The road from one site to another, if there is a way: where the land has none for the class that the two ask for,
    /// one of a lower class.
    pub fn road(&self, a: &Site, b: &Site) -> Option<Line> {
        let scale = &self.plan.scale;
        let [from, to] = [a.at, b.at].map(|at| at.map(|at| at.div_euclid(scale.step)));
        // The same for all classes, so they are found once.
        let window = self.window(from, to);
        let rivers = RiverIndex::new(&window, scale, shore_m(scale).max(REST_M) + 1.0);
        let nodes = PlanNodes::new(&window, &rivers, scale, self.seed);
        let asked = class_between(a, b);
        let classes = [RoadClass::Highway, RoadClass::Road, RoadClass::Track];
        classes
            .into_iter()
            .filter(|class| *class <= asked)
            .find_map(|class| self.of_class(class, &window, &rivers, &nodes, (a, b)))
    }

    fn of_class(
        &self,
        class: RoadClass,
        window: &Window,
        rivers: &RiverIndex,
        nodes: &PlanNodes,
        (a, b): (&Site, &Site),
    ) -> Option<Line> {
        let scale = &self.plan.scale;
        let standard = self.settings.standard(class);
        let [from, to] = [a.at, b.at].map(|at| at.map(|at| at.div_euclid(scale.step)));
        let inside = |node: PlanNode| [node[0] - window.at[0], node[1] - window.at[1]];
        // Anew for each class: where a wide road does not go, a narrower one may.
        let mut closed = BTreeSet::new();
        for _ in 0..TRIES {
            let search = Search { window, nodes, rivers, scale, standard, closed: &closed };
            let route = search.route(inside(from), inside(to))?;
            let mut culprits = BTreeSet::new();
            for softness in SOFTNESS {
                let line = Alignment::along(&route, scale, standard.radius_m, softness);
                match self.on_line(&line, &route, window, rivers, &standard, (a, b)) {
                    Ok(points) => return Some(self.finished(class, &standard, points, [a, b])),
                    // Those of the last count: its line keeps closest to the legs that are closed.
                    Err(legs) => culprits = legs,
                }
            }
            closed.extend(culprits.iter().map(|leg| (route.nodes[*leg], route.nodes[leg + 1])));
        }
        None
    }

    /// The land under all ways between two nodes.
    fn window(&self, a: PlanNode, b: PlanNode) -> Window {
        let apart = length([0, 1].map(|axis| (b[axis] - a[axis]) as f64));
        // Two more than the ellipse, for what rounding takes from its radius and its middle.
        // A function of the two nodes alone, so the road is the same whatever area asks for it.
        let radius = Domain::radius(apart) as i64 + 2;
        let middle = [0, 1].map(|axis| (a[axis] + b[axis]).div_euclid(2));
        let side = (2 * radius + 1) as usize;
        // As for the radius: a search looks at the ellipse and at the nodes next to it.
        let axis = Domain::axis(apart) + 4.0;
        let ends = [a, b].map(|node| Area::new(node[0], node[1], 1, 1));
        let way = |nodes: Area| ends.map(|end| (distance2(end, nodes) as f64).sqrt()).iter().sum::<f64>();
        self.plan.window(self.land, middle.map(|at| at - radius), (side, side), |nodes| way(nodes) <= axis)
    }

    /// The points of a road along a line, or the legs of the way that do not do.
    fn on_line(
        &self,
        line: &Alignment,
        route: &Route,
        window: &Window,
        rivers: &RiverIndex,
        standard: &Standard,
        (a, b): (&Site, &Site),
    ) -> Result<(Vec<LinePoint>, Vec<Structure>), BTreeSet<usize>> {
        let scale = &self.plan.scale;
        let origin = window.at.map(|at| at * scale.step);
        let window_at = origin.map(|at| at * FIXED);
        let legs =
            |points: &[usize]| points.iter().map(|point| line.leg(*point, route, scale)).collect::<BTreeSet<_>>();
        // What needs no land first, then the waters: a line that drowns needs no heights.
        if let Some([first, second]) = line.crosses_itself() {
            return Err(legs(&[first, first + 1, second, second + 1]));
        }
        let waters = line.waters(self.land, origin, scale);
        let is_drowned = |point: &usize| waters[*point].is_open() && !line.bridged[*point];
        let drowned: Vec<usize> = (0..waters.len()).filter(is_drowned).collect();
        if !drowned.is_empty() {
            return Err(legs(&drowned));
        }
        let mut spans = self.spans(line, rivers, &waters, standard).map_err(|points| legs(&points))?;
        let surfaces_m = surfaces_m(line, rivers);
        let heights_m = line.heights_m(self.land, origin, scale);
        for span in &mut spans {
            let (from_m, to_m) = (heights_m[span.first], heights_m[span.last]);
            // Near the sea a river's line may be told to lie far above the land that the sea has worn down.
            span.level_m = Some(span.level_m.map_or(from_m.min(to_m), |level_m| level_m.min(from_m.max(to_m))));
        }
        let ends_m = [a.height_m as f64, b.height_m as f64];
        let Some(levels_m) = self.levels_m(line, [&heights_m, &surfaces_m], &mut spans, ends_m, standard) else {
            return Err(spans.iter().flat_map(|span| legs(&[span.first, span.last])).collect());
        };
        let mut carriers = vec![None; levels_m.len()];
        for span in &spans {
            carriers[span.first..=span.last].fill(Some(span.kind));
        }
        // After the waters: it leaves alone what they have carried already.
        carry(&mut carriers, &levels_m, &heights_m);
        let half_width_m = standard.width_m / 2.0;
        let point = |(at, level_m): (&[i64; 2], &f64)| {
            // As precise as heights are.
            let level_m = f64::from(*level_m as f32);
            // From the site, since others do not know the window; in 1/256, so the quotient is exact.
            let origin = a.at.map(|at| at * FIXED);
            let place = [0, 1].map(|axis| (at[axis] + window_at[axis] - origin[axis]) as f64 / FIXED as f64);
            LinePoint { place, level_m, floor_m: level_m, half_width_m, discharge_m3s: 0.0 }
        };
        Ok((line.points.iter().zip(&levels_m).map(point).collect(), Structure::of_points(&carriers)))
    }

    /// Where a line is carried over water, from its start on, or the points that run along a river.
    fn spans(
        &self,
        line: &Alignment,
        rivers: &RiverIndex,
        waters: &[WaterKind],
        standard: &Standard,
    ) -> Result<Vec<Span>, Vec<usize>> {
        let points = &line.points;
        let (count, last) = (points.len(), points.len() - 1);
        let fixed_m = self.plan.scale.spacing_m / FIXED as f64;
        // For each point whether it is in a river, or over it; for each piece what it crosses.
        // Where rivers meet or widen they are drawn wider than their lines are.
        let mut inside: Vec<bool> = waters.iter().map(|water| *water == WaterKind::River).collect();
        let mut over: Vec<bool> = waters.iter().map(|water| *water != WaterKind::Dry).collect();
        let is_open = |points: std::ops::RangeInclusive<usize>| waters[points].iter().any(|water| water.is_open());
        let mut crossed: Vec<Option<(f64, f64)>> = vec![None; last];
        let mut near = Vec::new();
        for index in 0..last {
            let (from, to) = (points[index], points[index + 1]);
            rivers.near(from, to, &mut near);
            for piece in near.iter().map(|piece| &rivers.pieces[*piece as usize]) {
                for (point, at) in [(index, from), (index + 1, to)] {
                    let edge_m = piece.distance2(at).sqrt() * fixed_m - self.drawn_m(piece.width_m) / 2.0;
                    inside[point] |= edge_m <= 0.0;
                    over[point] |= edge_m <= REST_M;
                }
                if piece.is_crossed(from, to) {
                    let (width_m, level_m) = crossed[index].unwrap_or((0.0, f64::NEG_INFINITY));
                    crossed[index] = Some((width_m.max(piece.width_m), level_m.max(piece.surface_m(from))));
                }
            }
        }
        // A crossed piece marks both of its points, so it never lies between two runs.
        let marked: Vec<bool> = (0..count)
            .map(|point| {
                over[point] || point > 0 && crossed[point - 1].is_some() || point < last && crossed[point].is_some()
            })
            .collect();
        let mut spans: Vec<Span> = Vec::new();
        let mut first = 0;
        for run in marked.chunk_by(|a, b| a == b) {
            let (from, to) = (first, first + run.len() - 1);
            first = to + 1;
            if !run[0] {
                continue;
            }
            let under: Vec<(f64, f64)> = (from..to).filter_map(|piece| crossed[piece]).collect();
            if under.is_empty() && !is_open(from..=to) {
                // Nothing is crossed, so it runs along a river: it may be near, but not in it.
                if inside[from..=to].contains(&true) {
                    return Err((from..=to).collect());
                }
                continue;
            }
            // A bridge rests on land: one point further where its last is still over the water.
            let (from, to) = (from.saturating_sub(usize::from(over[from])), (to + usize::from(over[to])).min(last));
            // Its own pieces, and one to each side; what lies over a lake is as long as the way allows.
            let across_m: f64 = under.iter().map(|(width_m, _)| self.drawn_m(*width_m) + 2.0 * REST_M).sum();
            let open_m = if is_open(from..=to) { f64::INFINITY } else { 0.0 };
            let inner = line.lengths_m.get(from + 1..to.saturating_sub(1)).unwrap_or_default();
            let is_along = inner.iter().sum::<f64>() > SLANTING * across_m + open_m;
            // A road's ends lie at the heights of their sites, which are not on bridges.
            if from == 0 || to == last || is_along {
                return Err((from..=to).collect());
            }
            let width_m = under.iter().map(|(width_m, _)| *width_m).fold(0.0, f64::max);
            let is_ford = !under.is_empty() && width_m <= standard.ford_m && !is_open(from..=to);
            // One bridge over several rivers has to clear the highest.
            let level_m = under.iter().map(|(_, level_m)| *level_m).reduce(f64::max);
            let kind = if is_ford { StructureKind::Ford } else { StructureKind::Bridge };
            match spans.last_mut() {
                // Two that touch are one.
                Some(before) if before.last + 1 >= from => {
                    before.last = to;
                    // A bridge does for a ford, but no ford for a bridge.
                    before.kind = if before.kind == kind { kind } else { StructureKind::Bridge };
                    before.level_m = before.level_m.into_iter().chain(level_m).reduce(f64::max);
                }
                _ => spans.push(Span { first: from, last: to, kind, level_m }),
            }
        }
        Ok(spans)
    }

    /// Metres from bank to bank of a river in rasters, where a narrow one is wider than it is.
    fn drawn_m(&self, width_m: f64) -> f64 {
        width_m.max(2.0 * (DRAWN_VERTICES * self.plan.scale.spacing_m).min(DRAWN_MOST_M))
    }

    /// The heights of a road along a line. A ford that is too low to be reached becomes a bridge, and so does one in a dip
    /// that is gone over.
    fn levels_m(
        &self,
        line: &Alignment,
        [heights_m, surfaces_m]: [&[f64]; 2],
        spans: &mut [Span],
        ends_m: [f64; 2],
        standard: &Standard,
    ) -> Option<Vec<f64>> {
        let grade = standard.profile_grade();
        let clearances_m = [self.settings.clearance_m, LEAST_CLEARANCE_M.min(self.settings.clearance_m)];
        let wished_m = wished_m(heights_m, &line.lengths_m, grade, standard.bridge_m);
        // Where the road goes straight over a dip, the ford at its bottom lies beneath it.
        for span in spans.iter_mut() {
            if (span.first..=span.last).any(|point| wished_m[point] > heights_m[point]) {
                span.kind = StructureKind::Bridge;
            }
        }
        let land = Profiled { line, heights_m, surfaces_m, wished_m: &wished_m, ends_m };
        // The least is given up first: air under bridges before fords, and fords before the way.
        for clearance_m in clearances_m {
            if let Some(levels_m) = land.demands(spans, clearance_m).profile(grade) {
                return Some(levels_m);
            }
        }
        for span in spans.iter_mut() {
            span.kind = StructureKind::Bridge;
        }
        land.demands(spans, clearances_m[1]).profile(grade)
    }

    fn finished(
        &self,
        class: RoadClass,
        standard: &Standard,
        (points, structures): (Vec<LinePoint>, Vec<Structure>),
        [a, b]: [&Site; 2],
    ) -> Line {
        let (spacing_m, bank_m) = (self.plan.scale.spacing_m, self.settings.bank_m);
        let id = LineId::Road { from: a.id, to: b.id, part: 0 };
        Line {
            id,
            kind: LineKind::Road,
            class: LineClass::Road(class),
            name: None,
            course: id,
            origin: a.at,
            // As far as cuts and fills go: nothing looks for a line outside its bounds.
            bounds: lines::bounds(a.at, &points, (standard.width_m / 2.0 + bank_m) / spacing_m),
            points,
            structures,
            end: LineEnd::Site(b.id),
            bed: Bed::Built { bank_m },
            spacing_m,
        }
    }
}

/// The height of the surface of the river nearest to each point; infinite where none is near.
fn surfaces_m(line: &Alignment, rivers: &RiverIndex) -> Vec<f64> {
    let mut near = Vec::new();
    let mut surface_m = |at: &[i64; 2]| {
        rivers.near(*at, *at, &mut near);
        let pieces = near.iter().map(|piece| &rivers.pieces[*piece as usize]);
        let nearest = pieces.min_by(|a, b| a.distance2(*at).total_cmp(&b.distance2(*at)));
        nearest.map_or(f64::INFINITY, |piece| piece.surface_m(*at))
    };
    line.points.iter().map(&mut surface_m).collect()
}

/// The class of the road that two settlements ask for.
pub(super) fn class_between(a: &Site, b: &Site) -> RoadClass {
    match (a.class.min(b.class), a.class.max(b.class)) {
        (SiteClass::Village | SiteClass::Town, SiteClass::Town) => RoadClass::Highway,
        (SiteClass::Village, SiteClass::Village) | (SiteClass::Hamlet, SiteClass::Town) => RoadClass::Road,
        _ => RoadClass::Track,
    }
}

/// A line that is given heights.
struct Profiled<'a> {
    line: &'a Alignment,
    /// Of the land under its points.
    heights_m: &'a [f64],
    /// Of the river nearest to each point.
    surfaces_m: &'a [f64],
    /// That it should have where nothing else is asked.
    wished_m: &'a [f64],
    /// That it must have at its ends.
    ends_m: [f64; 2],
}

impl Profiled<'_> {
    /// What the heights must keep to, with so many metres of air under bridges.
    fn demands(&self, spans: &[Span], clearance_m: f64) -> Demands {
        let (heights_m, count) = (self.heights_m, self.heights_m.len());
        let mut demands = Demands {
            lengths_m: self.line.lengths_m.clone(),
            land_m: heights_m.to_vec(),
            wished_m: self.wished_m.to_vec(),
            least_m: vec![f64::NEG_INFINITY; count],
            most_m: vec![f64::INFINITY; count],
        };
        for span in spans {
            let (first, last) = (span.first, span.last);
            let level_m = span.level_m.expect("shores have told it");
            if span.kind == StructureKind::Ford {
                // At each point under the river beside it and no deeper: over it would be a dam, and a trench would take
                // the water of a steep one. Near the sea rivers may be told to lie above their banks.
                let banks_m = heights_m[first].max(heights_m[last]);
                for (point, height_m) in heights_m.iter().enumerate().take(last + 1).skip(first) {
                    let bed_m = (self.surfaces_m[point].min(banks_m) - FORD_M[0]).min(*height_m);
                    (demands.least_m[point], demands.most_m[point]) = (bed_m - FORD_M[1], bed_m);
                    demands.wished_m[point] = bed_m;
                }
            } else {
                let (from_m, to_m) = (self.wished_m[first], self.wished_m[last]);
                for point in first..=last {
                    demands.least_m[point] = level_m + clearance_m;
                    // From bank to bank, whatever lies between.
                    let share = (point - first) as f64 / (last - first).max(1) as f64;
                    demands.wished_m[point] = from_m + (to_m - from_m) * share;
                }
            }
        }
        // No span holds an end, so what it asks is not lost here.
        for (end, height_m) in [(0, self.ends_m[0]), (count - 1, self.ends_m[1])] {
            (demands.least_m[end], demands.most_m[end]) = (height_m, height_m);
            demands.wished_m[end] = height_m;
        }
        demands
    }
}
