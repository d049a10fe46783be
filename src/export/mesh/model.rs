//! What a tile's mesh file shows, whatever its format: the land at one level of detail, waters, roads and bridges.

use std::sync::Arc;

use crate::area::Region;
use crate::bake::MeshRecord;
use crate::export::options::MeshOptions;
use crate::land::WaterKind;
use crate::mesh::{Drape, Frame, Ribbon, RibbonKind, Sheet, Surface, ribbons, sheets};
use crate::tile::Tile;
use crate::world::World;

/// What makes models of a region's tiles.
pub(super) struct Modeller<'a> {
    pub world: &'a World,
    pub region: Region,
    pub frame: Frame,
    pub options: MeshOptions,
    /// The land with every vertex, which is the same for all tiles.
    full: Option<Arc<Surface>>,
}

/// A tile's mesh.
pub(super) struct Model {
    pub land: Arc<Surface>,
    pub waters: Vec<Sheet>,
    pub ribbons: Vec<Ribbon>,
}

/// What something is made of, besides the land.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Substance {
    /// Of its material, and with the tile's place of its node and mesh.
    pub name: &'static str,
    /// Linear red, green, blue, and opacity.
    pub colour: [f32; 4],
    pub roughness: f32,
}

/// All substances; rivers of both kinds are one.
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
        RibbonKind::River => SUBSTANCES[0],
        RibbonKind::Road => SUBSTANCES[3],
        RibbonKind::Bridge => SUBSTANCES[4],
    }
}

impl<'a> Modeller<'a> {
    pub fn new(world: &'a World, region: Region, options: &MeshOptions, quantized: bool) -> Modeller<'a> {
        let frame = options.frame(world, &region, quantized);
        let cells = region.tile_cells();
        let full = options.lods.all().contains(&0).then(|| {
            // One order for all tiles, as if the land were flat.
            let flat = |[column, row]: [u32; 2]| [column as f32, 0.0, row as f32];
            Arc::new(ordered(Surface::full(cells), flat))
        });
        Modeller { world, region, frame, options: options.clone(), full }
    }

    /// The models of a tile, one for each level of detail.
    pub fn models(&self, tile: &Tile) -> Vec<(u32, Model)> {
        let model = |&lod: &u32| {
            let land = self.land(tile, lod);
            let ground = Drape::new(&land, tile.heights(), tile.area());
            // With every vertex the ground is the raster's own, and waters fit it as they are.
            let waters = sheets(self.world, tile, (lod > 0).then_some(&ground));
            let ribbons = ribbons(tile, self.world.spacing_m(), &ground);
            (lod, Model { land, waters, ribbons })
        };
        self.options.lods.all().iter().map(model).collect()
    }

    /// What the manifest says of a model.
    pub fn record(&self, tile: &Tile, lod: u32, land: &Surface) -> MeshRecord {
        // Of the vertices that the mesh has, for these are what a reader finds.
        let (mut min_m, mut max_m) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let area = tile.area();
        let corner = self.frame.corner_m(&area);
        for [column, row] in &land.vertices {
            let (x, y) = (area.x0 + i64::from(*column), area.y0 + i64::from(*row));
            let [east, south] = self.frame.local_steps(&area, x, y).map(|steps| steps as f64 * self.frame.step_m());
            let place = [corner[0] + east, f64::from(tile.heights().at(x, y)), corner[2] + south];
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

    fn land(&self, tile: &Tile, lod: u32) -> Arc<Surface> {
        match self.options.bound_m(self.world, lod) {
            None => Arc::clone(self.full.as_ref().expect("there is one if LOD 0 is asked for")),
            Some(bound_m) => {
                let area = tile.area();
                // What rounding to steps takes of the bound is not left for the triangles.
                let left_m = |bound_m: f64| bound_m - self.frame.height_error_m();
                let finest = self.options.lods.all().first();
                let finest_m = finest.and_then(|lod| self.options.bound_m(self.world, *lod)).map_or(0.0, left_m);
                let edge_m = self.options.even_borders.then_some(finest_m);
                let surface = Surface::simplified(tile.heights(), area, left_m(bound_m), edge_m);
                let spacing_m = self.world.spacing_m() as f32;
                let place = |[column, row]: [u32; 2]| {
                    let height_m = tile.heights().at(area.x0 + i64::from(column), area.y0 + i64::from(row));
                    [column as f32 * spacing_m, height_m, row as f32 * spacing_m]
                };
                Arc::new(ordered(surface, place))
            }
        }
    }
}

/// A surface with its triangles and vertices in an order that suits a GPU: each vertex is wanted again soon, what is in front
/// is drawn first, and vertices lie in the order that they are wanted in.
fn ordered(surface: Surface, place: impl Fn([u32; 2]) -> [f32; 3]) -> Surface {
    let Surface { cells, vertices, triangles } = surface;
    // In this order, as the manual asks: each step keeps what the one before it has gained.
    let mut indices = meshopt::optimize_vertex_cache(triangles.as_flattened(), vertices.len());
    let places: Vec<[f32; 3]> = vertices.iter().map(|vertex| place(*vertex)).collect();
    let positions = meshopt::VertexDataAdapter::new(bytemuck::cast_slice(&places), size_of::<[f32; 3]>(), 0);
    // How much worse for the cache the order may become, as meshoptimizer's manual has it.
    const THRESHOLD: f32 = 1.05;
    meshopt::optimize_overdraw_in_place(&mut indices, &positions.expect("places are three floats each"), THRESHOLD);
    let vertices = meshopt::optimize_vertex_fetch(&mut indices, &vertices);
    Surface { cells, vertices, triangles: indices.as_chunks().0.to_vec() }
}

/// All ribbons of each substance, in the order of [`SUBSTANCES`].
pub(super) fn by_substance(ribbons: &[Ribbon]) -> impl Iterator<Item = (Substance, &[Ribbon])> {
    ribbons.chunk_by(|a, b| a.kind == b.kind).map(|run| (substance_of_ribbon(run[0].kind), run))
}
