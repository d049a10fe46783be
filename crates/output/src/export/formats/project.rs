//! `region.qgz`: a QGIS project with all layers of a bake that GIS can read, drawn like terrane's maps.
//!
//! Based on: the projects that QGIS 3.22 writes; QGIS fills in what this one leaves out. The file is an archive with
//! one document.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::bake::FileRecord;
use crate::error::Error;
use crate::export::formats::format::Format;
use crate::export::formats::georeference::Plane;
use crate::export::formats::raster::quantity::RasterClass;
use crate::export::formats::raster::{self, RasterLayer};
use crate::export::formats::svg::escaped;
use crate::export::formats::vector::{self, GeoPackage};
use crate::export::plan::Plan;
use crate::features::layer::GeometryType;
use crate::file::write_whole;
use crate::map::style::Colour;

/// The file in the folder of the bake.
pub(crate) const PATH: &str = "region.qgz";

/// Prefix of the layers' ids: QGIS takes no id of fewer than eleven letters.
const ID: &str = "terrane_layer_";

/// Writes the project of a bake that has vectors for GIS.
pub(crate) fn write(plan: &Plan, out: &Path) -> Result<Option<FileRecord>, Error> {
    if !plan.exports().iter().any(|export| export.name() == GeoPackage.name()) {
        return Ok(None);
    }
    let document = Project::new(plan).document();
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // Without a time, so that the same bake has the same bytes.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut pack = || {
        archive.start_file("region.qgs", options)?;
        archive.write_all(document.as_bytes())
    };
    pack().expect("memory takes everything");
    let bytes = archive.finish().expect("memory takes everything").into_inner();
    Ok(Some(FileRecord::new(PATH.to_owned(), GeoPackage.name(), write_whole(out.join(PATH), &bytes)?)))
}

/// A project under way.
struct Project {
    title: String,
    /// XML element of the coordinate reference system of all layers.
    plane: String,
    extent: String,
    range_m: (f32, f32),
    /// XML of the layer tree, the uppermost layer first, and of the layers' definitions.
    tree: String,
    layers: String,
}

impl Project {
    fn new(plan: &Plan) -> Project {
        let (world, region) = (plan.world(), plan.region());
        let plane = Plane::new(plan.preset_name(), world.seed());
        let [west, south, east, north] = region.bounds_km(world.spacing_m()).map(|km| km * 1000.0);
        let wkt = escaped(&plane.wkt2());
        let name = escaped(plane.name());
        let mut project = Project {
            title: escaped(&format!("{}, seed {}", plan.preset_name(), world.seed())),
            plane: format!(
                "<spatialrefsys><wkt>{wkt}</wkt><srsid>0</srsid><srid>0</srid><authid></authid>\
                 <description>{name}</description><geographicflag>false</geographicflag></spatialrefsys>"
            ),
            extent: format!("<xmin>{west}</xmin><ymin>{south}</ymin><xmax>{east}</xmax><ymax>{north}</ymax>"),
            range_m: plan.height_range_m(),
            tree: String::new(),
            layers: String::new(),
        };
        // Labels are drawn above lines, and lines above polygons.
        for (name, shape, style) in vector::drawn(world) {
            project.add_vector(name, shape, &style, name != "tiles");
        }
        // Below the vectors one raster is visible: the map, or else heights, or else colours. The other rasters are in
        // the list, but hidden.
        let rasters = raster::layers(plan.exports().iter().map(|export| export.name()));
        let lowest =
            |layer: &&RasterLayer| ["map", "height", "colour"].iter().position(|name| layer.name == *name).unwrap_or(9);
        let shown = rasters.iter().min_by_key(lowest).map(|layer| layer.name);
        for layer in &rasters {
            // The map of a walk is transparent where there are no tiles.
            let is_transparent = plan.walk().is_some() && layer.name == "map";
            project.add_raster(layer, Some(layer.name) == shown, is_transparent);
        }
        project
    }

    fn add(&mut self, name: &str, source: &str, provider: &str, is_shown: bool) {
        let checked = if is_shown { "Qt::Checked" } else { "Qt::Unchecked" };
        _ = writeln!(
            self.tree,
            "<layer-tree-layer id=\"{ID}{name}\" name=\"{name}\" source=\"{source}\" providerKey=\"{provider}\" \
             checked=\"{checked}\" expanded=\"0\"/>"
        );
    }

