//! Splines: roads and rivers as knots of curves for engines, in the frame of the meshes.
//!
//! ```text
//!   thin.rs              points of a line -> the knots of a curve that stays near it
//!   README.template.md   the columns, and how engines convert the axes
//! ```
//!
//! x is east, y is up, z is south, in metres from the origin of the meshes (`--mesh-origin`). Engines convert them so:
//!
//! | Engine | Position | Axes |
//! |---|---|---|
//! | Unreal | `X = 100 x, Y = 100 z, Z = 100 y` centimetres | left-handed, +Y south, +Z up |
//! | Unity | `(x, y, -z)` | left-handed, +Z north |
//! | Godot | `(x, y, z)` | right-handed, +Z south |
//! | Houdini | `(x, y, z)` | right-handed, +Z south |
//!
//! Lines are cut at the edge of the region, and the parts of a line inside are numbered. A line that lies in the region
//! as a whole has the same knots in every region.

mod thin;

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use glam::DVec3;
use serde_json::json;

use crate::area::{Place, Region};
use crate::bake::{FileRecord, Kept, Sink};
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::{Format, Request};
use crate::export::formats::locked;
use crate::export::formats::vector::{FeatureStore, around};
use crate::export::plan::digits::{push_decimal, shortest};
use crate::features::Value;
use crate::features::layer::GeometryType;
use crate::features::splines::{SPLINES, carried};
use crate::file::{PartFile, write_whole};
use crate::geometry::come_along;
use crate::lines::StructureKind;
use crate::tile::Tile;
use crate::watch::Watch;
use thin::{MISS_M, thinned};

/// Folder of the files within that of the bake.
const FOLDER: &str = "splines";

const TEXT: &str = include_str!("README.template.md");

/// Header of each table, by the number of its layer among [`SPLINES`].
const HEADS: [&str; 2] = [
    "id,part,whole,name,class,index,x_m,y_m,z_m,width_m,along_m,structure\n",
    "id,part,whole,name,order,index,x_m,y_m,z_m,width_m,along_m,discharge_m3s\n",
];

/// The format of splines: two tables, the same as JSON, and a README.
pub(crate) struct Splines;

impl Format for Splines {
    fn name(&self) -> &'static str {
        "splines"
    }

    fn about(&self) -> &'static str {
        "roads and rivers as knots of curves in the meshes' frame: CSV and JSON, and what engines make of the axes"
    }

    fn folders(&self) -> Vec<&'static str> {
        vec![FOLDER]
    }

    fn options(&self) -> &'static [&'static str] {
        &["--mesh-origin"]
    }

    fn files(&self, _request: &Request) -> u64 {
        4
    }

    fn blank_pieces(&self, _request: &Request) -> Option<Vec<Vec<u8>>> {
        Some(Vec::new())
    }

    fn sinks<'a>(&self, request: &Request<'a>, out: &Path) -> Result<Vec<Box<dyn Sink + 'a>>, Error> {
        Ok(vec![Box::new(SplineSink::create(request, out)?)])
    }
}

/// The files being written.
struct SplineSink<'a> {
    region: Region,
    spacing_m: f64,
    /// Origin of the meshes, in metres east and north of the world's origin.
    origin_m: [f64; 2],
    store: FeatureStore<'a>,
    out: PathBuf,
    files: Mutex<Option<Files>>,
}

struct Files {
    tables: [PartFile; 2],
    json: PartFile,
    separator: &'static str,
}

