//! Meshes, read back with the crates gltf and tobj: land within its bound, tiles that share their borders exactly,
//! waters and roads where they are; and what is refused.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::Command;

use gltf::Semantic;
use gltf::buffer::Source;
use gltf::mesh::Mode as Primitives;
use tempfile::TempDir;
use terrane::area::{Area, Region, TileId};
use terrane::clock::Clock;
use terrane::export::{Export, Manifest, MeshOptions, Mode, Output, Plan, TileNames};
use terrane::mesh::Waterlines;
use terrane::preset::Preset;
use terrane::tile::{Material, Tile};
use terrane::watch::Watch;
use terrane::world::World;

/// A world with a sea, the thesis' rivers and roads, and a spacing that is no power of two.
const WET: &str = r#"
    tile_cells = 32
    spacing_m = 3.3
    sea_level_m = 20.0
    noise = [{ kind = "ridged", height_m = 80.0, wavelength_m = 700.0, octaves = 4 }]
    rivers = { density = 1.0, bank_m = 8.0 }
    roads = { density = 1.0 }
"#;

const AT: TileId = TileId { x: -2, y: 100_000_000 };

fn wet() -> World {
    World::new(Preset::parse("wet", WET).unwrap(), Some(3)).unwrap()
}

fn region(world: &World) -> Region {
    Region::new(AT, 3, 2, world.tile_cells()).unwrap()
}

/// A bake of some exports in a folder of its own.
fn bake(world: &World, exports: &str, meshes: MeshOptions) -> (TempDir, Manifest) {
    bake_region(world, region(world), exports, meshes)
}

fn bake_region(world: &World, region: Region, exports: &str, meshes: MeshOptions) -> (TempDir, Manifest) {
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan::new(world, "wet", region, Export::parse_list(exports).unwrap()).unwrap();
    let plan = plan.with_meshes(meshes).unwrap();
    let output = Output::prepare(folder.path(), Mode::Replace, &plan, &plan.cost(2)).unwrap();
    let manifest = plan.run(&output, &Watch::default()).unwrap();
    (folder, manifest)
}

fn lods(text: &str) -> MeshOptions {
    MeshOptions { lods: text.parse().unwrap(), ..MeshOptions::default() }
}

/// A part of a mesh file: places in the region, in 32 bits as a program that draws it has them, and triangles.
struct Part {
    places: Vec<[f32; 3]>,
    triangles: Vec<[usize; 3]>,
}

/// The bytes of a glTF's buffers: a part of the file, or a file beside it.
fn buffers(file: &gltf::Gltf, path: &Path) -> Vec<Vec<u8>> {
    let bytes = |buffer: gltf::Buffer| match buffer.source() {
        Source::Bin => file.blob.clone().expect("the file has a binary part"),
        Source::Uri(name) => fs::read(path.parent().unwrap().join(name)).unwrap(),
    };
    let buffers: Vec<Vec<u8>> = file.buffers().map(bytes).collect();
    assert!(file.buffers().zip(&buffers).all(|(buffer, bytes)| bytes.len() >= buffer.length()), "{}", path.display());
    buffers
}

/// The parts of a glTF by what they are, of all tiles together.
fn parts(path: &Path) -> BTreeMap<String, Part> {
    // The reader knows no KHR_mesh_quantization; what it allows is read below.
    let file = gltf::Gltf::from_slice_without_validation(&fs::read(path).unwrap());
    let file = file.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let (document, buffers) = (&file.document, buffers(&file, path));
    let mut parts = BTreeMap::<String, Part>::new();
    for root in document.default_scene().expect("a scene").nodes() {
        let (corner, rotation, scale) = root.transform().decomposed();
        assert_eq!(
            (rotation, scale),
            ([0.0, 0.0, 0.0, 1.0], [1.0; 3]),
            "{} has no transform but its place",
            path.display()
        );
        for node in root.children() {
            let (lift, _, scale) = node.transform().decomposed();
            let part = parts
                .entry(kind(node.name().unwrap()).to_owned())
                .or_insert_with(|| Part { places: Vec::new(), triangles: Vec::new() });
            for primitive in node.mesh().expect("a mesh").primitives() {
                assert_eq!(primitive.mode(), Primitives::Triangles);
                let first = part.places.len();
                let accessor = primitive.get(&Semantic::Positions).unwrap();
                let view = accessor.view().unwrap();
                let stride = view.stride().unwrap();
                let bytes = &buffers[view.buffer().index()][view.offset()..][..view.length()];
                for vertex in bytes.chunks_exact(stride) {
                    let number = |axis: usize| match accessor.size() {
                        6 => f32::from(u16::from_le_bytes(vertex[2 * axis..][..2].try_into().unwrap())),
                        _ => f32::from_le_bytes(vertex[4 * axis..][..4].try_into().unwrap()),
                    };
                    part.places.push([0, 1, 2].map(|axis| corner[axis] + (lift[axis] + scale[axis] * number(axis))));
                }
                let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|data| &data[..]));
                let indices: Vec<usize> =
                    reader.read_indices().unwrap().into_u32().map(|index| first + index as usize).collect();
                part.triangles.extend(indices.as_chunks::<3>().0);
            }
        }
    }
    parts
}

