//! Tiles: everything about one square of the world, made without a look at its neighbours.

mod blend;
mod normals;

pub use blend::{Blend, GroundRule, Material};
pub use normals::Normals;

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use crate::agents::paths::PathList;
use crate::agents::way::{Imprint, Way};
use crate::area::{Area, TileId};
use crate::clock::Clock;
use crate::fluvial::{Land, Water, WaterKind};
use crate::grid::Grid;
use crate::places::bed::Beds;
use crate::places::drain::{self, drain};
use crate::places::road::Road;
use crate::places::site::Site;
use crate::world::{HEIGHT_PAD, World};

/// How many vertices around a tile its settlements are known: a mark on the map is no larger.
pub const SITE_PAD: usize = 8;

/// A finished tile of N x N cells: (N+1) x (N+1) vertices, those of its edge shared with its neighbours.
#[derive(Debug)]
pub struct Tile {
    id: TileId,
    spacing_m: f64,
    area: Area,
    heights: Grid<f32>,
    normals: Normals,
    blend: Blend,
    water: Option<Water>,
    imprint: Option<Imprint>,
    beds: Option<Beds>,
    paths: PathList,
    roads: Vec<Arc<Road>>,
    sites: Vec<Arc<Site>>,
}

/// A vertex as the thesis has it: 32 bytes, local to the tile's centre.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Metres east of the tile's centre, up, and south of the tile's centre.
    pub position: [f32; 3],
    /// Unit normal: east, up, south.
    pub normal: [f32; 3],
    /// 0..1 from west to east and from north to south, so that a seamless texture repeats from tile to tile.
    pub texture: [f32; 2],
}

impl Tile {
    /// The tile at `id` of `world`: the same bytes whatever was baked before, in whichever window.
    ///
    /// # Panics
    /// When a vertex of the tile lies more than [`MAX_COORDINATE`](crate::area::MAX_COORDINATE) from the origin.
    pub fn new(world: &World, id: TileId) -> Tile {
        Tile::timed(world, id, &Clock::default())
    }

    /// As [`new`](Tile::new), with the time of each stage booked on `clock`.
    pub fn timed(world: &World, id: TileId, clock: &Clock) -> Tile {
        // With the pad that later stages look at, and more where water must find its way through roads.
        let area = id.area(world.tile_cells()).padded(HEIGHT_PAD);
        let wide = area.padded(drain::PAD);
        // Settlements, and the roads between them.
        let (mut roads, sites) = clock.time("roads", || (world.roads(&wide), world.sites(&area.padded(SITE_PAD))));
        // The bare heights and the water on them.
        let mut land = world.relief().land(if roads.is_empty() { area } else { wide }, clock);
        // The roads' beds are cut into the land and fill it.
        let beds = clock.time("grade", || graded(&mut land, &roads, world.spacing_m()).map(|beds| beds.part(area)));
        if land.heights.area() != area {
            land = land.part(area);
        }
        roads.retain(|road| road.overlaps(&area));
        // The rivers and roads whose reach touches them.
        let paths = clock.time("agents", || world.ways(&area));
        let imprint = clock.time("carve", || Imprint::new(&land.heights, paths.iter().map(|path| &path.way)));
        Tile { paths, roads, sites, ..Tile::imprinted(world, id, land, imprint, beds, clock) }
    }

    /// The heights of the tile at `id` before anything shapes them, with the pad that a tile needs.
    pub fn bare_heights(world: &World, id: TileId) -> Grid<f32> {
        world.relief().heights(id.area(world.tile_cells()).padded(HEIGHT_PAD))
    }