impl<'a> SplineSink<'a> {
    fn create(request: &Request<'a>, out: &Path) -> Result<SplineSink<'a>, Error> {
        let Request { world, region, .. } = *request;
        let spacing_m = world.spacing_m();
        let origin = request.meshes.origin.expect("a plan has one");
        let [x, y] = origin.map(|at| at as f64 * spacing_m);
        let begin = |name: &str| PartFile::create(out.join(FOLDER).join(name));
        let files =
            Files { tables: [begin("roads.csv")?, begin("rivers.csv")?], json: begin("splines.json")?, separator: "" };
        Ok(SplineSink {
            region,
            spacing_m,
            // Subtract from 0.0: negation would make -0.0 of 0.0.
            origin_m: [x, 0.0 - y],
            store: FeatureStore::of_layers(request, SPLINES, &out.join(FOLDER).join("lines"))?,
            out: out.to_owned(),
            files: Mutex::new(Some(files)),
        })
    }

    /// Returns the JSON before its lines.
    fn head(&self) -> String {
        let [east_m, north_m] = self.origin_m;
        let head = json!({
            "axes": { "x": "east", "y": "up", "z": "south" },
            "unit": "metre",
            "origin": { "east_m": east_m, "north_m": north_m, "height_m": 0.0 },
            "curve": "uniform Catmull-Rom",
            "miss_m": MISS_M,
            "point": ["x_m", "y_m", "z_m", "width_m", "along_m", "discharge_m3s of rivers"],
        });
        let text = serde_json::to_string_pretty(&head).expect("numbers and names are JSON");
        let open = text.strip_suffix("\n}").expect("it is an object");
        format!("{open},\n  \"splines\": [")
    }

    /// Writes the parts of a line that lie in the region.
    fn add(&self, files: &mut Files, layer: usize, values: &[Value], line: &[Vec<[f64; 3]>]) -> Result<(), Error> {
        let [points, of_points] = line else { unreachable!("a spline has its points and their values") };
        let Some(whole) = Whole::new(points, of_points) else { return Ok(()) };
        let parts = whole.parts(|line| around(&self.region, self.spacing_m).clip(GeometryType::LineZ, vec![line]));
        let last = (whole.points.len() - 1) as f64;
        for (number, part) in parts.iter().enumerate() {
            let is_whole = part[0] == 0.0 && part[part.len() - 1] == last;
            let knots = whole.knots(part);
            let spline = Spline { layer, values, number, is_whole, knots, origin_m: self.origin_m };
            write(&mut files.tables[layer], &spline.rows())?;
            write(&mut files.json, files.separator)?;
            write(&mut files.json, &spline.json())?;
            files.separator = ",";
        }
        Ok(())
    }
}

fn write(file: &mut PartFile, text: &str) -> Result<(), Error> {
    file.write_all(text.as_bytes()).map_err(Error::io(file.path()))
}

impl Sink for SplineSink<'_> {
    fn name(&self) -> &'static str {
        "splines"
    }

    fn take(&self, tile: &Tile, _place: Place, clock: &Clock) -> Result<Kept, Error> {
        Ok(Kept { piece: self.store.take(tile, clock)?, files: Vec::new() })
    }

    fn append(&self, _row: u64, pieces: &[&[u8]], _clock: &Clock) -> Result<(), Error> {
        self.store.put(pieces)
    }

    fn finish(&self, watch: &Watch) -> Result<Vec<FileRecord>, Error> {
        let mut files = locked(&self.files).take().expect("a sink ends once");
        write(&mut files.json, &self.head())?;
        for (layer, heads) in HEADS.iter().enumerate() {
            write(&mut files.tables[layer], heads)?;
            self.store.for_each(layer, &watch.clock, |values, parts| {
                parts.iter().try_for_each(|line| self.add(&mut files, layer, values, line))
            })?;
        }
        write(&mut files.json, "\n  ]\n}\n")?;
        let [east_m, north_m] = self.origin_m.map(|metres| shortest(metres, 0.0));
        let text = TEXT.replace("ORIGIN_EAST", &east_m).replace("ORIGIN_NORTH", &north_m);
        let text = text.replace("MISS", &MISS_M.to_string());
        let Files { tables: [roads, rivers], json, .. } = files;
        let path = |name: &str| format!("{FOLDER}/{name}");
        let readme = write_whole(self.out.join(path("README.md")), text.as_bytes())?;
        let files = [
            ("roads.csv", roads.finish()?),
            ("rivers.csv", rivers.finish()?),
            ("splines.json", json.finish()?),
            ("README.md", readme),
        ];
        Ok(files.map(|(name, finished)| FileRecord::new(path(name), Splines.name(), finished)).to_vec())
    }
}