fn glb(folder: &TempDir, lod: u32, col: u64, row: u64) -> PathBuf {
    let level = if lod == 0 { String::new() } else { format!("_lod{lod}") };
    folder.path().join(format!("mesh/tile{level}_x{col}_y{row}.glb"))
}

/// What a part is: its name without the place of its tile.
fn kind(name: &str) -> &str {
    name.split("_x").next().unwrap()
}

fn bits(place: [f32; 3]) -> [u32; 3] {
    place.map(f32::to_bits)
}

/// How often each edge of triangles between exact places is used: no more than twice, and once only on the region's
/// border.
fn assert_welded(parts: &[&Part], what: &str) {
    let mut edges = BTreeMap::new();
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for part in parts {
        for place in &part.places {
            low = [0, 1, 2].map(|axis| low[axis].min(place[axis]));
            high = [0, 1, 2].map(|axis| high[axis].max(place[axis]));
        }
        for triangle in &part.triangles {
            let [a, b, c] = triangle.map(|index| part.places[index]);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let edge = if bits(from) < bits(to) { (bits(from), bits(to)) } else { (bits(to), bits(from)) };
                edges.entry(edge).or_insert((0, [from, to])).0 += 1;
            }
        }
    }
    for (count, [from, to]) in edges.into_values() {
        let outer =
            [0, 2].into_iter().any(|axis| from[axis] == to[axis] && [low[axis], high[axis]].contains(&from[axis]));
        assert!(count == 2 || count == 1 && outer, "{what}: the edge {from:?} {to:?} has {count} triangles");
    }
}

#[test]
fn tiles_meet_without_a_crack_at_every_level_in_floats_and_in_whole_numbers() {
    let world = wet();
    for quantized in [false, true] {
        let (folder, _) = bake(&world, "gltf", MeshOptions { quantized, ..lods("0..4") });
        for lod in 0..=4 {
            let lands: Vec<Part> = (0..6)
                .map(|tile| parts(&glb(&folder, lod, tile % 3, tile / 3)).remove("land").expect("a tile has land"))
                .collect();
            assert_welded(&lands.iter().collect::<Vec<_>>(), &format!("LOD {lod}"));
            // The region's file shows the same.
            let level = if lod == 0 { String::new() } else { format!("_lod{lod}") };
            let all = parts(&folder.path().join(format!("mesh/region{level}.gltf")));
            let places: BTreeSet<_> = all["land"].places.iter().copied().map(bits).collect();
            assert_eq!(places, lands.iter().flat_map(|land| &land.places).copied().map(bits).collect());
        }
    }
}

