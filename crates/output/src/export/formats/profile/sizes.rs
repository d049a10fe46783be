//! Sizes of regions that the engines take, and the nearest of them to the size asked for.

use super::Profile;
use crate::area::{Region, TileId};
use crate::error::Error;
use crate::mesh::{default_origin, middle};
use crate::preset::TILE_CELLS;
use crate::world::World;

/// Sides of Unreal's landscapes in vertices. Source: its technical guide.
const UNREAL: [u64; 7] = [8129, 4033, 2017, 1009, 505, 253, 127];

/// Quads of a section and sections of a component, each along a side, of Unreal's landscapes. The best come first: few
/// large components are faster than many small ones. The last are so small that a landscape needs too many.
const SECTIONS: [(u64, u64); 8] = [(63, 2), (127, 2), (127, 1), (63, 1), (255, 1), (255, 2), (31, 2), (31, 1)];

/// Largest number of components along a side of Unreal's landscapes: the editor clamps there. Source:
/// `LandscapeEditorObject.h`, which also advises at most 1024 in all.
const MOST_COMPONENTS: u64 = 32;

/// Largest number of regions of Terrain3D each way, and the largest side of an image that Godot loads.
const TERRAIN3D: (u64, u64) = (32, 16_384);

/// Returns the origin of a terrain of Terrain3D that takes a region. It is the origin of the meshes, if the region lies
/// within the regions around it; else the nearest place that is a multiple of a whole terrain from the world's origin;
/// or else the corner of tiles in the middle of the region.
pub(super) fn terrain3d_origin(region: &Region) -> [i64; 2] {
    let cells = i64::from(region.tile_cells());
    let (usual, middle) = (default_origin(region), middle(region).map(|at| at.div_euclid(cells) * cells));
    let terrain = TERRAIN3D.0 as i64 * cells;
    [0, 1].map(|axis| {
        let apart = (middle[axis] + terrain / 2).div_euclid(terrain) * terrain;
        let fits = |origin: &i64| fits_terrain3d(region, axis, *origin);
        [usual[axis], apart].into_iter().find(fits).unwrap_or(middle[axis])
    })
}

/// Tells whether a region lies within the regions around the origin of a terrain of Terrain3D, and on their lattice.
pub(super) fn is_on_terrain3d(region: &Region, origin: [i64; 2]) -> bool {
    [0, 1].iter().all(|axis| fits_terrain3d(region, *axis, origin[*axis]))
}

/// Tells the same of the columns alone (axis 0), or of the rows (axis 1).
fn fits_terrain3d(region: &Region, axis: usize, origin: i64) -> bool {
    let (cells, half) = (i64::from(region.tile_cells()), TERRAIN3D.0 as i64 / 2);
    let first = [region.at().x, region.at().y][axis] - origin.div_euclid(cells);
    let count = [region.cols(), region.rows()][axis] as i64;
    origin.rem_euclid(cells) == 0 && first >= -half && first + count <= half
}

/// A landscape's components: quads of a section and sections of a component, each along a side, and the numbers of
/// components from west to east and from north to south.
pub(in crate::export) struct Components {
    pub quads: u64,
    pub sections: u64,
    pub cols: u64,
    pub rows: u64,
}

/// Returns the components of a landscape of `width` x `height` vertices, if they fit exactly and the editor takes that
/// many.
pub(in crate::export) fn components(width: u64, height: u64) -> Option<Components> {
    SECTIONS.into_iter().find_map(|(quads, sections)| {
        let side = quads * sections;
        // Neighbouring components share a row of vertices, so a landscape has one row more than its components have
        // quads.
        let fits = |vertices: u64| {
            vertices > 1 && (vertices - 1).is_multiple_of(side) && (vertices - 1) / side <= MOST_COMPONENTS
        };
        (fits(width) && fits(height)).then(|| Components {
            quads,
            sections,
            cols: (width - 1) / side,
            rows: (height - 1) / side,
        })
    })
}

/// A size of a tile in cells, and of a region in tiles.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Size {
    cells: u64,
    cols: u64,
    rows: u64,
}

