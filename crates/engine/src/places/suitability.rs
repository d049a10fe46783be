//! Suitability of a place for a settlement: even and dry ground, near to water and to where waters meet, sheltered and
//! not too high.
//!
//! To judge the numbers chosen by eye, look at the places of settlements, on maps of all presets with places.

use crate::geometry::length;
use crate::land::WaterKind;
use crate::lines::FIXED;
use crate::places::fixed::FixedSegment;
use crate::places::plan_land::{PlanNode, PlanScale, Window};
use crate::places::river_index::RiverIndex;
use crate::places::settings::PlacesSettings;

/// Slope above which nobody builds; the flatter, the better.
// 14 degrees: steeper slopes need terraces. Chosen by eye.
const STEEP: f64 = 0.25;

/// Height in metres above the surface of the nearest river up to which land is flooded: about the rise of a river a few
/// metres deep in a hundred-year flood. Chosen by eye.
const FLOOD_M: f64 = 2.0;

/// Height in metres above the lowest land around from which on a place no longer counts as valley floor. Chosen by eye.
const FLOOR_M: f64 = 150.0;

/// Width in metres of a river above which its confluences and mouths count in full. Chosen by eye: brooks meet
/// everywhere, and few people live by that.
const WIDE_M: f64 = 5.0;

/// Shares of dry land around a shore: on a headland, which has no harbour, and in a bay, which shelters one.
// A straight coast has a little more than half, since settlements stand back from the shore.
const HEADLAND: f64 = 0.35;
const BAY: f64 = 0.65;

/// Weights of a place's merits: even ground, water nearby, a confluence or mouth, valley floor, and low altitude.
/// Chosen by eye on maps; their sum is 1.
const WEIGHTS: [f64; 5] = [0.25, 0.3, 0.2, 0.15, 0.1];

/// Distances in metres to waters that matter, chosen by eye. Small site cells have shorter ones.
#[expect(clippy::struct_field_names, reason = "the unit is a part of the name")]
pub(super) struct WaterRange {
    /// Least distance from the edge of a water to the middle of a settlement.
    pub dry_m: f64,
    /// Distance up to which a water counts in full.
    near_m: f64,
    /// Distance up to which a confluence or a mouth counts for a settlement.
    meet_m: f64,
    /// Distance beyond which a water counts for nothing.
    pub far_m: f64,
}

impl WaterRange {
    /// Returns the distances for site cells with sides of `site_m` metres.
    pub fn new(site_m: f64) -> WaterRange {
        let part = (site_m / 4000.0).min(1.0);
        WaterRange { dry_m: 60.0 * part, near_m: 300.0 * part, meet_m: 500.0 * part, far_m: 1000.0 * part }
    }

    /// Returns the merit of a water at a distance, 0 to 1.
    fn beside(&self, water_m: f64) -> f64 {
        ((self.far_m - water_m) / (self.far_m - self.near_m)).clamp(0.0, 1.0)
    }
}

/// Returns the suitability of a node for a settlement, 0 to 1, or `None` if nobody could live there.
pub(super) fn suitability(
    settings: &PlacesSettings,
    range: &WaterRange,
    scale: &PlanScale,
    window: &Window,
    rivers: &RiverIndex,
    at: PlanNode,
) -> Option<f64> {
    let height_m = window.height_m(at);
    if height_m > settings.max_height_m {
        return None;
    }
    // The mean slope of the place and its four neighbours, so that a settlement of some hundred metres finds room.
    let around = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)].map(|(dx, dy)| [at[0] + dx, at[1] + dy]);
    let sum: f64 = around.iter().map(|node| length(window.gradient(*node, scale.step_m()))).sum();
    let steepness = sum / around.len() as f64;
    if steepness > STEEP {
        return None;
    }
    let near = SiteSurroundings::new(window, rivers, scale, at, range);
    if near.shore_m.min(near.river_m) < range.dry_m.max(scale.step_m() / 2.0) || height_m < near.flood_m {
        return None;
    }
    let share = |value: f64| value.clamp(0.0, 1.0);
    let sheltered = share((near.dry - HEADLAND) / (BAY - HEADLAND));
    let goods = [
        1.0 - steepness / STEEP,
        range.beside(near.river_m).max(range.beside(near.shore_m) * sheltered),
        share(near.meet_m / WIDE_M),
        share(1.0 - (height_m - near.lowest_m) / FLOOR_M),
        // Above half of the greatest height, each further metre makes a place worth less.
        share(2.0 - 2.0 * height_m / settings.max_height_m.max(1.0)),
    ];
    Some(goods.iter().zip(WEIGHTS).map(|(good, weight)| good * weight).sum())
}

