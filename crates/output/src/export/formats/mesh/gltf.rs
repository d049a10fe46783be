//! glTF: a GLB for each tile and level of detail, each complete in itself, and a glTF of the region that places them.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use gltf_json::extensions;
use gltf_json::material::{
    AlphaMode, Material, NormalTexture, PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor,
};
use gltf_json::mesh::Mesh;
use gltf_json::scene::{Node, Scene};
use gltf_json::texture::{Info, Texture};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Root};
use serde::Serialize;
use serde_json::value::RawValue;
use serde_json::{Map, json};

use super::glb::{COMPRESSION, Glb, GlbFile, MAX_BYTES, QUANTIZATION, TRANSFORM};
use super::model::{Model, Modeller, Substance, by_substance, substance_of_water};
use super::region::{RegionFile, TileNumbers};
use super::relative_normals::relative_normals;
use super::values::{of_land, of_ribbons, of_sheet};
use super::{FOLDER, part_name, tile_path};
use crate::area::{Place, Region};
use crate::bake::{FileRecord, Kept, Sink, frames};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request};
use crate::export::formats::locked;
use crate::export::formats::raster::painter::Painter;
use crate::export::formats::raster::quantity::{COLOUR, COVER_WEIGHTS, GROUND_WEIGHTS};
use crate::export::formats::raster::writer::{Encoding, Sample, png_bytes};
use crate::export::plan::options::TileNames;
use crate::file::write_whole;
use crate::tile::Tile;
use crate::watch::Watch;

/// The format glTF: a GLB for each tile and level of detail, and a glTF of the region for each level; or one GLB of the
/// region for each level.
pub(crate) struct Gltf {
    name: &'static str,
    about: &'static str,
    /// True if one GLB has all tiles.
    whole: bool,
}

/// A GLB for each tile, and a glTF that places them.
pub(in crate::export) const GLTF: Gltf = Gltf {
    name: "gltf",
    about: "meshes of land, water and roads with textures: a GLB a tile, and a glTF that places all",
    whole: false,
};

/// One GLB of the region.
pub(in crate::export) const GLTF_REGION: Gltf =
    Gltf { name: "gltf-region", about: "the same as one GLB of the region", whole: true };

/// Hint for a GLB of a region that is too large.
pub(super) const SMALLER: &str = "give a coarser --lod, bake fewer tiles, or export gltf, which has a GLB a tile";

impl Format for Gltf {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn check(&self, request: &Request) -> Result<(), Error> {
        Gltf::check_size(&request.region)
    }

    fn check_meshes(&self, request: &Request) -> Result<(), Error> {
        let least = self.region_bytes(request, Gltf::bytes_at_least);
        if least <= MAX_BYTES {
            return Ok(());
        }
        Err(Error::Export {
            message: format!("the GLB of the region has at least {least} bytes, and GLB ends at 2^32"),
            hint: SMALLER.into(),
        })
    }

    fn warning(&self, request: &Request) -> Option<String> {
        let most = self.region_bytes(request, |request, _| Gltf::bytes_at_most(&request.region));
        let may =
            "the GLB of the region may come to more than the 2^32 bytes at which GLB ends, and then there is no bake";
        (most > MAX_BYTES).then(|| format!("{may}: {SMALLER}"))
    }

    fn options(&self) -> &'static [&'static str] {
        &["--lod", "--mesh-error", "--quantize", "--meshopt", "--even-borders", "--mesh-origin"]
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![FOLDER]
    }

    fn files(&self, request: &Request) -> u64 {
        let lods = request.meshes.lods.all().len() as u64;
        if self.whole { lods } else { lods.saturating_mul(request.region.tiles() + 1) }
    }

    fn kept_a_vertex(&self, request: &Request) -> u64 {
        let lods = request.meshes.lods.all().len() as u64;
        let vertices = (u64::from(request.region.tile_cells()) + 1).pow(2);
        // Waters and roads have few triangles compared with the land.
        if self.whole { lods * Gltf::land_bytes(&request.region).div_ceil(vertices) } else { 0 }
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(GltfSink::create(self, request, out)?)])
    }
}

