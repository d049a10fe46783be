//! Features as files that hold vectors.
//!
//! ```text
//!   store.rs        features, tile by tile -> each once, sorted       contours.rs   tiles -> contours
//!   vectors.rs      both, row of tiles by row
//!   clip.rs         what of a feature lies in the region
//!   geopackage.rs   store -> one database        geojson.rs   store -> a text a layer
//!   style.rs        a layer -> how QGIS draws it as our maps do
//! ```

mod clip;
mod contours;
mod geojson;
mod geopackage;
mod store;
mod style;
mod vectors;

pub(super) use geojson::GeoJson;
pub(super) use geopackage::{GeoPackage, PATH as GEOPACKAGE};
pub(super) use store::{FeatureStore, around, bytes_at_most};
pub(super) use style::LayerStyle;

use crate::features::layer::Shape;
use crate::features::layers;
use crate::world::World;

/// The layers of the GeoPackage of a world and how they are drawn, the uppermost first.
pub(super) fn drawn(world: &World) -> Vec<(&'static str, Shape, LayerStyle)> {
    const ORDER: [&str; 9] =
        ["sites", "peaks", "crossings", "roads", "rivers", "lakes", "coast", contours::NAME, "tiles"];
    let features = layers(world).iter().map(|layer| (layer.name(), layer.shape()));
    let all: Vec<_> = features.chain([(contours::NAME, contours::SHAPE), ("tiles", Shape::Polygon)]).collect();
    let of = |name: &&str| all.iter().find(|layer| layer.0 == *name).copied();
    let styled = |(name, shape)| style::of_layer(name, shape).map(|style| (name, shape, style));
    ORDER.iter().filter_map(of).filter_map(styled).collect()
}
