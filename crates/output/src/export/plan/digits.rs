//! Numbers as text that people read and type.

/// Writes a number with the fewest decimals that change it by at most `off`.
///
/// Ranges of heights are computed in 32 bits, where -31 may become -31.000002.
pub(crate) fn shortest(number: f64, off: f64) -> String {
    let [text] = shortest_that([number], |[written]| (written - number).abs() <= off);
    text
}

/// Writes numbers with the fewest decimals for which `holds` is true of the written numbers; with all their digits if
/// there is no such number of decimals.
pub fn shortest_that<const N: usize>(numbers: [f64; N], holds: impl Fn([f64; N]) -> bool) -> [String; N] {
    let with = |decimals: usize| numbers.map(|number| clean(&format!("{number:.decimals$}")));
    let written = |texts: &[String; N]| texts.each_ref().map(|text| text.parse().expect("it was written as a number"));
    // A double has no more than 17 significant digits.
    (0..=17).map(with).find(|texts| holds(written(texts))).unwrap_or_else(|| numbers.map(|number| number.to_string()))
}

/// Removes the zeros at the end of a decimal.
fn clean(text: &str) -> String {
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
    if text.trim_start_matches(['-', '0', '.']).is_empty() { "0".into() } else { text.to_owned() }
}

/// Rounds a number that is not negative up to three digits: an upper bound that users can type again as it is written.
pub(crate) fn no_less(number: f64) -> String {
    let unit = third_digit(number);
    shortest((number / unit).ceil() * unit, unit / 1000.0)
}

/// Rounds a number that is not negative down to three digits.
pub(crate) fn no_more(number: f64) -> String {
    let unit = third_digit(number);
    shortest((number / unit).floor() * unit, unit / 1000.0)
}

/// Returns the place value of the third digit of a number that is not negative: 100 for 12,345. For 0 the value is
/// tiny, since 0 counts as the least positive number.
fn third_digit(number: f64) -> f64 {
    10_f64.powi(number.max(f64::MIN_POSITIVE).log10().floor() as i32 - 2)
}

/// Converts a float of 32 bits to the number with the fewest digits that stands for it: 0.3 and not
/// 0.30000001192092896.
pub(crate) fn of_32_bits(number: f32) -> f64 {
    number.to_string().parse().expect("a number's text is a number")
}

/// Returns the precision in metres of 32-bit heights in a range: a 128th of a step of 16 bits.
pub(crate) fn noise_m(min_m: f64, max_m: f64) -> f64 {
    (max_m - min_m) * f64::from(f32::EPSILON)
}

/// Appends a number with a fixed number of decimals. Halves are rounded away from zero. The number times 10 to the
/// power of `decimals` must fit in 63 bits.
///
/// Works like `{:.3}`, but several times as fast: lists of points consist mostly of such numbers.
pub(crate) fn push_decimal(text: &mut String, number: f64, decimals: u32) {
    let whole = 10_u64.pow(decimals);
    let count = (number.abs() * whole as f64 + 0.5) as u64;
    if number < 0.0 && count > 0 {
        text.push('-');
    }
    push_count(text, count / whole);
    if decimals > 0 {
        text.push('.');
        let mut rest = count % whole;
        for place in (0..decimals).rev() {
            let unit = 10_u64.pow(place);
            text.push(char::from(b'0' + (rest / unit) as u8));
            rest %= unit;
        }
    }
}

fn push_count(text: &mut String, count: u64) {
    if count >= 10 {
        push_count(text, count / 10);
    }
    text.push(char::from(b'0' + (count % 10) as u8));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_those_that_are_asked_for() {
        let decimal = |number: f64, decimals: u32| {
            let mut text = String::from("at ");
            push_decimal(&mut text, number, decimals);
            text
        };
        assert_eq!(decimal(12.3456, 3), "at 12.346");
        assert_eq!(decimal(-0.05, 1), "at -0.1");
        assert_eq!(decimal(-0.0004, 3), "at 0.000");
        assert_eq!(decimal(-2_560_000_000_007.25, 3), "at -2560000000007.250");
        assert_eq!(decimal(7.5, 0), "at 8");
    }

    #[test]
    fn as_few_decimals_are_written_as_leave_a_condition_true() {
        let near = |off: f64| move |[a, b]: [f64; 2]| (a + 0.716).abs() <= off && (b - 2.5).abs() <= off;
        assert_eq!(shortest_that([-0.716_000_000_000_000_2, 2.5], near(1e-9)), ["-0.716", "2.5"]);
        assert_eq!(shortest_that([-0.716_000_000_000_000_2, 2.5], near(0.1)), ["-0.7", "2.5"]);
        assert_eq!(shortest_that([-0.04, 200.0], |_| true), ["0", "200"]);
        assert_eq!(shortest_that([0.1, 200.0], |_| false), ["0.1", "200"]);
    }

    #[test]
    fn bounds_have_three_digits_and_hold() {
        assert_eq!([no_less(274.440_002), no_more(274.440_002)], ["275", "274"]);
        assert_eq!([no_less(0.048_000_001_9), no_more(0.048_000_001_9)], ["0.0481", "0.048"]);
        assert_eq!([no_less(0.25), no_more(0.25)], ["0.25", "0.25"]);
        assert_eq!([no_less(0.0), no_more(0.0)], ["0", "0"]);
        assert_eq!([no_less(123_456.0), no_more(123_456.0)], ["124000", "123000"]);
    }

    #[test]
    fn what_32_bits_add_is_not_written() {
        let written = |min_m: f32, max_m: f32| {
            let (min_m, max_m) = (f64::from(min_m), f64::from(max_m));
            [min_m, max_m].map(|height_m| shortest(height_m, noise_m(min_m, max_m)))
        };
        assert_eq!(written(-31.000_002, 900.0), ["-31", "900"]);
        assert_eq!(written(2.999_999, 4801.0), ["3", "4801"]);
        assert_eq!(written(-0.000_01, 200.1), ["0", "200.1"]);
        assert_eq!(written(-87.65, 87.65), ["-87.65", "87.65"]);
        assert_eq!(shortest(-0.0, 0.0), "0");
        assert_eq!(shortest(10.0, 0.0), "10");
        assert_eq!(shortest(0.25, 0.0), "0.25");
        assert_eq!(shortest(f64::MAX, 0.0).len(), 309);
    }
}
