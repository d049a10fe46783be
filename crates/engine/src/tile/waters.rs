//! The water that is seen on a tile, whatever its source: fluvial relief, or, over land of noise, the sea and the
//! rivers that agents have dug.

use crate::area::Stride;
use crate::fluvial::settings::RIVER_WIDTH_M;
use crate::land::WaterKind;
use crate::lines::DugWaters;
use crate::tile::{Tile, TileView};
use crate::world::World;

/// The water at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WaterHere {
    /// The kind of water.
    pub kind: WaterKind,
    /// Depth of the water in metres, from the bed to the surface; 0 where it is dry.
    pub depth_m: f32,
    /// Discharge of the channel in cubic metres a second; 0 off the channels.
    ///
    /// Agents' rivers have no discharge of their own: theirs is the discharge of an equally wide river in a fluvial
    /// world with the default `river_width_m`.
    pub flow_m3s: f32,
}

impl TileView<'_> {
    /// Returns the water that is seen at a vertex.
    ///
    /// # Panics
    /// When the vertex is not one of the tile's.
    pub fn water(self, x: i64, y: i64) -> WaterHere {
        let TileView { tile, world } = self;
        if let Some(water) = &tile.water {
            let (depth_m, flow_m3s) = (water.depth_m.at(x, y), water.flow_m3s.at(x, y));
            return WaterHere { kind: water.kind.at(x, y), depth_m, flow_m3s };
        }
        let under_sea_m = world.preset().sea_level_m.map_or(0.0, |sea_m| sea_m as f32 - tile.heights.at(x, y));
        if under_sea_m > 0.0 {
            return WaterHere { kind: WaterKind::Sea, depth_m: under_sea_m, flow_m3s: 0.0 };
        }
        let Some(dug) = tile.imprint.as_ref().and_then(|imprint| imprint.dug()).filter(|dug| dug.is_wet(x, y)) else {
            return WaterHere::default();
        };
        let waters = tile.dug_waters();
        WaterHere {
            kind: WaterKind::River,
            // Where a bank has a share of the vertex, the water is shallower by this share.
            depth_m: waters.depth_m.at(x, y) * dug.water.at(x, y),
            flow_m3s: flow_m3s(waters.width_m.at(x, y)),
        }
    }
}

impl Tile {
    /// Returns the waters of the rivers that agents have dug on the tile.
    fn dug_waters(&self) -> &DugWaters {
        let lines = self.lines.iter().chain(&self.crossings).map(AsRef::as_ref);
        self.derived.dug_waters.get_or_init(|| DugWaters::new(lines, self.area))
    }
}

/// Returns the discharge in cubic metres a second of a river of some width in metres: widths grow as the root of the
/// discharge.
fn flow_m3s(width_m: f32) -> f32 {
    let roots = width_m / RIVER_WIDTH_M as f32;
    roots * roots
}

/// Tells whether a world may have rivers anywhere.
pub fn has_rivers(world: &World) -> bool {
    let of_agents = world.preset().rivers.is_some() && world.stride() == Stride::ONE;
    of_agents || world.relief().fluvial().is_some()
}

/// Tells whether a world may have water anywhere.
pub fn has_water(world: &World) -> bool {
    has_rivers(world) || world.preset().sea_level_m.is_some()
}
