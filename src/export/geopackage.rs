//! A GeoPackage: all layers and the footprints of the tiles, in one SQLite database.
//!
//! Based on: OGC 12-128r17, GeoPackage Encoding Standard 1.3. The reference system is the standard's own "undefined
//! Cartesian" (-1): metres east and north of the world's origin.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use rusqlite::types::Value;
use rusqlite::{Connection, params, params_from_iter};

use crate::area::{Place, Region, TileId};
use crate::bake::Sink;
use crate::error::Error;
use crate::export::file::PartFile;
use crate::export::layers::{Kind, Layer, Shape};
use crate::export::manifest::FileRecord;
use crate::export::vector::FeatureStore;
use crate::registry::unjournaled;
use crate::tile::Tile;
use crate::world::World;

/// The file in the folder of the bake.
pub(crate) const PATHS: &[&str] = &["vector/vector.gpkg"];

/// `GPKG` in the header of the database, and version 1.3.0 of the standard.
const APPLICATION_ID: i32 = i32::from_be_bytes(*b"GPKG");
const USER_VERSION: i32 = 10300;

/// The reference system of a plane that is nowhere on the Earth.
const UNDEFINED_CARTESIAN: i32 = -1;

/// The standard asks for the time of a layer's last change; the same bake has the same bytes, so it is none.
const LAST_CHANGE: &str = "1970-01-01T00:00:00.000Z";

/// What the standard asks every GeoPackage to have.
const SCHEMA: &str = "
    CREATE TABLE gpkg_spatial_ref_sys (
        srs_name TEXT NOT NULL,
        srs_id INTEGER NOT NULL PRIMARY KEY,
        organization TEXT NOT NULL,
        organization_coordsys_id INTEGER NOT NULL,
        definition TEXT NOT NULL,
        description TEXT
    );
    INSERT INTO gpkg_spatial_ref_sys VALUES
        ('Undefined Cartesian SRS', -1, 'NONE', -1, 'undefined', 'undefined Cartesian coordinate reference system'),
        ('Undefined geographic SRS', 0, 'NONE', 0, 'undefined', 'undefined geographic coordinate reference system'),
        ('WGS 84 geodetic', 4326, 'EPSG', 4326, 'GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563,AUTHORITY[\"EPSG\",\"7030\"]],AUTHORITY[\"EPSG\",\"6326\"]],PRIMEM[\"Greenwich\",0,AUTHORITY[\"EPSG\",\"8901\"]],UNIT[\"degree\",0.0174532925199433,AUTHORITY[\"EPSG\",\"9122\"]],AUTHORITY[\"EPSG\",\"4326\"]]', 'longitude and latitude in degrees');
    CREATE TABLE gpkg_contents (
        table_name TEXT NOT NULL PRIMARY KEY,
        data_type TEXT NOT NULL,
        identifier TEXT UNIQUE,
        description TEXT DEFAULT '',
        last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
        min_x DOUBLE,
        min_y DOUBLE,
        max_x DOUBLE,
        max_y DOUBLE,
        srs_id INTEGER,
        CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
    );
    CREATE TABLE gpkg_geometry_columns (
        table_name TEXT NOT NULL,
        column_name TEXT NOT NULL,
        geometry_type_name TEXT NOT NULL,
        srs_id INTEGER NOT NULL,
        z TINYINT NOT NULL,
        m TINYINT NOT NULL,
        CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
        CONSTRAINT uk_gc_table_name UNIQUE (table_name),
        CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
        CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id)
    );
    CREATE TABLE tiles (
        fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
        geom POLYGON,
        x INTEGER NOT NULL,
        y INTEGER NOT NULL,
        col INTEGER NOT NULL,
        row INTEGER NOT NULL
    );
";

/// The table of a layer.
fn table(layer: &Layer) -> String {
    let columns = layer.columns.iter().map(|column| {
        let kind = match column.kind {
            Kind::Integer => "INTEGER",
            Kind::Real | Kind::Real32 => "DOUBLE",
            Kind::Text => "TEXT",
        };
        format!(",\n        {} {kind}{}", column.name, if column.required { " NOT NULL" } else { "" })
    });
    let columns: String = columns.collect();
    let (name, shape) = (layer.name, shape_name(layer.shape));
    format!("CREATE TABLE {name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {shape}{columns});")
}

