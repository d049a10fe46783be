//! Label placement: chooses which names a map shows and where. Every sheet that shows a name shows it in the same
//! place.
//!
//! Each name that could be shown is a feature with one or more candidates: possible places on the map, of which at most
//! one is taken. Where candidates overlap, the one of better rank is shown. That rule alone would let a name depend on
//! names a continent away, through a chain of overlapping names. So the chain is cut after a few links, and what a
//! sheet shows depends only on what lies within [`pad_px`] of the sheet.
//!
//! To judge the numbers chosen by eye, look at the names of winding rivers.

use std::cmp::Reverse;
use std::collections::HashSet;
use std::ops::Range;

use glam::{DVec2, dvec2};

use crate::hash;
use crate::map::plotter::{bounds, widened};
use crate::map::text::{MeasuredLine, Quad, Shaped, length};

/// Order of precedence of a candidate. The candidates of one feature differ only in their place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rank {
    /// The class of the feature: 0 comes first.
    pub class: u32,
    /// Weight of the feature within its class: the heavier comes first.
    pub weight: u64,
    /// Number that identifies the feature. Its hash breaks ties between equal classes and weights, as if by chance.
    pub feature: u64,
    /// Number of the place among the places of the feature: 0 is the best.
    pub place: u32,
}

impl Rank {
    /// Returns the sort key: the better rank has the lower key.
    fn order(&self) -> impl Ord + use<> {
        // Feature numbers often follow positions on the map. Unhashed, they would rank neighbours one after the other
        // and make long chains of overlapping names.
        (self.class, Reverse(self.weight), hash::scatter(self.feature), self.place)
    }
}

/// A label, such as a name, at a place where it could be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate<T> {
    /// Order of precedence among the candidates.
    pub rank: Rank,
    /// Boxes that the label covers, in pixels of a grid that all sheets share.
    pub boxes: Vec<Quad>,
    /// Content that is shown at this place.
    pub item: T,
}

/// Number of rounds in which candidates are decided. Each further round widens the margin around a sheet in which all
/// names must be known, by the length of a name. Where most names find a place, three rounds miss few of the names that
/// more rounds would show.
const ROUNDS: u32 = 3;

/// Distance in pixels around a sheet within which candidates and obstacles must be given to [`place`], so that the
/// sheet shows the same as any larger sheet does there.
///
/// `longest_px` is the largest extent of a feature with all its candidates. If any part of a feature lies within the
/// distance, [`place`] needs all candidates of the feature.
pub fn pad_px(longest_px: f64, margin_px: f64) -> f64 {
    // In each round, a feature depends on the features that touch it, which are one margin away and at most
    // `longest_px` long. The obstacles under the last of these features must be known too, hence the one more.
    f64::from(ROUNDS + 1) * (longest_px + margin_px)
}

#[derive(Clone, Copy, PartialEq)]
enum Decision {
    Undecided,
    Shown,
    Dropped,
}

/// Returns the candidates that are shown, best first: none within a margin of another, none over an obstacle, at most
/// one of each feature.
///
/// Works in rounds. A candidate is shown once all better candidates that overlap it or belong to its feature are
/// dropped. It is dropped once one of these is shown. Candidates still undecided after the last round are not shown.
/// The order in which candidates are given does not matter.
///
/// # Panics
/// When two candidates of a feature have the same place, or do not have the same class and weight.
pub fn place<T>(mut candidates: Vec<Candidate<T>>, obstacles: &[Quad], margin_px: f64) -> Vec<Candidate<T>> {
    candidates.sort_unstable_by_key(|candidate| candidate.rank.order());
    let features = features(&candidates);
    let (better, mut decisions) = rivals(&candidates, obstacles, margin_px);
    for _ in 0..ROUNDS {
        // Read only the states of the round before. With newer states, one decision could pass through many features in
        // a single round.
        let before = decisions.clone();
        for feature in &features {
            decide(feature.clone(), &better, &before, &mut decisions);
        }
    }
    let shown = candidates.into_iter().zip(decisions).filter(|(_, state)| *state == Decision::Shown);
    shown.map(|(candidate, _)| candidate).collect()
}

