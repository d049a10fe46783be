//! Raster images: what each shows, how, and under which name.

use crate::area::{Place, Region};
use crate::export::options::TileNames;
use crate::export::raster::quantity::Quantity;
use crate::export::raster::writer::Encoding;

/// One raster image of a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Image {
    /// Folder and name, without place and ending.
    pub stem: &'static str,
    pub quantity: &'static Quantity,
    pub encoding: Encoding,
    /// One a tile, or one of the region.
    pub tiles: bool,
    /// Whether it is one that no engine has asked for: files beside that of a region say to GIS where it lies, and those of tiles
    /// may be named after their place in the world.
    pub placed: bool,
    pub layout: Layout,
}

/// In which way an image lies in its file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub naming: Naming,
    pub edge: Edge,
    /// Of images of tiles; those of a region are written from the north.
    pub rows: RowOrder,
}

/// A small file beside a raster that says what the raster does not say itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    /// What bare samples are.
    Json,
    /// Where a picture lies, for nearly all GIS.
    WorldFile,
    /// That, on which plane, and what its values mean, for what reads with GDAL.
    Auxiliary,
}

impl Beside {
    /// Its path, beside a raster.
    pub fn path(self, raster: &str) -> String {
        match self {
            Beside::Json => format!("{raster}.json"),
            // First and last letter of the ending, and a w.
            Beside::WorldFile => raster.strip_suffix("png").expect("pictures are PNGs").to_owned() + "pgw",
            Beside::Auxiliary => format!("{raster}.aux.xml"),
        }
    }
}

/// How the file of a tile is named after its place in the region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Naming {
    /// `_x3_y0`: columns from the west, rows from the north.
    Marked,
    /// `_3_0`: columns from the west, rows from the south.
    Bare,
}

/// Whether the eastern and southern edge are in the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Edge {
    /// Neighbours have the vertices between them in common: one vertex more than cells.
    Shared,
    /// Every vertex is in one tile only: as many vertices as cells.
    Owned,
}

/// Which row is the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RowOrder {
    FromNorth,
    FromSouth,
}

impl Naming {
    /// What stands before each number.
    fn marks(self) -> [&'static str; 2] {
        match self {
            Naming::Marked => ["_x", "_y"],
            Naming::Bare => ["_", "_"],
        }
    }
}

impl Image {
    /// An image of a region, as it lies when no engine has asked for anything else.
    pub const fn new(stem: &'static str, quantity: &'static Quantity, encoding: Encoding) -> Image {
        let layout = Layout { naming: Naming::Marked, edge: Edge::Shared, rows: RowOrder::FromNorth };
        Image { stem, quantity, encoding, tiles: false, placed: false, layout }
    }

    /// Without the vertices that tiles share.
    pub const fn owned_only(self) -> Image {
        Image { layout: Layout { edge: Edge::Owned, ..self.layout }, ..self }
    }

    /// With names that count tiles from the south-west.
    pub const fn named_from_south(self) -> Image {
        Image { layout: Layout { naming: Naming::Bare, ..self.layout }, ..self }
    }

    /// With the southernmost row first.
    pub const fn upside_down(self) -> Image {
        Image { layout: Layout { rows: RowOrder::FromSouth, ..self.layout }, ..self }
    }

    /// The file in the folder of the bake, for the region or for a tile of it.
    pub fn file(&self, region: &Region, place: Option<Place>, names: TileNames) -> String {
        let (stem, extension) = (self.stem, self.encoding.extension());
        let Some(place) = place else { return format!("{stem}.{extension}") };
        let [col, row] = if self.placed { names } else { TileNames::Region }.numbers(region, place);
        let row = match self.layout.naming {
            Naming::Marked => row,
            // Unity counts tiles along z, which points north.
            Naming::Bare => region.rows() as i64 - 1 - row,
        };
        let [east, other] = self.layout.naming.marks();
        format!("{stem}{east}{col}{other}{row}.{extension}")
    }

    /// What stands beside it.
    pub const fn beside(&self) -> &'static [Beside] {
        match (self.encoding, self.placed && !self.tiles) {
            (Encoding::R16, _) => &[Beside::Json],
            (Encoding::Png, true) => &[Beside::WorldFile, Beside::Auxiliary],
            (Encoding::Exr, true) => &[Beside::Auxiliary],
            _ => &[],
        }
    }

    /// Width and height of an image of the whole region.
    pub fn size(&self, region: &Region) -> (u64, u64) {
        let less = match self.layout.edge {
            Edge::Shared => 0,
            Edge::Owned => 1,
        };
        (region.width() - less, region.height() - less)
    }

    /// The columns and rows of vertices that this image takes of the tile at a place.
    pub fn owned(&self, region: &Region, place: Place) -> (usize, usize) {
        let cells = region.tile_cells() as usize;
        match (self.layout.edge, self.tiles) {
            (Edge::Owned, _) => (cells, cells),
            (Edge::Shared, true) => (cells + 1, cells + 1),
            // In one raster each vertex has one pixel, so a shared edge is taken once.
            (Edge::Shared, false) => region.owned(place),
        }
    }
}
