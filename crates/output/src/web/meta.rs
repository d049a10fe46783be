//! What a web map says of itself, in each of its files.

use std::ops::RangeInclusive;

use serde_json::{Value, json};

use crate::web::pyramid::{Bounds, Plan, TILE_PX};

/// What a map is called, and where it comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Meta {
    /// The map's name, shown above it.
    pub name: String,
    /// A sentence about it, such as its preset, seed and place.
    pub description: String,
    /// The version of what made it.
    pub version: String,
}

/// Zooms from the coarsest to that which is shown first: the bounds have 512 to 1024 pixels there.
const FIRST_ZOOM: u8 = 2;

/// What an archive of tiles says of itself.
pub(super) struct Described {
    pub name: String,
    pub description: String,
    pub version: String,
    pub zooms: RangeInclusive<u8>,
    /// West, south, east and north.
    pub degrees: [f64; 4],
    /// Where the tiles are in the world.
    ground: Value,
}

impl Described {
    /// The description of the archive `title` with `scale` pixels to one of the plan, whose tiles are cut into those of `further`
    /// zoom levels further.
    pub fn new(plan: &Plan, meta: &Meta, title: &str, scale: u32, further: u8) -> Described {
        Described {
            name: format!("{} ({title})", meta.name),
            description: meta.description.clone(),
            version: meta.version.clone(),
            zooms: plan.min_zoom() + further..=plan.max_zoom() + further,
            degrees: plan.degrees(),
            ground: ground(plan, scale, further),
        }
    }

    /// Longitude, latitude and zoom that are shown first.
    pub fn center(&self) -> (f64, f64, u8) {
        let [west, south, east, north] = self.degrees;
        let zoom = (self.zooms.start() + FIRST_ZOOM).min(*self.zooms.end());
        (f64::midpoint(west, east), f64::midpoint(south, north), zoom)
    }

    /// What archives hold besides tiles, as an object.
    pub fn json(&self) -> Value {
        json!({
            "name": self.name,
            "description": self.description,
            "version": self.version,
            "type": "baselayer",
            "terrane": self.ground,
        })
    }
}

/// Where the tiles are in the world: metres of the bounds, of the square's corner and of a pixel of the finest zoom.
pub(super) fn ground(plan: &Plan, scale: u32, further: u8) -> Value {
    let Bounds { west_m, south_m, east_m, north_m } = plan.bounds();
    json!({
        "bounds_m": [west_m, south_m, east_m, north_m],
        "corner_m": plan.corner_m(),
        "finest_m": plan.pixel_m(plan.max_zoom()) / f64::from(scale),
        "min_zoom": plan.min_zoom() + further,
        "max_zoom": plan.max_zoom() + further,
        "tile_px": (TILE_PX * i64::from(scale)) >> further,
    })
}