#[test]
fn no_vertex_of_the_raster_is_further_from_a_mesh_than_the_manifest_says() {
    let world = wet();
    let mut land_of = BTreeMap::new();
    for quantized in [false, true] {
        let (folder, manifest) = bake(&world, "gltf", MeshOptions { quantized, error_m: Some(1.5), ..lods("0..3") });
        let origin_m = manifest.region.mesh_origin_m;
        let mut tiles = 0;
        for file in &manifest.files {
            let (Some(mesh), Some(id)) = (&file.mesh, file.tile) else { continue };
            tiles += 1;
            assert!(mesh.lod == 0 || mesh.error_m == 1.5 * f64::from(mesh.lod - 1).exp2());
            let land = parts(&folder.path().join(&file.path)).remove("land").unwrap();
            assert_eq!((land.places.len() as u64, land.triangles.len() as u64), (mesh.vertices, mesh.triangles));
            let tile = land_of.entry((id.x, id.y)).or_insert_with(|| Tile::new(&world, id));
            let Area { x0, y0, x1, y1 } = tile.area();
            // Below rivers the ground lies below the water, which the raster is too coarse to show.
            let waters =
                Waterlines::new(&world, tile, f64::from(mesh.lod).exp2() / 32.0, 1, &Clock::default()).unwrap();
            let is_covered = |at| waters.as_ref().is_some_and(|waters| waters.covers(at));
            let mut seen = BTreeSet::new();
            for triangle in &land.triangles {
                // In vertices of the lattice.
                let corners = triangle.map(|index| {
                    let [east, up, south] = land.places[index].map(f64::from);
                    [(east + origin_m[0]) / 3.3 - x0 as f64, up, (south + origin_m[1]) / 3.3 - y0 as f64]
                });
                let [a, b, c] = corners;
                let twice = |p: [f64; 3], q: [f64; 3], r: [f64; 3]| {
                    (q[2] - p[2]) * (r[0] - p[0]) - (q[0] - p[0]) * (r[2] - p[2])
                };
                let whole = twice(a, b, c);
                assert!(whole > 0.0, "a triangle faces up");
                let range = |axis: usize| {
                    let values = corners.map(|corner| corner[axis]);
                    values.into_iter().fold(f64::INFINITY, f64::min).round() as i64
                        ..=values.into_iter().fold(f64::NEG_INFINITY, f64::max).round() as i64
                };
                for (x, y) in range(2).flat_map(|y| range(0).map(move |x| (x, y))) {
                    let at = [x as f64, 0.0, y as f64];
                    let shares = [twice(b, c, at), twice(c, a, at), twice(a, b, at)].map(|share| share / whole);
                    // A tenth of a thousandth of a cell, by which quantised places are off, is inside too.
                    if shares.iter().all(|share| *share > -1e-2) {
                        let height_m: f64 = (0..3).map(|corner| shares[corner] * corners[corner][1]).sum();
                        let off_m = (height_m - f64::from(tile.heights().at(x0 + x, y0 + y))).abs();
                        let inside = shares.iter().all(|share| *share >= 0.0) && !is_covered([x as u32, y as u32]);
                        assert!(!inside || off_m <= mesh.error_m + 1e-2, "LOD {}: {off_m} m off", mesh.lod);
                        seen.insert((x, y));
                    }
                }
            }
            assert_eq!(seen.len() as i64, (x1 - x0) * (y1 - y0), "every vertex is under a triangle");
        }
        assert_eq!(tiles, 4 * 6);
    }
}

#[test]
fn vertices_carry_the_rasters_normals_and_weights() {
    let world = wet();
    let (folder, manifest) = bake(&world, "gltf", lods("1"));
    let tile = Tile::new(&world, TileId { x: AT.x + 2, y: AT.y });
    let path = glb(&folder, 1, 2, 0);
    let document = gltf::Gltf::open(&path).unwrap();
    let buffers = buffers(&document, &path);
    let names: BTreeSet<&str> = document.images().filter_map(|image| image.name()).collect();
    assert_eq!(
        names,
        ["blend_cover", "blend_ground", "colour", "normal"]
            .map(|image| format!("{image}_x0_y100000000"))
            .each_ref()
            .map(String::as_str)
            .into()
    );
    let mut relative = Vec::new();
    for image in document.images() {
        let gltf::image::Source::View { view, mime_type: "image/png" } = image.source() else { panic!("no PNG") };
        let bytes = &buffers[view.buffer().index()][view.offset()..][..view.length()];
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        assert_eq!((reader.info().width, reader.info().height), (33, 33));
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        if image.name() == Some("normal_x0_y100000000") {
            relative = pixels.as_chunks::<3>().0.to_vec();
        }
    }
    // Some of the raster's normals are others than the mesh's, but none at its vertices, by more than what rounding
    // does.
    let is_same = |texel: [u8; 3]| texel.iter().zip([128, 128, 255]).all(|(axis, same)| axis.abs_diff(same) <= 1);
    assert!(!relative.iter().all(|texel| is_same(*texel)));
    let node = document.nodes().find(|node| node.name() == Some("land_x0_y100000000")).unwrap();
    let primitive = node.mesh().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|buffer| buffers.get(buffer.index()).map(|data| &data[..]));
    let textures = reader.read_tex_coords(0).unwrap().into_f32();
    assert!(reader.read_tex_coords(1).is_none(), "nothing reads it, and it would depend on the region");
    let [ground, cover] = ["GROUND", "COVER"].map(|name| -> Vec<[u8; 4]> {
        let accessor = primitive.get(&Semantic::Extras(name.to_owned())).unwrap();
        assert!(accessor.normalized());
        gltf::accessor::Iter::new(accessor, |buffer| buffers.get(buffer.index()).map(|data| &data[..]))
            .unwrap()
            .collect()
    });
    let normals = reader.read_normals().unwrap();
    for (index, ((normal, texture), tangent)) in normals.zip(textures).zip(reader.read_tangents().unwrap()).enumerate()
    {
        let [column, row] = texture.map(|share| (share * 32.0).round());
        if texture.iter().zip([column, row]).any(|(share, at)| (share * 32.0 - at).abs() > 1e-4) {
            // On a bank or a shore.
            let length: f32 = normal.iter().map(|axis| axis * axis).sum();
            assert!((length - 1.0).abs() < 1e-5);
            continue;
        }
        let (x, y) = (tile.area().x0 + column as i64, tile.area().y0 + row as i64);
        assert_eq!(normal, tile.normals().at(x, y));
        assert!(is_same(relative[row as usize * 33 + column as usize]));
        assert!((0..3).map(|axis| normal[axis] * tangent[axis]).sum::<f32>().abs() < 1e-6 && tangent[0] > 0.0);
        let weights = [ground[index], cover[index]];
        assert_eq!(weights.as_flattened().iter().map(|weight| u32::from(*weight)).sum::<u32>(), 255);
        assert_eq!(weights.as_flattened(), Material::ALL.map(|material| tile.blend().weight(material, x, y)));
    }
    assert!(manifest.files.iter().any(|file| file.path == "mesh/region_lod1.gltf"));
}

