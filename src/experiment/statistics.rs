//! Statistics of timings: moments, quantiles and t-tests.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Statistics of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Number of values.
    pub n: usize,
    /// Mean; NaN for no values.
    pub mean: f64,
    /// Standard deviation of a sample, with the divisor n - 1; 0 for fewer than two values.
    pub standard_deviation: f64,
    /// Median; NaN for no values.
    pub median: f64,
    /// 99th percentile; NaN for no values.
    pub percentile_99: f64,
    /// Greatest value; NaN for no values.
    pub greatest: f64,
}

impl Summary {
    /// Returns the summary of some values in any order.
    pub fn of(values: &[f64]) -> Summary {
        let n = values.len();
        let mut sorted = values.to_vec();
        // Sum in sorted order too, so that the order of the values does not change a bit of the result.
        sorted.sort_by(f64::total_cmp);
        let mean = sorted.iter().sum::<f64>() / n as f64;
        let squares: f64 = sorted.iter().map(|value| (value - mean).powi(2)).sum();
        let standard_deviation = if n < 2 { 0.0 } else { (squares / (n - 1) as f64).sqrt() };
        Summary {
            n,
            mean,
            standard_deviation,
            median: quantile(&sorted, 0.5),
            percentile_99: quantile(&sorted, 0.99),
            greatest: quantile(&sorted, 1.0),
        }
    }
}

/// Returns the value below which a share of the sorted values lies, linear between neighbours; NaN for no values.
///
/// Based on: Hyndman and Fan, "Sample quantiles in statistical packages" (1996), definition 7, the default of most
/// programs.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = share * last as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
}

/// The outcome of an unpaired two-tailed t-test of two means.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TTest {
    /// The difference of the means in units of its standard error; positive if the first is greater.
    pub t: f64,
    /// Degrees of freedom.
    pub freedom: f64,
    /// Probability of a difference at least as large if the means are the same; 0 where it is too small for a number.
    pub p: f64,
}

impl TTest {
    /// Student's test, as in the thesis' table 7.2: it assumes that both variances are the same.
    ///
    /// `None` where the test says nothing: fewer than two values on a side, or no variance at all.
    pub fn student(a: &Summary, b: &Summary) -> Option<TTest> {
        let [degrees_a, degrees_b] = [a, b].map(|side| side.n as f64 - 1.0);
        let [variance_a, variance_b] = [a, b].map(|side| side.standard_deviation.powi(2));
        let freedom = degrees_a + degrees_b;
        let pooled = (degrees_a * variance_a + degrees_b * variance_b) / freedom;
        TTest::new(a, b, pooled * (1.0 / a.n as f64 + 1.0 / b.n as f64), freedom)
    }

    /// Welch's test: it lets each side have a variance of its own.
    ///
    /// `None` where the test says nothing: fewer than two values on a side, or no variance at all.
    pub fn welch(a: &Summary, b: &Summary) -> Option<TTest> {
        let [share_a, share_b] = [a, b].map(|side| side.standard_deviation.powi(2) / side.n as f64);
        let square = share_a + share_b;
        let freedom = square.powi(2) / (share_a.powi(2) / (a.n as f64 - 1.0) + share_b.powi(2) / (b.n as f64 - 1.0));
        TTest::new(a, b, square, freedom)
    }

    /// Makes the test of a difference whose squared standard error is `square`.
    fn new(a: &Summary, b: &Summary, square: f64, freedom: f64) -> Option<TTest> {
        // Otherwise the degrees of freedom are zero or less, or the quotient has no value.
        if a.n < 2 || b.n < 2 || square <= 0.0 {
            return None;
        }
        let t = (a.mean - b.mean) / square.sqrt();
        let distribution = StudentsT::new(0.0, 1.0, freedom).ok()?;
        Some(TTest { t, freedom, p: 2.0 * distribution.sf(t.abs()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(got: f64, expected: f64) {
        assert!((got - expected).abs() <= 1e-9 * expected.abs(), "{got:e} instead of {expected:e}");
    }

    // The expected values come from SciPy 1.x: numpy.percentile and scipy.stats.ttest_ind.

    const FEW: [f64; 10] = [19.8, 20.4, 19.6, 17.8, 18.5, 18.9, 18.3, 18.9, 19.5, 22.0];
    const MORE: [f64; 20] = [
        28.2, 26.6, 20.1, 23.3, 25.2, 22.1, 17.7, 27.6, 20.6, 13.7, 23.2, 17.5, 20.6, 18.0, 23.9, 21.6, 24.3, 20.4,
        24.0, 13.2,
    ];

    #[test]
    fn a_sample_is_summarised_as_by_numpy() {
        let summary = Summary::of(&FEW);
        assert_eq!(summary.n, 10);
        near(summary.mean, 19.369_999_999_999_997);
        near(summary.standard_deviation, 1.203_744_158_864_332_5);
        near(summary.median, 19.2);
        near(summary.percentile_99, 21.856);
        assert_eq!(summary.greatest, 22.0);
    }

    #[test]
    fn t_tests_are_those_of_scipy() {
        let [few, more] = [Summary::of(&FEW), Summary::of(&MORE)];
        let student = TTest::student(&few, &more).unwrap();
        near(student.t, -1.649_204_532_775_818);
        assert_eq!(student.freedom, 28.0);
        near(student.p, 0.110_281_973_218_222_92);
        let welch = TTest::welch(&few, &more).unwrap();
        near(welch.t, -2.219_240_915_823_623_3);
        near(welch.freedom, 24.496_223_124_201_244);
        near(welch.p, 0.035_972_271_029_796_92);
        // The sign follows the order of the sides; the probability does not depend on it.
        assert_eq!(TTest::welch(&more, &few).unwrap(), TTest { t: -welch.t, ..welch });
    }

    #[test]
    fn small_probabilities_keep_their_digits() {
        let sample = |n: usize, from: f64, step: f64, period: usize| {
            Summary::of(&(0..n).map(|index| from + step * (index % period) as f64).collect::<Vec<_>>())
        };
        let [a, b] = [sample(60, 1.0, 0.1, 7), sample(40, 2.0, 0.3, 5)];
        near(TTest::student(&a, &b).unwrap().p, 2.834_339_431_384_118_8e-37);
        near(TTest::welch(&a, &b).unwrap().p, 1.257_677_204_353_915e-23);
        // The probability is too small for a number, as in SciPy.
        let [a, b] = [sample(200, 1.0, 0.01, 7), sample(150, 20.0, 0.03, 5)];
        assert_eq!(TTest::student(&a, &b).unwrap().p, 0.0);
    }

    #[test]
    fn tests_that_say_nothing_are_none() {
        let summaries = [&[][..], &[1.0], &[2.0, 2.0, 2.0]].map(Summary::of);
        for (a, b) in [(0, 0), (0, 2), (1, 2), (2, 1), (2, 2)] {
            assert_eq!(TTest::student(&summaries[a], &summaries[b]), None, "{a} {b}");
            assert_eq!(TTest::welch(&summaries[a], &summaries[b]), None, "{a} {b}");
        }
        assert!(summaries[0].mean.is_nan() && summaries[0].percentile_99.is_nan());
        assert_eq!((summaries[1].median, summaries[1].standard_deviation), (1.0, 0.0));
    }
}
