//! Vector exports: features and contours as files.
//!
//! ```text
//!   store.rs        features, tile by tile -> each feature once, sorted
//!   contours.rs     tiles -> contours
//!   vectors.rs      features and contours together, row of tiles by row
//!   clip.rs         a feature -> its parts in the region
//!   geopackage.rs   store -> one database
//!   geojson.rs      store -> a text file for each layer
//!   style.rs        a layer -> a QGIS style like that of terrane's maps
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
pub(super) use store::{FeatureStore, around};
pub(super) use style::LayerStyle;

use crate::export::formats::format::Request;
use crate::features::layer::GeometryType;
use crate::features::layers;
use crate::world::World;

/// Returns the largest number of bytes of features and contours that are kept of a vertex.
fn kept_a_vertex(request: &Request) -> u64 {
    const POINT_BYTES: f64 = 16.0;
    let Request { world, vectors, .. } = request;
    // A contour crosses the edge between two vertices once for each interval of their difference in height. Over a
    // whole row of tiles this difference is taken as half the distance at most. Each vertex has two edges of its own.
    let interval_m = vectors.contours_m.unwrap_or_else(|| contours::default_interval_m(world));
    let points = 2.0 * 0.5 * world.spacing_m() / interval_m;
    (POINT_BYTES * (1.0 + points)) as u64
}

/// Returns the layers of a world's GeoPackage and their styles, the uppermost first.
pub(super) fn drawn(world: &World) -> Vec<(&'static str, GeometryType, LayerStyle)> {
    const ORDER: [&str; 9] =
        ["sites", "peaks", "crossings", "roads", "rivers", "lakes", "coast", contours::NAME, "tiles"];
    let features = layers(world).iter().map(|layer| (layer.name(), layer.shape()));
    let all: Vec<_> = features.chain([(contours::NAME, contours::SHAPE), ("tiles", GeometryType::Polygon)]).collect();
    let of = |name: &&str| all.iter().find(|layer| layer.0 == *name).copied();
    let styled = |(name, shape)| style::of_layer(name, shape).map(|style| (name, shape, style));
    ORDER.iter().filter_map(of).filter_map(styled).collect()
}
