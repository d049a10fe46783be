//! The surface of a tile: all that follows from its land and from what lines have done to it.

use crate::area::Area;
use crate::clock::{Clock, stage};
use crate::land::Land;
use crate::lines::Imprint;
use crate::tile::{Blend, GroundRule, Normals};

/// What lies on the land of a tile.
#[derive(Debug)]
pub(crate) struct Surface {
    pub normals: Normals,
    pub blend: Blend,
    /// What lines have done to the land; `None` where they have done nothing.
    pub imprint: Option<Imprint>,
}

impl Surface {
    /// The surface of the vertices of `area`, given the land around them as lines have left it, with the time of each stage booked
    /// on `clock`.
    ///
    /// # Panics
    /// When `land` does not hold the [input](crate::tile::shaped_input) of the area.
    pub fn new(rule: &GroundRule, land: &Land, imprint: Option<Imprint>, area: Area, clock: &Clock) -> Surface {
        let Land { heights, water } = land;
        // Normals and slopes from differences across the edge.
        let normals = clock.time(stage::NORMALS, || Normals::new(heights, area, rule.spacing_m()));
        // What the ground is made of.
        let blend = clock.time(stage::BLEND, || {
            let mut blend = Blend::new(rule, heights, water.as_ref(), &normals);
            if let Some(imprint) = &imprint {
                blend.cover_with(imprint);
            }
            blend
        });
        Surface { normals, blend, imprint }
    }
}