impl Profile {
    /// Returns the sizes that the program takes, in words.
    fn rule(self) -> &'static str {
        match self {
            Profile::Blender => "any size",
            Profile::GodotTerrain3d => {
                "tiles of 64, 128, 256, 512, 1024 or 2048 cells, at most 32 each way and 16384 cells in all"
            }
            Profile::Unreal => "127, 253, 505, 1009, 2017, 4033 or 8129 vertices each way (8129 only both ways)",
            Profile::UnrealTiled => {
                "tiles that make up a landscape of whole components, at most 32 each way: tile x count = 1 + 1 to 32 times 31, 62, \
                 63, 126, 127, 254, 255 or 510, the same of these each way"
            }
            Profile::Unity => "tiles of 32, 64, 128, 256, 512, 1024, 2048 or 4096 cells",
            Profile::Hterrain => "a square of 65, 129, 257, 513, 1025, 2049 or 4097 vertices",
        }
    }

    /// Tells whether the program takes regions of a size.
    fn takes(self, Size { cells, cols, rows }: Size) -> bool {
        let (width, height) = (cells * cols + 1, cells * rows + 1);
        match self {
            Profile::Blender => true,
            Profile::GodotTerrain3d => {
                let (regions, side) = TERRAIN3D;
                (64..=2048).contains(&cells)
                    && cells.is_power_of_two()
                    && cols.max(rows) <= regions
                    && cells * cols.max(rows) <= side
            }
            Profile::Unreal => {
                UNREAL.contains(&width) && UNREAL.contains(&height) && components(width, height).is_some()
            }
            Profile::UnrealTiled => components(width - 1, height - 1).is_some(),
            Profile::Unity => (32..=4096).contains(&cells) && cells.is_power_of_two(),
            Profile::Hterrain => width == height && (64..=4096).contains(&(width - 1)) && (width - 1).is_power_of_two(),
        }
    }

    /// Returns the most cells that the program takes along a side; `u64::MAX` if there is no bound.
    fn max_cells(self) -> u64 {
        match self {
            Profile::Unreal => 8128,
            Profile::Hterrain => 4096,
            Profile::GodotTerrain3d => TERRAIN3D.1,
            Profile::UnrealTiled => MOST_COMPONENTS * 510 + 1,
            Profile::Blender | Profile::Unity => u64::MAX,
        }
    }
}

/// Checks that a profile takes a region.
///
/// # Errors
/// When it does not; the hint names the options of the nearest region that it takes.
pub(super) fn check(profile: Profile, world: &World, region: &Region) -> Result<(), Error> {
    let asked = Size { cells: u64::from(region.tile_cells()), cols: region.cols(), rows: region.rows() };
    if profile.takes(asked) {
        return Ok(());
    }
    let message = format!(
        "profile {} takes {}; the region has {} x {} tiles of {} cells, {} x {} vertices",
        profile.name(),
        profile.rule(),
        asked.cols,
        asked.rows,
        asked.cells,
        region.width(),
        region.height()
    );
    let hint = match nearest(profile, world, asked) {
        Some(size) => format!("the nearest that fits: {}", options(size, asked, region.at(), world)),
        None => "the preset's rivers and roads keep it from all tiles that fit; see their tile sizes".into(),
    };
    Err(Error::Region { message, hint })
}

/// Returns the nearest region that a profile takes, and the options that ask for it; `None` if it takes the given one.
///
/// # Errors
/// When the profile takes no region of the world.
pub(super) fn fitted(profile: Profile, world: &World, region: &Region) -> Result<Option<(Region, String)>, Error> {
    let asked = Size { cells: u64::from(region.tile_cells()), cols: region.cols(), rows: region.rows() };
    if profile.takes(asked) {
        return Ok(None);
    }
    let Some(size) = nearest(profile, world, asked) else { return check(profile, world, region).map(|()| None) };
    let cells = u32::try_from(size.cells).expect("a tile has at most 4096 cells a side");
    let fitted = Region::new(moved(size, asked, region.at()), size.cols, size.rows, cells)?;
    Ok(Some((fitted, options(size, asked, region.at(), world))))
}

/// Returns the tile of a size whose corner lies nearest to the corner of the tile asked for.
fn moved(size: Size, asked: Size, at: TileId) -> TileId {
    if size.cells == asked.cells {
        return at;
    }
    let moved = |tile: i64| {
        // Compute in wide whole numbers: tiles may be far from the origin.
        let (vertex, cells) = (i128::from(tile) * i128::from(asked.cells), i128::from(size.cells));
        // A tile beyond 64 bits is refused like a region that leaves the coordinates.
        (vertex + cells / 2).div_euclid(cells).clamp(i64::MIN.into(), i64::MAX.into()) as i64
    };
    TileId { x: moved(at.x), y: moved(at.y) }
}

