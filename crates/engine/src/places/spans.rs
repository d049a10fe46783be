//! Where a road is carried over waters, or goes through them: its bridges and fords.

use std::ops::RangeInclusive;

use crate::land::WaterKind;
use crate::lines::{FIXED, StructureKind};
use crate::places::alignment::Alignment;
use crate::places::river_index::RiverIndex;
use crate::places::settings::Standard;

/// Vertices from a river's middle that are wet in rasters, however narrow it is: of 32,159 wet vertices of rivers narrower than
/// 1.2 vertices in a bake of `alps`, 996 in 1000 lie as near, and 985 within 1.4.
const DRAWN_VERTICES: f64 = 1.8;

/// Metres from a narrow river that a road keeps because of it at most: on a coarse lattice valleys would be closed to roads.
/// Chosen by eye.
const DRAWN_MOST_M: f64 = 40.0;

/// Metres from a river's edge to where a bridge rests. Chosen by eye.
pub(super) const REST_M: f64 = 1.0;

/// How many times longer than straight across a crossing is at most: what is longer goes along the river, in its bed.
// A way crosses at 30 degrees at the flattest, which makes it twice as long; its rounded line may turn there.
const SLANTING: f64 = 2.5;

/// Points of a line that are carried over water.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub first: usize,
    pub last: usize,
    /// A bridge or a ford.
    pub kind: StructureKind,
    /// Height in metres of the highest river beneath; of lakes and the sea none is known.
    river_m: Option<f64>,
}

impl Span {
    /// The height in metres of the water's surface, given those of the land at the line's points.
    pub fn water_m(&self, heights_m: &[f64]) -> f64 {
        let (from_m, to_m) = (heights_m[self.first], heights_m[self.last]);
        // Near the sea a river's line may be told to lie far above the land that the sea has worn down.
        self.river_m.map_or(from_m.min(to_m), |river_m| river_m.min(from_m.max(to_m)))
    }
}

/// The rivers that a piece of a line crosses.
#[derive(Clone, Copy)]
struct Crossed {
    /// Width in metres of the widest.
    width_m: f64,
    /// Height in metres of the highest's surface.
    level_m: f64,
}

/// The waters on a line.
struct Wetness<'a> {
    waters: &'a [WaterKind],
    /// Whether each point lies in a river.
    inside: Vec<bool>,
    /// Whether each point lies in or beside any water, so that no bridge can rest there.
    over: Vec<bool>,
    /// For each piece what it crosses.
    crossed: Vec<Option<Crossed>>,
}

/// Where a line is carried over water, from its start on, or the points that run along a river. `waters` are what its points
/// lie in.
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
            // Two that touch are one.
            Some(before) if before.last + 1 >= span.first => {
                before.last = span.last;
                // A bridge does for a ford, but no ford for a bridge.
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
        // Where rivers meet or widen they are drawn wider than their lines are.
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

    /// Which points are over water, or at the end of a piece that is. A crossed piece marks both of its points, so it never
    /// lies between two runs.
    fn marked(&self) -> Vec<bool> {
        let mut marked = self.over.clone();
        for (piece, _) in self.crossed.iter().enumerate().filter(|(_, crossed)| crossed.is_some()) {
            (marked[piece], marked[piece + 1]) = (true, true);
        }
        marked
    }

    /// How a run of marked points is carried; none where it only lies near a river. An error where it lies in one, or cannot
    /// be carried.
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
            // Nothing is crossed, so it runs along a river: it may be near, but not in it.
            return if self.inside[run.clone()].contains(&true) { Err(run.collect()) } else { Ok(None) };
        }
        // A bridge rests on land: one point further where its last is still over the water.
        let (from, to) =
            (from.saturating_sub(usize::from(self.over[from])), (to + usize::from(self.over[to])).min(last));
        // Its own pieces, and one to each side; what lies over a lake is as long as the way allows.
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

/// Metres from bank to bank of a river in rasters, where a narrow one is wider than it is.
pub(super) fn drawn_m(width_m: f64, spacing_m: f64) -> f64 {
    width_m.max(2.0 * (DRAWN_VERTICES * spacing_m).min(DRAWN_MOST_M))
}