impl Gltf {
    /// Returns the most bytes of a tile's land in its GLB.
    fn land_bytes(region: &Region) -> u64 {
        let cells = u64::from(region.tile_cells());
        let (vertices, triangles) = ((cells + 1).pow(2), 2 * cells.pow(2));
        // Positions, normals, tangents, coordinates and weights; and texels in four PNGs, which are a little longer
        // than the texels where nothing can be compressed.
        let texels = vertices * (3 + 3 + 4 + 4);
        vertices * (12 + 12 + 16 + 8 + 8) + triangles * 12 + texels + texels / 8
    }

    /// Returns the most bytes of a tile's GLB.
    fn bytes_at_most(region: &Region) -> u64 {
        let cells = u64::from(region.tile_cells());
        // Water has at most as many vertices and triangles as land. The last term is for roads.
        Gltf::land_bytes(region) + (cells + 1).pow(2) * 32 + 2 * cells.pow(2) * 12 + (1 << 20)
    }

    /// Returns the bytes of the largest GLB that has all tiles, given the bytes of a tile at a level of detail; 0 if
    /// each tile has its own GLB.
    fn region_bytes(&self, request: &Request, of_tile: impl Fn(&Request, u32) -> u64) -> u64 {
        let lods = request.meshes.lods.all().iter().filter(|_| self.whole);
        let largest = lods.map(|lod| of_tile(request, *lod)).max().unwrap_or(0);
        largest.saturating_mul(request.region.tiles())
    }

    /// Returns the fewest bytes of a tile's GLB: those of its land with every vertex. For coarser land, which may be
    /// two triangles, and for compressed numbers, which may be few bytes, it is 0.
    fn bytes_at_least(request: &Request, lod: u32) -> u64 {
        if lod > 0 || request.meshes.compressed {
            return 0;
        }
        let cells = u64::from(request.region.tile_cells());
        let vertices = (cells + 1).pow(2);
        // Positions, normals, texture coordinates and the weights of the ground.
        let vertex = if request.meshes.quantized { 8 + 4 + 4 + 4 } else { 12 + 12 + 8 + 4 };
        let index = if u16::try_from(vertices).is_ok() { 2 } else { 4 };
        vertices * vertex + 2 * cells.pow(2) * 3 * index
    }

    /// Refuses tiles whose GLB could be larger than 2^32 bytes.
    fn check_size(region: &Region) -> Result<(), Error> {
        let bytes = Gltf::bytes_at_most(region);
        if bytes <= MAX_BYTES {
            return Ok(());
        }
        // The largest tile that fits, for the hint.
        let fits = (1..region.tile_cells()).rev().find(|cells| {
            let smaller = Region::new(region.at(), 1, 1, *cells);
            smaller.is_ok_and(|region| Gltf::bytes_at_most(&region) <= MAX_BYTES)
        });
        Err(Error::Export {
            message: format!(
                "the GLB of a tile of {} cells a side could have {bytes} bytes, and GLB ends at 2^32",
                region.tile_cells()
            ),
            hint: format!("give --tile-cells {} or less, or export obj", fits.unwrap_or(1)),
        })
    }
}

/// Writes the GLBs, each by the thread that made the tile, and the region's files, tile by tile.
pub(crate) struct GltfSink<'a> {
    name: &'static str,
    whole: bool,
    modeller: Modeller<'a>,
    /// Painters of the colour and of both halves of the blend map.
    painters: [(&'static str, Painter<'a>); 3],
    names: TileNames,
    out: PathBuf,
    regions: Mutex<Vec<RegionFile>>,
}