/// The surroundings of a position.
struct SiteSurroundings {
    /// Metres to the nearest lake or sea, capped at the range that matters.
    shore_m: f64,
    /// Metres to the edge of the nearest river, capped likewise.
    river_m: f64,
    /// Height in metres that the nearest river rises to in a flood.
    flood_m: f64,
    /// Width in metres of the river that joins at a confluence, or that flows into or out of a lake or the sea; 0 if
    /// there is none.
    meet_m: f64,
    /// Share of the nodes around that are dry.
    dry: f64,
    /// Height in metres of the lowest dry node around.
    lowest_m: f64,
}

impl SiteSurroundings {
    fn new(
        window: &Window,
        rivers: &RiverIndex,
        scale: &PlanScale,
        at: PlanNode,
        range: &WaterRange,
    ) -> SiteSurroundings {
        let sample_m = scale.step_m();
        let far = (range.far_m / sample_m) as i64;
        // Lakes and the sea are looked up by nodes, since they are no lines. Rivers are found by their pieces, since
        // they may pass between nodes.
        let (mut shore2, mut lowest_m, mut dry, mut all) = ((far * far) as f64, f64::INFINITY, 0, 0);
        for (dx, dy) in (-far..=far).flat_map(|dy| (-far..=far).map(move |dx| (dx, dy))) {
            let (square, node) = (dx * dx + dy * dy, [at[0] + dx, at[1] + dy]);
            if square > far * far || !window.holds(node) {
                continue;
            }
            all += 1;
            match window.water(node) {
                WaterKind::Dry => {
                    dry += 1;
                    lowest_m = f64::min(lowest_m, window.height_m(node));
                }
                WaterKind::River => {}
                WaterKind::Lake | WaterKind::Sea => shore2 = shore2.min(square as f64),
            }
        }
        let place = scale.fixed(at);
        let fixed_m = scale.spacing_m / FIXED as f64;
        let mut near = Vec::new();
        let (mut river_m, mut flood_m) = (range.far_m, f64::NEG_INFINITY);
        // Widths of the river pieces that cross the circle of radius `meet_m`: a river that flows through crosses it
        // twice, so a confluence shows as a third arm.
        let mut arms_m = Vec::new();
        for piece in rivers.around(place, &mut near) {
            let edge_m = piece.middle.distance2(place).sqrt() * fixed_m - piece.width_m / 2.0;
            if edge_m < river_m {
                (river_m, flood_m) = (edge_m, piece.surface_m(place) + FLOOD_M);
            }
            let is_inside = [piece.middle.from, piece.middle.to]
                .map(|end| FixedSegment { from: place, to: end }.length_m(scale.spacing_m) < range.meet_m);
            if is_inside[0] != is_inside[1] {
                arms_m.push(piece.width_m);
            }
        }
        arms_m.sort_by(|a, b| b.total_cmp(a));
        let shore_m = shore2.sqrt() * sample_m;
        let meeting = if shore_m < range.meet_m { 0 } else { 2 };
        let meet_m = arms_m.get(meeting).copied().unwrap_or(0.0);
        SiteSurroundings { shore_m, river_m, flood_m, meet_m, dry: f64::from(dry) / f64::from(all), lowest_m }
    }
}
