//! The content of a tile's mesh file in any format: the land at one level of detail, waters, roads and bridges.

use std::sync::Arc;

use crate::area::Region;
use crate::bake::MeshRecord;
use crate::clock::Clock;
use crate::export::plan::options::MeshOptions;
use crate::land::WaterKind;
use crate::mesh::{
    Frame, Ground, GroundVertex, PARTS, Ribbon, RibbonKind, Surface, WaterSheet, Waterlines, ribbons, roads_near,
    sheets,
};
use crate::stop::Stopped;
use crate::tile::Tile;
use crate::world::World;

/// Makes the models of a region's tiles.
pub(super) struct Modeller<'a> {
    pub world: &'a World,
    pub region: Region,
    pub frame: Frame,
    pub options: MeshOptions,
    /// The land with every vertex, which is the same for all tiles; `None` if LOD 0 is not asked for.
    full: Option<Arc<Surface>>,
}

/// A tile's mesh.
pub(super) struct Model {
    pub land: Ground,
    pub waters: Vec<WaterSheet>,
    pub ribbons: Vec<Ribbon>,
}

/// The material of a part other than the land.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Substance {
    /// Name of the material; together with the tile's place also the name of the node and the mesh.
    pub name: &'static str,
    /// Linear red, green, blue, and opacity.
    pub colour: [f32; 4],
    pub roughness: f32,
}

/// All substances.
pub(super) const SUBSTANCES: [Substance; 5] = [
    Substance { name: "river", colour: [0.035, 0.11, 0.14, 0.8], roughness: 0.12 },
    Substance { name: "lake", colour: [0.02, 0.08, 0.12, 0.85], roughness: 0.06 },
    Substance { name: "sea", colour: [0.01, 0.055, 0.1, 0.88], roughness: 0.1 },
    Substance { name: "road", colour: [0.16, 0.115, 0.075, 1.0], roughness: 0.95 },
    Substance { name: "bridge", colour: [0.2, 0.19, 0.18, 1.0], roughness: 0.9 },
];

pub(super) fn substance_of_water(kind: WaterKind) -> Substance {
    match kind {
        WaterKind::Lake => SUBSTANCES[1],
        WaterKind::Sea => SUBSTANCES[2],
        WaterKind::River | WaterKind::Dry => SUBSTANCES[0],
    }
}

pub(super) fn substance_of_ribbon(kind: RibbonKind) -> Substance {
    match kind {
        RibbonKind::Road => SUBSTANCES[3],
        RibbonKind::Bridge => SUBSTANCES[4],
    }
}