fn shape_name(shape: Shape) -> &'static str {
    match shape {
        Shape::Point => "POINT",
        Shape::Line | Shape::LineZ => "LINESTRING",
        Shape::Polygon => "POLYGON",
    }
}

/// The rectangle around all of a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    min: [f64; 2],
    max: [f64; 2],
}

impl Bounds {
    const NOTHING: Bounds = Bounds { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    fn of(lines: &[Vec<[f64; 3]>]) -> Bounds {
        lines
            .iter()
            .flatten()
            .fold(Bounds::NOTHING, |bounds, &[x, y, _]| bounds.and(Bounds { min: [x, y], max: [x, y] }))
    }

    fn and(self, other: Bounds) -> Bounds {
        let both = |a: [f64; 2], b: [f64; 2], pick: fn(f64, f64) -> f64| [pick(a[0], b[0]), pick(a[1], b[1])];
        Bounds { min: both(self.min, other.min, f64::min), max: both(self.max, other.max, f64::max) }
    }
}

/// A geometry as the standard has it in a column: its header with the envelope, then well-known binary.
fn geometry(shape: Shape, lines: &[Vec<[f64; 3]>]) -> Vec<u8> {
    let Bounds { min, max } = Bounds::of(lines);
    let points: usize = lines.iter().map(Vec::len).sum();
    let mut bytes = Vec::with_capacity(8 + 32 + 9 + 4 * lines.len() + 8 * shape.dimensions() * points);
    // Version 1 of the form is 0; little-endian, with an envelope of x and y.
    bytes.extend(*b"GP\x00\x03");
    bytes.extend(UNDEFINED_CARTESIAN.to_le_bytes());
    bytes.extend([min[0], max[0], min[1], max[1]].map(f64::to_le_bytes).as_flattened());
    bytes.push(1);
    let kind: u32 = match shape {
        Shape::Point => 1,
        Shape::Line => 2,
        Shape::LineZ => 1002,
        Shape::Polygon => 3,
    };
    bytes.extend(kind.to_le_bytes());
    if shape == Shape::Polygon {
        bytes.extend((lines.len() as u32).to_le_bytes());
    }
    for line in lines {
        if shape != Shape::Point {
            bytes.extend((line.len() as u32).to_le_bytes());
        }
        let numbers = line.iter().flat_map(|point| &point[..shape.dimensions()]);
        bytes.extend(numbers.flat_map(|number| number.to_le_bytes()));
    }
    bytes
}

/// The database under way.
pub(crate) struct GeoPackage<'a> {
    region: Region,
    spacing_m: f64,
    features: FeatureStore<'a>,
    path: PathBuf,
    /// The connection first, so that it is closed when an abandoned file is removed.
    file: Mutex<Option<(Connection, PartFile)>>,
}

impl<'a> GeoPackage<'a> {
    /// Begins the database in the folder of the bake.
    pub fn create(world: &'a World, region: Region, out: &Path) -> Result<GeoPackage<'a>, Error> {
        let path = out.join(PATHS[0]);
        let mut file = PartFile::create(path.clone())?;
        let features = FeatureStore::create(world, &path)?;
        let create = |at: &Path| {
            let connection = Connection::open(at)?;
            unjournaled(&connection)?;
            connection.pragma_update(None, "application_id", APPLICATION_ID)?;
            connection.pragma_update(None, "user_version", USER_VERSION)?;
            connection.execute_batch("BEGIN")?;
            connection.execute_batch(SCHEMA)?;
            for layer in features.layers() {
                connection.execute_batch(&table(layer))?;
            }
            connection.execute_batch("COMMIT")?;
            Ok(connection)
        };
        let connection = create(file.lend()).map_err(Error::sqlite(&path))?;
        let file = Mutex::new(Some((connection, file)));
        Ok(GeoPackage { region, spacing_m: world.spacing_m(), features, path, file })
    }

    fn lock(&self) -> MutexGuard<'_, Option<(Connection, PartFile)>> {
        self.file.lock().expect("no thread panics while it writes")
    }

