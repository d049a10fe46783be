//! The surface of a tile: all that follows from its land and from the imprint of lines.

use crate::area::{Area, TileId};
use crate::clock::{Clock, stage};
use crate::land::Land;
use crate::lines::Imprint;
use crate::stop::Stopped;
use crate::tile::ground_climate::GroundClimate;
use crate::tile::{Blend, GroundRule, Normals, shaped_input};
use crate::world::World;

/// Normals, materials and imprint of a tile's land.
#[derive(Debug)]
pub(crate) struct TileSurface {
    pub normals: Normals,
    pub blend: Blend,
    /// The imprint of lines in the land; `None` where they have left none.
    pub imprint: Option<Imprint>,
}

impl TileSurface {
    /// Lets the imprint of lines shape a tile's land. Returns the land that the tile depends on, and its surface.
    ///
    /// # Panics
    /// When `land` does not hold the tile's [input](shaped_input).
    pub fn of_land(
        world: &World,
        id: TileId,
        mut land: Land,
        mut imprint: Option<Imprint>,
        clock: &Clock,
    ) -> Result<(Land, TileSurface), Stopped> {
        let cells = id.area(world.tile_cells());
        let shaped = shaped_input(world, cells);
        if let Some(imprint) = &imprint {
            clock.time(stage::IMPRINT, || imprint.shape(&mut land.heights, land.water.as_ref()))?;
        }
        if land.heights.area() != shaped {
            land = land.part(shaped);
            imprint = imprint.map(|imprint| imprint.part(shaped));
        }
        let climate = clock.time(stage::BLEND, || GroundClimate::new(world, &land.heights, cells))?;
        let surface = TileSurface::new(&GroundRule::of(world), climate.as_ref(), &land, imprint, cells, clock)?;
        Ok((land, surface))
    }

    /// Computes the surface of the vertices of `area`, given their climate, if they have one, and the land around them
    /// as shaped by lines, and books the time of each stage on `clock`.
    ///
    /// # Panics
    /// When `land` does not hold the [input](crate::tile::shaped_input) of the area.
    pub fn new(
        rule: &GroundRule,
        climate: Option<&GroundClimate>,
        land: &Land,
        imprint: Option<Imprint>,
        area: Area,
        clock: &Clock,
    ) -> Result<TileSurface, Stopped> {
        let Land { heights, water } = land;
        // Central differences, which reach across the tile's edge.
        let normals = clock.time(stage::NORMALS, || Normals::new(heights, area, rule.spacing_m()))?;
        // Materials, with the sand and dirt of lines on top.
        let blend = clock.time(stage::BLEND, || {
            let mut blend = Blend::new(rule, climate, heights, water.as_ref(), &normals);
            if let Some(imprint) = &imprint {
                blend.cover_with(imprint);
            }
            blend
        })?;
        Ok(TileSurface { normals, blend, imprint })
    }
}