impl<'a> Modeller<'a> {
    pub fn new(world: &'a World, region: Region, options: &MeshOptions, quantized: bool) -> Modeller<'a> {
        let frame = options.frame(world, &region, quantized);
        let cells = region.tile_cells();
        let full = options.lods.all().contains(&0).then(|| {
            // One order for all tiles, made as if the land were flat and without water.
            let Surface { vertices, triangles, .. } = Surface::full(cells);
            let (vertices, triangles) =
                ordered(&vertices, &triangles, |[column, row]| [*column as f32, 0.0, *row as f32]);
            Arc::new(Surface { cells, vertices, triangles })
        });
        Modeller { world, region, frame, options: options.clone(), full }
    }

    /// Returns the models of a tile, one for each level of detail.
    pub fn models(&self, tile: &Tile, clock: &Clock) -> Result<Vec<(u32, Model)>, Stopped> {
        let roads = roads_near(self.world, &tile.area(), clock)?;
        let model = |&lod: &u32| {
            // Each level doubles the tolerance, as it doubles the error of heights.
            let tolerance = FINEST_LINE * f64::from(lod).exp2();
            let waterlines = Waterlines::new(self.world, tile, tolerance, self.frame.grain(), clock)?;
            let land = self.land(tile, lod, waterlines.as_ref(), clock)?;
            let waters = waterlines.as_ref().map_or_else(Vec::new, sheets);
            let ribbons = ribbons(&tile.area(), &roads, &land, tolerance);
            Ok((lod, Model { land, waters, ribbons }))
        };
        self.options.lods.all().iter().map(model).collect()
    }

    /// Returns the manifest's record of a model.
    pub fn record(&self, tile: &Tile, lod: u32, land: &Ground) -> MeshRecord {
        // Use the vertices of the mesh, since these are the ones that a reader finds.
        let (mut min_m, mut max_m) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let area = tile.area();
        let corner = self.frame.corner_m(&area);
        for vertex in &land.vertices {
            let [east, south] =
                self.frame.steps_between(&area, vertex.place).map(|steps| steps as f64 * self.frame.step_m());
            let place = [corner[0] + east, f64::from(vertex.height_m), corner[2] + south];
            min_m = [0, 1, 2].map(|axis| min_m[axis].min(place[axis]));
            max_m = [0, 1, 2].map(|axis| max_m[axis].max(place[axis]));
        }
        MeshRecord {
            lod,
            error_m: self.options.bound_m(self.world, lod).unwrap_or(self.frame.height_error_m()),
            vertices: land.vertices.len() as u64,
            triangles: land.triangles.len() as u64,
            min_m,
            max_m,
        }
    }

    fn land(&self, tile: &Tile, lod: u32, waters: Option<&Waterlines>, clock: &Clock) -> Result<Ground, Stopped> {
        let (area, heights) = (tile.area(), tile.heights());
        // Rounding to steps uses up a part of the bound, which is not left for the triangles.
        let left_m = |bound_m: f64| bound_m - self.frame.height_error_m();
        let bound_m = self.options.bound_m(self.world, lod).map(left_m);
        let surface = match bound_m {
            None => Arc::clone(self.full.as_ref().expect("there is one if LOD 0 is asked for")),
            Some(bound_m) => {
                let finest = self.options.lods.all().first();
                let finest_m = finest.and_then(|lod| self.options.bound_m(self.world, *lod)).map_or(0.0, left_m);
                let edge_m = self.options.even_borders.then_some(finest_m);
                Arc::new(Surface::simplified(heights, area, bound_m, edge_m, clock)?)
            }
        };
        let ground = match waters {
            Some(waters) => Ground::cut(&surface, heights, area, waters, bound_m, clock)?,
            None => Ground::new(&surface, heights, area),
        };
        if bound_m.is_none() {
            // The full land has its order already, and the vertices that waters add are few.
            return Ok(ground);
        }
        let cell_m = self.world.spacing_m() as f32 / PARTS as f32;
        let Ground { cells, vertices, triangles } = ground;
        let place = |vertex: &GroundVertex| {
            let [east, south] = vertex.place.map(|at| at as f32 * cell_m);
            [east, vertex.height_m, south]
        };
        let (vertices, triangles) = ordered(&vertices, &triangles, place);
        Ok(Ground { cells, vertices, triangles })
    }
}

/// Distance in cells by which shores, banks and the edges of roads may be off at LOD 0.
const FINEST_LINE: f64 = 1.0 / 32.0;

/// Returns vertices and triangles in an order that suits a GPU: a vertex is used again soon, triangles in front are
/// drawn first, and vertices lie in the order of their use.
fn ordered<V: Clone + Default>(
    vertices: &[V],
    triangles: &[[u32; 3]],
    place: impl Fn(&V) -> [f32; 3],
) -> (Vec<V>, Vec<[u32; 3]>) {
    // The manual asks for this order of steps: each keeps the gain of the step before.
    let mut indices = meshopt::optimize_vertex_cache(triangles.as_flattened(), vertices.len());
    let places: Vec<[f32; 3]> = vertices.iter().map(place).collect();
    let positions = meshopt::VertexDataAdapter::new(bytemuck::cast_slice(&places), size_of::<[f32; 3]>(), 0);
    // Factor by which the order may become worse for the vertex cache, from meshoptimizer's manual.
    const THRESHOLD: f32 = 1.05;
    meshopt::optimize_overdraw_in_place(&mut indices, &positions.expect("places are three floats each"), THRESHOLD);
    let vertices = meshopt::optimize_vertex_fetch(&mut indices, vertices);
    (vertices, indices.as_chunks().0.to_vec())
}

/// Returns the ribbons of each substance, in the order of [`SUBSTANCES`].
pub(super) fn by_substance(ribbons: &[Ribbon]) -> impl Iterator<Item = (Substance, &[Ribbon])> {
    ribbons.chunk_by(|a, b| a.kind == b.kind).map(|run| (substance_of_ribbon(run[0].kind), run))
}