/// Files of several regions and levels in one scene: programs number names that are there twice.
#[test]
fn names_tell_tile_and_kind_and_no_two_files_share_one() {
    let world = wet();
    let (folder, _) = bake(&world, "gltf,obj,obj-tiles", lods("0,2"));
    let (mut names, mut kinds, mut shared) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for tile in 0..6 {
        for (lod, level) in [(0, ""), (2, "_lod2")] {
            let document = gltf::Gltf::open(glb(&folder, lod, tile % 3, tile / 3)).unwrap();
            let place = format!("_x{}_y{}{level}", AT.x + (tile % 3) as i64, AT.y + (tile / 3) as i64);
            for node in document.nodes() {
                let name = node.name().unwrap();
                assert_eq!(name.strip_suffix(&place), Some(kind(name)), "{name} at {place}");
                assert!(node.mesh().is_none_or(|mesh| mesh.name() == Some(name)), "{name}");
                assert!(names.insert(name.to_owned()), "{name} is there twice");
                kinds.insert(kind(name).to_owned());
            }
            for material in document.materials() {
                let name = material.name().unwrap();
                match name.strip_suffix(&place) {
                    Some(own) => assert_eq!(own, "land"),
                    None => _ = shared.insert(name.to_owned()),
                }
            }
            let images: Vec<_> = document.images().map(|image| image.name().unwrap().to_owned()).collect();
            assert!(images.iter().all(|image| image.ends_with(&place)), "{images:?}");
        }
    }
    assert_eq!(kinds, ["land", "river", "road", "sea", "tile"].map(String::from).into());
    assert_eq!(shared, ["river", "road", "sea"].map(String::from).into());
    // The same in the files of the region, and in OBJ, which has no nodes of tiles.
    names.retain(|name| kind(name) != "tile");
    let (mut in_regions, mut in_tiles) = (BTreeSet::new(), BTreeSet::new());
    for path in fs::read_dir(folder.path().join("mesh")).unwrap().map(|entry| entry.unwrap().path()) {
        if path.extension().is_some_and(|ending| ending == "obj") {
            let text = fs::read_to_string(&path).unwrap();
            let is_region = path.file_name().unwrap().to_str().unwrap().starts_with("region");
            let found = if is_region { &mut in_regions } else { &mut in_tiles };
            for name in text.lines().filter_map(|line| line.strip_prefix("o ")) {
                assert!(found.insert(name.to_owned()), "{name} is there twice");
            }
        }
    }
    assert_eq!((&in_regions, &in_tiles), (&names, &names));
}

