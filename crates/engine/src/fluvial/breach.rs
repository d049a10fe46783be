//! Breaches: cuts that drain the hollows left by gullies and the coast.
//!
//! Valleys have no pits, but carving makes some where a hillside turns or gullies meet. From each pit water rises until
//! it overflows, as far as the square around the pit reaches. The way out is then cut to an even fall. Cuts only lower
//! the land, and each reads the land as it was before any cut, so their order does not matter.
//!
//! Based on: J. B. Lindsay, K. Dhun, Modelling surface drainage patterns in altered landscapes using LiDAR, 2015.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::area::Area;

/// Greatest length of a cut along either axis, in vertices: few pits of natural size need more, and each vertex more
/// makes the stage read one more vertex of valleys on each side of an area.
const REACH: i64 = 8;

/// Vertices a side of the square around a pit.
const SIDE: usize = 2 * REACH as usize + 1;

/// Returns the area whose land breaches read: a cut may come from a pit one reach away, and the pit reads as far again
/// on its other side.
pub fn input(area: Area) -> Area {
    area.padded(2 * REACH as usize)
}

/// Cuts hollows of the land open, given the surface of land and sea, and whether a vertex may be a pit. Heights are
/// right where their [`input`] lies within the area.
pub fn breach(area: Area, surface_m: &[f32], may_be_pit: impl Fn(usize) -> bool, height_m: &mut [f32]) {
    let width = area.width();
    let mut seen = PitFlood::default();
    let mut lowest = vec![0.0; width - 2];
    let pad = REACH as usize + 1;
    for row in pad..area.height() - pad {
        let start = row * width;
        lowest_around(surface_m, width, start + 1, &mut lowest);
        for at in start + pad..start + width - pad {
            if lowest[at - start - 1] >= surface_m[at] && may_be_pit(at) {
                seen.breach(at, width, surface_m, height_m);
            }
        }
    }
}

/// Finds the least height of the eight vertices around each vertex of a row.
fn lowest_around(surface_m: &[f32], width: usize, start: usize, lowest: &mut [f32]) {
    let len = lowest.len();
    let from = |at: usize| &surface_m[at..at + len];
    let (north, here, south) = (start - width, start, start + width);
    lowest.copy_from_slice(from(north - 1));
    for others in [north, north + 1, here - 1, here + 1, south - 1, south, south + 1].map(from) {
        for (lowest, other) in lowest.iter_mut().zip(others) {
            *lowest = lowest.min(*other);
        }
    }
}

/// The square around a pit, as water rises in it.
#[derive(Default)]
struct PitFlood {
    /// Vertices that the water reaches next: the lowest first, and of equal ones the first in the square.
    shore: BinaryHeap<Reverse<(u32, usize)>>,
    /// For each vertex of the square, the vertex from which the water came; the vertex itself if no water came.
    from: Vec<usize>,
}

impl PitFlood {
    /// Cuts the way out of a pit, if there is one within reach.
    fn breach(&mut self, pit: usize, width: usize, surface_m: &[f32], height_m: &mut [f32]) {
        let in_world = |at: usize| pit + at / SIDE * width + at % SIDE - REACH as usize * (width + 1);
        let middle = SIDE * SIDE / 2;
        self.shore.clear();
        self.from.clear();
        self.from.extend(0..SIDE * SIDE);
        let mut came = [false; SIDE * SIDE];
        came[middle] = true;
        let top_m = surface_m[pit];
        let mut next = middle;
        let end = loop {
            let (x, y) = (next % SIDE, next / SIDE);
            for (x, y) in around(x, y).filter(|(x, y)| *x < SIDE && *y < SIDE) {
                let at = y * SIDE + x;
                if !came[at] {
                    (came[at], self.from[at]) = (true, next);
                    self.shore.push(Reverse((ordered(surface_m[in_world(at)]), at)));
                }
            }
            let Some(Reverse((_, lowest))) = self.shore.pop() else { return };
            next = lowest;
            if surface_m[in_world(next)] < top_m {
                break next;
            }
        };
        let way = || std::iter::successors(Some(end), |at| Some(self.from[*at]).filter(|from| from != at));
        let steps = way().count() - 1;
        let end_m = surface_m[in_world(end)];
        for (step, at) in way().enumerate().skip(1) {
            let most_m = end_m + (top_m - end_m) * step as f32 / steps as f32;
            let height_m = &mut height_m[in_world(at)];
            *height_m = height_m.min(most_m);
        }
    }
}