/// A line with the values of its points. No two points in a row are at the same place.
struct Whole {
    points: Vec<[f64; 3]>,
    /// Width, discharge, and the number of the structure that carries each point; 0 for the ground.
    values: Vec<[f64; 3]>,
    /// Metres from the start to each point, seen from above.
    along_m: Vec<f64>,
}

/// A knot of a curve.
struct SplineKnot {
    /// Metres east, north and up.
    at: [f64; 3],
    width_m: f64,
    along_m: f64,
    discharge_m3s: f64,
    carrier: Option<StructureKind>,
}

impl Whole {
    /// Makes a line of points; `None` if all are at one place, as those of a pool.
    fn new(points: &[[f64; 3]], values: &[[f64; 3]]) -> Option<Whole> {
        let mut both: Vec<([f64; 3], [f64; 3])> = points.iter().copied().zip(values.iter().copied()).collect();
        both.dedup_by(|next, before| next.0 == before.0);
        let (points, values): (Vec<_>, Vec<_>) = both.into_iter().unzip();
        let along_m = come_along(&points.iter().map(|[east, north, _]| [*east, *north]).collect::<Vec<_>>());
        (points.len() > 1).then_some(Whole { points, values, along_m })
    }

    /// Returns the line's parts in a region, as positions on the line: a whole number is a point, a fraction the share
    /// of the way to the next one.
    fn parts(&self, clip: impl FnOnce(Vec<[f64; 3]>) -> Vec<Vec<Vec<[f64; 3]>>>) -> Vec<Vec<f64>> {
        // Put the number of each point in the place of its height: clipping then interpolates it where a line crosses
        // the edge.
        let numbered = self.points.iter().zip(0_u32..).map(|([east, north, _], at)| [*east, *north, f64::from(at)]);
        let parts = clip(numbered.collect()).into_iter().flatten();
        let places = parts.map(|part| part.into_iter().map(|[.., at]| at).collect::<Vec<f64>>());
        let grows = |part: Vec<f64>| {
            let mut part = part;
            part.dedup();
            part
        };
        places.map(grows).filter(|part| part.len() > 1).collect()
    }

    fn at(&self, at: f64) -> SplineKnot {
        let index = (at as usize).min(self.points.len() - 2);
        let share = at - index as f64;
        let mix = |a: f64, b: f64| a + (b - a) * share;
        let [here, next] = [index, index + 1].map(|index| self.values[index]);
        // A place between two points is on a structure if both points are on one of the same kind.
        let carrier = match share {
            0.0 => here[2],
            1.0 => next[2],
            _ if here[2] == next[2] => here[2],
            _ => 0.0,
        };
        SplineKnot {
            at: [0, 1, 2].map(|axis| mix(self.points[index][axis], self.points[index + 1][axis])),
            width_m: mix(here[0], next[0]),
            along_m: mix(self.along_m[index], self.along_m[index + 1]),
            discharge_m3s: mix(here[1], next[1]),
            carrier: carried(carrier),
        }
    }

    /// Returns the knots of a part.
    fn knots(&self, part: &[f64]) -> Vec<SplineKnot> {
        let points: Vec<DVec3> = part.iter().map(|at| self.at(*at).at.into()).collect();
        // A structure begins and ends at a knot.
        let carriers: Vec<Option<StructureKind>> = part.iter().map(|at| self.at(*at).carrier).collect();
        let differs = |index: usize, other: Option<usize>| {
            let other = other.and_then(|other| carriers.get(other)).copied().flatten();
            carriers[index].is_some() && other != carriers[index]
        };
        let fixed: Vec<bool> = (0..part.len())
            .map(|index| differs(index, index.checked_sub(1)) || differs(index, Some(index + 1)))
            .collect();
        let of_part = |knot: f64| {
            let index = (knot as usize).min(part.len() - 2);
            part[index] + (part[index + 1] - part[index]) * (knot - index as f64)
        };
        thinned(&points, &fixed).into_iter().map(|knot| self.at(of_part(knot))).collect()
    }
}