#[test]
fn water_lies_level_and_its_tiles_meet() {
    let world = wet();
    let (folder, _) = bake(&world, "gltf", lods("0"));
    let all = parts(&folder.path().join("mesh/region.gltf"));
    let sea = &all["sea"];
    assert!(sea.places.iter().all(|place| place[1] <= 20.0) && sea.places.iter().any(|place| place[1] == 20.0));
    // As much of it as lies below the level.
    let area: f64 = sea
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|index| sea.places[index].map(f64::from));
            ((b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])) / 2.0
        })
        .inspect(|area| assert!(*area > 0.0, "water faces up"))
        .sum();
    let tiles = (0..6).map(|tile| Tile::new(&world, TileId { x: AT.x + tile % 3, y: AT.y + tile / 3 }));
    let wet: f64 = tiles
        .map(|tile| {
            let Area { x0, y0, x1, y1 } = tile.area();
            let below = |x: i64, y: i64, [u, v]: [f64; 2]| {
                let height = |i: i64, j: i64| f64::from(tile.heights().at(x + i, y + j));
                (height(0, 0) * (1.0 - u) + height(1, 0) * u) * (1.0 - v)
                    + (height(0, 1) * (1.0 - u) + height(1, 1) * u) * v
            };
            let shares = || (0..16).map(|at| [(f64::from(at % 4) + 0.5) / 4.0, (f64::from(at / 4) + 0.5) / 4.0]);
            let cells = (y0..y1 - 1).flat_map(|y| (x0..x1 - 1).map(move |x| (x, y)));
            cells.map(|(x, y)| shares().filter(|share| below(x, y, *share) < 20.0).count() as f64 / 16.0).sum::<f64>()
        })
        .sum();
    // The banks of agents' rivers, which are dug below the sea, are their own.
    assert!((area / (wet * 3.3 * 3.3) - 1.0).abs() < 0.03, "{area} m2, and {} of land below it", wet * 3.3 * 3.3);
    assert!(sea.triangles.len() < 4000, "{} triangles for what is flat", sea.triangles.len());
}

#[test]
fn water_and_its_land_meet_at_the_seams_of_tiles_at_every_level() {
    let wet = wet();
    // With the thesis' rivers, and with rivers, lakes and a coast of fluvial land.
    let settled = crate::bakes::settled();
    let settled_region = Region::new(TileId { x: -2, y: -2 }, 3, 2, settled.tile_cells()).unwrap();
    for ((world, region), lod) in
        [(&wet, region(&wet)), (settled, settled_region)].into_iter().flat_map(|it| (0..=3).map(move |lod| (it, lod)))
    {
        // Of one, in whole numbers, whose steps are coarser than what banks are found in.
        let quantized = std::ptr::eq(world, settled);
        let (folder, _) = bake_region(world, region, "gltf", MeshOptions { quantized, ..lods(&lod.to_string()) });
        let lands: Vec<Part> =
            (0..6).map(|tile| parts(&glb(&folder, lod, tile % 3, tile / 3)).remove("land").unwrap()).collect();
        assert_welded(&lands.iter().collect::<Vec<_>>(), &format!("LOD {lod}"));
        let mut edges = BTreeMap::new();
        for tile in 0..6 {
            let all = parts(&glb(&folder, lod, tile % 3, tile / 3));
            let land = &all["land"];
            let bounds = [0, 2].map(|axis| {
                let at =
                    |pick: fn(f32, f32) -> f32, first: f32| land.places.iter().map(|it| it[axis]).fold(first, pick);
                [at(f32::min, f32::INFINITY), at(f32::max, f32::NEG_INFINITY)]
            });
            for part in ["river", "lake", "sea"].into_iter().filter_map(|name| all.get(name)) {
                for triangle in &part.triangles {
                    let [a, b, c] = triangle.map(|index| part.places[index]);
                    for (from, to) in [(a, b), (b, c), (c, a)] {
                        let on_edge = [(0, 0), (2, 1)]
                            .iter()
                            .any(|&(axis, side)| from[axis] == to[axis] && bounds[side].contains(&from[axis]));
                        let edge = if bits(from) < bits(to) { (bits(from), bits(to)) } else { (bits(to), bits(from)) };
                        if on_edge {
                            edges.entry(edge).or_insert((0, [from, to])).0 += 1;
                        }
                    }
                }
            }
        }
        // What lies on the outer edge of the region is there once.
        let all = parts(
            &folder
                .path()
                .join(format!("mesh/region{}.gltf", if lod == 0 { String::new() } else { format!("_lod{lod}") })),
        );
        let outer = [0, 2].map(|axis| {
            let places = || all["land"].places.iter().map(|it| it[axis]);
            [places().fold(f32::INFINITY, f32::min), places().fold(f32::NEG_INFINITY, f32::max)]
        });
        let mut inner = 0;
        for (count, [from, to]) in edges.into_values() {
            let is_outer = [(0, 0), (2, 1)]
                .iter()
                .any(|&(axis, side)| from[axis] == to[axis] && outer[side].contains(&from[axis]));
            assert!(is_outer || count == 2, "LOD {lod}: {from:?} to {to:?} has {count}");
            inner += usize::from(!is_outer);
        }
        assert!(inner > 3, "{inner} edges of water lie where tiles meet");
    }
}

