//! The levels of a road along its line: what they must keep to, and what is given up where they cannot.

use crate::geometry::lerp;
use crate::lines::StructureKind;
use crate::places::alignment::Alignment;
use crate::places::bridging::wished_m;
use crate::places::profile::Demands;
use crate::places::river_index::RiverIndex;
use crate::places::settings::Standard;
use crate::places::spans::Span;

/// Metres from the water's surface down to a ford, at least, and more that a ford may lie lower. Chosen by eye: half a metre is
/// about the hub of a cart's wheel.
const FORD_DEPTH_M: [f64; 2] = [0.2, 0.3];

/// The least clearance of a bridge in metres where its full one would be too steep to climb to. Chosen by eye.
const LEAST_CLEARANCE_M: f64 = 0.3;

/// A line that is given levels.
pub(super) struct Levelled<'a> {
    pub line: &'a Alignment,
    /// Heights of the land at its points, in metres.
    pub heights_m: &'a [f64],
    pub rivers: &'a RiverIndex,
    pub standard: &'a Standard,
    /// Heights of the sites at its start and at its end, in metres, which its levels there must have.
    pub ends_m: [f64; 2],
}

impl Levelled<'_> {
    /// The level of the road at each point in metres, if there is one that is nowhere too steep, with so many metres of air
    /// under bridges. A ford that is too low to be reached becomes a bridge, and so does one in a dip that is gone over.
    pub fn levels_m(&self, spans: &mut [Span], clearance_m: f64) -> Option<Vec<f64>> {
        let grade = self.standard.profile_grade();
        let wished_m = wished_m(self.heights_m, &self.line.lengths_m, grade, self.standard.bridge_m);
        // Where the road goes straight over a dip, the ford at its bottom lies beneath it.
        for span in spans.iter_mut() {
            if (span.first..=span.last).any(|point| wished_m[point] > self.heights_m[point]) {
                span.kind = StructureKind::Bridge;
            }
        }
        let surfaces_m = self.surfaces_m();
        let profile =
            |spans: &[Span], clearance_m| self.demands(&wished_m, &surfaces_m, spans, clearance_m).profile(grade);
        // The least is given up first: air under bridges before fords, and fords before the way.
        let least_m = LEAST_CLEARANCE_M.min(clearance_m);
        if let Some(levels_m) = profile(spans, clearance_m).or_else(|| profile(spans, least_m)) {
            return Some(levels_m);
        }
        for span in spans.iter_mut() {
            span.kind = StructureKind::Bridge;
        }
        profile(spans, least_m)
    }

    /// The height of the surface of the river nearest to each point; infinite where none is near.
    fn surfaces_m(&self) -> Vec<f64> {
        let mut near = Vec::new();
        let mut surface_m = |at: &[i64; 2]| {
            let pieces = self.rivers.around(*at, &mut near);
            let nearest = pieces.min_by(|a, b| a.middle.distance2(*at).total_cmp(&b.middle.distance2(*at)));
            nearest.map_or(f64::INFINITY, |piece| piece.surface_m(*at))
        };
        self.line.points.iter().map(&mut surface_m).collect()
    }

    /// What the levels must keep to, given those that are wished, the heights of rivers' surfaces, and the metres of air under
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
                // At each point under the river beside it and no deeper: over it would be a dam, and a trench would take
                // the water of a steep one. Near the sea rivers may be told to lie above their banks.
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
                    // From bank to bank, whatever lies between.
                    let share = (point - first) as f64 / (last - first).max(1) as f64;
                    demands.wished_m[point] = lerp([from_m, rise_m], share);
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
