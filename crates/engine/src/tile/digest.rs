//! Digests: hashes of a tile's parts, the cheapest proof that two tiles agree.

use std::fmt;

use crate::area::Area;
use crate::grid::Grid;
use crate::land::WaterKind;
use crate::lines::{Line, LineEnd, RoadClass};
use crate::places::site::Site;
use crate::tile::Tile;

/// A part of a tile that has a hash of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TilePart {
    /// Heights in metres, as 32-bit floats, row by row.
    Heights,
    /// Normals as 32-bit floats: all east components, then all up, then all south.
    Normals,
    /// Blend weights, a byte each: grass, dirt, rock and sand of all vertices, then snow, forest, scree and wetland of
    /// all.
    Blend,
    /// Kinds of water, a byte each: 0 none, 1 river, 2 lake, 3 sea.
    Water,
    /// Depths of the water in metres, as 32-bit floats.
    Depth,
    /// Discharges in cubic metres a second, as 32-bit floats.
    Flow,
    /// Beds of channels, a byte each: 1 where a vertex lies in a bed, else 0.
    Beds,
    /// The rivers and roads that concern the tile, each whole.
    Lines,
    /// The settlements on the tile.
    Sites,
}

impl TilePart {
    /// All parts, in the order of lists.
    pub const ALL: [TilePart; 9] = [
        TilePart::Heights,
        TilePart::Normals,
        TilePart::Blend,
        TilePart::Water,
        TilePart::Depth,
        TilePart::Flow,
        TilePart::Beds,
        TilePart::Lines,
        TilePart::Sites,
    ];

    /// Returns the name in lists and in the registry.
    pub const fn name(self) -> &'static str {
        ["heights", "normals", "blend", "water", "depth", "flow", "beds", "lines", "sites"][self as usize]
    }
}

/// The BLAKE3 hash of each part of a tile. It covers the tile's own vertices, edges included, row by row from the
/// north-western one.
///
/// All numbers are hashed least significant byte first, so that the hashes are the same on every machine. A tile of a
/// relief without water has no hashes of water and beds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest([Option<blake3::Hash>; TilePart::ALL.len()]);

impl Digest {
    /// Makes a digest of the given hashes, in the order of [`TilePart::ALL`].
    pub fn new(hashes: [Option<blake3::Hash>; TilePart::ALL.len()]) -> Digest {
        Digest(hashes)
    }

    /// Returns the hash of a part, if the tile has it.
    pub fn of(&self, part: TilePart) -> Option<blake3::Hash> {
        self.0[part as usize]
    }

    /// Returns all parts with their hashes.
    pub fn parts(&self) -> impl Iterator<Item = (TilePart, Option<blake3::Hash>)> {
        TilePart::ALL.into_iter().zip(self.0)
    }
}

impl fmt::Display for Digest {
    /// Writes all hashes in full, separated by spaces, with `-` for parts that the tile does not have. A precision
    /// limits the number of digits of each hash.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, hash) in self.0.iter().enumerate() {
            let separator = if index > 0 { " " } else { "" };
            match hash {
                Some(hash) => write!(f, "{separator}{}", &hash.to_hex()[..f.precision().unwrap_or(64)])?,
                None => write!(f, "{separator}-")?,
            }
        }
        Ok(())
    }
}

impl Tile {
    /// Hashes everything that the tile holds.
    pub fn digest(&self) -> Digest {
        let area = self.area();
        let water = self.water();
        let floats = |grid: &Grid<f32>| hash(area, [grid], f32::to_le_bytes);
        let of = |part| match part {
            TilePart::Heights => Some(floats(self.heights())),
            TilePart::Normals => Some(hash(area, self.normals().axes(), f32::to_le_bytes)),
            TilePart::Blend => Some(hash(area, [self.blend().ground(), self.blend().cover()], u32::to_le_bytes)),
            TilePart::Water => water.map(|water| hash(area, [&water.kind], |kind: WaterKind| [kind as u8])),
            TilePart::Depth => water.map(|water| floats(&water.depth_m)),
            TilePart::Flow => water.map(|water| floats(&water.flow_m3s)),
            TilePart::Beds => water.map(|water| hash(area, [&water.bed], |bed: bool| [u8::from(bed)])),
            TilePart::Lines => Some(of_texts(self.lines().iter().map(|line| bytes_of_line(line)))),
            TilePart::Sites => Some(of_texts(self.sites().iter().map(|site| bytes_of_site(site)))),
        };
        Digest(TilePart::ALL.map(of))
    }
}

/// Hashes the values of an area in some grids, one grid after the other.
fn hash<T: Copy, const N: usize>(
    area: Area,
    grids: impl IntoIterator<Item = impl std::ops::Deref<Target = Grid<T>>>,
    bytes: impl Fn(T) -> [u8; N],
) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    // Each grid is hashed in one piece, since long pieces are hashed several times as fast.
    let mut piece = Vec::with_capacity(area.len() * N);
    for grid in grids {
        piece.clear();
        for y in area.y0..area.y1 {
            piece.extend(grid.row(y, area.x0, area.x1).iter().flat_map(|value| bytes(*value)));
        }
        hasher.update(&piece);
    }
    hasher.finalize()
}

/// Hashes a list of byte strings, each preceded by its length.
fn of_texts(texts: impl Iterator<Item = Vec<u8>>) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    for text in texts {
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(&text);
    }
    hasher.finalize()
}

fn bytes_of_line(line: &Line) -> Vec<u8> {
    let class = line.class.map(RoadClass::name).unwrap_or_default();
    let end = match line.end {
        LineEnd::Nothing => String::new(),
        end => end.id().unwrap_or_else(|| end.name().to_owned()),
    };
    let name = line.name.as_deref().unwrap_or_default();
    let mut bytes = format!("{}\n{class}\n{name}\n{}\n{end}\n", line.id, line.course).into_bytes();
    for structure in &line.structures {
        bytes.extend(format!("{} {} {}\n", structure.kind.name(), structure.first, structure.last).into_bytes());
    }
    bytes.extend(line.origin.iter().flat_map(|part| part.to_le_bytes()));
    for point in &line.points {
        let [east, south] = point.place;
        let numbers = [east, south, point.level_m, point.floor_m, point.half_width_m, point.discharge_m3s];
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
    }
    bytes
}

fn bytes_of_site(site: &Site) -> Vec<u8> {
    let Site { id, at: [x, y], height_m, class, population, name } = site;
    format!("{id}\n{x} {y} {}\n{class:?} {population}\n{name}", height_m.to_bits()).into_bytes()
}
