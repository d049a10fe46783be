//! Surroundings of a vertex that affect its ground: rock above it, and water beside it.
//!
//! Rubble and damp spread from vertex to vertex, in steps of four, of two and of one, so that three rounds cross seven
//! vertices. A vertex takes the most that any of its neighbours brings, so the order in which they are looked at does
//! not matter.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Water, WaterKind};
use crate::simd::{Kernel, Simd, dispatch, starts};
use crate::tile::rule::{GroundRule, clamp, ramp, steepness};

/// Steps of the rounds in vertices, and the distance that they cover together.
pub(crate) const STEPS: [usize; 3] = [4, 2, 1];
pub(crate) const REACH: usize = STEPS[0] + STEPS[1] + STEPS[2];

/// Returns the area of heights that the surroundings of an area depend on, including those for the slope of the
/// furthest vertex.
pub(super) const fn input(area: Area) -> Area {
    area.padded(REACH + 1)
}

/// Slopes, in metres up a metre, of the way along which rubble comes down: below the first all of it stays where it is,
/// above the second all of it rolls on. They are slopes of 17 and 27 degrees; rubble comes to rest at 30 to 38.
const ROLLS: [f32; 2] = [0.3, 0.5];

/// The share of rubble that rolls on is linear in the rise: this is its constant term.
pub(super) const ROLL_SHIFT: f32 = -ROLLS[0] / (ROLLS[1] - ROLLS[0]);

/// Metres on level ground over which damp loses as much as over a metre up a bank.
const CLIMB: f32 = 5.0;

/// Discharge in cubic metres a second from which on a river wets as much ground as a lake does. A sixteenth of it wets
/// half as much: the floor of a valley widens more slowly than its river.
const LARGE_M3S: f32 = 2.0;

/// Constants of a round, for straight and for diagonal ways: the loss on the way from a neighbour, and the factor that
/// turns a rise in metres into a share of rubble that rolls.
#[derive(Clone, Copy, Debug)]
pub(super) struct Round {
    pub losses: [f32; 2],
    pub roll_scales: [f32; 2],
}

impl Round {
    /// Returns the round with steps of so many vertices.
    fn new(step: usize, spacing_m: f32, reach_m: f32) -> Round {
        let straight_m = step as f32 * spacing_m;
        let ways_m = [straight_m, straight_m * std::f32::consts::SQRT_2];
        Round {
            losses: ways_m.map(|way_m| way_m / reach_m),
            roll_scales: ways_m.map(|way_m| 1.0 / (way_m * (ROLLS[1] - ROLLS[0]))),
        }
    }

    /// Returns all rounds in their order.
    #[cfg(feature = "gpu")]
    pub fn all(spacing_m: f32, reach_m: f32) -> [Round; STEPS.len()] {
        STEPS.map(|step| Round::new(step, spacing_m, reach_m))
    }
}

/// Surroundings of the vertices of an area.
#[derive(Debug)]
pub(super) struct GroundSurroundings {
    /// Rubble that comes from above: 1 beneath rock, 0 out of its reach. Where rock stands, rubble is at least as much
    /// as the share of rock.
    pub rubble: Grid<f32>,
    /// Damp from nearby water: 1 at a lake, 0 out of its reach.
    pub damp: Grid<f32>,
    /// Noise for ragged edges, about -1 to 1.
    pub noise: Grid<f32>,
}

impl GroundSurroundings {
    /// Computes the surroundings of an area; `None` where the rule does not look at them.
    ///
    /// # Panics
    /// When `heights` or `water` does not hold the area's [`input`].
    pub fn new(
        rule: &GroundRule,
        heights: &Grid<f32>,
        water: Option<&Water>,
        area: Area,
    ) -> Option<GroundSurroundings> {
        if !rule.is_ragged {
            return None;
        }
        let mut noise = Grid::filled(area, 0.0);
        if let Some(fractal) = &rule.noise {
            fractal.fill(area, None, noise.values_mut());
        }
        let none = || Grid::filled(area, 0.0);
        Some(GroundSurroundings {
            rubble: rubble(rule, heights, area).unwrap_or_else(none),
            damp: damp(rule, heights, water, area).unwrap_or_else(none),
            noise,
        })
    }
}

/// Returns the rubble of an area; `None` where there is no rock from which it could come.
fn rubble(rule: &GroundRule, heights: &Grid<f32>, area: Area) -> Option<Grid<f32>> {
    let reach_m = rule.scree?.reach_m;
    let mut rock = Grid::filled(area.padded(REACH), 0.0);
    let is_there = dispatch(Rock { rule, heights, to: &mut rock });
    is_there.then(|| spread::<true>(rock, heights, area, rule.spacing_m, reach_m))
}

/// Returns the damp of an area; `None` where no water is near.
fn damp(rule: &GroundRule, heights: &Grid<f32>, water: Option<&Water>, area: Area) -> Option<Grid<f32>> {
    let (wet_m, water) = rule.wet_m.zip(water)?;
    let wide = area.padded(REACH);
    let mut near = Grid::filled(wide, 0.0);
    // Banks rise from the water's surface, so its depth is added to the ground.
    let mut levels_m = Grid::filled(wide, 0.0);
    let mut is_there = false;
    let Area { x0, y0, x1, y1 } = wide;
    for y in y0..y1 {
        let (near, levels_m) = (near.row_mut(y, x0, x1), levels_m.row_mut(y, x0, x1));
        levels_m.copy_from_slice(heights.row(y, x0, x1));
        let kinds = water.kind.row(y, x0, x1);
        let is_fresh = |kind: &WaterKind| matches!(kind, WaterKind::River | WaterKind::Lake);
        let Some(first) = kinds.iter().position(is_fresh) else { continue };
        let last = kinds.iter().rposition(is_fresh).unwrap_or(first);
        let [depths, flows] = [&water.depth_m, &water.flow_m3s].map(|grid| grid.row(y, x0, x1));
        for column in first..=last {
            near[column] = match kinds[column] {
                WaterKind::Dry | WaterKind::Sea => continue,
                WaterKind::Lake => 1.0,
                WaterKind::River => (flows[column] / LARGE_M3S).sqrt().sqrt().min(1.0),
            };
            levels_m[column] += depths[column];
        }
        is_there = true;
    }
    is_there.then(|| spread::<false>(near, &levels_m, area, rule.spacing_m, wet_m))
}

