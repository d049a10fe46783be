//! Selection of the vertices to keep on a tile's edge.
//!
//! Both tiles at an edge have the same heights along it, and nothing else counts. So they choose the same vertices
//! independently, and their meshes meet without a crack.
//!
//! Based on: Douglas & Peucker 1973. A row is split where it is furthest from the line between its ends, and so are
//! both parts, until all vertices are near enough. The bound decides how often a row is split, but not where: so the
//! vertices for a coarser bound are among those for a finer one.

use crate::geometry::simplified;

/// Returns the indices of the vertices to keep of a row of heights, ascending, always with the first and the last. No
/// height lies further than `bound` from the line between the two kept heights around it, in the unit of the heights.
pub fn chain(heights: &[i32], bound: f64) -> Vec<u32> {
    let split = |start: usize, end: usize| {
        // `furthest` returns the distance times the length: a whole number, so the comparison is exact.
        let (middle, error) = furthest(heights, start, end)?;
        (error > bound * (end - start) as f64).then_some(middle)
    };
    simplified(heights.len(), split).into_iter().map(|index| index as u32).collect()
}

/// Finds the index between `start` and `end` whose height is furthest from the line between their heights; of equal
/// ones, the nearest to the middle. Returns the index, and its distance times `end - start`.
fn furthest(heights: &[i32], start: usize, end: usize) -> Option<(usize, f64)> {
    let [from, to] = [start, end].map(|index| heights[index] as i64);
    let length = (end - start) as i64;
    let error = |index: usize| {
        let along = (index - start) as i64;
        ((heights[index] as i64 - from) * length - (to - from) * along).abs()
    };
    // Twice the distance from the middle, since that is a whole number.
    let off_middle = |index: usize| (2 * index).abs_diff(start + end);
    let worst = (start + 1..end).max_by_key(|index| (error(*index), std::cmp::Reverse(off_middle(*index))))?;
    Some((worst, error(worst) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hash::combine;

    fn rows() -> Vec<Vec<i32>> {
        let noise = |seed: u64, range: u64| move |x: i64| (combine(seed, x as u64) % range) as i32;
        let mut rows: Vec<Vec<i32>> = vec![vec![7; 100], (0..65).collect(), vec![3, -3], vec![0, 0, 1, 0, 0]];
        for length in [3, 17, 64, 257, 1000_i64] {
            rows.push((0..length).map(noise(1, 40_000)).collect());
            rows.push((0..length).map(|x| (x - length / 3).abs() as i32 * 900 + noise(2, 50)(x)).collect());
            rows.push((0..length).map(|x| if x < length / 2 { -40_000_000 } else { 40_000_000 }).collect());
        }
        rows
    }

    #[test]
    fn nothing_of_a_row_is_beyond_the_bound() {
        for row in rows() {
            for bound in [0, 1, 10, 1000, 20_000, 100_000_000] {
                let kept = chain(&row, bound as f64);
                assert_eq!((kept[0], kept[kept.len() - 1] as usize), (0, row.len() - 1));
                for pair in kept.windows(2) {
                    let [from, to] = [pair[0], pair[1]].map(i64::from);
                    let [start, end] = [from, to].map(|at| row[at as usize] as i64);
                    for x in from..=to {
                        let line = start * (to - x) + end * (x - from);
                        let off = (row[x as usize] as i64 * (to - from) - line).abs();
                        assert!(off <= bound * (to - from), "{bound}: {x} of {from}..{to}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_coarser_chain_is_part_of_a_finer_one() {
        for row in rows() {
            let chains: Vec<_> = [0, 3, 50, 700, 9000, 30_000].map(|bound| chain(&row, bound as f64)).into();
            for pair in chains.windows(2) {
                assert!(pair[1].iter().all(|kept| pair[0].contains(kept)), "{:?} and {:?}", pair[0], pair[1]);
            }
        }
    }

    #[test]
    fn a_straight_row_is_its_ends() {
        let slope: Vec<i32> = (0..257).map(|x| 5 - 3 * x).collect();
        assert_eq!(chain(&slope, 0.0), [0, 256]);
        assert_eq!(chain(&[0, 0, 9, 0, 0], 9.0), [0, 4]);
        assert_eq!(chain(&[0, 0, 9, 0, 0], 8.0), [0, 2, 4]);
        assert_eq!(chain(&[0, 0, 9, 0, 0], 4.0), [0, 1, 2, 3, 4]);
        assert_eq!(chain(&[4, 9], 0.0), [0, 1]);
    }
}
