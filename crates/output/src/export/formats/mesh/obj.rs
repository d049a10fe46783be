//! Wavefront OBJ: one file for the region, written tile by tile, or one for each tile; each with an MTL of its
//! materials.
//!
//! x is east, y is up, z is south, in metres from the origin of the meshes (`--mesh-origin`). Each vertex has a texture
//! coordinate and a normal with the same number as its own.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::model::{Model, Modeller, SUBSTANCES, Substance, by_substance, substance_of_water};
use super::relative_normals::normal_at;
use super::{FOLDER, part_name, region_path, tile_path};
use crate::area::Place;
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request, file_name};
use crate::export::formats::locked;
use crate::export::plan::options::TileNames;
use crate::file::{PartFile, write_whole};
use crate::mesh::PARTS;
use crate::tile::Tile;
use crate::watch::Watch;

/// The format OBJ.
pub(crate) struct Obj {
    name: &'static str,
    about: &'static str,
    /// The export of the pictures that the materials show.
    colour: &'static str,
    /// True for a file for each tile, false for one file of the region.
    tiles: bool,
}

/// One OBJ of the region.
pub(crate) static OBJ: Obj = Obj {
    name: "obj",
    about: "the same meshes as one OBJ of the region, with its MTL and colour",
    colour: "colour",
    tiles: false,
};

/// An OBJ for each tile.
pub(crate) static OBJ_TILES: Obj =
    Obj { name: "obj-tiles", about: "the same, an OBJ a tile", colour: "colour-tiles", tiles: true };

impl Format for Obj {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn needs(&self) -> Option<&'static str> {
        Some(self.colour)
    }

    fn options(&self) -> &'static [&'static str] {
        &["--lod", "--mesh-error", "--even-borders", "--mesh-origin"]
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![FOLDER]
    }

    fn files(&self, request: &Request) -> u64 {
        let models = if self.tiles { request.region.tiles() } else { 1 };
        models.saturating_mul(2 * request.meshes.lods.all().len() as u64)
    }

    fn kept_a_vertex(&self, request: &Request) -> u64 {
        // Three lines of text for each vertex, and the corners of two triangles as numbers.
        const BYTES: u64 = 3 * 32 + 6 * 4;
        if self.tiles { 0 } else { request.meshes.lods.all().len() as u64 * BYTES }
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(ObjSink::create(self, request, out)?)])
    }
}

/// Writes OBJ files.
pub(crate) struct ObjSink<'a> {
    name: &'static str,
    modeller: Modeller<'a>,
    names: TileNames,
    out: PathBuf,
    /// For files of the region: path and file of each level, and the number of vertices written to it.
    regions: Option<Mutex<Vec<(String, PartFile, u64)>>>,
}

/// The text of a tile's vertices, and the tile's parts, whose faces count from its first vertex.
#[derive(Default)]
struct Text {
    vertices: String,
    count: u32,
    parts: Vec<Object>,
}

/// An object of an OBJ.
struct Object {
    name: String,
    material: String,
    faces: Vec<u32>,
}