/// A part of a line, ready to be written.
struct Spline<'a> {
    layer: usize,
    /// Attributes of the line: id, name, class, order.
    values: &'a [Value],
    number: usize,
    is_whole: bool,
    knots: Vec<SplineKnot>,
    origin_m: [f64; 2],
}

impl Spline<'_> {
    fn is_river(&self) -> bool {
        self.layer == 1
    }

    /// Returns metres east, up and south of the meshes' origin, the width, and the distance along the line.
    fn numbers(&self, knot: &SplineKnot) -> [f64; 5] {
        let [east, north, up] = knot.at;
        [east - self.origin_m[0], up, self.origin_m[1] - north, knot.width_m, knot.along_m]
    }

    /// Returns the rows of the table.
    fn rows(&self) -> String {
        let [id, name, class, order] = self.values else { unreachable!("a spline has these columns") };
        let kind = if self.is_river() { order } else { class };
        let (id, name, kind) = (cell(id), cell(name), cell(kind));
        let (part, whole) = (self.number, u8::from(self.is_whole));
        let mut text = String::new();
        for (index, knot) in self.knots.iter().enumerate() {
            _ = write!(text, "{id},{part},{whole},{name},{kind},{index}");
            for number in self.numbers(knot) {
                text.push(',');
                push_decimal(&mut text, number, 3);
            }
            text.push(',');
            match (self.is_river(), knot.carrier) {
                (true, _) if knot.discharge_m3s > 0.0 => push_decimal(&mut text, knot.discharge_m3s, 4),
                (false, Some(carrier)) => text.push_str(carrier.name()),
                _ => {}
            }
            text.push('\n');
        }
        text
    }

    /// Returns the spline as JSON, on a line of its own.
    fn json(&self) -> String {
        let [id, name, class, order] = self.values else { unreachable!("a spline has these columns") };
        let kind = if self.is_river() { "river" } else { "road" };
        let head = json!({
            "kind": kind, "id": id, "part": self.number, "whole": self.is_whole, "name": name, "class": class, "order": order,
            "structures": self.structures(),
        });
        let head = head.to_string();
        let mut text = format!("\n    {},\"points\":[", head.strip_suffix('}').expect("it is an object"));
        for (index, knot) in self.knots.iter().enumerate() {
            text.push_str(if index > 0 { ",[" } else { "[" });
            for (place, number) in self.numbers(knot).into_iter().enumerate() {
                text.push_str(if place > 0 { "," } else { "" });
                push_decimal(&mut text, number, 3);
            }
            if self.is_river() {
                text.push(',');
                match knot.discharge_m3s > 0.0 {
                    true => push_decimal(&mut text, knot.discharge_m3s, 4),
                    false => text.push_str("null"),
                }
            }
            text.push(']');
        }
        text + "]}"
    }

    /// Returns the structures, each with its first and its last knot.
    fn structures(&self) -> Vec<serde_json::Value> {
        let (mut structures, mut first) = (Vec::new(), 0);
        for run in self.knots.chunk_by(|a, b| a.carrier == b.carrier) {
            let last = first + run.len() - 1;
            if let Some(carrier) = run[0].carrier {
                structures.push(json!({ "kind": carrier.name(), "first": first, "last": last }));
            }
            first = last + 1;
        }
        structures
    }
}

/// Returns a value as a cell of a table.
fn cell(value: &Value) -> String {
    match value {
        Value::Nothing => String::new(),
        Value::Integer(number) => number.to_string(),
        Value::Real(number) => number.to_string(),
        Value::Real32(number) => number.to_string(),
        // Quotes as in RFC 4180.
        Value::Text(text) if text.contains([',', '"', '\n']) => format!("\"{}\"", text.replace('"', "\"\"")),
        Value::Text(text) => text.clone(),
    }
}