#[test]
fn roads_lie_on_the_land_and_meet_where_tiles_do_at_every_level() {
    let wet = wet();
    // Agents' roads, and roads between settlements beside rivers.
    let settled = crate::bakes::settled();
    let settled_region = Region::new(TileId { x: -2, y: -2 }, 3, 2, settled.tile_cells()).unwrap();
    for ((world, region), lod) in
        [(&wet, region(&wet)), (settled, settled_region)].into_iter().flat_map(|it| (0..=3).map(move |lod| (it, lod)))
    {
        let (folder, _) = bake_region(world, region, "gltf", lods(&lod.to_string()));
        let side_m = f64::from(world.tile_cells()) * world.spacing_m();
        let (mut seams, mut tried) = (BTreeMap::new(), 0);
        for tile in 0..6 {
            let all = parts(&glb(&folder, lod, tile % 3, tile / 3));
            let Some(road) = all.get("road") else { continue };
            let land = &all["land"];
            let edges = [0, 2].map(|axis| {
                let places = || land.places.iter().map(|place| place[axis]);
                [places().fold(f32::INFINITY, f32::min), places().fold(f32::NEG_INFINITY, f32::max)]
            });
            for triangle in &road.triangles {
                let corners = triangle.map(|index| road.places[index]);
                let up = doubled_area(corners.map(|corner| corner.map(f64::from)));
                assert!(up > -1e-2, "LOD {lod}: a road faces up: {corners:?}");
                for corner in corners {
                    let is_within = |(axis, [low, high]): (usize, [f32; 2])| (low..=high).contains(&corner[axis]);
                    assert!([0, 2].into_iter().zip(edges).all(is_within), "LOD {lod}: {corner:?} is on no land");
                }
                let middle =
                    [0, 1, 2].map(|axis| corners.iter().map(|corner| f64::from(corner[axis])).sum::<f64>() / 3.0);
                let above_m = middle[1] - height_m(land, [middle[0], middle[2]]);
                assert!((0.1..0.14).contains(&above_m), "LOD {lod}: {above_m} m above the land at {middle:?}");
                tried += 1;
                for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(from, to)| (corners[from], corners[to])) {
                    let on_edge = [(0, 0), (2, 1)]
                        .iter()
                        .any(|&(axis, side)| from[axis] == to[axis] && edges[side].contains(&from[axis]));
                    if on_edge {
                        let edge = if bits(from) < bits(to) { (bits(from), bits(to)) } else { (bits(to), bits(from)) };
                        seams.entry(edge).or_insert((0, [from, to])).0 += 1;
                    }
                }
            }
        }
        // What lies on the outer edge of the region is there once.
        let corner = parts(&glb(&folder, lod, 0, 0)).remove("land").unwrap();
        let first = [0, 2].map(|axis| corner.places.iter().map(|place| place[axis]).fold(f32::INFINITY, f32::min));
        let mut inner = 0;
        for (count, [from, to]) in seams.into_values() {
            let is_outer = [(0, 0, 3.0), (2, 1, 2.0)].iter().any(|&(axis, side, tiles)| {
                let outer = [0.0, tiles].map(|tiles| f64::from(first[side]) + tiles * side_m);
                from[axis] == to[axis] && outer.iter().any(|at| (f64::from(from[axis]) - at).abs() < 0.01)
            });
            assert!(is_outer || count == 2, "LOD {lod}: the edge {from:?} {to:?} has {count} triangles");
            inner += usize::from(!is_outer);
        }
        // None of the few roads of the first world goes from tile to tile.
        assert!(inner > 1 || !std::ptr::eq(world, settled), "LOD {lod}: {inner} edges of roads lie where tiles meet");
        assert!(tried > 20, "LOD {lod}: {tried} triangles prove little");
    }
}

/// Twice the area of a triangle seen from above, positive if it faces up.
fn doubled_area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
}

/// The height of a land at a place that lies on it.
fn height_m(land: &Part, [east, south]: [f64; 2]) -> f64 {
    let at = [east, 0.0, south];
    let shares = |triangle: &[usize; 3]| {
        let corners = triangle.map(|index| land.places[index].map(f64::from));
        let [a, b, c] = corners;
        let whole = doubled_area(corners);
        let shares = [[at, b, c], [a, at, c], [a, b, at]].map(|part| doubled_area(part) / whole);
        (
            shares.into_iter().fold(f64::INFINITY, f64::min),
            (0..3).map(|corner| shares[corner] * corners[corner][1]).sum(),
        )
    };
    // Of the triangles at an edge, whichever it is most in.
    let best = land.triangles.iter().map(shares).max_by(|a: &(f64, f64), b| a.0.total_cmp(&b.0));
    best.expect("a land has triangles").1
}