impl<'a> ObjSink<'a> {
    /// Begins the files in the folder of the bake.
    fn create(format: &Obj, request: &Request<'a>, out: &Path) -> Result<ObjSink<'a>, Error> {
        let Request { world, region, meshes, names, .. } = *request;
        let begin = |lod: &u32| -> Result<(String, PartFile, u64), Error> {
            let path = region_path(*lod, "obj");
            let mut file = PartFile::create(out.join(&path))?;
            writeln!(file, "mtllib {}", file_name(&region_path(*lod, "mtl"))).map_err(Error::io(file.path()))?;
            Ok((path, file, 0))
        };
        let regions = (!format.tiles).then(|| meshes.lods.all().iter().map(begin).collect::<Result<Vec<_>, _>>());
        Ok(ObjSink {
            name: format.name,
            modeller: Modeller::new(world, region, meshes, false),
            names,
            out: out.to_owned(),
            regions: regions.transpose()?.map(Mutex::new),
        })
    }

    fn text(&self, tile: &Tile, lod: u32, model: &Model) -> Text {
        let Modeller { frame, region, options, .. } = &self.modeller;
        let area = tile.area();
        let [corner_east, _, corner_south] = frame.corner_m(&area);
        let mut text = Text::default();
        let named = |part: &str| part_name(part, tile.id(), lod, &options.lods);
        // OBJ has no transforms, so vertices include the tile's place; text has room for all the digits.
        let placed = |place: [u32; 2], height_m: f32| {
            let [east, south] = frame.steps_between(&area, place).map(|steps| steps as f64 * frame.step_m());
            [corner_east + east, f64::from(height_m), corner_south + south]
        };
        // Texels lie on vertices: of the tile's picture, or of the region's.
        let (before, sides) = if self.regions.is_none() {
            ([0, 0], [area.width() as u64; 2])
        } else {
            let origin = region.at().area(region.tile_cells());
            ([area.x0 - origin.x0, area.y0 - origin.y0], [region.width(), region.height()])
        };
        let texture = |place: [u32; 2]| {
            let [u, v] = [0, 1].map(|axis| {
                let at = before[axis] as f64 + f64::from(place[axis]) / f64::from(PARTS);
                (at + 0.5) / sides[axis] as f64
            });
            // OBJ counts v from the bottom of a picture.
            [u, 1.0 - v]
        };
        // In a file of the region, the land shows the picture of the region.
        let material = if self.regions.is_none() { named("land") } else { "land".to_owned() };
        text.add(
            named("land"),
            &material,
            &model.land.triangles,
            model
                .land
                .vertices
                .iter()
                .map(|vertex| (placed(vertex.place, vertex.height_m), texture(vertex.place), normal_at(tile, vertex))),
        );
        for sheet in &model.waters {
            let name = substance_of_water(sheet.kind).name;
            text.add(
                named(name),
                name,
                &sheet.triangles,
                sheet
                    .vertices
                    .iter()
                    .map(|(place, height_m)| (placed(*place, *height_m), texture(*place), [0.0, 1.0, 0.0])),
            );
        }
        for (substance, ribbons) in by_substance(&model.ribbons) {
            for ribbon in ribbons {
                text.add(
                    named(substance.name),
                    substance.name,
                    &ribbon.triangles,
                    ribbon.vertices.iter().map(|vertex| {
                        let [east, south] = frame.local_m(&area, vertex.place);
                        let place = [corner_east + east, vertex.height_m, corner_south + south].map(thousandths);
                        (place, vertex.texture.map(f64::from), vertex.normal)
                    }),
                );
            }
        }
        text
    }
}

/// Returns the text of an MTL. The land's material has the name `land` and shows `picture`.
fn materials(land: &str, picture: &str) -> String {
    let mut text = format!("newmtl {land}\nKd 1 1 1\nKs 0 0 0\nPr 0.95\nmap_Kd ../colour/{picture}\n");
    for Substance { name, colour: [red, green, blue, opacity], roughness } in SUBSTANCES {
        _ = write!(text, "\nnewmtl {name}\nKd {red} {green} {blue}\nKs 0.5 0.5 0.5\nPr {roughness}\nd {opacity}\n");
    }
    text
}

/// Rounds to millimetres: more digits are of no use.
fn thousandths(metres: f64) -> f64 {
    (metres * 1000.0).round() / 1000.0
}

impl Text {
    fn add(
        &mut self,
        name: String,
        material: &str,
        triangles: &[[u32; 3]],
        vertices: impl Iterator<Item = ([f64; 3], [f64; 2], [f32; 3])>,
    ) {
        let first = self.count;
        for ([east, up, south], [u, v], [normal_east, normal_up, normal_south]) in vertices {
            self.count += 1;
            // A height is printed as the shortest text that reads back as the same 32 bits.
            let up = up as f32;
            _ = write!(
                self.vertices,
                "v {east} {up} {south}\nvt {u:.6} {v:.6}\nvn {normal_east:.4} {normal_up:.4} {normal_south:.4}\n"
            );
        }
        let faces = triangles.as_flattened().iter().map(|index| first + index);
        match self.parts.last_mut() {
            // All ribbons of a substance are one object.
            Some(part) if part.name == name => part.faces.extend(faces),
            _ => self.parts.push(Object { name, material: material.to_owned(), faces: faces.collect() }),
        }
    }

    /// Writes the text into a file that has `before` vertices already.
    fn write(&self, before: u64, target: &mut impl std::io::Write) -> std::io::Result<()> {
        target.write_all(self.vertices.as_bytes())?;
        let mut line = String::new();
        for Object { name, material, faces } in &self.parts {
            writeln!(target, "o {name}\nusemtl {material}")?;
            for triangle in faces.as_chunks::<3>().0 {
                // Reuse one line: a face is written a million times.
                line.clear();
                line.push('f');
                for index in triangle {
                    // OBJ counts from 1, over the whole file.
                    let number = before + u64::from(*index) + 1;
                    _ = write!(line, " {number}/{number}/{number}");
                }
                line.push('\n');
                target.write_all(line.as_bytes())?;
            }
        }
        Ok(())
    }

