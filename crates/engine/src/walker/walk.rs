//! A walk: the walker's route and the tiles that it comes to. These are known without making any tile.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::area::{MAX_COORDINATE, Region, Stride, TileId};
use crate::error::Error;
use crate::walker::camera::Camera;
use crate::walker::{WalkerOptions, path};
use crate::world::World;

/// Request for a walk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Tour {
    /// Way of the walker.
    pub way: Way,
    /// Layers of tiles around the walker's own tile.
    pub layers: u32,
}

/// The way of a walker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// Moves as the camera of the thesis' experiment: it turns ninety degrees to the right each minute.
    Camera {
        /// Tile in whose middle the camera starts.
        at: TileId,
        /// Duration in minutes of the camera's virtual time.
        minutes: f64,
        /// Speed in metres a second.
        speed_m_s: f64,
    },
    /// Goes in straight lines from place to place.
    Path {
        /// Places in metres east and north of the world's origin.
        places_m: Vec<[f64; 2]>,
    },
}

impl Display for Tour {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match &self.way {
            Way::Camera { at: TileId { x, y }, minutes, speed_m_s } => {
                write!(f, "a camera for {minutes} minutes at {speed_m_s} m/s from tile {x},{y} on")?;
            }
            Way::Path { places_m } => write!(f, "a path of {} places", places_m.len())?,
        }
        write!(
            f,
            ", {} of tiles around it",
            if self.layers == 1 { "a layer".to_owned() } else { format!("{} layers", self.layers) }
        )
    }
}

impl Way {
    /// Reads the places of a way from a file with one place per line: metres east and north of the origin with a comma
    /// between.
    ///
    /// # Errors
    /// When the file cannot be read, or when a line is no place; the error points at that line.
    pub fn of_file(path: &Path) -> Result<Way, Error> {
        Ok(Way::Path { places_m: path::read(path)? })
    }
}

/// A walk that has been checked and can be made.
#[derive(Clone, Debug)]
pub struct Walk {
    tour: Tour,
    /// Tiles that the walker enters, in order.
    route: Vec<TileId>,
    tiles: BTreeSet<TileId>,
    region: Region,
}

/// Largest number of tiles in a walk: their records take 64 MiB.
const MOST_TILES: usize = 1 << 20;

/// Allowed number of layers around the walker of a command.
pub const LAYERS: RangeInclusive<u32> = 1..=16;

impl Walk {
    /// Plans the walk of a tour through a world.
    ///
    /// # Errors
    /// When the world has fluvial relief or another stride than 1, when the number of layers is out of range, when the
    /// way leaves the coordinates or is too long, or when speed or duration are out of range; the hint names values
    /// that are allowed.
    pub fn new(tour: Tour, world: &World) -> Result<Walk, Error> {
        let refuse = |message: String, hint: String| Error::Option { message, hint };
        if world.relief().fluvial().is_some() || world.stride() != Stride::ONE {
            return Err(refuse(
                "the agents of a walk know land of noise at its full scale alone, and this has rivers before it has land".into(),
                "bake it, or walk a preset of noise, such as thesis, mountains or hills".into(),
            ));
        }
        if !LAYERS.contains(&tour.layers) {
            return Err(refuse(
                format!("{} layers of tiles cannot stand around a walker", tour.layers),
                format!("give {} to {}", LAYERS.start(), LAYERS.end()),
            ));
        }
        let layers = tour.layers as i64;
        let mut route: Vec<TileId> = Vec::new();
        let mut tiles = BTreeSet::new();
        let mut enter = |tile: TileId| {
            if route.last() == Some(&tile) {
                return Ok(());
            }
            route.push(tile);
            // Tiles outside the coordinates saturate here; the check of the region refuses them.
            let beside = |x: i64, y: i64| TileId { x: tile.x.saturating_add(x), y: tile.y.saturating_add(y) };
            tiles.extend((-layers..=layers).flat_map(|x| (-layers..=layers).map(move |y| beside(x, y))));
            match tiles.len() {
                0..=MOST_TILES => Ok(()),
                _ => Err(refuse(
                    format!("the walk comes to more than {MOST_TILES} tiles"),
                    "give a shorter way, fewer --layers or larger --tile-cells".into(),
                )),
            }
        };
        let side_m = f64::from(world.tile_cells()) * world.spacing_m();
        let in_tiles = |[east_m, south_m]: [f64; 2]| [east_m / side_m, south_m / side_m];
        match &tour.way {
            Way::Camera { at, minutes, speed_m_s } => {
                Camera::check(*minutes, *speed_m_s, side_m)?;
                // Counted from the start tile, so that the camera takes the same way anywhere.
                for place in Camera::new([side_m / 2.0; 2], *speed_m_s).places_m(*minutes).map(in_tiles) {
                    let TileId { x, y } = tile_at(place);
                    enter(TileId { x: at.x.saturating_add(x), y: at.y.saturating_add(y) })?;
                }
            }
            Way::Path { places_m } => {
                let most_m = MAX_COORDINATE as f64 * world.spacing_m();
                if let Some([east_m, north_m]) =
                    places_m.iter().find(|place| place.iter().any(|side| side.abs() > most_m))
                {
                    return Err(refuse(
                        format!("a place at {east_m},{north_m} m leaves the coordinates"),
                        format!("no vertex lies more than {most_m} m from the origin"),
                    ));
                }
                // Rows of tiles count southwards.
                let places = places_m.iter().map(|[east_m, north_m]| in_tiles([*east_m, 0.0 - north_m]));
                let mut before = None;
                for place in places {
                    match before.replace(place) {
                        None => enter(tile_at(place))?,
                        Some(before) => between(before, place).try_for_each(&mut enter)?,
                    }
                }
            }
        }
        let region = around(&tiles, world.tile_cells())?;
        Ok(Walk { tour, route, tiles, region })
    }