#[test]
fn obj_shows_what_gltf_shows() {
    let world = wet();
    let (folder, manifest) = bake(&world, "obj,obj-tiles,gltf", lods("0,2"));
    let options = tobj::LoadOptions { single_index: true, triangulate: false, ..Default::default() };
    for level in ["", "_lod2"] {
        let path = folder.path().join(format!("mesh/region{level}.obj"));
        let (models, materials) = tobj::load_obj(&path, &options).unwrap();
        let materials = materials.unwrap();
        let land = |model: &&tobj::Model| model.mesh.material_id.is_some_and(|id| kind(&materials[id].name) == "land");
        let triangles: usize = models.iter().filter(land).map(|model| model.mesh.indices.len() / 3).sum();
        let all = parts(&folder.path().join(format!("mesh/region{level}.gltf")));
        assert_eq!(triangles, all["land"].triangles.len());
        let places: BTreeSet<_> = models
            .iter()
            .filter(land)
            .flat_map(|model| model.mesh.positions.as_chunks::<3>().0)
            .map(|place| place.map(|axis| (axis * 100.0).round() as i64))
            .collect();
        let expected: BTreeSet<_> =
            all["land"].places.iter().map(|place| place.map(|axis| (axis * 100.0).round() as i64)).collect();
        assert_eq!(places, expected);
        let picture = materials.iter().find_map(|material| material.diffuse_texture.clone()).unwrap();
        assert!(folder.path().join("mesh").join(picture).exists(), "the picture that the material names is there");
        let (tile, materials) =
            tobj::load_obj(folder.path().join(format!("mesh/tile{level}_x1_y1.obj")), &options).unwrap();
        assert!(!tile.is_empty());
        let picture = materials.unwrap().iter().find_map(|material| material.diffuse_texture.clone()).unwrap();
        assert!(folder.path().join("mesh").join(picture).exists(), "the picture of the tile is there");
    }
    let listed: BTreeSet<&str> = manifest.files.iter().map(|file| &file.path[..]).collect();
    for path in ["mesh/region.mtl", "mesh/tile_lod2_x2_y1.mtl", "colour/colour.png", "colour/colour_x0_y0.png"] {
        assert!(listed.contains(path), "{path} is in the manifest");
    }
}

#[test]
fn meshes_are_the_same_on_any_number_of_threads() {
    let world = wet();
    let hashes = |threads: usize| -> BTreeMap<String, String> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = MeshOptions { quantized: true, compressed: true, ..lods("0..1") };
        let (_folder, manifest) = pool.install(|| bake(&world, "gltf,obj", options));
        manifest.files.into_iter().map(|file| (file.path, file.blake3)).collect()
    };
    assert_eq!(hashes(1), hashes(5));
}

#[test]
fn what_makes_no_mesh_is_refused_with_what_would_do() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str], hint: &str| {
        let out = folder.path().join("out");
        let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
        command.args(["bake", "hills", "--size", "1x1", "--export", "gltf", "--out"]).arg(&out).args(arguments);
        let output = command.output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(hint), "{arguments:?}: {stderr}");
        assert!(!out.exists(), "nothing is left");
    };
    for error in ["0", "-1", "NaN", "1e9", "inf"] {
        refused(&["--lod", "1", "--mesh-error", error], "--mesh-error");
    }
    refused(&["--lod", "30"], "the coarsest level of this world is --lod");
    refused(&["--lod", "3..1"], "the finest level comes first");
    refused(&["--lod", "1", "--mesh-error", "1e-6", "--quantize"], "leave out --quantize");
}

#[test]
fn an_option_that_no_export_reads_is_refused_with_those_that_do() {
    let folder = tempfile::tempdir().unwrap();
    let run = |exports: &str, options: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
        let out = folder.path().join("out");
        command.args(["bake", "hills", "--size", "1x1", "--dry-run"]).arg("--out").arg(out).args(options);
        command.args(exports.split(' ').filter(|word| !word.is_empty())).output().unwrap()
    };
    for (exports, option, hint) in [
        ("", &["--lod", "0"][..], "gltf, gltf-region, obj, obj-tiles, collision"),
        ("--export height,vector", &["--mesh-error", "0.5"], "gltf, gltf-region, obj, obj-tiles, collision"),
        ("--profile unity", &["--lod", "0..1"], "gltf, gltf-region, obj, obj-tiles, collision"),
        ("--export height", &["--quantize"], "that do: gltf, gltf-region, collision\n"),
        ("--export obj", &["--quantize"], "that do: gltf, gltf-region, collision\n"),
        ("--export obj-tiles", &["--meshopt"], "that do: gltf, gltf-region, collision\n"),
    ] {
        let output = run(exports, option);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{exports} {option:?}: {stderr}");
        assert!(stderr.contains(option[0]) && stderr.contains(hint), "{exports} {option:?}: {stderr}");
    }
    for (exports, options) in [
        ("--export gltf", &["--lod", "0..1", "--mesh-error", "0.5", "--quantize", "--meshopt"][..]),
        ("--export obj", &["--lod", "1", "--mesh-error", "0.5"]),
        ("--profile blender", &["--lod", "2", "--quantize"]),
    ] {
        assert!(run(exports, options).status.success(), "{exports} {options:?}");
    }
}

