//! Tiles: everything about one square of the world, made without a look at its neighbours.

mod accumulation;
mod at_large;
mod blend;
mod digest;
mod ground_climate;
mod grows;
mod instances;
mod masks;
mod normals;
mod plants;
mod rule;
mod surface;
mod surroundings;
mod view;
mod waters;

pub use blend::{Blend, Material};
pub use digest::{Digest, TilePart};
pub use grows::{Grows, Growth};
pub use instances::most_instances;
pub use instances::{A_HECTARE, Instance, instances, least_distance_m};
pub use masks::{WETTEST, accumulation_input};
pub use normals::Normals;
pub use plants::Plant;
pub use rule::GroundRule;
#[cfg(feature = "gpu")]
pub(crate) use rule::wgsl;
pub(crate) use surface::TileSurface;
#[cfg(feature = "gpu")]
pub(crate) use surroundings::{REACH as RUBBLE_REACH, STEPS as RUBBLE_STEPS};
pub use view::TileView;
pub use waters::{WaterHere, has_rivers, has_water};

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use crate::area::{Area, Stride, TileId};
use crate::clock::{Clock, stage};
use crate::grid::Grid;
use crate::land::{Land, Water};
use crate::lines::{Bed, Imprint, Line, Lines};
use crate::places::site::Site;
use crate::stop::Stopped;
use crate::world::World;

/// Returns the area whose settlements are seen on an area: a settlement's mark on a map reaches no further than this.
pub fn sites_input(area: Area) -> Area {
    area.padded(8)
}

/// Returns the area of shaped land that a tile depends on: the land that normals and weights look at.
pub fn shaped_input(world: &World, area: Area) -> Area {
    normals::input(area).hull(&blend::input(&world.preset().ground, area))
}

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
    lines: Lines,
    /// For a walker's tile, the steps with which agents cross its edges; the tile's own lines may lack them.
    crossings: Lines,
    sites: Vec<Arc<Site>>,
    derived: masks::Derived,
}

/// The plan of a tile, known before there is any land: its lines and settlements, and the area of land that it depends
/// on.
#[derive(Debug)]
pub struct TilePlan {
    id: TileId,
    /// The lines that shape the tile's land.
    lines: Lines,
    /// The steps of other lines over the tile's edges.
    crossings: Lines,
    sites: Vec<Arc<Site>>,
    /// The area of bare land that the tile depends on.
    pub(crate) land: Area,
}

impl TilePlan {
    /// Returns the plan of the tile at `id` without lines that shape its land: for pictures, which draw lines
    /// themselves.
    pub fn without_lines(world: &World, id: TileId) -> TilePlan {
        TilePlan::of_lines(world, id, Lines::new(), Lines::new())
    }

    /// Returns the plan of the tile at `id` with given lines, and with the steps of other lines over its edges.
    pub(crate) fn of_lines(world: &World, id: TileId, lines: Lines, crossings: Lines) -> TilePlan {
        let land = shaped_input(world, id.area(world.tile_cells()));
        TilePlan { id, lines, crossings, sites: Vec::new(), land }
    }

    /// Returns the lines that shape the tile's land.
    #[cfg(feature = "gpu")]
    pub(crate) fn lines(&self) -> impl Iterator<Item = &Line> {
        self.lines.iter().map(AsRef::as_ref)
    }

    /// Returns the tile's vertices.
    #[cfg(feature = "gpu")]
    pub(crate) fn cells(&self, world: &World) -> Area {
        self.id.area(world.tile_cells())
    }

    /// Plans the tile at `id`, and books the time of each stage on `clock`.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn new(world: &World, id: TileId, clock: &Clock) -> Result<TilePlan, Stopped> {
        let cells = id.area(world.tile_cells());
        let shaped = shaped_input(world, cells);
        let wide = Imprint::input(shaped);
        // Rivers, settlements, and the roads between them. Seen from afar they do nothing to the land, so wider strides
        // have none.
        let (lines, sites) = match world.stride() {
            Stride::ONE => {
                let near = sites_input(normals::input(cells));
                clock.time(stage::LINES, || Ok((world.lines(&wide, clock)?, world.sites(&near, clock)?)))??
            }
            _ => Default::default(),
        };
        // Built roads need more land, since water must find its way through them.
        let is_built = lines.iter().any(|line| matches!(line.bed, Bed::Built { .. }));
        Ok(TilePlan { id, lines, crossings: Lines::new(), sites, land: if is_built { wide } else { shaped } })
    }
}

/// A vertex in the layout of the thesis: 32 bytes, local to the tile's centre.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Position in metres: east of the tile's centre, up, and south of the tile's centre.
    pub position: [f32; 3],
    /// Unit normal: east, up, south.
    pub normal: [f32; 3],
    /// Texture coordinates, 0..1 from west to east and from north to south, so that a seamless texture repeats from
    /// tile to tile.
    pub texture: [f32; 2],
}

