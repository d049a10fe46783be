//! Viaducts and tunnels: a road leaves the land where an embankment would be too high or a cutting too deep.
//!
//! First come dips and ridges whose sides are steeper than the grade of the road: it goes straight over or through
//! those that are short enough for a bridge. Elsewhere earthworks carry the road; where they would still be too high or
//! too deep, a viaduct or a tunnel takes their place.
//!
//! To judge the numbers chosen by eye, look where highways of `alps` cross gorges and ridges.

use crate::lines::{HIGHEST_FILL_M, StructureKind};
use crate::places::profile::swept;

/// Height in metres of a fill above which a viaduct carries the road, and of the fill at which the viaduct ends.
/// The height at which a structure ends is chosen by eye: a third of that where one begins, as for tunnels.
const FILL_M: Tolerance = Tolerance { begins_m: HIGHEST_FILL_M as f64, end_m: 4.0 };

/// Depth in metres of a cut below which a tunnel carries the road, and of the cut at which the tunnel ends. Chosen by
/// eye.
const CUT_M: Tolerance = Tolerance { begins_m: 25.0, end_m: 8.0 };

/// Depth in metres up to which a cut may slope down to a tunnel's mouth: a ditch beside the road is as deep. Chosen by
/// eye.
const MOUTH_M: f64 = 0.5;

/// Distances from the land at which a structure begins and ends: two thresholds (hysteresis), so that a structure does
/// not flicker on and off along the road.
struct Tolerance {
    /// Distance in metres from the land above which a road needs a structure.
    begins_m: f64,
    /// Distance in metres from the land at which the structure ends.
    end_m: f64,
}

impl Tolerance {
    /// Finds the first and last points of all structures, from the start of the road on. `off_m` is the road's distance
    /// from the land at each point.
    fn runs(&self, off_m: &[f64]) -> Vec<(usize, usize)> {
        let (mut runs, mut first) = (Vec::new(), 0);
        for run in off_m.chunk_by(|a, b| (*a > self.end_m) == (*b > self.end_m)) {
            if run.iter().any(|off_m| *off_m > self.begins_m) {
                runs.push((first, first + run.len() - 1));
            }
            first += run.len();
        }
        runs
    }
}

/// Returns the heights that a road should have, given those of the land and the metres from each point to the next.
/// They follow the land, but go straight over dips and through ridges whose sides are steeper than `grade` and that are
/// no longer than `most_m`.
pub(super) fn wished_m(heights_m: &[f64], lengths_m: &[f64], grade: f64, most_m: f64) -> Vec<f64> {
    let mut wished_m = heights_m.to_vec();
    let over_m = swept(lengths_m, heights_m.to_vec(), -grade, f64::max);
    straighten(&mut wished_m, lengths_m, &FILL_M.runs(&off_m(&over_m, heights_m)), most_m);
    let under_m = swept(lengths_m, wished_m.clone(), grade, f64::min);
    let ridges = CUT_M.runs(&off_m(&wished_m, &under_m));
    straighten(&mut wished_m, lengths_m, &ridges, most_m);
    wished_m
}

/// Replaces the heights in runs of points by straight lines between the points before and after each run. Leaves runs
/// that are longer than `most_m` or lie at an end of the road.
fn straighten(heights_m: &mut [f64], lengths_m: &[f64], runs: &[(usize, usize)], most_m: f64) {
    for &(first, last) in runs {
        let (Some(before), after) = (first.checked_sub(1), last + 1) else { continue };
        let length_m: f64 = lengths_m[before..after.min(lengths_m.len())].iter().sum();
        if after == heights_m.len() || length_m > most_m {
            continue;
        }
        let (from_m, to_m, mut along_m) = (heights_m[before], heights_m[after], 0.0);
        for point in first..=last {
            along_m += lengths_m[point - 1];
            heights_m[point] = from_m + (to_m - from_m) * along_m / length_m;
        }
    }
}

