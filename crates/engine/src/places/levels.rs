//! The levels of a road along its line: the limits that they must keep, and the demands that are given up where they
//! cannot all be met.
//!
//! To judge the numbers chosen by eye, look at the fords and low bridges of `plains`.

use crate::geometry::lerp;
use crate::lines::StructureKind;
use crate::places::alignment::Alignment;
use crate::places::bridging::wished_m;
use crate::places::profile::Demands;
use crate::places::river_index::RiverIndex;
use crate::places::settings::Standard;
use crate::places::spans::Span;

/// Least depth of a ford below the water's surface in metres, and how much deeper it may lie. Chosen by eye: half a
/// metre is about the hub of a cart's wheel.
const FORD_DEPTH_M: [f64; 2] = [0.2, 0.3];

/// Clearance of a bridge in metres where the road would be too steep with the full clearance. Chosen by eye.
const LEAST_CLEARANCE_M: f64 = 0.3;

/// A line and all that its levels depend on.
pub(super) struct Levelled<'a> {
    pub line: &'a Alignment,
    /// Heights of the land at the line's points, in metres.
    pub heights_m: &'a [f64],
    pub rivers: &'a RiverIndex,
    pub standard: &'a Standard,
    /// Heights in metres of the sites at the start and at the end, which the levels there must have.
    pub ends_m: [f64; 2],
}

impl Levelled<'_> {
    /// Returns the level of the road at each point in metres, with a clearance of `clearance_m` under bridges, or
    /// `None` if it would be too steep anyway. A ford that the road cannot get down to becomes a bridge, and so does a
    /// ford in a dip that the road goes straight over.
    pub fn levels_m(&self, spans: &mut [Span], clearance_m: f64) -> Option<Vec<f64>> {
        let grade = self.standard.profile_grade();
        let wished_m = wished_m(self.heights_m, &self.line.lengths_m, grade, self.standard.bridge_m);
        // A ford at the bottom of a dip lies under the road that goes straight over the dip.
        for span in spans.iter_mut() {
            if (span.first..=span.last).any(|point| wished_m[point] > self.heights_m[point]) {
                span.kind = StructureKind::Bridge;
            }
        }
        let surfaces_m = self.surfaces_m();
        let profile =
            |spans: &[Span], clearance_m| self.demands(&wished_m, &surfaces_m, spans, clearance_m).profile(grade);
        // The least important demand is given up first: the clearance of bridges before fords, and fords before the
        // whole line.
        let least_m = LEAST_CLEARANCE_M.min(clearance_m);
        if let Some(levels_m) = profile(spans, clearance_m).or_else(|| profile(spans, least_m)) {
            return Some(levels_m);
        }
        for span in spans.iter_mut() {
            span.kind = StructureKind::Bridge;
        }
        profile(spans, least_m)
    }

    /// Returns the surface height in metres of the river nearest to each point; infinite where none is near.
    fn surfaces_m(&self) -> Vec<f64> {
        let mut near = Vec::new();
        let mut surface_m = |at: &[i64; 2]| {
            let pieces = self.rivers.around(*at, &mut near);
            let nearest = pieces.min_by(|a, b| a.middle.distance2(*at).total_cmp(&b.middle.distance2(*at)));
            nearest.map_or(f64::INFINITY, |piece| piece.surface_m(*at))
        };
        self.line.points.iter().map(&mut surface_m).collect()
    }

    /// Returns the limits of the levels, given the wished levels, the surfaces of the rivers, and the clearance under
    /// bridges.
    fn demands(&self, wished_m: &[f64], surfaces_m: &[f64], spans: &[Span], clearance_m: f64) -> Demands {
        let (heights_m, count) = (self.heights_m, self.heights_m.len());
        let mut demands = Demands {
            lengths_m: self.line.lengths_m.clone(),
            land_m: heights_m.to_vec(),
            wished_m: wished_m.to_vec(),
            least_m: vec![f64::NEG_INFINITY; count],
            most_m: vec![f64::INFINITY; count],
        };
        for span in spans {
            let (first, last) = (span.first, span.last);
            if span.kind == StructureKind::Ford {
                // Each point lies just under the surface of the river beside it: a road above the water would be a dam,
                // and a deep trench would divert a steep river. Near the sea the given surface may lie above the banks,
                // so their height caps it.
                let banks_m = heights_m[first].max(heights_m[last]);
                for point in first..=last {
                    let bed_m = (surfaces_m[point].min(banks_m) - FORD_DEPTH_M[0]).min(heights_m[point]);
                    (demands.least_m[point], demands.most_m[point]) = (bed_m - FORD_DEPTH_M[1], bed_m);
                    demands.wished_m[point] = bed_m;
                }
            } else {
                let (from_m, rise_m) = (wished_m[first], wished_m[last] - wished_m[first]);
                for point in first..=last {
                    demands.least_m[point] = span.water_m(heights_m) + clearance_m;
                    // A straight line from bank to bank, whatever the ground between them.
                    let share = (point - first) as f64 / (last - first).max(1) as f64;
                    demands.wished_m[point] = lerp([from_m, rise_m], share);
                }
            }
        }
        // No span includes an end of the road, so this overwrites no limit of a span.
        for (end, height_m) in [(0, self.ends_m[0]), (count - 1, self.ends_m[1])] {
            (demands.least_m[end], demands.most_m[end]) = (height_m, height_m);
            demands.wished_m[end] = height_m;
        }
        demands
    }
}