/// Sorts candidates by rank and returns the indices of those that influence whether the candidates selected by `asked`
/// are shown: all candidates of their features and of the features that they make room for, as many links away as
/// [`place`] looks.
///
/// So a caller needs to know the surroundings only around these candidates: as far as the extent of a feature and a
/// margin.
///
/// # Panics
/// Under the same conditions as [`place`].
pub fn concerned<T>(
    candidates: &mut [Candidate<T>],
    obstacles: &[Quad],
    margin_px: f64,
    asked: impl Fn(&Candidate<T>) -> bool,
) -> Vec<usize> {
    candidates.sort_unstable_by_key(|candidate| candidate.rank.order());
    let features = features(candidates);
    let (better, _) = rivals(candidates, obstacles, margin_px);
    let mut feature_of = vec![0; candidates.len()];
    for (number, feature) in features.iter().enumerate() {
        feature_of[feature.clone()].fill(number);
    }
    let mut is_reached = vec![false; features.len()];
    let mut reached: Vec<usize> = (0..candidates.len()).filter(|index| asked(&candidates[*index])).collect();
    for _ in 0..=ROUNDS {
        let mut next = Vec::new();
        for number in reached.into_iter().map(|index| feature_of[index]) {
            if !std::mem::replace(&mut is_reached[number], true) {
                next.extend(features[number].clone().flat_map(|index| better[index].iter().copied()));
            }
        }
        reached = next;
    }
    (0..candidates.len()).filter(|index| is_reached[feature_of[*index]]).collect()
}

/// Returns the range of indices of each feature's candidates, given candidates in the order of rank.
fn features<T>(candidates: &[Candidate<T>]) -> Vec<Range<usize>> {
    let twins = candidates.windows(2).any(|pair| pair[0].rank == pair[1].rank);
    assert!(!twins, "two candidates of a feature have the same place");
    let mut numbers = HashSet::new();
    let mut end = 0;
    let alike = |a: &Candidate<T>, b: &Candidate<T>| Rank { place: 0, ..a.rank } == Rank { place: 0, ..b.rank };
    candidates
        .chunk_by(alike)
        .map(|feature| {
            assert!(numbers.insert(feature[0].rank.feature), "the candidates of a feature differ in class or weight");
            end += feature.len();
            end - feature.len()..end
        })
        .collect()
}

/// Decides those candidates of a feature that the states of the round before allow to decide.
fn decide(feature: Range<usize>, better: &[Vec<usize>], before: &[Decision], decisions: &mut [Decision]) {
    if before[feature.clone()].contains(&Decision::Shown) {
        return;
    }
    // The candidates of a feature are decided one after the other within the round: they need no further round to see
    // each other's states.
    let mut waits = false;
    for candidate in feature.clone().filter(|candidate| before[*candidate] == Decision::Undecided) {
        let rivals = || better[candidate].iter().map(|rival| before[*rival]);
        if rivals().any(|rival| rival == Decision::Shown) {
            decisions[candidate] = Decision::Dropped;
        } else if waits || rivals().any(|rival| rival == Decision::Undecided) {
            waits = true;
        } else {
            decisions[feature].fill(Decision::Dropped);
            decisions[candidate] = Decision::Shown;
            return;
        }
    }
}

/// Finds, for each of the candidates in the order of rank, the better candidates of other features that overlap it.
/// Also returns the states before the first round, in which only candidates over an obstacle are decided: they are
/// dropped.
fn rivals<T>(candidates: &[Candidate<T>], obstacles: &[Quad], margin_px: f64) -> (Vec<Vec<usize>>, Vec<Decision>) {
    let mut better = vec![Vec::new(); candidates.len()];
    let mut decisions = vec![Decision::Undecided; candidates.len()];
    let mut boxes: Vec<_> = obstacles.iter().map(|quad| OwnedBox::new(None, *quad, margin_px)).collect();
    for (index, candidate) in candidates.iter().enumerate() {
        boxes.extend(candidate.boxes.iter().map(|quad| OwnedBox::new(Some(index), *quad, margin_px)));
    }
    each_near_pair(&boxes, |one, other| match (one.owner, other.owner) {
        (Some(a), Some(b)) => {
            let strangers = candidates[a].rank.feature != candidates[b].rank.feature;
            if strangers && overlap(&one.quad, &other.quad, margin_px) {
                better[a.max(b)].push(a.min(b));
            }
        }
        // The margin applies only between labels: a symbol may stand close to its own label.
        (Some(index), None) | (None, Some(index)) if overlap(&one.quad, &other.quad, 0.0) => {
            decisions[index] = Decision::Dropped;
        }
        _ => {}
    });
    (better, decisions)
}

