//! Heuristics of the search: the costs by which rivers and roads choose their way.
//!
//! Based on: Grelsson (2014), sections 4.2 and 4.1. The thesis names the terms of the costs; the weights come from the
//! preset.

use crate::agents::search::{Heuristic, Node};
use crate::agents::settings::{RiverAgents, RoadAgents};
use crate::agents::{Direction, Terrain};

/// A river prefers to go downhill, and on equal ground in its assigned direction.
pub struct RiverHeuristic<'a, G> {
    ground: &'a mut G,
    agents: &'a RiverAgents,
    direction: Direction,
    lowest_m: f32,
}

impl<'a, G: Terrain> RiverHeuristic<'a, G> {
    /// Creates the heuristic of a river that starts at `start`.
    pub fn new(ground: &'a mut G, agents: &'a RiverAgents, direction: Direction, start: Node) -> Self {
        let lowest_m = ground.height_m(start);
        RiverHeuristic::resumed(ground, agents, direction, lowest_m)
    }

    /// Creates the heuristic of a river that continues; `lowest_m` is the lowest ground that it has passed.
    pub fn resumed(ground: &'a mut G, agents: &'a RiverAgents, direction: Direction, lowest_m: f32) -> Self {
        RiverHeuristic { ground, agents, direction, lowest_m }
    }
}

impl<G: Terrain> Heuristic for RiverHeuristic<'_, G> {
    fn stride(&self) -> i64 {
        1
    }

    fn score(&mut self, from: Node, to: Node, step: Direction) -> Option<f32> {
        let rise_m = self.ground.height_m(to) - self.ground.height_m(from);
        let along = step.along(self.direction) as f32;
        Some(self.agents.height_weight as f32 * rise_m - self.agents.direction_weight as f32 * along)
    }

    /// Climbing is measured from the lowest ground so far: a river digs its bed through a bump, but not through a
    /// mountain.
    fn refuses(&mut self, _from: Node, to: Node) -> bool {
        let height_m = self.ground.height_m(to);
        let refused = height_m > self.lowest_m + self.agents.max_climb_m as f32;
        self.lowest_m = self.lowest_m.min(height_m);
        refused
    }
}

/// A road prefers its assigned direction, and level ground. It never turns back, and never enters ground that is too
/// steep.
///
/// The thesis has no limit of steepness. If too steep ground ended a road, half of the roads in mountains would end at
/// their first step. So such ground is closed to roads instead: a road goes around it, and ends where every way on is
/// too steep.
pub struct RoadHeuristic<'a, G> {
    ground: &'a mut G,
    agents: &'a RoadAgents,
    direction: Direction,
}

impl<'a, G: Terrain> RoadHeuristic<'a, G> {
    /// Creates the heuristic of a road.
    pub fn new(ground: &'a mut G, agents: &'a RoadAgents, direction: Direction) -> Self {
        RoadHeuristic { ground, agents, direction }
    }
}

impl<G: Terrain> Heuristic for RoadHeuristic<'_, G> {
    fn stride(&self) -> i64 {
        self.agents.step_cells as i64
    }

    fn score(&mut self, _from: Node, to: Node, step: Direction) -> Option<f32> {
        if step == self.direction.opposite() {
            return None;
        }
        let along = step.along(self.direction) as f32;
        let steepness = self.ground.steepness(to);
        if steepness > self.agents.max_steepness as f32 {
            return None;
        }
        Some(self.agents.steepness_weight as f32 * steepness - self.agents.direction_weight as f32 * along)
    }

    fn refuses(&mut self, _from: Node, to: Node) -> bool {
        self.ground.steepness(to) > self.agents.max_steepness as f32 || self.ground.is_under_water(to)
    }
}
