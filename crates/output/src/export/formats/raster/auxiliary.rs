//! `.aux.xml`: a sidecar file that GDAL, and so nearly every GIS, reads beside a raster. It holds the coordinate
//! reference system and the other metadata for which the raster's own format has no room.
//!
//! Based on: GDAL's Persistent Auxiliary Metadata, gdal.org, "PAM".

use std::fmt::Write;

use crate::export::formats::georeference::{Georeference, Plane};
use crate::export::formats::raster::quantity::Quantity;
use crate::export::formats::raster::statistics::Statistics;
use crate::export::formats::svg::escaped;
use crate::export::plan::digits::of_32_bits;

/// Returns the `.aux.xml` text for a raster of a quantity. `range_m` is the range of heights of 16-bit steps;
/// quantities without steps ignore it.
pub(super) fn auxiliary(
    plane: &Plane,
    place: Georeference,
    quantity: &Quantity,
    range_m: (f32, f32),
    statistics: Option<&Statistics>,
) -> String {
    let mut text = whereabouts(plane, place, "Point");
    let mut line = |line: std::fmt::Arguments| writeln!(text, "  {line}").expect("a String takes everything");
    for (number, about) in (1..).zip(quantity.channels) {
        line(format_args!("<PAMRasterBand band=\"{number}\">"));
        line(format_args!("  <Description>{}</Description>", escaped(about)));
        if quantity.is_steps() {
            let (min_m, max_m) = (of_32_bits(range_m.0), of_32_bits(range_m.1));
            line(format_args!("  <Offset>{min_m}</Offset>\n    <Scale>{}</Scale>", (max_m - min_m) / 65535.0));
        }
        if let Some(classes) = quantity.classes {
            line(format_args!("  <CategoryNames>"));
            for class in classes() {
                line(format_args!("    <Category>{}</Category>", escaped(&class.name)));
            }
            line(format_args!("  </CategoryNames>"));
        }
        if let Some(unit) = quantity.unit {
            line(format_args!("  <UnitType>{unit}</UnitType>"));
        }
        if let Some(statistics) = statistics.filter(|_| quantity.sample.is_grey()) {
            line(format_args!("  <Metadata>"));
            for (key, value) in statistics.items() {
                line(format_args!("    <MDI key=\"{key}\">{value}</MDI>"));
            }
            line(format_args!("  </Metadata>"));
        }
        line(format_args!("</PAMRasterBand>"));
    }
    text + END
}

/// Returns the `.aux.xml` text for a picture of a map.
pub(in crate::export) fn auxiliary_of_map(plane: &Plane, place: Georeference) -> String {
    whereabouts(plane, place, "Area") + END
}

const END: &str = "</PAMDataset>\n";

/// Returns the beginning of an `.aux.xml` text: the raster's plane (its coordinate reference system), its position, and
/// whether a pixel stands for an area or a point.
fn whereabouts(plane: &Plane, place: Georeference, pixel: &str) -> String {
    let mut text = String::from("<PAMDataset>\n");
    let mut line = |line: std::fmt::Arguments| writeln!(text, "  {line}").expect("a String takes everything");
    let [east, north] = place.corner_m();
    let spacing_m = place.spacing_m;
    line(format_args!("<SRS dataAxisToSRSAxisMapping=\"1,2\">{}</SRS>", escaped(&plane.wkt2())));
    line(format_args!("<GeoTransform>{east}, {spacing_m}, 0, {north}, 0, -{spacing_m}</GeoTransform>"));
    line(format_args!("<Metadata>\n    <MDI key=\"AREA_OR_POINT\">{pixel}</MDI>\n  </Metadata>"));
    text
}