/// Returns the options that ask for a size near a tile, and a note on what else changes in the world.
fn options(size: Size, asked: Size, at: TileId, world: &World) -> String {
    let Size { cells, cols, rows } = size;
    if cells == asked.cells {
        return format!("--size {cols}x{rows}");
    }
    let at = match moved(size, asked, at) {
        TileId { x: 0, y: 0 } => String::new(),
        TileId { x, y } => format!(" --at {x},{y}"),
    };
    let note = match world.preset().rivers.is_some() || world.preset().roads.is_some() {
        true => " (agents start from tiles: rivers and roads will be others)",
        false => "",
    };
    format!("--tile-cells {cells} --size {cols}x{rows}{at}{note}")
}

/// Largest difference from the nearest number of tiles that is tried. This covers all remainders modulo the largest
/// component that a smaller tile does not reach by its own size.
const TRIED: u64 = 12;

/// Returns the size that a profile takes and that is nearest to the one asked for, mainly in the sides of the region,
/// then in those of a tile.
fn nearest(profile: Profile, world: &World, asked: Size) -> Option<Size> {
    let total = |count: u64| count.saturating_mul(asked.cells).min(profile.max_cells());
    let (width, height) = (total(asked.cols), total(asked.rows));
    let mut best: Option<(f64, Size)> = None;
    for cells in TILE_CELLS {
        // The number of tiles that comes nearest to the side, and some around it.
        let counts = |total: u64| {
            let near = (total.saturating_add(u64::from(cells) / 2) / u64::from(cells)).max(1);
            near.saturating_sub(TRIED).max(1)..=near.saturating_add(TRIED)
        };
        // The preset is checked once for each tile size, and only for a size that would win.
        let mut possible = None;
        for cols in counts(width) {
            for rows in counts(height) {
                let size = Size { cells: u64::from(cells), cols, rows };
                if !profile.takes(size) {
                    continue;
                }
                // Share by which the greater number exceeds the smaller: twice is as far off as half.
                let off = |a: u64, b: u64| a.max(b) as f64 / a.min(b) as f64 - 1.0;
                let size_off = off(cols * size.cells, width) + off(rows * size.cells, height);
                let score = size_off + off(size.cells, asked.cells) / 4.0;
                if best.is_none_or(|(least, _)| score < least)
                    && *possible.get_or_insert_with(|| world.preset().with_tile_cells(cells).check().is_ok())
                {
                    best = Some((score, size));
                }
            }
        }
    }
    best.map(|(_, size)| size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_that_lie_together_are_on_one_terrain_of_terrain3d() {
        let region = |x, y, cols, rows| Region::new(TileId { x, y }, cols, rows, 256).unwrap();
        for (at, origin) in [
            (region(0, 0, 8, 8), [0, 0]),
            (region(-16, 8, 32, 8), [0, 0]),
            // These two are neighbours, and lie beyond the regions around the world's origin.
            (region(28, 4, 8, 8), [32, 0]),
            (region(36, 4, 8, 8), [32, 0]),
            // Only an origin in its own middle has room for this region.
            (region(10, 0, 20, 1), [20, 0]),
            (region(1_000_000_000, -3, 2, 2), [1_000_000_000, 0]),
        ] {
            let found = terrain3d_origin(&at);
            assert_eq!(found, origin.map(|tile| tile * 256), "{at:?}");
            assert!(is_on_terrain3d(&at, found), "{at:?}");
        }
        let near = region(0, 0, 8, 8);
        assert!(!is_on_terrain3d(&near, [128, 0]), "no corner of tiles");
        assert!(!is_on_terrain3d(&near, [9 * 256, 17 * 256]) && !is_on_terrain3d(&near, [0, -9 * 256]));
    }

    #[test]
    fn landscapes_of_unreal_have_the_components_of_its_guide() {
        for (side, quads, sections, count) in [
            (8129, 127, 2, 32),
            (4033, 63, 2, 32),
            (2017, 63, 2, 16),
            (1009, 63, 2, 8),
            (505, 63, 2, 4),
            (253, 63, 2, 2),
            (127, 63, 2, 1),
        ] {
            let found = components(side, side).unwrap();
            assert_eq!(
                (found.quads, found.sections, found.cols, found.rows),
                (quads, sections, count, count),
                "{side}"
            );
        }
        assert!(components(2048, 2048).is_none());
        assert!(components(8129, 4033).is_none());
        // Components of 31 quads fit, but the editor takes at most 32 of them.
        assert!(components(32 * 31 + 1, 32 * 31 + 1).is_some() && components(33 * 31 + 1, 31 + 1).is_none());
    }
}