    /// The tile at `id` of given bare heights and ways, with the time of each stage booked on `clock`.
    ///
    /// # Panics
    /// When `heights` does not reach [`HEIGHT_PAD`] vertices past the tile.
    pub fn shaped<'a>(
        world: &World,
        id: TileId,
        heights: Grid<f32>,
        ways: impl IntoIterator<Item = &'a Way>,
        clock: &Clock,
    ) -> Tile {
        let imprint = clock.time("carve", || Imprint::new(&heights, ways));
        Tile::imprinted(world, id, Land { heights, water: None }, imprint, None, clock)
    }

    /// The tile at `id` of given land, graded already by its beds, and of what ways do to it, with the time of each stage
    /// booked on `clock`.
    ///
    /// # Panics
    /// When `land` does not reach [`HEIGHT_PAD`] vertices past the tile.
    pub(crate) fn imprinted(
        world: &World,
        id: TileId,
        land: Land,
        imprint: Option<Imprint>,
        beds: Option<Beds>,
        clock: &Clock,
    ) -> Tile {
        let Land { mut heights, water } = land;
        let area = id.area(world.tile_cells());
        let spacing_m = world.spacing_m();
        // The land as the ways leave it.
        if let Some(imprint) = &imprint {
            clock.time("carve", || imprint.shape(&mut heights));
        }
        // Normals and slopes from differences across the edge.
        let normals = clock.time("normals", || Normals::new(&heights, area, spacing_m));
        // What the ground is made of.
        let blend = clock.time("blend", || {
            let mut blend =
                Blend::new(&GroundRule::new(&world.preset().ground, world.preset().sea_level_m), &heights, &normals);
            if let Some(water) = &water {
                blend.wet(water);
            }
            if let Some(imprint) = &imprint {
                blend.cover_with(imprint);
            }
            if let Some(beds) = &beds {
                blend.pave(beds.share());
            }
            blend
        });
        let (paths, roads, sites) = (PathList::new(), Vec::new(), Vec::new());
        Tile { id, spacing_m, area, heights, normals, blend, water, imprint, beds, paths, roads, sites }
    }

    /// Where the tile is in the world.
    pub fn id(&self) -> TileId {
        self.id
    }

    /// The tile's vertices, edges included, pad not.
    pub fn area(&self) -> Area {
        self.area
    }

    /// Heights in metres of the tile's vertices and of [`HEIGHT_PAD`] more on each side.
    pub fn heights(&self) -> &Grid<f32> {
        &self.heights
    }

    /// Normals and slopes of the tile's vertices.
    pub fn normals(&self) -> &Normals {
        &self.normals
    }

    /// Blend weights of the tile's vertices.
    pub fn blend(&self) -> &Blend {
        &self.blend
    }

    /// The water on the tile's vertices and on [`HEIGHT_PAD`] more on each side; `None` in a world whose relief knows of
    /// no water.
    pub fn water(&self) -> Option<&Water> {
        self.water.as_ref()
    }

    /// What rivers and roads have done to the tile; `None` where there are none.
    pub fn imprint(&self) -> Option<&Imprint> {
        self.imprint.as_ref()
    }

    /// The order-free paths that may touch the tile, whole, sorted by kind and owner; none for a tile that was
    /// [shaped](Tile::shaped) by other ways.
    pub fn paths(&self) -> &PathList {
        &self.paths
    }

    /// The roads between settlements that may touch the tile, whole, sorted by id; none in a world without places.
    pub fn roads(&self) -> &[Arc<Road>] {
        &self.roads
    }

    /// The settlements on the tile and within [`SITE_PAD`] vertices of it, sorted by id; none in a world without places.
    pub fn sites(&self) -> &[Arc<Site>] {
        &self.sites
    }

    /// What the roads between settlements have done to the tile; `None` where there are none.
    pub fn beds(&self) -> Option<&Beds> {
        self.beds.as_ref()
    }

    /// The tile's centre in the world, in metres east and south of the origin.
    pub fn centre_m(&self) -> [f64; 2] {
        let middle = |from: i64, to: i64| (from + to - 1) as f64 / 2.0 * self.spacing_m;
        [middle(self.area.x0, self.area.x1), middle(self.area.y0, self.area.y1)]
    }

    /// The vertex at a place of the lattice, local to the tile's centre.
    ///
    /// # Panics
    /// When it is not one of the tile's.
    pub fn vertex(&self, x: i64, y: i64) -> Vertex {
        let cells = (self.area.width() - 1) as f32;
        let texture = [(x - self.area.x0) as f32 / cells, (y - self.area.y0) as f32 / cells];
        let side_m = cells * self.spacing_m as f32;
        let [east, south] = texture.map(|share| (share - 0.5) * side_m);
        Vertex { position: [east, self.heights.at(x, y), south], normal: self.normals.at(x, y), texture }
    }

    /// All vertices, row by row from the north-western one.
    pub fn vertices(&self) -> impl Iterator<Item = Vertex> + '_ {
        let Area { x0, y0, x1, y1 } = self.area;
        (y0..y1).flat_map(move |y| (x0..x1).map(move |x| self.vertex(x, y)))
    }
}

/// What roads do to land, which it is done to: all but its waters and the beds of its channels, which go on as they are
/// under bridges, in fords and in culverts. What they dam elsewhere is drained, but for what is near the border.
fn graded(land: &mut Land, roads: &[Arc<Road>], spacing_m: f64) -> Option<Beds> {
    let mut beds = Beds::new(land.heights.area(), roads.iter().map(AsRef::as_ref), spacing_m)?;
    let water = land.water.as_ref().expect("where roads are the land knows its water");
    let wet: Vec<bool> = water.kind.values().iter().map(|kind| *kind != WaterKind::Dry).collect();
    beds.spare(wet.iter().copied().zip(water.bed.values().iter().copied()));
    let bare = land.heights.clone();
    beds.shape(&mut land.heights);
    drain(&bare, &wet, &mut land.heights);
    Some(beds)
}