/// Returns the eight places around a place of the square, and the place itself. Beside the edges some lie outside.
fn around(x: usize, y: usize) -> impl Iterator<Item = (usize, usize)> {
    let beside = |at: usize| [at.wrapping_sub(1), at, at + 1];
    beside(y).into_iter().flat_map(move |row| beside(x).into_iter().map(move |column| (column, row)))
}

/// Maps heights to whole numbers in the same order.
fn ordered(height_m: f32) -> u32 {
    let bits = height_m.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slope that falls to the east, with a hollow of one vertex behind a sill `sill` vertices wide.
    fn hollow(area: Area, sill: i64) -> Vec<f32> {
        let height_m = |(x, y): (i64, i64)| {
            let in_hollow = x == 0 && y == 0;
            let on_sill = (1..=sill).contains(&x);
            // Lowest along the hollow's row, so the way out stays in that row.
            -x as f32
                + y.abs() as f32 * 0.5
                + if in_hollow {
                    -3.0
                } else if on_sill {
                    2.0
                } else {
                    0.0
                }
        };
        area.vertices().map(height_m).collect()
    }

    fn breached(area: Area, surface_m: &[f32], may_be_pit: bool) -> Vec<f32> {
        let mut height_m = surface_m.to_vec();
        breach(area, surface_m, |_| may_be_pit, &mut height_m);
        height_m
    }

    const AREA: Area = Area { x0: -30, y0: -30, x1: 31, y1: 31 };

    fn at(values: &[f32], x: i64) -> f32 {
        values[(-AREA.y0) as usize * AREA.width() + (x - AREA.x0) as usize]
    }

    #[test]
    fn the_way_out_of_a_hollow_falls_all_along() {
        let before = hollow(AREA, 2);
        let after = breached(AREA, &before, true);
        let way: Vec<f32> = (0..6).map(|x| at(&after, x)).collect();
        assert!(way.windows(2).all(|pair| pair[1] < pair[0]), "{way:?}");
        assert!(after.iter().zip(&before).all(|(after, before)| after <= before), "nothing rises");
        let changed = after.iter().zip(&before).filter(|(after, before)| after < before).count();
        assert_eq!(changed, 3, "the sill, and what lies behind it as high as the pit");
        assert_eq!(breached(AREA, &before, false), before, "what is no pit stays");
    }

    #[test]
    fn a_hollow_without_a_way_out_in_reach_stays() {
        let before: Vec<f32> = AREA.vertices().map(|(x, y)| (x * x + y * y) as f32).collect();
        assert_eq!(breached(AREA, &before, true), before);
    }

    #[test]
    fn nothing_outside_the_input_matters() {
        let part = Area::new(-5, -3, 9, 12);
        // A trench with a pit seven vertices west of the part. The lower one of its two ways out leads away from the
        // part.
        let trench = |(x, y): (i64, i64)| match x {
            _ if y != 0 => 100.0,
            -12 => 0.0,
            -19..-12 => 1.0,
            -11..=-5 => 2.0,
            _ => -1.0,
        };
        let before: Vec<f32> = AREA.vertices().map(trench).collect();
        let within = |area: Area| AREA.vertices().map(move |(x, y)| area.contains(&Area::new(x, y, 1, 1)));
        let read = before.iter().zip(within(input(part)));
        let poisoned: Vec<f32> = read.map(|(value, is_read)| if is_read { *value } else { f32::NAN }).collect();
        let of_part = |values: Vec<f32>| -> Vec<f32> {
            values.into_iter().zip(within(part)).filter(|(_, is_kept)| *is_kept).map(|(value, _)| value).collect()
        };
        assert_eq!(of_part(breached(AREA, &poisoned, true)), of_part(breached(AREA, &before, true)));
    }
}
