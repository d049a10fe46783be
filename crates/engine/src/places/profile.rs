//! The heights of a road: close to the land's, and never steeper than allowed.
//!
//! A function is no steeper than g if its values at any two points differ by at most g times their distance: g is its
//! Lipschitz constant. Two sweeps each find the highest such function below the land and the lowest one above it. Their
//! mean is such a function too, and cuts about as much as it fills. A function of this kind
//! that is clamped between two others stays one. Finally, dips in cuttings are raised, since water would stand in them.
//!
//! To judge the numbers chosen by eye, look at the cuttings and embankments of roads in `alps`.

/// The limits of a road's heights at each of its points.
#[derive(Debug)]
#[expect(clippy::struct_field_names, reason = "the unit is a part of the name")]
pub(super) struct Demands {
    /// Metres from each point to the next.
    pub lengths_m: Vec<f64>,
    /// Heights of the land.
    pub land_m: Vec<f64>,
    /// Wished heights of the road.
    pub wished_m: Vec<f64>,
    /// Lower limits of the heights.
    pub least_m: Vec<f64>,
    /// Upper limits of the heights.
    pub most_m: Vec<f64>,
}

/// Number of points to each side over which the wished heights are averaged, twice. Chosen by eye.
// One average leaves corners where its window meets a step; the second one rounds them.
const SMOOTHING: usize = 3;

impl Demands {
    /// Returns the heights of a road that keeps the limits and is nowhere steeper than `grade`, or `None` if there are
    /// none.
    pub fn profile(&self, grade: f64) -> Option<Vec<f64>> {
        let swept = |values: &[f64], grade, extreme| swept(&self.lengths_m, values.to_vec(), grade, extreme);
        let most_m = swept(&self.most_m, grade, f64::min);
        let least_m = swept(&self.least_m, -grade, f64::max);
        // The sweeps spread the limit of each point to all others. Where the swept limits cross, no profile of this
        // grade exists.
        if most_m.iter().zip(&least_m).any(|(most_m, least_m)| least_m > most_m) {
            return None;
        }
        // Smoothing moves the ends off their sites too. The limits fix the heights there, so the clamping below moves
        // them back.
        let wished_m = smoothed(&self.wished_m);
        let under_m = swept(&wished_m, grade, f64::min);
        let above_m = swept(&wished_m, -grade, f64::max);
        let mean_m = under_m.iter().zip(&above_m).map(|(under_m, above_m)| f64::midpoint(*under_m, *above_m));
        // Clamped to the swept limits, which are no steeper than the grade: clamped to the bare limits the profile
        // could jump.
        Some(self.drained(clamped(mean_m, &least_m, &most_m), &most_m, grade))
    }

    /// Fills dips in cuttings, where water would stand: a level under the land is raised to the lower end of the dip,
    /// or to the land if that is lower, as far as the limits and the grade allow.
    fn drained(&self, levels_m: Vec<f64>, most_m: &[f64], grade: f64) -> Vec<f64> {
        let land_m = smoothed(&self.land_m);
        // Water at a point runs off over the lower one of two sills: the highest level before the point, and the
        // highest after.
        let highest = |most_m: &mut f64, z: &f64| {
            *most_m = most_m.max(*z);
            Some(*most_m)
        };
        let before: Vec<f64> = levels_m.iter().scan(f64::NEG_INFINITY, highest).collect();
        let mut after: Vec<f64> = levels_m.iter().rev().scan(f64::NEG_INFINITY, highest).collect();
        after.reverse();
        let raised = |index: usize| {
            let sill_m = before[index].min(after[index]);
            levels_m[index].max(sill_m.min(land_m[index]).min(most_m[index]))
        };
        let raised_m = swept(&self.lengths_m, (0..levels_m.len()).map(raised).collect(), grade, f64::min);
        // The levels are no steeper than the grade, so the sweep takes back no more than was added, but for rounding.
        levels_m.iter().zip(raised_m).map(|(z, raised_m)| z.max(raised_m)).collect()
    }
}

/// Returns at each point the extreme over all points of their values plus `grade` times their distance. `lengths_m` are
/// the metres from each point to the next.
pub(super) fn swept(lengths_m: &[f64], mut values: Vec<f64>, grade: f64, extreme: fn(f64, f64) -> f64) -> Vec<f64> {
    // The points lie in a row, so one sweep each way reaches all. Infinite values mean no limit, and stay infinite.
    for index in 1..values.len() {
        values[index] = extreme(values[index], values[index - 1] + grade * lengths_m[index - 1]);
    }
    for index in (1..values.len()).rev() {
        values[index - 1] = extreme(values[index - 1], values[index] + grade * lengths_m[index - 1]);
    }
    values
}