/// A box of a candidate, or of an obstacle, which has no owner.
struct OwnedBox {
    owner: Option<usize>,
    quad: Quad,
    /// North-western and south-eastern corner of the bounding box, widened by half a margin.
    least: DVec2,
    greatest: DVec2,
}

impl OwnedBox {
    fn new(owner: Option<usize>, quad: Quad, margin_px: f64) -> OwnedBox {
        let [west, north, east, south] = widened(bounds(quad.iter()), 0.5 * margin_px);
        OwnedBox { owner, quad, least: dvec2(west, north), greatest: dvec2(east, south) }
    }
}

/// Calls `meet` once for each pair of boxes whose bounding boxes overlap.
fn each_near_pair(boxes: &[OwnedBox], mut meet: impl FnMut(&OwnedBox, &OwnedBox)) {
    // Grid cells are about as large as a box: most boxes lie in few cells, and most cells hold few boxes. The cell size
    // does not change which pairs are found.
    let extent = |one: &OwnedBox| one.greatest.x - one.least.x + one.greatest.y - one.least.y;
    let cell_px = (boxes.iter().map(extent).sum::<f64>() / (2.0 * boxes.len() as f64)).max(1.0);
    let cell = |place: DVec2| (place / cell_px).to_array().map(|axis| axis.floor() as i64);
    let mut entries = Vec::with_capacity(4 * boxes.len());
    for (index, one) in boxes.iter().enumerate() {
        let (from, to) = (cell(one.least), cell(one.greatest));
        entries.extend((from[1]..=to[1]).flat_map(|y| (from[0]..=to[0]).map(move |x| ([x, y], index))));
    }
    entries.sort_unstable();
    for group in entries.chunk_by(|a, b| a.0 == b.0) {
        for (ahead, (here, index)) in group.iter().enumerate() {
            let one = &boxes[*index];
            for other in group[..ahead].iter().map(|(_, index)| &boxes[*index]) {
                let (from, to) = (one.least.max(other.least), one.greatest.min(other.greatest));
                // Two boxes may share several cells. Report them only in the cell that holds the north-western corner
                // of their common part.
                if from.cmple(to).all() && cell(from) == *here {
                    meet(one, other);
                }
            }
        }
    }
}

/// True if at most a margin lies between two boxes, measured along the normals of their sides.
///
/// Based on: the separating axis theorem. Convex shapes that are apart are also apart along the normal of one of their
/// sides, and a box has two such normals.
pub fn overlap(a: &Quad, b: &Quad, margin_px: f64) -> bool {
    let apart = |[from, to]: [DVec2; 2]| {
        let normal = (from - to).perp();
        let range = |quad: &Quad| {
            let places = quad.map(|corner| corner.dot(normal));
            (places.into_iter().fold(f64::MAX, f64::min), places.into_iter().fold(f64::MIN, f64::max))
        };
        let ((a_least, a_greatest), (b_least, b_greatest)) = (range(a), range(b));
        (b_least - a_greatest).max(a_least - b_greatest) > margin_px * normal.length()
    };
    let sides = |quad: &Quad| [[quad[0], quad[1]], [quad[1], quad[2]]];
    !sides(a).into_iter().chain(sides(b)).any(apart)
}

/// Returns the places beside a symbol where the baseline of a name can begin, best first: right above, right, right
/// below, left above, left, left below, above, below.
///
/// `radius_px` is the radius of the symbol and of the clear space around it; no ink of the name comes nearer.
///
/// Based on: the order of Yoeli (The Logic of Automated Map Lettering, 1972), from the most to the least legible.
pub fn around_point(DVec2 { x, y }: DVec2, radius_px: f64, name: &Shaped) -> [DVec2; 8] {
    let [left, top, right, bottom] = name.ink;
    // A name diagonally above or below touches the circle with a corner.
    let corner = radius_px * 0.5f64.sqrt();
    // Beside the symbol, the middle of the small letters is level with the middle of the symbol.
    let beside = y + 0.5 * name.x_height;
    let middle = x - 0.5 * (left + right);
    let (above, below) = (y - corner - bottom, y + corner - top);
    [
        [x + corner - left, above],
        [x + radius_px - left, beside],
        [x + corner - left, below],
        [x - corner - right, above],
        [x - radius_px - right, beside],
        [x - corner - right, below],
        [middle, y - radius_px - bottom],
        [middle, y + radius_px - top],
    ]
    .map(DVec2::from)
}