    /// The corners of a rectangle of tiles, anticlockwise from the south-western one and back to it.
    fn footprint(&self, at: TileId, cols: u64, rows: u64) -> Vec<[f64; 3]> {
        let cells = self.region.tile_cells() as i64;
        let metres = |tile: i64| (tile * cells) as f64 * self.spacing_m;
        let (west, east) = (metres(at.x), metres(at.x + cols as i64));
        let (south, north) = (0.0 - metres(at.y + rows as i64), 0.0 - metres(at.y));
        [[west, south], [east, south], [east, north], [west, north], [west, south]].map(|[x, y]| [x, y, 0.0]).to_vec()
    }

    fn write_tiles(&self, connection: &mut Connection, row: u64) -> rusqlite::Result<()> {
        let transaction = connection.transaction()?;
        let mut insert =
            transaction.prepare_cached("INSERT INTO tiles (geom, x, y, col, row) VALUES (?, ?, ?, ?, ?)")?;
        for col in 0..self.region.cols() {
            let tile = self.region.tile(Place { row, col });
            let shape = geometry(Shape::Polygon, &[self.footprint(tile, 1, 1)]);
            insert.execute(params![shape, tile.x, tile.y, col as i64, row as i64])?;
        }
        drop(insert);
        transaction.commit()
    }

    /// Writes a layer and returns its bounds, if it has any feature.
    fn write_layer(&self, connection: &mut Connection, number: usize) -> Result<Option<Bounds>, Error> {
        let failed = || Error::sqlite(&self.path);
        let layer = &self.features.layers()[number];
        let mut bounds: Option<Bounds> = None;
        let transaction = connection.transaction().map_err(failed())?;
        let columns: Vec<&str> = ["geom"].into_iter().chain(layer.columns.iter().map(|column| column.name)).collect();
        let marks = ", ?".repeat(layer.columns.len());
        let insert = format!("INSERT INTO {} ({}) VALUES (?{marks})", layer.name, columns.join(", "));
        let mut insert = transaction.prepare(&insert).map_err(failed())?;
        self.features.for_each(number, |feature| {
            let own = Bounds::of(&feature.lines);
            bounds = Some(bounds.map_or(own, |bounds| bounds.and(own)));
            let shape = Value::Blob(geometry(layer.shape, &feature.lines));
            let row = [shape].into_iter().chain(feature.values);
            insert.execute(params_from_iter(row)).map(|_| ()).map_err(failed())
        })?;
        drop(insert);
        transaction.commit().map_err(failed())?;
        Ok(bounds)
    }
}

/// Lists a layer where readers look for layers.
fn register(
    connection: &Connection,
    (layer, shape, about): (&str, Shape, &str),
    bounds: Option<Bounds>,
) -> rusqlite::Result<()> {
    let side = |pick: fn(&Bounds) -> f64| bounds.as_ref().map(pick);
    connection.execute(
        "INSERT INTO gpkg_contents VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
        params![
            layer,
            about,
            LAST_CHANGE,
            side(|bounds| bounds.min[0]),
            side(|bounds| bounds.min[1]),
            side(|bounds| bounds.max[0]),
            side(|bounds| bounds.max[1]),
            UNDEFINED_CARTESIAN,
        ],
    )?;
    connection.execute(
        "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, ?, 0)",
        params![layer, shape_name(shape), UNDEFINED_CARTESIAN, shape == Shape::LineZ],
    )?;
    Ok(())
}