impl<'a> GltfSink<'a> {
    /// Begins the files in the folder of the bake.
    pub fn create(format: &Gltf, request: &Request<'a>, out: &Path) -> Result<GltfSink<'a>, Error> {
        let Request { world, region, meshes: options, names, .. } = *request;
        let painter = |name, quantity| (name, Painter::new(world, quantity, Encoding::Png, world.height_range_m()));
        let Gltf { name, whole, .. } = *format;
        let regions = options.lods.all().iter().map(|lod| RegionFile::create(*lod, name, whole, out));
        Ok(GltfSink {
            name,
            whole,
            modeller: Modeller::new(world, region, options, options.quantized),
            painters: [
                painter("colour", &COLOUR),
                painter("blend_ground", &GROUND_WEIGHTS),
                painter("blend_cover", &COVER_WEIGHTS),
            ],
            names,
            out: out.to_owned(),
            regions: Mutex::new(regions.collect::<Result<_, _>>()?),
        })
    }

    /// Makes the GLB of a tile's model.
    fn document(&self, tile: &Tile, lod: u32, model: &Model) -> Glb {
        let Modeller { world, frame, options, .. } = &self.modeller;
        let area = tile.area();
        let named = |part: &str| part_name(part, tile.id(), lod, &options.lods);
        let mut glb = Glb::new(options.compressed);
        if options.compressed {
            glb.uses(COMPRESSION, true);
        }
        if options.quantized {
            glb.uses(QUANTIZATION, true);
        }
        let mut children = Vec::new();
        // The land. A mesh with every vertex has the raster's normals; a coarser one has a normal map with the detail
        // between its vertices.
        let detail = (lod > 0).then(|| relative_normals(tile, &model.land));
        let ground = &world.preset().ground;
        let land = of_land(tile, &model.land, frame, ground, options.quantized, detail.is_some());
        let material = self.land_material(&mut glb, tile, named, detail.as_deref());
        let name = named("land");
        let mesh = glb.mesh(&name, land, Some(material));
        let quantum = frame.step_m() as f32;
        let [east, up, south] = frame.corner_m(&area).map(|metres| metres as f32);
        let lifted = options.quantized.then_some([0.0, up, 0.0]);
        let scale = options.quantized.then_some([quantum; 3]);
        // Quantised positions count steps; the node scales and lifts them to metres.
        children.push(glb.root.push(Node { scale, translation: lifted, ..node(&name, Some(mesh)) }));
        // Waters, then rivers of the thesis' agents, roads and bridges.
        for sheet in &model.waters {
            let substance = substance_of_water(sheet.kind);
            add(&mut glb, &mut children, substance, &named(substance.name), of_sheet(sheet, frame, &area));
        }
        for (substance, ribbons) in by_substance(&model.ribbons) {
            add(&mut glb, &mut children, substance, &named(substance.name), of_ribbons(ribbons, frame, &area));
        }
        let extras = extras(&json!({ "tile_x": tile.id().x, "tile_y": tile.id().y, "lod": lod }));
        // The tile's node stands at its corner, which keeps the numbers in the tile small.
        let root = glb.root.push(Node {
            children: Some(children),
            translation: Some([east, 0.0, south]),
            extras: Some(extras),
            ..node(&named("tile"), None)
        });
        let scene = Scene { extensions: None, extras: None, name: None, nodes: vec![root] };
        glb.root.scene = Some(glb.root.push(scene));
        glb
    }

    fn land_material(
        &self,
        glb: &mut Glb,
        tile: &Tile,
        named: impl Fn(&str) -> String,
        detail: Option<&[u8]>,
    ) -> Index<Material> {
        let side = tile.area().width();
        let png = |sample, rows: &[u8], srgb| png_bytes(sample, (side as u32, side as u32), srgb, rows);
        let painted = |(_, painter): &(&str, Painter)| {
            png(painter.quantity().sample, &painter.paint(tile, side, side), painter.quantity().is_colour)
        };
        let [colour, blends @ ..] = &self.painters;
        let base = glb.texture(&named(colour.0), &painted(colour));
        let normal = detail.map(|rows| glb.texture(&named("normal"), &png(Sample::Rgb8, rows, false)));
        let blend_images: Vec<String> = blends.iter().map(|blend| named(blend.0)).collect();
        // glTF has no blend maps: they are images without a texture, and the material's extras name them for scripts.
        for (name, blend) in blend_images.iter().zip(blends) {
            glb.image(name, &painted(blend));
        }
        // A reader without this extension shows the texture half a texel off, which is better than nothing.
        glb.uses(TRANSFORM, false);
        // Texels lie on vertices: texture coordinate 0 is the middle of the first texel, and 1 the middle of the last
        // one.
        let texels = side as f32;
        let (offset, scale) = ([0.5 / texels; 2], [(texels - 1.0) / texels; 2]);
        let transform = json!({ "offset": offset, "scale": scale });
        let others = || Map::from_iter([(TRANSFORM.to_owned(), transform.clone())]);
        let info = |index: Index<Texture>| Info {
            index,
            tex_coord: 0,
            extensions: Some(extensions::texture::Info { others: others() }),
            extras: None,
        };
        let normal_texture = normal.map(|index| NormalTexture {
            index,
            scale: 1.0,
            tex_coord: 0,
            extensions: Some(extensions::material::NormalTexture { others: others() }),
            extras: None,
        });
        glb.root.push(Material {
            name: Some(named("land")),
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_texture: Some(info(base)),
                metallic_factor: StrengthFactor(0.0),
                // Soil and rock hardly shine: the same roughness as that of roads in `SUBSTANCES`.
                roughness_factor: StrengthFactor(0.95),
                ..Default::default()
            },
            normal_texture,
            extras: Some(extras(&json!({ "blend_images": blend_images }))),
            ..Default::default()
        })
    }
}