    fn add_vector(&mut self, name: &str, shape: GeometryType, style: &vector::LayerStyle, is_shown: bool) {
        let source = format!("./{}|layername={name}", vector::GEOPACKAGE);
        self.add(name, &source, "ogr", is_shown);
        let geometry = match shape {
            GeometryType::Point => "Point",
            GeometryType::Line | GeometryType::LineZ => "Line",
            GeometryType::Polygon => "Polygon",
        };
        let labels = style.labels.as_deref().unwrap_or_default();
        _ = writeln!(
            self.layers,
            "<maplayer type=\"vector\" geometry=\"{geometry}\" styleCategories=\"AllStyleCategories\" labelsEnabled=\"{}\">\n\
             <id>{ID}{name}</id><datasource>{source}</datasource><layername>{name}</layername><srs>{}</srs>\
             <provider encoding=\"UTF-8\">ogr</provider>\n{}{labels}</maplayer>",
            u8::from(style.labels.is_some()),
            self.plane,
            style.renderer,
        );
    }

    fn add_raster(&mut self, layer: &RasterLayer, is_shown: bool, is_transparent: bool) {
        let (name, source) = (layer.name, format!("./{}", layer.path));
        self.add(name, &source, "gdal", is_shown);
        let renderer = match layer.channels {
            // A hillshade with the same light as on terrane's maps.
            1 if name == "height" => {
                "<rasterrenderer type=\"hillshade\" band=\"1\" azimuth=\"315\" angle=\"45\" zfactor=\"1\" multidirection=\"1\" \
                 alphaBand=\"-1\" opacity=\"1\"/>"
                    .to_owned()
            }
            1 if let Some(classes) = layer.classes => {
                let entry = |(value, class): (usize, RasterClass)| {
                    let colour = Colour(class.colour);
                    let name = escaped(&class.name);
                    format!("<paletteEntry value=\"{value}\" color=\"{colour}\" alpha=\"255\" label=\"{name}\"/>")
                };
                let entries: String = classes().into_iter().enumerate().map(entry).collect();
                format!(
                    "<rasterrenderer type=\"paletted\" band=\"1\" alphaBand=\"-1\" opacity=\"1\">\
                     <colorPalette>{entries}</colorPalette></rasterrenderer>"
                )
            }
            1 => {
                let [min, max] = layer.shown.unwrap_or([0.0, f64::from(self.range_m.1)]);
                format!(
                    "<rasterrenderer type=\"singlebandgray\" grayBand=\"1\" gradient=\"BlackToWhite\" alphaBand=\"-1\" \
                     opacity=\"1\"><minMaxOrigin><limits>MinMax</limits><extent>WholeRaster</extent></minMaxOrigin>\
                     <contrastEnhancement><minValue>{min}</minValue><maxValue>{max}</maxValue>\
                     <algorithm>StretchToMinimumMaximum</algorithm></contrastEnhancement></rasterrenderer>"
                )
            }
            // Of weights only the first three channels are shown: the fourth has no colour left.
            _ => format!(
                "<rasterrenderer type=\"multibandcolor\" redBand=\"1\" greenBand=\"2\" blueBand=\"3\" alphaBand=\"{}\" \
                 opacity=\"1\"/>",
                if is_transparent { 4 } else { -1 }
            ),
        };
        _ = writeln!(
            self.layers,
            "<maplayer type=\"raster\" styleCategories=\"AllStyleCategories\">\n<id>{ID}{name}</id>\
             <datasource>{source}</datasource><layername>{name}</layername><srs>{}</srs><provider>gdal</provider>\n\
             <pipe>{renderer}<rasterresampler zoomedInResampler=\"bilinear\" zoomedOutResampler=\"bilinear\" \
             maxOversampling=\"4\"/></pipe></maplayer>",
            self.plane
        );
    }

    fn document(&self) -> String {
        let Project { title, plane, extent, tree, layers, .. } = self;
        format!(
            "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n<qgis projectname=\"{title}\" version=\"3.22.0\">\n\
             <title>{title}</title>\n<projectCrs>{plane}</projectCrs>\n<layer-tree-group>\n{tree}</layer-tree-group>\n\
             <projectlayers>\n{layers}</projectlayers>\n\
             <mapcanvas name=\"theMapCanvas\" annotationsVisible=\"1\"><units>meters</units><extent>{extent}</extent>\
             <rotation>0</rotation><destinationsrs>{plane}</destinationsrs></mapcanvas>\n\
             <properties><Paths><Absolute type=\"bool\">false</Absolute></Paths>\
             <SpatialRefSys><ProjectionsEnabled type=\"int\">1</ProjectionsEnabled></SpatialRefSys></properties>\n</qgis>\n"
        )
    }
}