/// Adds viaducts and tunnels to the carriers of a road's points: where nothing else carries the road, and its levels
/// are too far above or below the heights of the land.
pub(super) fn carry(carriers: &mut [Option<StructureKind>], levels_m: &[f64], heights_m: &[f64]) {
    let structures = [
        (StructureKind::Bridge, FILL_M.runs(&off_m(levels_m, heights_m))),
        (StructureKind::Tunnel, CUT_M.runs(&off_m(heights_m, levels_m))),
    ];
    for (kind, runs) in structures {
        for (mut first, mut last) in runs {
            // Water would gather in a cutting that slopes down to a tunnel's mouth, so the tunnel is extended to the
            // end of that cutting.
            if kind == StructureKind::Tunnel {
                let is_cut = |point: usize| heights_m[point] - levels_m[point] > MOUTH_M;
                while first > 0 && levels_m[first - 1] > levels_m[first] && is_cut(first - 1) {
                    first -= 1;
                }
                while last + 1 < carriers.len() && levels_m[last + 1] > levels_m[last] && is_cut(last + 1) {
                    last += 1;
                }
            }
            // A structure of a single point would carry no piece of the road.
            let last = if first == last { (last + 1).min(carriers.len() - 1) } else { last };
            for carrier in &mut carriers[first..=last] {
                carrier.get_or_insert(kind);
            }
        }
    }
}

/// Returns the heights of the upper line above the lower one.
fn off_m(upper_m: &[f64], lower_m: &[f64]) -> Vec<f64> {
    upper_m.iter().zip(lower_m).map(|(upper_m, lower_m)| upper_m - lower_m).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points 8 m apart, level at 100 m, but lower by `dip_m` from 400 m to 480 m.
    fn land(dip_m: f64) -> (Vec<f64>, Vec<f64>) {
        let heights_m = (0..100).map(|point| if (50..=60).contains(&point) { 100.0 - dip_m } else { 100.0 });
        (heights_m.collect(), vec![8.0; 99])
    }

    #[test]
    fn deep_dips_are_gone_over_and_high_ridges_through() {
        for dip_m in [30.0, -30.0] {
            let (heights_m, lengths_m) = land(dip_m);
            assert_eq!(wished_m(&heights_m, &lengths_m, 0.1, 160.0), [100.0; 100], "{dip_m}");
            // The dip is 96 m long from land to land: too long for structures of at most 80 m.
            assert_eq!(wished_m(&heights_m, &lengths_m, 0.1, 80.0), heights_m, "{dip_m}");
        }
        for dip_m in [10.0, -20.0] {
            let (heights_m, lengths_m) = land(dip_m);
            assert_eq!(wished_m(&heights_m, &lengths_m, 0.1, 160.0), heights_m, "{dip_m}");
        }
        // A slope that the road can climb is neither a dip nor a ridge.
        let slope_m: Vec<f64> = (0..100).map(|point| f64::from(point) * 0.7).collect();
        assert_eq!(wished_m(&slope_m, &[8.0; 99], 0.1, 1000.0), slope_m);
    }

    #[test]
    fn no_bank_is_high_and_no_cut_deep() {
        for (dip_m, kind) in [(30.0, Some(StructureKind::Bridge)), (-30.0, Some(StructureKind::Tunnel))] {
            let (heights_m, _) = land(dip_m);
            let mut kinds = [None; 100];
            kinds[55] = Some(StructureKind::Ford);
            carry(&mut kinds, &[100.0; 100], &heights_m);
            for (point, carrier) in kinds.iter().enumerate() {
                let expected = if (50..=60).contains(&point) { kind } else { None };
                assert_eq!(*carrier, if point == 55 { Some(StructureKind::Ford) } else { expected }, "{point}");
            }
        }
        for dip_m in [10.0, -20.0] {
            let mut kinds = [None; 100];
            carry(&mut kinds, &[100.0; 100], &land(dip_m).0);
            assert_eq!(kinds, [None; 100], "{dip_m}");
        }
    }
}