/// The GLBs of two regions, of which one is shifted by a tile and larger, and both far from the origin.
#[test]
fn a_tile_has_the_same_glb_in_every_region() {
    let world = wet();
    let bake = |at: TileId, cols: u64, rows: u64, names: TileNames| {
        let region = Region::new(at, cols, rows, world.tile_cells()).unwrap();
        let plan = Plan::new(&world, "wet", region, Export::parse_list("gltf").unwrap()).unwrap();
        let plan = plan.with_meshes(lods("0..1")).unwrap().with_names(names);
        let folder = tempfile::tempdir().unwrap();
        let output = Output::prepare(folder.path(), Mode::New, &plan, &plan.cost(1)).unwrap();
        plan.run(&output, &Watch::default()).unwrap();
        folder
    };
    let one = bake(AT, 2, 2, TileNames::Region);
    let other = bake(TileId { x: AT.x - 1, y: AT.y + 1 }, 3, 1, TileNames::World);
    for lod in ["", "_lod1"] {
        for col in 0..2 {
            let read = |folder: &TempDir, x: i64, y: i64| {
                fs::read(folder.path().join(format!("mesh/tile{lod}_x{x}_y{y}.glb"))).unwrap()
            };
            assert!(read(&one, col, 1) == read(&other, AT.x + col, AT.y + 1), "{lod} {col}");
        }
    }
}

#[test]
fn collision_meshes_are_positions_of_the_coarsest_level() {
    let world = wet();
    let (folder, manifest) = bake(&world, "collision,gltf", lods("0..2"));
    let tiles: Vec<_> = manifest.files.iter().filter(|file| file.export == "collision").collect();
    assert_eq!(tiles.len(), 6);
    let seen = manifest.files.iter().find(|file| file.path == "mesh/tile_lod2_x1_y0.glb").unwrap();
    let solid = tiles.iter().find(|file| file.path == "collision/tile_x1_y0.glb").unwrap();
    assert_eq!(solid.mesh, seen.mesh, "the same triangles, in the same place");
    let document = gltf::Gltf::open(folder.path().join(&solid.path)).unwrap();
    assert_eq!((document.materials().count(), document.images().count()), (0, 0));
    let mut names = document.nodes().filter(|node| node.mesh().is_some()).map(|node| node.name().unwrap().to_owned());
    assert!(names.all(|name| name.ends_with("-colonly")));
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
        assert_eq!(primitive.attributes().map(|(semantic, _)| semantic).collect::<Vec<_>>(), [Semantic::Positions]);
    }
}

/// One file has what the tiles' files have.
#[test]
fn the_glb_of_a_region_has_the_meshes_of_all_tiles() {
    let world = wet();
    for compressed in [false, true] {
        let options = MeshOptions { quantized: compressed, compressed, ..lods("1") };
        let (folder, _) = bake(&world, "gltf,gltf-region", options);
        let json = |path: &str| {
            let bytes = fs::read(folder.path().join(path)).unwrap();
            gltf::Gltf::from_slice_without_validation(&bytes).unwrap().document.into_json()
        };
        let (placed, whole) = (json("mesh/region_lod1.gltf"), json("mesh/region_lod1.glb"));
        assert_eq!(serde_json::to_value(&placed.nodes).unwrap(), serde_json::to_value(&whole.nodes).unwrap());
        assert_eq!(serde_json::to_value(&placed.meshes).unwrap(), serde_json::to_value(&whole.meshes).unwrap());
        assert_eq!(whole.buffers.len(), if compressed { 2 } else { 1 });
        if !compressed {
            let [one, other] =
                ["gltf", "glb"].map(|it| parts(&folder.path().join("mesh/region_lod1").with_extension(it)));
            assert!(one.len() > 3 && one.keys().eq(other.keys()));
            for (name, part) in one {
                assert!(part.places == other[&name].places && part.triangles == other[&name].triangles, "{name}");
            }
        }
    }
}
