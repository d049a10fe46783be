//! What rivers and roads look for.
//!
//! Based on: Grelsson (2014), sections 4.2 and 4.1. The thesis names the terms; their weights are the preset's.

use crate::agents::search::{Heuristic, Node};
use crate::agents::settings::{RiverAgents, RoadAgents};
use crate::agents::{Direction, Terrain};

/// A river goes down, and where it can choose, in its direction.
pub struct RiverHeuristic<'a, G> {
    ground: &'a mut G,
    agents: &'a RiverAgents,
    direction: Direction,
    lowest_m: f32,
}

impl<'a, G: Terrain> RiverHeuristic<'a, G> {
    /// The heuristic of a river that starts at `start`.
    pub fn new(ground: &'a mut G, agents: &'a RiverAgents, direction: Direction, start: Node) -> Self {
        let lowest_m = ground.height_m(start);
        RiverHeuristic::resumed(ground, agents, direction, lowest_m)
    }

    /// The heuristic of a river that goes on: `lowest_m` is the lowest ground that it has come through.
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

    /// Too far uphill is measured from the lowest point so far: a bed is dug through a bump, not through a mountain.
    fn refuses(&mut self, _from: Node, to: Node) -> bool {
        let height_m = self.ground.height_m(to);
        let refused = height_m > self.lowest_m + self.agents.max_climb_m as f32;
        self.lowest_m = self.lowest_m.min(height_m);
        refused
    }
}

/// A road goes in its direction, and where it can choose, over level ground; never back, and never where it is too steep.
///
/// The thesis has no such limit. As a rule that stops the road it would end half of the roads of mountains at their first
/// step, so it closes the way instead: a road goes around, and ends where all ways on are too steep.
pub struct RoadHeuristic<'a, G> {
    ground: &'a mut G,
    agents: &'a RoadAgents,
    direction: Direction,
}

impl<'a, G: Terrain> RoadHeuristic<'a, G> {
    /// The heuristic of a road.
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