/// Adds a part with this name. Its material has the name of the substance alone, since all tiles share it.
fn add(
    glb: &mut Glb,
    children: &mut Vec<Index<Node>>,
    substance: Substance,
    name: &str,
    geometry: super::values::MeshData,
) {
    let [.., opacity] = substance.colour;
    let material = glb.root.push(Material {
        name: Some(substance.name.to_owned()),
        alpha_mode: Valid(if opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque }),
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor(substance.colour),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(substance.roughness),
            ..Default::default()
        },
        ..Default::default()
    });
    let mesh = glb.mesh(name, geometry, Some(material));
    children.push(glb.root.push(node(name, Some(mesh))));
}

pub(super) fn node(name: &str, mesh: Option<Index<Mesh>>) -> Node {
    Node { mesh, name: Some(name.to_owned()), ..Default::default() }
}

fn extras(value: &impl Serialize) -> Box<RawValue> {
    serde_json::value::to_raw_value(value).expect("names and numbers are JSON")
}

impl Sink for GltfSink<'_> {
    fn name(&self) -> &str {
        self.name
    }

    fn take(&self, tile: &Tile, place: Place, clock: &Clock) -> Result<Kept, Error> {
        let Kept { mut piece, mut files } = Kept::default();
        for (lod, model) in self.modeller.models(tile, clock)? {
            let path = tile_path(lod, self.names.numbers(&self.modeller.region, place), "glb");
            let glb = self.document(tile, lod, &model).finish();
            // The region's file needs the JSON of each tile, in the order of tiles; numbers may stay in the tile's GLB.
            frames::push(&mut piece, path.as_bytes());
            frames::push(&mut piece, glb.json());
            frames::push(&mut piece, if self.whole { glb.numbers() } else { &[] });
            if self.whole {
                continue;
            }
            let finished = write_whole(self.out.join(&path), &glb.bytes)?;
            files.push(FileRecord {
                tile: Some(tile.id()),
                mesh: Some(self.modeller.record(tile, lod, &model.land)),
                ..FileRecord::new(path, self.name, finished)
            });
        }
        Ok(Kept { piece, files })
    }

    fn append(&self, _row: u64, pieces: &[&[u8]], clock: &Clock) -> Result<(), Error> {
        let mut regions = locked(&self.regions);
        for piece in pieces {
            clock.check()?;
            let parts: Vec<&[u8]> = frames::pieces(piece).collect();
            // The region's files and the parts have the levels in the same order.
            for (region, part) in regions.iter_mut().zip(parts.chunks_exact(3)) {
                let [path, json, numbers] = part else { unreachable!("chunks of three have three parts") };
                let root = Root::from_slice(json).expect("it was written by this sink");
                let numbers = if self.whole {
                    TileNumbers::Here(numbers)
                } else {
                    let path = str::from_utf8(path).expect("it was written by this sink");
                    TileNumbers::In(path, GlbFile::numbers_at(json.len()))
                };
                region.add(root, numbers)?;
            }
        }
        Ok(())
    }

    fn finish(&self, watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        locked(&self.regions).drain(..).map(|region| region.finish(&watch.clock)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::TileId;

    #[test]
    fn a_tile_that_no_glb_can_hold_is_refused_with_one_that_can_be() {
        let region = |cells: u32| Region::new(TileId { x: 0, y: 0 }, 1, 1, cells).unwrap();
        assert!(Gltf::check_size(&region(4096)).is_ok());
        let error = Gltf::check_size(&region(8192)).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let largest = error.hint().unwrap().split(' ').find_map(|word| word.parse::<u32>().ok()).unwrap();
        assert!(Gltf::check_size(&region(largest)).is_ok() && Gltf::check_size(&region(largest + 1)).is_err());
    }
}
