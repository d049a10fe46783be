//! The surface of a tile: all that follows from its land and from the imprint of lines.

use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::land::Land;
use crate::lines::Imprint;
use crate::tile::{Blend, GroundRule, Normals};

/// Normals, materials and imprint of a tile's land.
#[derive(Debug)]
pub(crate) struct TileSurface {
    pub normals: Normals,
    pub blend: Blend,
    /// The imprint of lines in the land; `None` where they have left none.
    pub imprint: Option<Imprint>,
}

impl TileSurface {
    /// Computes the surface of the vertices of `area`, given the land around them as shaped by lines, and books the
    /// time of each stage on `clock`.
    ///
    /// # Panics
    /// When `land` does not hold the [input](crate::tile::shaped_input) of the area.
    pub fn new(rule: &GroundRule, land: &Land, imprint: Option<Imprint>, area: Area, clock: &Clock) -> TileSurface {
        let Land { heights, water } = land;
        // Central differences, which reach across the tile's edge.
        let normals = clock.time(stage::NORMALS, || Normals::new(heights, area, rule.spacing_m()));
        // Materials, with the sand and dirt of lines on top.
        let blend = clock.time(stage::BLEND, || {
            let mut blend = Blend::new(rule, heights, water.as_ref(), &normals);
            if let Some(imprint) = &imprint {
                blend.cover_with(imprint);
            }
            blend
        });
        TileSurface { normals, blend, imprint }
    }
}