/// Writes the share of rock at each vertex, equal to that of the blend weights, and returns whether there is any rock.
struct Rock<'a> {
    rule: &'a GroundRule,
    heights: &'a Grid<f32>,
    to: &'a mut Grid<f32>,
}

impl Kernel for Rock<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Area { x0, y0, x1, y1 } = self.to.area();
        let width = (x1 - x0) as usize;
        let (zero, one) = (simd.splat(0.0), simd.splat(1.0));
        let scale = simd.splat(self.rule.half_per_spacing);
        let mut most = zero;
        for y in y0..y1 {
            let north = self.heights.row(y - 1, x0, x1);
            let middle = self.heights.row(y, x0 - 1, x1 + 1);
            let south = self.heights.row(y + 1, x0, x1);
            let to = self.to.row_mut(y, x0, x1);
            for from in starts(width, S::LANES) {
                // The same arithmetic as for normals, to the last bit: rock then has exactly as much rubble as its own
                // share.
                let rise_east = (simd.load(&middle[from + 2..]) - simd.load(&middle[from..])) * scale;
                let rise_south = (simd.load(&south[from..]) - simd.load(&north[from..])) * scale;
                let up = one / simd.sqrt((rise_east * rise_east + rise_south * rise_south) + one);
                let bare = ramp(simd, steepness(simd, up, self.rule), self.rule.rock);
                simd.store(bare, &mut to[from..]);
                most = simd.max(most, bare);
            }
        }
        simd.any(simd.lt(zero, most))
    }
}

/// Spreads the sources up to [`REACH`] vertices around an area over the area: rubble downhill, or damp on level ground.
fn spread<const DOWNHILL: bool>(
    sources: Grid<f32>,
    levels_m: &Grid<f32>,
    area: Area,
    spacing_m: f32,
    reach_m: f32,
) -> Grid<f32> {
    let (mut spread, mut left) = (sources, REACH);
    for step in STEPS {
        left -= step;
        let mut to = Grid::filled(area.padded(left), 0.0);
        dispatch(SpreadRound::<DOWNHILL> { from: &spread, levels_m, step, spacing_m, reach_m, to: &mut to });
        spread = to;
    }
    spread
}

/// One round: every vertex takes the most of its own value and of those that the eight neighbours, `step` vertices
/// away, bring.
struct SpreadRound<'a, const DOWNHILL: bool> {
    from: &'a Grid<f32>,
    levels_m: &'a Grid<f32>,
    step: usize,
    spacing_m: f32,
    reach_m: f32,
    to: &'a mut Grid<f32>,
}

impl<const DOWNHILL: bool> Kernel for SpreadRound<'_, DOWNHILL> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Area { x0, y0, x1, y1 } = self.to.area();
        let (width, step, pad) = ((x1 - x0) as usize, self.step, self.step as i64);
        let zero = simd.splat(0.0);
        let Round { losses, roll_scales } = Round::new(self.step, self.spacing_m, self.reach_m);
        let roll_shift = simd.splat(ROLL_SHIFT);
        let climb = simd.splat(CLIMB / self.reach_m);
        for y in y0..y1 {
            let rows = [y - pad, y, y + pad];
            let froms = rows.map(|y| self.from.row(y, x0 - pad, x1 + pad));
            let levels = rows.map(|y| self.levels_m.row(y, x0 - pad, x1 + pad));
            let to = self.to.row_mut(y, x0, x1);
            for first in starts(width, S::LANES) {
                let mut most = simd.load(&froms[1][first + step..]);
                let mut around = most;
                for neighbour in 0..9 {
                    around = simd.max(around, simd.load(&froms[neighbour / 3][first + neighbour % 3 * step..]));
                }
                // Most places get nothing from anywhere, and no vertex has less than 0.
                if !simd.any(simd.lt(zero, around)) {
                    simd.store(zero, &mut to[first..]);
                    continue;
                }
                let here_m = simd.load(&levels[1][first + step..]);
                for neighbour in 0..9 {
                    let (row, column) = (neighbour / 3, neighbour % 3);
                    if row == 1 && column == 1 {
                        continue;
                    }
                    let way = usize::from(row != 1 && column != 1);
                    let there = first + column * step;
                    let has = simd.load(&froms[row][there..]);
                    let rise_m = simd.load(&levels[row][there..]) - here_m;
                    let brings = if DOWNHILL {
                        has * clamp(simd, rise_m * simd.splat(roll_scales[way]) + roll_shift) - simd.splat(losses[way])
                    } else {
                        has - simd.splat(losses[way]) - simd.max(-rise_m, zero) * climb
                    };
                    most = simd.max(most, brings);
                }
                simd.store(most, &mut to[first..]);
            }
        }
    }
}