    /// Packs the text as bytes, which a sink keeps until the turn of the tile comes.
    fn pack(&self, bytes: &mut Vec<u8>) {
        let add = |bytes: &mut Vec<u8>, part: &[u8]| {
            bytes.extend((part.len() as u64).to_le_bytes());
            bytes.extend(part);
        };
        bytes.extend(u64::from(self.count).to_le_bytes());
        add(bytes, self.vertices.as_bytes());
        bytes.extend((self.parts.len() as u64).to_le_bytes());
        for Object { name, material, faces } in &self.parts {
            add(bytes, name.as_bytes());
            add(bytes, material.as_bytes());
            add(bytes, &faces.iter().flat_map(|index| index.to_le_bytes()).collect::<Vec<u8>>());
        }
    }

    /// Reads a text back that [`pack`](Text::pack) wrote at the start of the bytes, and leaves what follows.
    fn unpack(bytes: &mut &[u8]) -> Text {
        fn number(bytes: &mut &[u8]) -> usize {
            u64::from_le_bytes(part(bytes, 8).try_into().expect("eight bytes")) as usize
        }
        fn part<'a>(bytes: &mut &'a [u8], length: usize) -> &'a [u8] {
            bytes.split_off(..length).expect("what was packed is whole")
        }
        fn text(bytes: &mut &[u8]) -> String {
            let length = number(bytes);
            String::from_utf8(part(bytes, length).to_vec()).expect("it was text")
        }
        let count = number(bytes) as u32;
        let vertices = text(bytes);
        let parts = (0..number(bytes)).map(|_| {
            let (name, material) = (text(bytes), text(bytes));
            let length = number(bytes);
            let faces = part(bytes, length).as_chunks().0.iter().map(|index| u32::from_le_bytes(*index)).collect();
            Object { name, material, faces }
        });
        let parts = parts.collect();
        Text { vertices, count, parts }
    }
}

impl Sink for ObjSink<'_> {
    fn name(&self) -> &str {
        self.name
    }

    fn take(&self, tile: &Tile, place: Place, clock: &Clock) -> Result<Kept, Error> {
        let Kept { mut piece, mut files } = Kept::default();
        for (lod, model) in self.modeller.models(tile, clock)? {
            let text = self.text(tile, lod, &model);
            if self.regions.is_some() {
                // The number of vertices before this tile is known only once the tiles before it are written.
                text.pack(&mut piece);
                continue;
            }
            let [x, y] = self.names.numbers(&self.modeller.region, place);
            let (path, beside) = (tile_path(lod, [x, y], "obj"), tile_path(lod, [x, y], "mtl"));
            let mut file = PartFile::create(self.out.join(&path))?;
            let written = writeln!(file, "mtllib {}", file_name(&beside)).and_then(|()| text.write(0, &mut file));
            written.map_err(Error::io(file.path()))?;
            let record = FileRecord {
                tile: Some(tile.id()),
                mesh: Some(self.modeller.record(tile, lod, &model.land)),
                ..FileRecord::new(path, self.name, file.finish()?)
            };
            let land = part_name("land", tile.id(), lod, &self.modeller.options.lods);
            let picture = format!("colour_x{x}_y{y}.png");
            let finished = write_whole(self.out.join(&beside), materials(&land, &picture).as_bytes())?;
            let second = FileRecord { tile: Some(tile.id()), ..FileRecord::new(beside, self.name, finished) };
            files.extend([record, second]);
        }
        Ok(Kept { piece, files })
    }

    fn append(&self, _row: u64, pieces: &[&[u8]], clock: &Clock) -> Result<(), Error> {
        let Some(regions) = &self.regions else { return Ok(()) };
        let mut regions = locked(regions);
        for piece in pieces {
            clock.check()?;
            let mut rest = *piece;
            for (_, file, before) in regions.iter_mut() {
                let text = Text::unpack(&mut rest);
                text.write(*before, file).map_err(Error::io(file.path()))?;
                *before += u64::from(text.count);
            }
        }
        Ok(())
    }

    fn finish(&self, _watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let mut records = Vec::new();
        let Some(regions) = &self.regions else { return Ok(records) };
        for (path, file, _) in locked(regions).drain(..) {
            let beside = format!("{}mtl", path.strip_suffix("obj").expect("it was named so"));
            records.push(FileRecord::new(path, self.name, file.finish()?));
            let finished = write_whole(self.out.join(&beside), materials("land", "colour.png").as_bytes())?;
            records.push(FileRecord::new(beside, self.name, finished));
        }
        Ok(records)
    }
}
