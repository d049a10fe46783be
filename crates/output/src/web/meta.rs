//! The metadata of a web map, which each of its files holds.

use std::ops::RangeInclusive;

use serde_json::{Value, json};

use crate::web::pyramid::{Bounds, Pyramid, TILE_PX};

/// Name and origin of a map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Meta {
    /// Name of the map, shown above it.
    pub name: String,
    /// A sentence about the map, such as its preset, seed and place.
    pub description: String,
    /// Version of the program that made the map.
    pub version: String,
}

/// Zoom levels from the coarsest to the one shown first, in which the bounds have 512 to 1024 pixels.
const FIRST_ZOOM: u8 = 2;

/// The metadata of an archive of tiles.
pub(super) struct Described {
    pub name: String,
    pub description: String,
    pub version: String,
    pub zooms: RangeInclusive<u8>,
    /// West, south, east and north.
    pub degrees: [f64; 4],
    /// Position of the tiles in the world.
    ground: Value,
}

impl Described {
    /// Describes the archive `title`. It has `scale` pixels per pixel of the plan, and its tiles are cut into those of
    /// `further` zoom levels deeper.
    pub fn new(pyramid: &Pyramid, meta: &Meta, title: &str, scale: u32, further: u8) -> Described {
        Described {
            name: format!("{} ({title})", meta.name),
            description: meta.description.clone(),
            version: meta.version.clone(),
            zooms: pyramid.min_zoom() + further..=pyramid.max_zoom() + further,
            degrees: pyramid.degrees(),
            ground: ground(pyramid, scale, further),
        }
    }

    /// Longitude, latitude and zoom of the first view.
    pub fn center(&self) -> (f64, f64, u8) {
        let [west, south, east, north] = self.degrees;
        let zoom = (self.zooms.start() + FIRST_ZOOM).min(*self.zooms.end());
        (f64::midpoint(west, east), f64::midpoint(south, north), zoom)
    }

    /// Returns the metadata of an archive as a JSON object.
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

/// Returns the position of the tiles in the world: metres of the bounds, of the square's corner and of a pixel of the
/// finest zoom.
pub(super) fn ground(pyramid: &Pyramid, scale: u32, further: u8) -> Value {
    let Bounds { west_m, south_m, east_m, north_m } = pyramid.bounds();
    json!({
        "bounds_m": [west_m, south_m, east_m, north_m],
        "corner_m": pyramid.corner_m(),
        "finest_m": pyramid.pixel_m(pyramid.max_zoom()) / f64::from(scale),
        "min_zoom": pyramid.min_zoom() + further,
        "max_zoom": pyramid.max_zoom() + further,
        "tile_px": (TILE_PX * i64::from(scale)) >> further,
    })
}
