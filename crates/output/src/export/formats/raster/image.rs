//! Raster images: the quantity that each one shows, its encoding, its layout and its file name.

use crate::area::{Place, Region};
use crate::export::formats::raster::quantity::Quantity;
use crate::export::formats::raster::writer::Encoding;
use crate::export::plan::options::TileNames;

/// One raster image of a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Image {
    /// Folder and file name, without the tile's numbers and the extension.
    pub stem: &'static str,
    pub quantity: &'static Quantity,
    pub encoding: Encoding,
    /// True if there is one file per tile; else there is one file of the whole region.
    pub tiles: bool,
    /// True if the image is not made for a game engine. Then sidecar files tell GIS where a region's image lies, and
    /// tiles may be named after their numbers in the world.
    pub placed: bool,
    pub layout: ImageLayout,
}

/// Naming of an image's files, their edges, and the order of their rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ImageLayout {
    pub naming: Naming,
    pub edge: EdgeVertices,
    /// Order of rows in images of tiles. Images of a region always begin in the north.
    pub rows: RowOrder,
}

/// A small sidecar file beside a raster, with the metadata that the raster itself cannot hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sidecar {
    /// JSON that describes a file of bare samples: size, sample type, order of bytes and rows, and range of heights.
    Json,
    /// World file: the position of a picture, for nearly every GIS.
    WorldFile,
    /// `.aux.xml`: position, plane, and the meaning of the values, for programs that read rasters with GDAL.
    Auxiliary,
}

impl Sidecar {
    /// Returns the path of this file beside a raster.
    pub fn path(self, raster: &str) -> String {
        match self {
            Sidecar::Json => format!("{raster}.json"),
            // The extension of a world file is the first and last letter of the picture's extension, and a w.
            Sidecar::WorldFile => raster.strip_suffix("png").expect("pictures are PNGs").to_owned() + "pgw",
            Sidecar::Auxiliary => format!("{raster}.aux.xml"),
        }
    }
}

/// Pattern by which a tile's file is named after its column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Naming {
    /// `_x3_y0`: columns from the west, rows from the north.
    Marked,
    /// `_3_0`: columns from the west, rows from the south.
    Bare,
}

/// Treatment of the vertices on the eastern and southern edges of a tile or region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EdgeVertices {
    /// Edges are included, so neighbouring tiles share the vertices between them: one vertex more than cells on each
    /// side.
    Shared,
    /// Eastern and southern edges are left out, so each vertex is in one tile only: as many vertices as cells.
    Owned,
}

/// Order of the rows in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowOrder {
    FromNorth,
    FromSouth,
}

impl Naming {
    /// Returns the texts before the column's and the row's number in a file name.
    fn marks(self) -> [&'static str; 2] {
        match self {
            Naming::Marked => ["_x", "_y"],
            Naming::Bare => ["_", "_"],
        }
    }
}

impl Image {
    /// Creates an image of a region in the usual layout: shared edges, and rows and names from the north-west.
    pub const fn new(stem: &'static str, quantity: &'static Quantity, encoding: Encoding) -> Image {
        let layout = ImageLayout { naming: Naming::Marked, edge: EdgeVertices::Shared, rows: RowOrder::FromNorth };
        Image { stem, quantity, encoding, tiles: false, placed: false, layout }
    }

    /// Returns this image without the vertices of the eastern and southern edges.
    pub const fn owned_only(self) -> Image {
        Image { layout: ImageLayout { edge: EdgeVertices::Owned, ..self.layout }, ..self }
    }

    /// Returns this image with file names that count tiles from the south-west.
    pub const fn named_from_south(self) -> Image {
        Image { layout: ImageLayout { naming: Naming::Bare, ..self.layout }, ..self }
    }

    /// Returns this image with the southernmost row first.
    pub const fn upside_down(self) -> Image {
        Image { layout: ImageLayout { rows: RowOrder::FromSouth, ..self.layout }, ..self }
    }

    /// Returns the path in the bake's folder of the tile's file at a place or, with `None`, of the region's file.
    pub fn file(&self, region: &Region, place: Option<Place>, names: TileNames) -> String {
        let (stem, extension) = (self.stem, self.encoding.extension());
        let Some(place) = place else { return format!("{stem}.{extension}") };
        let [col, row] = if self.placed { names } else { TileNames::Region }.numbers(region, place);
        let row = match self.layout.naming {
            Naming::Marked => row,
            // Unity counts tiles along its z axis, which points north.
            Naming::Bare => region.rows() as i64 - 1 - row,
        };
        let [east, other] = self.layout.naming.marks();
        format!("{stem}{east}{col}{other}{row}.{extension}")
    }

    /// Returns the sidecar files of this image.
    pub const fn beside(&self) -> &'static [Sidecar] {
        match (self.encoding, self.placed && !self.tiles) {
            (Encoding::R16, _) => &[Sidecar::Json],
            (Encoding::Png, true) => &[Sidecar::WorldFile, Sidecar::Auxiliary],
            (Encoding::Exr, true) => &[Sidecar::Auxiliary],
            _ => &[],
        }
    }

    /// Returns the width and height in pixels of an image of the whole region.
    pub fn size(&self, region: &Region) -> (u64, u64) {
        let less = match self.layout.edge {
            EdgeVertices::Shared => 0,
            EdgeVertices::Owned => 1,
        };
        (region.width() - less, region.height() - less)
    }

    /// Returns the number of columns and rows of vertices that this image takes from the tile at a place.
    pub fn owned(&self, region: &Region, place: Place) -> (usize, usize) {
        let cells = region.tile_cells() as usize;
        match (self.layout.edge, self.tiles) {
            (EdgeVertices::Owned, _) => (cells, cells),
            (EdgeVertices::Shared, true) => (cells + 1, cells + 1),
            // A raster of the region has one pixel per vertex, so only one of two tiles gives their shared edge.
            (EdgeVertices::Shared, false) => region.owned(place),
        }
    }
}
