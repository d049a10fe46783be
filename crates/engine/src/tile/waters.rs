//! The water that is seen on a tile, whoever has brought it: that of fluvial relief; over land of noise the sea, and the rivers that
//! agents have dug.

use crate::area::Stride;
use crate::fluvial::settings::RIVER_WIDTH_M;
use crate::land::WaterKind;
use crate::lines::DugWaters;
use crate::tile::{Tile, TileView};
use crate::world::World;

/// What water there is at a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WaterHere {
    /// Its kind.
    pub kind: WaterKind,
    /// Metres from the bed to the surface; 0 where it is dry.
    pub depth_m: f32,
    /// Discharge in cubic metres a second of the channel; 0 off the channels.
    ///
    /// Agents know none: that of their rivers is the discharge of a river that is as wide in a fluvial world with the default
    /// `river_width_m`.
    pub flow_m3s: f32,
}

impl TileView<'_> {
    /// The water that is seen at a vertex.
    ///
    /// # Panics
    /// When it is not one of the tile's.
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
            // Where a bank has a share of the vertex the water is less deep.
            depth_m: waters.depth_m.at(x, y) * dug.water.at(x, y),
            flow_m3s: flow_m3s(waters.width_m.at(x, y)),
        }
    }
}

impl Tile {
    /// The waters of the rivers that agents have dug on it.
    fn dug_waters(&self) -> &DugWaters {
        let lines = self.lines.iter().chain(&self.crossings).map(AsRef::as_ref);
        self.derived.dug_waters.get_or_init(|| DugWaters::new(lines, self.area))
    }
}

/// Cubic metres a second of a river that is so many metres wide: widths grow as the root of the discharge.
fn flow_m3s(width_m: f32) -> f32 {
    let roots = width_m / RIVER_WIDTH_M as f32;
    roots * roots
}

/// Whether there are rivers in a world, if only somewhere.
pub fn has_rivers(world: &World) -> bool {
    let of_agents = world.preset().rivers.is_some() && world.stride() == Stride::ONE;
    of_agents || world.relief().fluvial().is_some()
}

/// Whether there is any water in a world, if only somewhere.
pub fn has_water(world: &World) -> bool {
    has_rivers(world) || world.preset().sea_level_m.is_some()
}