/// A part of a line along which a name can be set.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelPath {
    /// Number of the repetition of the name along the line. Each repetition is a feature of its own.
    pub repetition: u32,
    /// Number of the place among the places of the repetition: 0 is the best.
    pub place: u32,
    /// The part of the line, smoothed, from left to right.
    pub line: Vec<DVec2>,
    /// Distance along the part at which the name begins.
    pub start: f64,
}

/// Distances of a repetition's places from its regular position along the line, in widths of the name. The regular
/// positions are evenly spaced.
const SHIFTS: [f64; 7] = [0.0, 0.3, -0.3, 0.6, -0.6, 0.9, -0.9];

/// Extra bend for which a place is still preferred, as a share of its length, for each width of the name that it is
/// nearer to the regular position. Chosen by eye.
const BEND_A_SHIFT: f64 = 0.03;

/// Finds places for a name `width_px` wide along a line. The name is repeated about every `repeat_px`, and the
/// straightest places of each repetition come first. Names read from left to right, or upwards if the line is steep.
/// Returns no places if the line is too short.
///
/// Bends shorter than about four times `smooth_px`, roughly the size of the letters, are smoothed away. The places
/// depend on the whole line, so give the whole line and not only the part that a sheet shows. All places of a
/// repetition lie within three widths of the name and twice `smooth_px`.
pub fn along_line(line: &[DVec2], width_px: f64, repeat_px: f64, smooth_px: f64) -> Vec<LabelPath> {
    // Smooth twice: at first, small wiggles make the line longer than it looks, so that steps along it are shorter on
    // the map.
    let smoothed = smooth(&smooth(line, smooth_px), smooth_px);
    let Some(measured) = MeasuredLine::new(&smoothed) else { return Vec::new() };
    // Leave room at both ends, so that rounding does not leave a name without its last letter.
    let half = 0.5 * width_px + smooth_px;
    let (first, last) = (half, measured.length() - half);
    if last < first {
        return Vec::new();
    }
    let count = (measured.length() / repeat_px).floor().max(1.0);
    let mut places = Vec::new();
    for repetition in 0..count as u32 {
        let middle = measured.length() * (f64::from(repetition) + 0.5) / count;
        let shifts = SHIFTS.map(|shift| (shift, middle + shift * width_px));
        let fitting = shifts.into_iter().filter(|(_, middle)| (first..=last).contains(middle));
        let mut choices: Vec<(f64, Vec<DVec2>)> = fitting
            .map(|(shift, middle)| {
                let part = part(&measured, middle - half, middle + half);
                (bend(&part) + BEND_A_SHIFT * shift.abs(), part)
            })
            .collect();
        // A stable sort: of equal choices, the first of the list stays first.
        choices.sort_by(|a, b| a.0.total_cmp(&b.0));
        places.extend((0..).zip(choices).map(|(place, (_, part))| {
            let line = left_to_right(part);
            let start = 0.5 * (length(&line) - width_px);
            LabelPath { repetition, place, line, start }
        }));
    }
    places
}

/// Returns a line without its short bends, through evenly spaced places. The ends stay in place.
fn smooth(line: &[DVec2], smooth_px: f64) -> Vec<DVec2> {
    let Some(measured) = MeasuredLine::new(line) else { return Vec::new() };
    // Eight averages of three neighbours, weighted 1, 2, 1, approximate a Gaussian with a standard deviation of two
    // steps.
    const MEANS: usize = 8;
    let steps = (measured.length() / (0.5 * smooth_px)).ceil().max(1.0) as usize;
    let mut places: Vec<_> =
        (0..=steps).map(|step| measured.place(measured.length() * step as f64 / steps as f64)).collect();
    for _ in 0..MEANS {
        let mean = |three: &[DVec2]| 0.25 * (three[0] + three[2]) + 0.5 * three[1];
        let inner: Vec<_> = places.windows(3).map(mean).collect();
        places[1..steps].copy_from_slice(&inner);
    }
    places
}

/// The part of a line between two distances along it.
fn part(measured: &MeasuredLine, from: f64, to: f64) -> Vec<DVec2> {
    let mut part = vec![measured.place(from)];
    part.extend(measured.between(from, to));
    part.push(measured.place(to));
    part
}

/// Share of a line's length by which the line is longer than the straight way between its ends: 0 for a straight line.
fn bend(line: &[DVec2]) -> f64 {
    1.0 - line[0].distance(line[line.len() - 1]) / length(line)
}