/// Bends the levels as little as the grade from both ends demands. If the ends are too far apart in height for the
/// grade, both are missed by the same amount.
pub(super) fn pinned_at_ends(lengths_m: &[f64], levels_m: &[f64], grade: f64) -> Vec<f64> {
    let last = levels_m.len() - 1;
    let length_m: f64 = lengths_m.iter().sum();
    let (start_m, end_m) = (levels_m[0], levels_m[last]);
    let miss_m = ((end_m - start_m).abs() - grade * length_m).max(0.0) / 2.0;
    let ends_m = [start_m + miss_m.copysign(end_m - start_m), end_m - miss_m.copysign(end_m - start_m)];
    let pins = |free_m: f64| {
        let mut values = vec![free_m; levels_m.len()];
        (values[0], values[last]) = (ends_m[0], ends_m[1]);
        values
    };
    let most_m = swept(lengths_m, pins(f64::INFINITY), grade, f64::min);
    let least_m = swept(lengths_m, pins(f64::NEG_INFINITY), -grade, f64::max);
    clamped(levels_m.iter().copied(), &least_m, &most_m)
}

/// Clamps the levels between the lower and the upper limits of their points.
fn clamped(levels_m: impl Iterator<Item = f64>, least_m: &[f64], most_m: &[f64]) -> Vec<f64> {
    levels_m.zip(least_m.iter().zip(most_m)).map(|(z, (least, most))| z.max(*least).min(*most)).collect()
}

/// Averages the values over the points around each, twice.
fn smoothed(values: &[f64]) -> Vec<f64> {
    let averaged = |values: &[f64]| -> Vec<f64> {
        let around = |index: usize| {
            let window = &values[index.saturating_sub(SMOOTHING)..=(index + SMOOTHING).min(values.len() - 1)];
            window.iter().sum::<f64>() / window.len() as f64
        };
        (0..values.len()).map(around).collect()
    };
    averaged(&averaged(values))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demands(wished_m: Vec<f64>) -> Demands {
        let count = wished_m.len();
        let mut demands = Demands {
            lengths_m: vec![8.0; count - 1],
            least_m: vec![f64::NEG_INFINITY; count],
            most_m: vec![f64::INFINITY; count],
            land_m: wished_m.clone(),
            wished_m,
        };
        for end in [0, count - 1] {
            (demands.least_m[end], demands.most_m[end]) = (demands.wished_m[end], demands.wished_m[end]);
        }
        demands
    }

    fn steepest(profile: &[f64]) -> f64 {
        profile.windows(2).map(|pair| (pair[1] - pair[0]).abs() / 8.0).fold(0.0, f64::max)
    }

    #[test]
    fn a_ridge_is_cut_and_its_feet_are_filled() {
        let ridge: Vec<f64> = (0..101).map(|i| if (40..60).contains(&i) { 30.0 } else { 0.0 }).collect();
        let demands = demands(ridge.clone());
        let profile = demands.profile(0.1).expect("the ends are level");
        assert!(steepest(&profile) <= 0.1 + 1e-12);
        assert_eq!((profile[0], profile[100]), (0.0, 0.0));
        assert!(profile[50] < 25.0 && profile[35] > 5.0, "{profile:?}");
    }

    #[test]
    fn what_is_asked_of_a_point_is_kept_or_there_is_no_profile() {
        let mut valley = demands(vec![0.0; 101]);
        valley.least_m[50] = 12.0;
        valley.most_m[20] = -3.0;
        let profile = valley.profile(0.07).expect("28 m of climb are enough");
        assert!(profile[50] >= 12.0 && profile[20] <= -3.0 && steepest(&profile) <= 0.07 + 1e-12);
        valley.least_m[50] = 40.0;
        assert!(valley.profile(0.07).is_none());
    }

    #[test]
    fn a_road_has_no_dip_in_a_cutting() {
        // Down to a ridge, through it in a cutting, and then over a river.
        let land = |i: usize| if (40..70).contains(&i) { 20.0 } else { 0.0 };
        let mut cut = demands((0..121).map(land).collect());
        for i in 0..121 {
            cut.wished_m[i] = if (50..60).contains(&i) { -9.0 } else { 0.0 };
        }
        cut.least_m[90] = 6.0;
        let profile = cut.profile(0.08).expect("the ends are level");
        assert!(steepest(&profile) <= 0.08 + 1e-12 && profile[90] >= 6.0);
        let dip = |at: &usize| {
            let higher = |mut way: std::ops::Range<usize>| way.any(|other| profile[other] > profile[*at] + 1e-9);
            profile[*at] < land(*at) - 1.0 && higher(0..*at) && higher(at + 1..121)
        };
        assert_eq!((0..121).find(dip), None, "{profile:?}");
    }
}
