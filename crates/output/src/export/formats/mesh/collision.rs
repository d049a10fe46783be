//! Collision meshes: only the surfaces that something can stand on or run into. Each tile has a GLB with positions
//! alone: the land, and the decks of bridges.
//!
//! On import, Godot makes collision bodies of objects whose names end with `-colonly`. Other engines use the mesh as it
//! is in a mesh collider.

use std::path::{Path, PathBuf};

use gltf_json::scene::{Node, Scene};

use super::glb::{COMPRESSION, Glb, QUANTIZATION};
use super::gltf::node;
use super::model::Modeller;
use super::part_name;
use super::values::{of_ribbons, positions_of_land};
use crate::area::Place;
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request};
use crate::export::plan::options::{Lods, MeshOptions, TileNames};
use crate::file::write_whole;
use crate::mesh::RibbonKind;
use crate::tile::Tile;
use crate::watch::Watch;

/// Folder of the files within that of the bake.
const FOLDER: &str = "collision";

/// The finest level of detail: a mesh with every vertex is more than physics needs.
const FINEST: u32 = 1;

/// The format of collision meshes.
pub(crate) struct Collision;

impl Format for Collision {
    fn name(&self) -> &'static str {
        "collision"
    }

    fn about(&self) -> &'static str {
        "collision meshes: land at the coarsest --lod, but LOD 1 at least, and bridges, without anything but positions; a GLB a tile"
    }

    fn options(&self) -> &'static [&'static str] {
        &["--lod", "--mesh-error", "--quantize", "--meshopt", "--even-borders", "--mesh-origin"]
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![FOLDER]
    }

    fn files(&self, request: &Request) -> u64 {
        request.region.tiles()
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        let Request { world, region, meshes, names, .. } = *request;
        let coarsest = meshes.lods.all().iter().copied().max().unwrap_or(FINEST).max(FINEST);
        let options = MeshOptions { lods: Lods::only(coarsest), ..meshes.clone() };
        let modeller = Modeller::new(world, region, &options, options.quantized);
        Ok(vec![Box::new(CollisionSink { modeller, names, out: out.to_owned() })])
    }
}

/// Writes the files. The thread that made a tile writes its file.
struct CollisionSink<'a> {
    modeller: Modeller<'a>,
    names: TileNames,
    out: PathBuf,
}

impl Sink for CollisionSink<'_> {
    fn name(&self) -> &'static str {
        FOLDER
    }

    fn take(&self, tile: &Tile, place: Place, clock: &Clock) -> Result<Kept, Error> {
        let Modeller { frame, options, region, .. } = &self.modeller;
        let area = tile.area();
        let mut files = Vec::new();
        for (lod, model) in self.modeller.models(tile, clock)? {
            let mut glb = Glb::new(options.compressed);
            if options.compressed {
                glb.uses(COMPRESSION, true);
            }
            if options.quantized {
                glb.uses(QUANTIZATION, true);
            }
            let named = |part: &str| part_name(part, tile.id(), lod, &options.lods) + "-colonly";
            let land = &model.land;
            let mesh = glb.mesh(&named("land"), positions_of_land(tile, land, frame, options.quantized), None);
            let [east, up, south] = frame.corner_m(&area).map(|metres| metres as f32);
            let lifted = options.quantized.then_some([0.0, up, 0.0]);
            let scale = options.quantized.then_some([frame.step_m() as f32; 3]);
            let land_node = Node { scale, translation: lifted, ..node(&named("land"), Some(mesh)) };
            let mut children = vec![glb.root.push(land_node)];
            let decks = model.ribbons.iter().filter(|ribbon| ribbon.kind == RibbonKind::Bridge).cloned();
            let decks: Vec<_> = decks.collect();
            if !decks.is_empty() {
                let mut deck = of_ribbons(&decks, frame, &tile.area());
                deck.attributes.truncate(1);
                let mesh = glb.mesh(&named("bridge"), deck, None);
                children.push(glb.root.push(node(&named("bridge"), Some(mesh))));
            }
            let tile_node = Node {
                children: Some(children),
                translation: Some([east, 0.0, south]),
                ..node(&part_name("tile", tile.id(), lod, &options.lods), None)
            };
            let root = glb.root.push(tile_node);
            glb.root.scene =
                Some(glb.root.push(Scene { extensions: None, extras: None, name: None, nodes: vec![root] }));
            let [x, y] = self.names.numbers(region, place);
            let path = format!("{FOLDER}/tile_x{x}_y{y}.glb");
            let bytes = glb.finish().bytes;
            let finished = write_whole(self.out.join(&path), &bytes)?;
            files.push(FileRecord {
                tile: Some(tile.id()),
                mesh: Some(self.modeller.record(tile, lod, land)),
                ..FileRecord::new(path, Collision.name(), finished)
            });
        }
        Ok(Kept { piece: Vec::new(), files })
    }

    fn append(&self, _row: u64, _pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        Ok(())
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        Ok(Vec::new())
    }
}