/// Turns a line so that it leads from left to right, or upwards if it is steep.
fn left_to_right(mut line: Vec<DVec2>) -> Vec<DVec2> {
    // Cosine of about 80 degrees, from which on a line counts as steep.
    const STEEP: f64 = 0.17;
    let way = line[line.len() - 1] - line[0];
    let steep = way.x.abs() < STEEP * way.length();
    if if steep { way.y > 0.0 } else { way.x < 0.0 } {
        line.reverse();
    }
    line
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::map::font::Face;
    use crate::map::text::shape;

    const MARGIN_PX: f64 = 2.0;

    /// A pseudo-random number from 0 to 1.
    fn chance(index: u64, what: u64) -> f64 {
        hash::share(hash::combine(index, what))
    }

    /// Candidates for the names of `count` towns at random points in a square.
    fn towns(count: u64, side_px: f64) -> Vec<Candidate<DVec2>> {
        let names = ["Au", "Sarnbruck", "Monte Castellone", "Holm"];
        let sizes = [12.0, 18.0, 26.0];
        let shaped = names.map(|name| sizes.map(|size| shape(name, Face::Regular, size, 0.0)));
        let town = |feature: u64| {
            let class = (3.0 * chance(feature, 0).sqrt()) as usize;
            let name = &shaped[(4.0 * chance(feature, 1)) as usize][2 - class];
            let at = side_px * dvec2(chance(feature, 2), chance(feature, 3));
            let weight = (4.0 * chance(feature, 4)) as u64;
            (0..).zip(around_point(at, 5.0, name)).map(move |(place, start)| Candidate {
                rank: Rank { class: class as u32, weight, feature, place },
                boxes: name.at(start, 0.0).boxes,
                item: start,
            })
        };
        (0..count).flat_map(town).collect()
    }

    fn touches<T>(candidate: &Candidate<T>, window: &Quad) -> bool {
        candidate.boxes.iter().any(|quad| overlap(quad, window, 0.0))
    }

    fn square(at: impl Into<DVec2>, side: f64) -> Quad {
        let at = at.into();
        [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y].map(|corner| at + side * corner)
    }

    /// Largest extent of any feature with all its candidates.
    fn longest(candidates: &[Candidate<DVec2>]) -> f64 {
        let corners = |feature: &[Candidate<DVec2>]| -> Vec<_> {
            feature.iter().flat_map(|candidate| candidate.boxes.iter().flatten().copied()).collect()
        };
        let extent = |feature: &[Candidate<DVec2>]| {
            let corners = corners(feature);
            let away = |a: &DVec2| corners.iter().map(|b| a.distance(*b)).fold(0.0, f64::max);
            corners.iter().map(away).fold(0.0, f64::max)
        };
        candidates.chunk_by(|a, b| a.rank.feature == b.rank.feature).map(extent).fold(0.0, f64::max)
    }

    #[test]
    fn a_window_shows_what_the_whole_shows_there() {
        let all = towns(20_000, 9_000.0);
        let whole = place(all.clone(), &[], MARGIN_PX);
        let pad = pad_px(longest(&all), MARGIN_PX);
        for start in [[4_000.0, 4_000.0], [4_300.5, 3_700.25], [0.0, 5_000.0], [8_500.0, 8_500.0]] {
            let (core, padded) = (square(start, 600.0), square(start.map(|axis| axis - pad), 600.0 + 2.0 * pad));
            let near = all.chunk_by(|a, b| a.rank.feature == b.rank.feature);
            let near = near.filter(|feature| feature.iter().any(|one| touches(one, &padded))).flatten().cloned();
            let near: Vec<_> = near.collect();
            assert!(near.len() > 5_000 && near.len() < all.len(), "{}", near.len());
            let in_core = |shown: &[Candidate<DVec2>]| -> Vec<_> {
                shown.iter().filter(|one| touches(one, &core)).cloned().collect()
            };
            let shown = in_core(&place(near, &[], MARGIN_PX));
            assert!(shown.len() > 20, "{}", shown.len());
            assert_eq!(shown, in_core(&whole));
        }
    }

    #[test]
    fn what_is_known_where_it_matters_is_enough() {
        let all = towns(20_000, 12_000.0);
        let whole = place(all.clone(), &[], MARGIN_PX);
        let longest = longest(&all);
        let reach = longest + MARGIN_PX;
        let features: Vec<&[Candidate<DVec2>]> = all.chunk_by(|a, b| a.rank.feature == b.rank.feature).collect();
        let edges = |feature: &&[Candidate<DVec2>]| bounds(feature.iter().flat_map(|one| &one.boxes).flatten());
        let edges: Vec<[f64; 4]> = features.iter().map(edges).collect();
        // Numbers of the features of which a candidate touches a square.
        let near = |square: &Quad| -> Vec<usize> {
            let [west, north, east, south] = bounds(square.iter());
            let may_touch = |[w, n, e, s]: [f64; 4]| w <= east && e >= west && n <= south && s >= north;
            let touching = |number: &usize| features[*number].iter().any(|one| touches(one, square));
            (0..features.len()).filter(|number| may_touch(edges[*number])).filter(touching).collect()
        };
        let of = |numbers: &BTreeSet<usize>| -> Vec<Candidate<DVec2>> {
            numbers.iter().flat_map(|number| features[*number]).cloned().collect()
        };
        for window in 0..12 {
            let start = [2, 3].map(|what| 1_000.0 + 9_500.0 * chance(window, what));
            let core = square(start, 300.0);
            let in_core = |shown: &[Candidate<DVec2>]| -> Vec<_> {
                shown.iter().filter(|one| touches(one, &core)).cloned().collect()
            };
            let first = square(start.map(|axis| axis - reach), 300.0 + 2.0 * reach);
            let mut numbers: BTreeSet<usize> = near(&first).into_iter().collect();
            let mut looked_at = BTreeSet::new();
            loop {
                let mut known = of(&numbers);
                let concerned = concerned(&mut known, &[], MARGIN_PX, |one| touches(one, &core));
                for candidate in concerned.into_iter().map(|index| &known[index]) {
                    if looked_at.insert((candidate.rank.feature, candidate.rank.place)) {
                        numbers.extend(near(&square(candidate.boxes[0][0] - reach, 2.0 * reach + longest)));
                    }
                }
                if of(&numbers).len() == known.len() {
                    break;
                }
            }
            let known = of(&numbers);
            assert_eq!(in_core(&place(known.clone(), &[], MARGIN_PX)), in_core(&whole), "{start:?}");
            let pad = pad_px(longest, MARGIN_PX);
            let in_pad = near(&square(start.map(|axis| axis - pad), 300.0 + 2.0 * pad)).into_iter().collect();
            let in_pad = of(&in_pad).len();
            assert!(known.len() < in_pad, "{} of {in_pad}", known.len());
        }
    }

    #[test]
    fn names_hear_of_those_that_they_make_room_for_and_of_theirs() {
        // Each name overlaps the next, which has a worse rank.
        let mut row: Vec<_> = (0..10).map(|index| one(0, 100 - index, index, 0, [index as f64 * 9.5, 0.0])).collect();
        let concerned = concerned(&mut row, &[], 0.0, |one| one.rank.feature == 9);
        let features: Vec<u64> = concerned.into_iter().map(|index| row[index].rank.feature).collect();
        assert_eq!(features, (9 - u64::from(ROUNDS)..=9).collect::<Vec<_>>());
    }

    #[test]
    fn a_long_chain_of_names_does_not_reach_past_the_pad() {
        // Each name overlaps the next, which has a worse rank. If the chain were not cut, the first name would decide
        // which of all the others are shown.
        let row =
            |from: u64| (from..100).map(|index| one(0, 100 - index, index, 0, [index as f64 * 9.5, 0.0])).collect();
        let reach_px = |from: u64| {
            let shown = place(row(from), &[], 0.0);
            shown.iter().map(|one| one.boxes[0][1][0] - from as f64 * 9.5).fold(0.0, f64::max)
        };
        for from in [0, 1, 50, 63] {
            assert!((15.0..pad_px(10.0, 0.0)).contains(&reach_px(from)), "{}", reach_px(from));
        }
    }

    #[test]
    fn none_overlap_and_only_what_conflicts_is_left_out() {
        let all = towns(1_500, 4_000.0);
        let obstacles: Vec<_> =
            (0..200).map(|index| square([chance(index, 7), chance(index, 8)].map(|at| at * 4_000.0), 9.0)).collect();
        let shown = place(all.clone(), &obstacles, MARGIN_PX);
        let conflict = |one: &Candidate<DVec2>, other: &Candidate<DVec2>| {
            one.rank.feature == other.rank.feature || overlap(&one.boxes[0], &other.boxes[0], MARGIN_PX)
        };
        for (index, one) in shown.iter().enumerate() {
            assert!(!shown[..index].iter().any(|other| conflict(one, other)));
            assert!(!obstacles.iter().any(|obstacle| overlap(obstacle, &one.boxes[0], 0.0)));
        }
        let open = all.iter().filter(|one| {
            let blocked = obstacles.iter().any(|obstacle| overlap(obstacle, &one.boxes[0], 0.0));
            !blocked && !shown.iter().any(|other| conflict(one, other))
        });
        let mut open: Vec<_> = open.map(|one| one.rank.feature).collect();
        open.dedup();
        assert!(open.len() <= shown.len() / 50, "{} of {} names are left out for nothing", open.len(), shown.len());
        assert!(shown.len() > 1_000, "{}", shown.len());
    }

    #[test]
    fn the_order_of_candidates_does_not_matter() {
        let all = towns(2_000, 2_000.0);
        let mut shuffled = all.clone();
        shuffled.sort_by_key(|one| hash::combine(one.rank.feature, u64::from(one.rank.place)));
        assert_eq!(place(all, &[], MARGIN_PX), place(shuffled, &[], MARGIN_PX));
    }

    /// A candidate that covers a square.
    fn one(class: u32, weight: u64, feature: u64, place: u32, at: [f64; 2]) -> Candidate<()> {
        Candidate { rank: Rank { class, weight, feature, place }, boxes: vec![square(at, 10.0)], item: () }
    }

    fn features(shown: &[Candidate<()>]) -> Vec<(u64, u32)> {
        shown.iter().map(|one| (one.rank.feature, one.rank.place)).collect()
    }

    #[test]
    fn the_better_rank_stays_and_the_other_takes_its_second_place() {
        let town = one(0, 1, 7, 0, [0.0, 0.0]);
        let city = one(0, 9, 8, 0, [5.0, 0.0]);
        let hamlet = one(1, 99, 9, 0, [9.0, 9.0]);
        let town_elsewhere = one(0, 1, 7, 1, [-15.0, 0.0]);
        assert_eq!(features(&place(vec![town.clone(), city.clone(), hamlet.clone()], &[], 0.0)), [(8, 0)]);
        assert_eq!(features(&place(vec![town.clone(), hamlet.clone()], &[], 0.0)), [(7, 0)]);
        assert_eq!(features(&place(vec![hamlet, town, city, town_elsewhere], &[], 0.0)), [(8, 0), (7, 1)]);
    }

    #[test]
    fn obstacles_win_and_names_keep_a_margin_from_each_other_alone() {
        let obstacle = [square([11.0, 0.0], 5.0)];
        assert_eq!(features(&place(vec![one(0, 0, 1, 0, [0.0, 0.0])], &obstacle, 3.0)), [(1, 0)]);
        assert_eq!(features(&place(vec![one(0, 0, 1, 0, [2.0, 0.0])], &obstacle, 3.0)), []);
        let pair = |gap: f64| vec![one(0, 0, 1, 0, [0.0, 0.0]), one(1, 0, 2, 0, [10.0 + gap, 0.0])];
        assert_eq!(features(&place(pair(2.5), &[], 3.0)), [(1, 0)]);
        assert_eq!(features(&place(pair(3.5), &[], 3.0)), [(1, 0), (2, 0)]);
    }

    #[test]
    #[should_panic(expected = "have the same place")]
    fn a_place_is_given_once() {
        place(vec![one(0, 0, 1, 0, [0.0, 0.0]), one(0, 0, 1, 0, [50.0, 0.0])], &[], 0.0);
    }

    #[test]
    #[should_panic(expected = "differ in class or weight")]
    fn a_feature_has_one_weight() {
        place(vec![one(0, 1, 1, 0, [0.0, 0.0]), one(0, 0, 1, 1, [50.0, 0.0]), one(0, 0, 2, 0, [0.0, 0.0])], &[], 0.0);
    }

    #[test]
    fn turned_boxes_overlap_where_their_bounds_are_not_enough() {
        let slanted = [[0.0, 0.0], [10.0, 10.0], [9.0, 11.0], [-1.0, 1.0]].map(DVec2::from);
        assert!(overlap(&slanted, &square([4.0, 5.0], 2.0), 0.0));
        assert!(!overlap(&slanted, &square([6.0, 0.0], 3.0), 0.0), "within the bounds, beside the box");
        assert!(overlap(&slanted, &square([6.0, 0.0], 3.0), 3.0));
        assert!(overlap(&slanted, &slanted, 0.0));
    }

    #[test]
    fn names_around_a_point_keep_clear_of_its_symbol() {
        let name = shape("Höglberg", Face::Semibold, 20.0, 0.0);
        let symbol = square([100.0 - 3.5, 100.0 - 3.5], 7.0);
        let places = around_point(dvec2(100.0, 100.0), 6.0, &name);
        for (index, start) in places.iter().enumerate() {
            let placed = name.at(*start, 0.0);
            assert!(!overlap(&placed.boxes[0], &symbol, 0.0), "place {index}");
            assert!(overlap(&placed.boxes[0], &symbol, 12.0), "place {index} is far off");
        }
        assert!(places[..3].iter().all(|start| start[0] > 100.0) && places[0][1] < places[1][1]);
        assert!(places[3..6].iter().all(|start| start[0] + name.width < 100.0) && places[5][1] > places[4][1]);
    }

    /// A meandering river that flows in the direction `way`.
    fn river(way: DVec2) -> Vec<DVec2> {
        let at = |step: i32| {
            let (far, aside) =
                (f64::from(step) * 4.0, 14.0 * libm::sin(f64::from(step) * 0.21) + 2.0 * chance(step as u64, 0));
            500.0 + way * far + way.perp() * aside
        };
        (0..600).map(at).collect()
    }

    #[test]
    fn names_along_a_line_read_from_left_to_right_and_can_be_set() {
        let name = shape("Steinach", Face::Italic, 16.0, 0.15);
        for way in [[1.0, 0.0], [-1.0, 0.0], [0.6, 0.8], [-0.8, 0.6], [0.0, 1.0], [0.0, -1.0]].map(DVec2::from) {
            let places = along_line(&river(way), name.width, 700.0, 16.0);
            let repetitions = places.iter().filter(|place| place.place == 0).count();
            assert!((3..=4).contains(&repetitions), "{repetitions}");
            assert!(places.len() > repetitions * 4);
            for LabelPath { line, start, .. } in places {
                let placed = name.along(&line, start, 3.0).expect("a gentle river has room for its name");
                let [first, last] = [&placed.glyphs[0], &placed.glyphs[7]].map(|glyph| glyph.at);
                let leads = last - first;
                assert!(leads.x > 0.0 || leads.y < 0.0, "{way:?}: {leads:?}");
                assert!(way.perp_dot(leads).abs() < 0.5 * leads.length(), "{way:?}: {leads:?}");
            }
        }
    }

    #[test]
    fn a_line_turned_around_has_its_names_in_the_same_places() {
        let mut line = river(dvec2(0.8, 0.6));
        let ends = |line: &[DVec2]| -> Vec<_> {
            let mut ends: Vec<_> =
                along_line(line, 120.0, 700.0, 16.0).iter().map(|place| place.line[0].round()).collect();
            ends.sort_by(|a, b| a.x.total_cmp(&b.x));
            ends
        };
        let before = ends(&line);
        line.reverse();
        assert_eq!(ends(&line), before);
    }

    #[test]
    fn the_straight_part_of_a_line_comes_first() {
        // Straight in the right half, wavy in the left half.
        let wave = |x: f64| if x < 300.0 { 30.0 * libm::sin(x * 0.05) } else { 0.0 };
        let line: Vec<_> = (0..=120).map(|step| f64::from(step) * 5.0).map(|x| dvec2(x, wave(x))).collect();
        let places = along_line(&line, 150.0, 10_000.0, 10.0);
        let middle = |place: &LabelPath| place.line[place.line.len() / 2][0];
        assert!(middle(&places[0]) > 350.0, "{}", middle(&places[0]));
        assert!((0..).zip(&places).all(|(index, one)| one.place == index && one.repetition == 0));
    }

    #[test]
    fn a_short_line_has_no_place_for_a_name() {
        assert_eq!(along_line(&[DVec2::ZERO, dvec2(100.0, 0.0)], 90.0, 500.0, 10.0), []);
        assert_eq!(along_line(&[DVec2::ZERO, dvec2(110.0, 0.0)], 90.0, 500.0, 10.0).len(), 1);
        assert_eq!(along_line(&[], 90.0, 500.0, 10.0), []);
    }
}