impl Tile {
    /// Makes the tile at `id` of `world`. Its bytes are the same whatever was baked before, and in whichever window.
    ///
    /// # Panics
    /// When a vertex of the tile lies more than [`MAX_COORDINATE`](crate::area::MAX_COORDINATE) from the origin.
    pub fn new(world: &World, id: TileId) -> Tile {
        Clock::unstopped(|clock| Tile::timed(world, id, clock))
    }

    /// Does the same as [`new`](Tile::new), and books the time of each stage on `clock`.
    ///
    /// # Errors
    /// When `clock` stops the work.
    pub fn timed(world: &World, id: TileId, clock: &Clock) -> Result<Tile, Stopped> {
        let plan = TilePlan::new(world, id, clock)?;
        let land = world.relief().land(plan.land, clock)?;
        Tile::of_plan(world, plan, land, clock)
    }

    /// Makes the tile of a plan from the land that the plan asks for, and books the time of each stage on `clock`.
    ///
    /// # Panics
    /// When `land` does not cover the area that the plan asks for.
    pub(crate) fn of_plan(world: &World, plan: TilePlan, land: Land, clock: &Clock) -> Result<Tile, Stopped> {
        let lines = plan.lines.iter().map(AsRef::as_ref);
        let imprint = clock.time(stage::IMPRINT, || Imprint::new(&land.heights, land.water.as_ref(), lines))?;
        let (land, surface) = TileSurface::of_land(world, plan.id, land, imprint, clock)?;
        Ok(Tile::build(world, plan, land, surface))
    }

    /// Builds the tile of a plan, given its land as shaped by lines, and the surface of that land.
    pub(crate) fn build(world: &World, plan: TilePlan, land: Land, surface: TileSurface) -> Tile {
        let TilePlan { id, mut lines, crossings, sites, .. } = plan;
        let area = id.area(world.tile_cells());
        // Only lines within the heights seen on the tile, slopes included, concern the tile.
        let near = normals::input(area);
        lines.retain(|line| line.concerns(&near));
        let (Land { heights, water }, TileSurface { normals, blend, imprint }) = (land, surface);
        let (spacing_m, derived) = (world.spacing_m(), masks::Derived::default());
        Tile { id, spacing_m, area, heights, normals, blend, water, imprint, lines, crossings, sites, derived }
    }

    /// Returns the heights of the tile at `id` before lines shape them, with the pad that a tile needs.
    pub fn bare_heights(world: &World, id: TileId) -> Grid<f32> {
        world.relief().heights(shaped_input(world, id.area(world.tile_cells())))
    }

    /// Returns the tile's place in the world.
    pub fn id(&self) -> TileId {
        self.id
    }

    /// Returns the distance in metres from a vertex to the next.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// Returns the area of the tile's vertices, with its edges and without its pad.
    pub fn area(&self) -> Area {
        self.area
    }

    /// Returns the heights in metres of the tile's vertices and of some around them: of its [input](shaped_input).
    pub fn heights(&self) -> &Grid<f32> {
        &self.heights
    }

    /// Returns the normals and slopes of the tile's vertices.
    pub fn normals(&self) -> &Normals {
        &self.normals
    }

    /// Returns the blend weights of the tile's vertices.
    pub fn blend(&self) -> &Blend {
        &self.blend
    }

    /// Returns the water on the tile's vertices and on some around them; `None` in a world whose relief has no water.
    pub fn water(&self) -> Option<&Water> {
        self.water.as_ref()
    }

    /// Returns the imprint of rivers and roads in the tile's land; `None` where they have left none.
    pub fn imprint(&self) -> Option<&Imprint> {
        self.imprint.as_ref()
    }

    /// Returns the rivers and roads that concern the tile, each whole, sorted by id. The tile of a
    /// [walker](crate::walker) has its own lines as far as they lie in it.
    pub fn lines(&self) -> &[Arc<Line>] {
        &self.lines
    }

    /// Returns the settlements that are seen on the tile ([`sites_input`]), sorted by id; none in a world without
    /// places.
    pub fn sites(&self) -> &[Arc<Site>] {
        &self.sites
    }

    /// Returns the tile's centre in metres east and south of the world's origin.
    pub fn centre_m(&self) -> [f64; 2] {
        let middle = |from: i64, to: i64| (from + to - 1) as f64 / 2.0 * self.spacing_m;
        [middle(self.area.x0, self.area.x1), middle(self.area.y0, self.area.y1)]
    }

    /// Returns the vertex at a place of the lattice, local to the tile's centre.
    ///
    /// # Panics
    /// When the place is not one of the tile's vertices.
    pub fn vertex(&self, x: i64, y: i64) -> Vertex {
        let cells = (self.area.width() - 1) as f32;
        let texture = [(x - self.area.x0) as f32 / cells, (y - self.area.y0) as f32 / cells];
        let side_m = cells * self.spacing_m as f32;
        let [east, south] = texture.map(|share| (share - 0.5) * side_m);
        Vertex { position: [east, self.heights.at(x, y), south], normal: self.normals.at(x, y), texture }
    }

    /// Iterates over all vertices, row by row from the north-western one.
    pub fn vertices(&self) -> impl Iterator<Item = Vertex> + '_ {
        self.area.vertices().map(|(x, y)| self.vertex(x, y))
    }
}