impl Sink for GeoPackage<'_> {
    fn name(&self) -> &'static str {
        PATHS[0]
    }

    fn take(&self, tile: &Tile, _place: Place) -> Result<Vec<u8>, Error> {
        self.features.take(tile);
        Ok(Vec::new())
    }

    fn append(&self, row: u64, _pieces: &[&[u8]]) -> Result<(), Error> {
        self.features.flush()?;
        let mut file = self.lock();
        let (connection, _) = file.as_mut().expect("rows come before the end");
        self.write_tiles(connection, row).map_err(Error::sqlite(&self.path))
    }

    fn finish(&self) -> Result<Vec<FileRecord>, Error> {
        let (mut connection, file) = self.lock().take().expect("a sink ends once");
        let failed = || Error::sqlite(&self.path);
        for (number, layer) in self.features.layers().iter().enumerate() {
            let bounds = self.write_layer(&mut connection, number)?;
            register(&connection, (layer.name, layer.shape, layer.about), bounds).map_err(failed())?;
        }
        let all = Bounds::of(&[self.footprint(self.region.at(), self.region.cols(), self.region.rows())]);
        let about =
            "the tiles of the region; x and y are their numbers in the world, col and row count from its corner";
        register(&connection, ("tiles", Shape::Polygon, about), Some(all)).map_err(failed())?;
        connection.close().map_err(|(_, error)| failed()(error))?;
        Ok(vec![FileRecord::new(PATHS[0].to_owned(), "vector", file.finish()?)])
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::agents::paths::{Path as AgentPath, PathEnding};
    use crate::agents::settings::{RiverAgents, RoadAgents};
    use crate::agents::way::Way;
    use crate::agents::way::WayKind;
    use crate::area::Area;
    use crate::export::geojson::GeoJson;
    use crate::export::layers::{of_path, path_key};
    use crate::preset::Preset;

    /// A river across three tiles that joins another, a pool of one node, a road, and a river far away.
    fn paths() -> Vec<Arc<AgentPath>> {
        let river = |x0: i64, nodes: i64, owner: (i64, i64), ending| {
            let line: Vec<_> = (0..nodes).map(|step| (x0 + step, 10)).collect();
            let heights_m: Vec<_> = (0..nodes).map(|step| 40.0 - 0.25 * step as f32).collect();
            let way = Way::river(&line, &heights_m, &RiverAgents::default(), 2.0, 0.0, 100.0);
            Arc::new(AgentPath { owner: TileId { x: owner.0, y: owner.1 }, way, ending })
        };
        let road = Way::road(&[(20, 20), (20, 27), (20, 34)], &[5.0, 6.0, 8.0], &RoadAgents::default(), 2.0);
        vec![
            river(-5, 41, (1, 0), PathEnding::River(TileId { x: 7, y: -7 })),
            river(12, 1, (-1, 2), PathEnding::Pond),
            river(100_000, 30, (6250, 0), PathEnding::Sea),
            Arc::new(AgentPath { owner: TileId { x: 1, y: 1 }, way: road, ending: PathEnding::Nothing }),
        ]
    }

    fn baked(out: &Path, order: impl Fn(Vec<Arc<AgentPath>>) -> Vec<Arc<AgentPath>>) {
        let text = "tile_cells = 16\nspacing_m = 2.0\nnoise = [{ kind = \"fbm\", height_m = 10.0, wavelength_m = 300.0, octaves = 2 }]";
        let world = World::new(Preset::parse("test", text).unwrap(), None).unwrap();
        let region = Region::new(TileId { x: 0, y: 0 }, 2, 3, 16).unwrap();
        std::fs::create_dir_all(out.join("vector")).unwrap();
        let (package, json) = (GeoPackage::create(&world, region, out).unwrap(), GeoJson::create(&world, out).unwrap());
        for row in 0..3 {
            // Each row of tiles brings all paths again.
            for store in [&package.features, json.features()] {
                for path in order(paths()).iter().filter(|path| path.way.touches(&Area::new(0, 0, 33, 49))) {
                    let layer = usize::from(path.way.kind() == WayKind::Road);
                    store.add(layer, path_key(path.owner), || of_path(path, 2.0));
                }
            }
            package.append(row, &[]).unwrap();
            json.append(row, &[]).unwrap();
        }
        assert_eq!((package.finish().unwrap().len(), json.finish().unwrap().len()), (1, 2));
        drop((package, json));
        assert_eq!(std::fs::read_dir(out.join("vector")).unwrap().count(), 3, "what was put away is gone");
    }

    fn text(database: &Connection, query: &str) -> String {
        database.query_row(query, (), |row| row.get(0)).unwrap_or_else(|error| panic!("{query}: {error}"))
    }

    #[test]
    fn paths_become_features_whole_once_and_sorted() {
        let folder = tempfile::tempdir().unwrap();
        baked(folder.path(), |paths| paths);
        let database = Connection::open(folder.path().join(PATHS[0])).unwrap();
        let listed = "SELECT group_concat(owner_x || ',' || owner_y || ' ' || ending || ' ' || length_m, '; ') FROM ";
        // The river's 40 steps of 2 m are whole though it begins west of the region; the far one is not there.
        assert_eq!(text(&database, &format!("{listed} rivers")), "-1,2 pond 0.0; 1,0 river 80.0");
        assert_eq!(text(&database, &format!("{listed} roads")), "1,1 nothing 28.0");
        let properties = "SELECT printf('%d,%d %g %g %g %g', joins_x, joins_y, width_start_m, width_end_m, \
                          floor_start_m, floor_end_m) FROM rivers WHERE owner_x = 1";
        assert_eq!(text(&database, properties), "7,-7 3 6.6 39.4 28.64");
        // Metres, and north up.
        let bounds = "SELECT printf('%g %g %g %g', min_x, min_y, max_x, max_y) FROM gpkg_contents WHERE table_name = ";
        assert_eq!(text(&database, &format!("{bounds} 'rivers'")), "-10 -20 70 -20");
        assert_eq!(text(&database, &format!("{bounds} 'roads'")), "40 -68 40 -40");
        assert_eq!(text(&database, &format!("{bounds} 'tiles'")), "0 -96 64 0");
        assert_eq!(text(&database, "PRAGMA integrity_check"), "ok");
        let number = |pragma: &str| database.pragma_query_value(None, pragma, |row| row.get::<_, i32>(0)).unwrap();
        assert_eq!((number("application_id"), number("user_version")), (0x4750_4B47, 10300));
        // The text has the same lines.
        let json = std::fs::read(folder.path().join("vector/rivers.geojson")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        let river = &json["features"][1];
        assert_eq!(json["features"].as_array().unwrap().len(), 2);
        assert_eq!((&river["properties"]["owner_x"], &river["properties"]["length_m"]), (&1.into(), &80.0.into()));
        let line = river["geometry"]["coordinates"].as_array().unwrap();
        assert_eq!((&line[0], line.last().unwrap()), (&vec![-10.0, -20.0].into(), &vec![70.0, -20.0].into()));
    }

    #[test]
    fn the_order_in_which_paths_come_does_not_matter() {
        let folder = tempfile::tempdir().unwrap();
        let (one, other) = (folder.path().join("one"), folder.path().join("other"));
        baked(&one, |paths| paths);
        baked(&other, |paths| paths.into_iter().rev().collect());
        for file in PATHS.iter().chain(&["vector/rivers.geojson", "vector/roads.geojson"]) {
            assert!(std::fs::read(one.join(file)).unwrap() == std::fs::read(other.join(file)).unwrap(), "{file}");
        }
    }

    #[test]
    fn a_geometry_is_header_envelope_and_well_known_binary() {
        let bytes = geometry(Shape::Line, &[vec![[1.0, -2.0, 0.0], [-3.0, 5.0, 0.0]]]);
        assert_eq!(bytes.len(), 8 + 32 + 9 + 32);
        assert_eq!(bytes[..8], [b'G', b'P', 0, 3, 0xFF, 0xFF, 0xFF, 0xFF]);
        let number = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert_eq!([8, 16, 24, 32].map(number), [-3.0, 1.0, -2.0, 5.0]);
        assert_eq!(bytes[40..49], [1, 2, 0, 0, 0, 2, 0, 0, 0]);
        assert_eq!([49, 57, 65, 73].map(number), [1.0, -2.0, -3.0, 5.0]);
    }
}