    /// Returns the request that this walk fulfils.
    pub fn tour(&self) -> &Tour {
        &self.tour
    }

    /// Returns the tiles that the walker enters, in order; never the same tile twice in a row.
    pub fn route(&self) -> &[TileId] {
        &self.route
    }

    /// Returns all tiles of the walk: those that the walker enters, and the layers around them.
    pub fn tiles(&self) -> &BTreeSet<TileId> {
        &self.tiles
    }

    /// Returns the bounding rectangle of all tiles of the walk.
    pub fn region(&self) -> Region {
        self.region
    }

    /// Returns the options of a walker for this walk.
    pub fn options(&self) -> WalkerOptions {
        WalkerOptions { start: self.route[0], layers: self.tour.layers, ..WalkerOptions::default() }
    }
}

fn tile_at(place: [f64; 2]) -> TileId {
    let [x, y] = place.map(|side| side.floor() as i64);
    TileId { x, y }
}

/// Lists the tiles along a straight way in order, including the first; through a corner the way leads diagonally.
fn between(from: [f64; 2], to: [f64; 2]) -> impl Iterator<Item = TileId> {
    let (start, end) = (tile_at(from), tile_at(to));
    // Returns the fraction of the way, 0 to 1, at which it leaves a column or a row of tiles.
    let leaves = move |axis: usize, tile: i64, end: i64| {
        let edge = if end > tile { tile + 1 } else { tile };
        if end == tile { f64::INFINITY } else { (edge as f64 - from[axis]) / (to[axis] - from[axis]) }
    };
    std::iter::successors(Some(start), move |tile| {
        if *tile == end {
            return None;
        }
        let (across, down) = (leaves(0, tile.x, end.x), leaves(1, tile.y, end.y));
        let x = if across <= down { tile.x + (end.x - tile.x).signum() } else { tile.x };
        let y = if down <= across { tile.y + (end.y - tile.y).signum() } else { tile.y };
        Some(TileId { x, y })
    })
}

/// Returns the smallest region that contains these tiles.
fn around(tiles: &BTreeSet<TileId>, tile_cells: u32) -> Result<Region, Error> {
    let ends = |side: fn(&TileId) -> i64| {
        let sides = || tiles.iter().map(side);
        sides().min().zip(sides().max()).expect("a walk begins somewhere")
    };
    let ((west, east), (north, south)) = (ends(|tile| tile.x), ends(|tile| tile.y));
    let [cols, rows] = [west.abs_diff(east), north.abs_diff(south)].map(|tiles| tiles.saturating_add(1));
    // Agents in a tile look at some vertices beyond its edges, so the region must also be valid with one more tile on
    // each side.
    let padded = TileId { x: west.saturating_sub(1), y: north.saturating_sub(1) };
    Region::new(padded, cols.saturating_add(2), rows.saturating_add(2), tile_cells)?;
    Region::new(TileId { x: west, y: north }, cols, rows, tile_cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossed(from: [f64; 2], to: [f64; 2]) -> Vec<(i64, i64)> {
        between(from, to).map(|tile| (tile.x, tile.y)).collect()
    }

    #[test]
    fn a_straight_way_goes_through_all_tiles_on_it() {
        assert_eq!(crossed([0.5, 0.5], [0.7, 0.2]), [(0, 0)]);
        assert_eq!(crossed([0.5, 0.5], [3.5, 0.5]), [(0, 0), (1, 0), (2, 0), (3, 0)]);
        assert_eq!(crossed([0.5, 0.5], [-1.5, 1.2]), [(0, 0), (-1, 0), (-1, 1), (-2, 1)]);
        // Ways through corners.
        assert_eq!(crossed([0.5, 0.5], [2.5, -1.5]), [(0, 0), (1, -1), (2, -2)]);
        // Each tile is next to the one before, and the last contains the end of the way.
        for end in [[31.1, 7.9], [-12.3, 40.4], [0.1, -22.2], [-9.0, -9.0]] {
            let tiles = crossed([0.3, 0.8], end);
            assert!(tiles.windows(2).all(|pair| (pair[0].0 - pair[1].0).abs().max((pair[0].1 - pair[1].1).abs()) == 1));
            assert_eq!(tiles[tiles.len() - 1], (end[0].floor() as i64, end[1].floor() as i64));
        }
    }
}
