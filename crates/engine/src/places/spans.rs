//! Bridges and fords: the spans of a road that cross water.
//!
//! To judge the numbers chosen by eye, look where roads cross or follow rivers, on maps at 1:10,000.

use std::ops::RangeInclusive;

use crate::land::WaterKind;
use crate::lines::{FIXED, StructureKind};
use crate::places::alignment::Alignment;
use crate::places::river_index::RiverIndex;
use crate::places::settings::Standard;

/// Distance in vertices from a river's middle within which rasters show water, however narrow the river is: of 32,159
/// wet vertices of rivers narrower than 1.2 vertices in a bake of `alps`, 996 in 1000 lie as near, and 985 within 1.4.
const DRAWN_VERTICES: f64 = 1.8;

/// Cap in metres on the distance that `DRAWN_VERTICES` keeps roads from narrow rivers: without it a coarse lattice
/// would close valleys to roads. Chosen by eye.
const DRAWN_MOST_M: f64 = 40.0;

/// Distance in metres from a river's edge to the point where a bridge rests on land. Chosen by eye.
pub(super) const REST_M: f64 = 1.0;

/// Largest ratio of a crossing's length to the width of the water: a longer crossing runs along the river, in its bed.
// Routes cross at 30 degrees at the flattest, which makes the crossing twice as long; the rounded line may turn there.
const SLANTING: f64 = 2.5;

/// A run of points of a line that a bridge or a ford carries over water.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub first: usize,
    pub last: usize,
    /// A bridge or a ford.
    pub kind: StructureKind,
    /// Height in metres of the highest river beneath; `None` over lakes and the sea, whose height is unknown.
    river_m: Option<f64>,
}

impl Span {
    /// Returns the height in metres of the water's surface, given the heights of the land at the line's points.
    pub fn water_m(&self, heights_m: &[f64]) -> f64 {
        let (from_m, to_m) = (heights_m[self.first], heights_m[self.last]);
        // Near the sea a river's line may be far too high above land that the sea has worn down, so the banks cap its
        // level.
        self.river_m.map_or(from_m.min(to_m), |river_m| river_m.min(from_m.max(to_m)))
    }
}

/// The rivers that one piece of a line crosses.
#[derive(Clone, Copy)]
struct Crossed {
    /// Width in metres of the widest river.
    width_m: f64,
    /// Height in metres of the highest surface.
    level_m: f64,
}

/// The waters on a line.
struct Wetness<'a> {
    waters: &'a [WaterKind],
    /// For each point, true if it lies in a river.
    inside: Vec<bool>,
    /// For each point, true if it lies in or beside any water, so that no bridge can rest there.
    over: Vec<bool>,
    /// For each piece, the rivers that it crosses.
    crossed: Vec<Option<Crossed>>,
}

/// Finds the spans of a line over water, from its start on. `waters` has the water at each point. The error lists
/// points that cannot be spanned, most of which run along a river.
pub(super) fn spans(
    line: &Alignment,
    rivers: &RiverIndex,
    waters: &[WaterKind],
    standard: &Standard,
) -> Result<Vec<Span>, Vec<usize>> {
    let wetness = Wetness::new(line, rivers, waters);
    let mut spans: Vec<Span> = Vec::new();
    let mut first = 0;
    for run in wetness.marked().chunk_by(|a, b| a == b) {
        let (from, to) = (first, first + run.len() - 1);
        first = to + 1;
        let span = if run[0] { wetness.span(line, from..=to, standard)? } else { None };
        let Some(span) = span else { continue };
        match spans.last_mut() {
            // Spans that touch are merged.
            Some(before) if before.last + 1 >= span.first => {
                before.last = span.last;
                // A bridge can replace a ford, but not the other way round.
                before.kind = if before.kind == span.kind { span.kind } else { StructureKind::Bridge };
                before.river_m = before.river_m.into_iter().chain(span.river_m).reduce(f64::max);
            }
            _ => spans.push(span),
        }
    }
    Ok(spans)
}

