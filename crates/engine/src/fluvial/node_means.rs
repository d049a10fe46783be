//! The mean of finer nodes: land at strides so large that even the trunks' valleys are finer than its nodes.

use crate::area::Area;
use crate::grid::Grid;
use crate::land::{Land, Water, WaterKind};

/// Least depth of the sea and least height of land above it, in metres: so each node's height agrees with its kind.
const LEAST_M: f32 = 0.01;

/// Least share of a node's ground under rivers at which the node is a river.
const LEAST_RIVER: f32 = 0.1;

/// Largest number of finer nodes a side that are made at once.
const MOST_NODES: i64 = 512;

/// The land of an area of nodes, as it is filled in.
pub struct Means {
    /// Finer nodes from one node to the next: a power of two.
    finer: i64,
    sea_level_m: f32,
    heights: Grid<f32>,
    water: Water,
}

/// The weighted sums over the finer nodes of a node; the weights add up to 1.
#[derive(Clone, Copy, Default)]
struct Sums {
    sea: f32,
    lake: f32,
    river: f32,
    land_m: f32,
    sea_m: f32,
    depth_m: f32,
    flow_m3s: f32,
}

impl Means {
    /// Makes the land at the nodes of an area from finer nodes, of which there are `finer` from one node to the next
    /// and whose land `make` makes. Each node is the mean of the square around it, in which the finer nodes on the edge
    /// count half.
    pub fn of<E>(area: Area, finer: i64, sea_level_m: f32, make: impl Fn(Area) -> Result<Land, E>) -> Result<Land, E> {
        let mut means = Means { finer, sea_level_m, heights: Grid::filled(area, 0.0), water: Water::none(area) };
        for part in area.squares((MOST_NODES / finer).max(1) as usize) {
            means.fill(part, &make(around(part, finer))?);
        }
        Ok(Land { heights: means.heights, water: Some(means.water) })
    }

    /// Fills in a part of the area, from the land of the finer nodes around it.
    fn fill(&mut self, part: Area, land: &Land) {
        for (x, y) in part.vertices() {
            let sums = Sums::around([x, y], self.finer, land);
            let (height_m, kind, depth_m) = sums.mean(self.sea_level_m);
            let put = |grid: &mut Grid<f32>, value: f32| grid.row_mut(y, x, x + 1)[0] = value;
            put(&mut self.heights, height_m);
            put(&mut self.water.depth_m, depth_m);
            put(&mut self.water.flow_m3s, if kind == WaterKind::Sea { 0.0 } else { sums.flow_m3s });
            self.water.kind.row_mut(y, x, x + 1)[0] = kind;
        }
    }
}

impl Sums {
    /// Sums up the finer nodes around a node.
    fn around([x, y]: [i64; 2], finer: i64, land: &Land) -> Sums {
        let water = land.water.as_ref().expect("fluvial land knows its water");
        let half = finer / 2;
        let weight = |off: i64| if off.abs() == half { 0.5 / finer as f32 } else { 1.0 / finer as f32 };
        let mut sums = Sums::default();
        for dy in -half..=half {
            for dx in -half..=half {
                let ([x, y], weight) = ([x * finer + dx, y * finer + dy], weight(dx) * weight(dy));
                let height_m = land.heights.at(x, y);
                let kind = water.kind.at(x, y);
                if kind == WaterKind::Sea {
                    sums.sea += weight;
                    sums.sea_m += weight * height_m;
                    continue;
                }
                match kind {
                    WaterKind::Lake => sums.lake += weight,
                    WaterKind::River => sums.river += weight,
                    WaterKind::Dry | WaterKind::Sea => {}
                }
                sums.land_m += weight * height_m;
                sums.depth_m += weight * water.depth_m.at(x, y);
                sums.flow_m3s = sums.flow_m3s.max(water.flow_m3s.at(x, y));
            }
        }
        sums
    }

    /// Returns height, kind and depth of water at the node. The kind follows from the ground's largest part, and the
    /// height is the mean over sea alone or land alone.
    fn mean(&self, sea_level_m: f32) -> (f32, WaterKind, f32) {
        if self.sea >= 0.5 {
            let floor_m = (self.sea_m / self.sea).min(sea_level_m - LEAST_M);
            return (floor_m, WaterKind::Sea, sea_level_m - floor_m);
        }
        let land = 1.0 - self.sea;
        let height_m = (self.land_m / land).max(sea_level_m + LEAST_M);
        let (is_lake, is_river) = (self.lake >= 0.5 * land, self.river >= LEAST_RIVER * land);
        if !is_lake && !is_river {
            return (height_m, WaterKind::Dry, 0.0);
        }
        let depth_m = (self.depth_m / (self.lake + self.river)).max(LEAST_M);
        (height_m, if is_lake { WaterKind::Lake } else { WaterKind::River }, depth_m)
    }
}

/// Returns the finer nodes of which the nodes of an area are made.
fn around(area: Area, finer: i64) -> Area {
    let half = finer / 2;
    Area {
        x0: area.x0 * finer - half,
        y0: area.y0 * finer - half,
        x1: (area.x1 - 1) * finer + half + 1,
        y1: (area.y1 - 1) * finer + half + 1,
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn a_node_is_the_mean_of_what_it_covers_and_parts_agree() {
        let land = |area: Area| {
            let mut land = Land { heights: Grid::filled(area, 0.0), water: Some(Water::none(area)) };
            for (x, y) in area.vertices() {
                // A slope with the sea at its foot.
                let height_m = 3.0 * x as f32 + y as f32 + 0.5;
                land.heights.row_mut(y, x, x + 1)[0] = height_m;
                let water = land.water.as_mut().unwrap();
                if height_m < 0.0 {
                    water.kind.row_mut(y, x, x + 1)[0] = WaterKind::Sea;
                    water.depth_m.row_mut(y, x, x + 1)[0] = -height_m;
                }
            }
            Ok::<_, Infallible>(land)
        };
        let area = Area::new(-90, -40, 180, 90);
        for finer in [2, 8] {
            let Ok(whole) = Means::of(area, finer, 0.0, land);
            let water = whole.water.as_ref().unwrap();
            for (x, y) in area.vertices() {
                let (height_m, middle_m) = (whole.heights.at(x, y), (3 * x + y) as f32 * finer as f32 + 0.5);
                assert_eq!(water.kind.at(x, y) == WaterKind::Sea, height_m < 0.0, "{x},{y}");
                if middle_m.abs() > 4.0 * finer as f32 {
                    assert!((height_m - middle_m).abs() < 1e-3 * middle_m.abs(), "{height_m} at {x},{y}");
                }
            }
            for part in area.halves() {
                let Ok(land) = Means::of(part, finer, 0.0, land);
                assert_eq!(land.heights, whole.heights.part(part));
            }
        }
    }
}