impl Wetness<'_> {
    fn new<'a>(line: &Alignment, rivers: &RiverIndex, waters: &'a [WaterKind]) -> Wetness<'a> {
        let spacing_m = line.scale.spacing_m;
        let fixed_m = spacing_m / FIXED as f64;
        // Where rivers meet or widen, the raster shows more water than their lines and widths tell.
        let mut inside: Vec<bool> = waters.iter().map(|water| *water == WaterKind::River).collect();
        let mut over: Vec<bool> = waters.iter().map(|water| *water != WaterKind::Dry).collect();
        let mut crossed: Vec<Option<Crossed>> = vec![None; line.lengths_m.len()];
        let mut near = Vec::new();
        for (index, crossed) in crossed.iter_mut().enumerate() {
            let own = line.piece(index);
            for piece in rivers.near(own, &mut near) {
                for (point, at) in [(index, own.from), (index + 1, own.to)] {
                    let edge_m = piece.middle.distance2(at).sqrt() * fixed_m - drawn_m(piece.width_m, spacing_m) / 2.0;
                    inside[point] |= edge_m <= 0.0;
                    over[point] |= edge_m <= REST_M;
                }
                if piece.middle.crosses(&own) {
                    let (width_m, level_m) = crossed.map_or((0.0, f64::NEG_INFINITY), |it| (it.width_m, it.level_m));
                    let surface_m = piece.surface_m(own.from);
                    *crossed = Some(Crossed { width_m: width_m.max(piece.width_m), level_m: level_m.max(surface_m) });
                }
            }
        }
        Wetness { waters, inside, over, crossed }
    }

    /// Returns for each point whether it is over water or at an end of a piece that crosses a river. Such a piece marks
    /// both of its points, so it never lies between two runs.
    fn marked(&self) -> Vec<bool> {
        let mut marked = self.over.clone();
        for (piece, _) in self.crossed.iter().enumerate().filter(|(_, crossed)| crossed.is_some()) {
            (marked[piece], marked[piece + 1]) = (true, true);
        }
        marked
    }

    /// Returns the span of a run of marked points; `None` if the run only lies near a river. The error lists the run's
    /// points if it lies in the river or cannot be spanned.
    fn span(
        &self,
        line: &Alignment,
        run: RangeInclusive<usize>,
        standard: &Standard,
    ) -> Result<Option<Span>, Vec<usize>> {
        let is_open = |points: RangeInclusive<usize>| self.waters[points].iter().any(|water| water.is_open());
        let (from, to, last) = (*run.start(), *run.end(), self.crossed.len());
        let under: Vec<Crossed> = self.crossed[from..to].iter().filter_map(|crossed| *crossed).collect();
        if under.is_empty() && !is_open(run.clone()) {
            // The run crosses nothing, so it goes along a river: it may be near the water, but not in it.
            return if self.inside[run.clone()].contains(&true) { Err(run.collect()) } else { Ok(None) };
        }
        // A bridge rests on land: where an end of the run is over the water, the span goes on to the next point.
        let (from, to) =
            (from.saturating_sub(usize::from(self.over[from])), (to + usize::from(self.over[to])).min(last));
        // The pieces of the crossing, without the one at each end. Crossings of lakes and the sea may be longer: the
        // route has limited them.
        let drawn_m = |crossed: &Crossed| drawn_m(crossed.width_m, line.scale.spacing_m);
        let across_m: f64 = under.iter().map(|crossed| drawn_m(crossed) + 2.0 * REST_M).sum();
        let is_open = is_open(from..=to);
        let inner = line.lengths_m.get(from + 1..to.saturating_sub(1)).unwrap_or_default();
        let is_along = !is_open && inner.iter().sum::<f64>() > SLANTING * across_m;
        // A road's ends lie at the heights of their sites, which are not on bridges.
        if from == 0 || to == last || is_along {
            return Err((from..=to).collect());
        }
        let width_m = under.iter().map(|crossed| crossed.width_m).fold(0.0, f64::max);
        let is_ford = !under.is_empty() && width_m <= standard.ford_m && !is_open;
        let kind = if is_ford { StructureKind::Ford } else { StructureKind::Bridge };
        // One bridge over several rivers has to clear the highest.
        let river_m = under.iter().map(|crossed| crossed.level_m).reduce(f64::max);
        Ok(Some(Span { first: from, last: to, kind, river_m }))
    }
}

/// Returns the width in metres of a river in rasters, which show narrow rivers wider than they are.
pub(super) fn drawn_m(width_m: f64, spacing_m: f64) -> f64 {
    width_m.max(2.0 * (DRAWN_VERTICES * spacing_m).min(DRAWN_MOST_M))
}
