//! The features of a region for the vector exports: collected tile by tile, and sorted when they are read.

use std::collections::BTreeSet;
use std::path::Path as FilePath;
use std::sync::Mutex;

use rusqlite::types::{ToSqlOutput, ValueRef};
use rusqlite::{Connection, ToSql, params_from_iter};

use crate::area::{Region, TileId};
use crate::bake::frames;
use crate::clock::Clock;
use crate::error::Error;
use crate::export::formats::format::Request;
use crate::export::formats::locked;
use crate::export::formats::vector::clip::Envelope;
use crate::features::layer::{Geometry, Head, ValueKind};
use crate::features::{AnyLayer, MakeRow, Row, Value, layers, visit_walked};
use crate::file::{Operation, PartFile, database, gate, sqlite_error};
use crate::registry::unjournaled;
use crate::stop::Stopped;
use crate::tile::Tile;
use crate::world::World;

/// Features that tiles have packed, by layer and key.
type Said = BTreeSet<(usize, Vec<u8>)>;

/// The features of a region, each once, by layer and key.
///
/// Features come with their row of tiles and wait in a nameless database in the folder of the bake, so memory does not
/// grow with the region.
pub(crate) struct FeatureStore<'a> {
    world: &'a World,
    layers: &'static [&'static dyn AnyLayer],
    /// Rectangle at whose edge features are cut off; `None` keeps them whole.
    edge: Option<Envelope>,
    /// True if the tiles are those of a walk: they have lines of their own, which the world does not know.
    is_walk: bool,
    /// The features that tiles have packed since the last row was put away. `None` for a shard, where each tile packs
    /// all its features, so that its piece does not depend on other tiles.
    said: Option<Mutex<Said>>,
    store: Mutex<(Connection, PartFile)>,
}

impl<'a> FeatureStore<'a> {
    /// Creates the store of a world's features, in the folder of the file that will hold them.
    pub fn create(request: &Request<'a>, file: &FilePath) -> Result<FeatureStore<'a>, Error> {
        let Request { world, region, vectors, walk, .. } = *request;
        let edge = vectors.clipped.then(|| around(&region, world.spacing_m()));
        let store = FeatureStore::of_layers(request, layers(world), file)?;
        Ok(FeatureStore { edge, is_walk: walk.is_some(), ..store })
    }

    /// Creates the store of some layers of a world. Their features are not cut off.
    pub fn of_layers(
        request: &Request<'a>,
        layers: &'static [&'static dyn AnyLayer],
        file: &FilePath,
    ) -> Result<FeatureStore<'a>, Error> {
        // The file is never finished, so it is removed together with the store.
        let mut part = PartFile::create(file.with_extension("features"))?;
        let path = part.lend();
        let open = || {
            let connection = database::open(path)?;
            unjournaled(&connection)?;
            for (number, layer) in layers.iter().enumerate() {
                // Columns without types keep values unchanged.
                let columns = (0..layer.heads().len()).map(|column| format!("value_{column}, "));
                let columns = columns.collect::<Vec<_>>().concat();
                connection.execute_batch(&format!(
                    "CREATE TABLE layer_{number} (key BLOB PRIMARY KEY, {columns}lines BLOB) WITHOUT ROWID"
                ))?;
            }
            Ok(connection)
        };
        let connection = open().map_err(sqlite_error(path))?;
        Ok(FeatureStore {
            world: request.world,
            layers,
            edge: None,
            is_walk: false,
            said: (!request.is_shard).then(Mutex::default),
            store: Mutex::new((connection, part)),
        })
    }

    /// Returns the layers.
    pub fn layers(&self) -> &'static [&'static dyn AnyLayer] {
        self.layers
    }

    /// Returns the features of a tile as bytes, without those that another tile of its row has packed.
    pub fn take(&self, tile: &Tile, clock: &Clock) -> Result<Vec<u8>, Stopped> {
        let mut piece = Vec::new();
        if self.is_walk {
            visit_walked(self.world, tile, clock, |number, key, row| self.pack(&mut piece, number, key, row))?;
            return Ok(piece);
        }
        for (number, layer) in self.layers().iter().enumerate() {
            let pack = &mut |key, row: &MakeRow<'_>| self.pack(&mut piece, number, key, row);
            layer.visit(self.world, &tile.area(), clock, pack)?;
        }
        Ok(piece)
    }

    /// Adds a feature of a layer to the piece of a tile, unless another tile has packed it.
    pub fn pack(
        &self,
        piece: &mut Vec<u8>,
        layer: usize,
        key: Vec<u8>,
        row: impl Fn() -> Result<Row, Stopped>,
    ) -> Result<(), Stopped> {
        if let Some(said) = &self.said
            && !locked(said).insert((layer, key.clone()))
        {
            return Ok(());
        }
        // Make the row without the lock: a long river takes its time.
        let Row { values, lines } = row()?;
        let lines = packed(&lines, self.layers()[layer].shape().dimensions());
        let values = serde_json::to_vec(&values).expect("numbers and texts are JSON");
        for part in [&[layer as u8][..], &key, &values, &lines] {
            frames::push(piece, part);
        }
        Ok(())
    }

    /// Puts the features of a row of tiles into the database.
    pub fn put(&self, pieces: &[&[u8]]) -> Result<(), Error> {
        // A tile that is being made may pack them again, which does no harm.
        self.said.iter().for_each(|said| locked(said).clear());
        let (connection, part) = &mut *locked(&self.store);
        let mut put = || {
            let transaction = connection.transaction()?;
            for piece in pieces {
                let parts: Vec<&[u8]> = frames::pieces(piece).collect();
                for part in parts.chunks_exact(4) {
                    let [[number], key, values, lines] = part else { unreachable!("it was packed by this store") };
                    let heads = self.layers()[usize::from(*number)].heads();
                    let values: Vec<serde_json::Value> =
                        serde_json::from_slice(values).expect("it was packed by this store");
                    let values: Vec<Value> =
                        values.iter().zip(&heads).map(|(value, head)| of_json(value, head)).collect();
                    // A feature that touches several rows of tiles comes again with each row.
                    let marks = ", ?".repeat(values.len() + 1);
                    let insert = format!("INSERT OR IGNORE INTO layer_{number} VALUES (?{marks})");
                    let values: Vec<_> = values.iter().map(kept).collect();
                    let values = values.iter().map(|value| value as &dyn ToSql);
                    let row = [key as &dyn ToSql].into_iter().chain(values).chain([lines as &dyn ToSql]);
                    transaction.prepare_cached(&insert)?.execute(params_from_iter(row))?;
                }
            }
            transaction.commit()
        };
        gate(Operation::Write, part.path())?;
        put().map_err(sqlite_error(part.path()))
    }

    /// Visits all features of a layer one by one, sorted by key: the values of each, and its geometry, or the parts of
    /// the geometry in the region if features are cut off.
    pub fn for_each(
        &self,
        number: usize,
        clock: &Clock,
        mut visit: impl FnMut(&[Value], &[Geometry]) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let (connection, part) = &*locked(&self.store);
        let failed = || sqlite_error(part.path());
        let layer = &self.layers()[number];
        // Sort, so that files do not depend on which tile came first.
        let select = format!("SELECT * FROM layer_{number} ORDER BY key");
        let mut select = connection.prepare(&select).map_err(failed())?;
        let heads = layer.heads();
        let parse = |row: &rusqlite::Row| {
            let values = heads.iter().zip(1..).map(|(head, column)| Ok(value(head, row.get_ref(column)?)));
            let lines = unpacked(row.get_ref(heads.len() + 1)?.as_blob()?, layer.shape().dimensions());
            Ok(Row { values: values.collect::<rusqlite::Result<_>>()?, lines })
        };
        for row in select.query_map((), parse).map_err(failed())? {
            clock.check()?;
            let Row { values, lines } = row.map_err(failed())?;
            let parts = match self.edge {
                Some(edge) => edge.clip(layer.shape(), lines),
                None => vec![lines],
            };
            if !parts.is_empty() {
                visit(&values, &parts)?;
            }
        }
        Ok(())
    }
}

/// Returns the rectangle that a region covers.
pub(crate) fn around(region: &Region, spacing_m: f64) -> Envelope {
    Envelope::of(&[footprint(region, spacing_m, region.at(), region.cols(), region.rows())])
}

/// Returns the corners of a rectangle of tiles, anticlockwise from the south-western corner and back to it.
pub(crate) fn footprint(region: &Region, spacing_m: f64, at: TileId, cols: u64, rows: u64) -> Vec<[f64; 3]> {
    let cells = region.tile_cells() as i64;
    let metres = |tile: i64| (tile * cells) as f64 * spacing_m;
    let (west, east) = (metres(at.x), metres(at.x + cols as i64));
    // Subtract from 0.0: negation would make -0.0 of 0.0.
    let (south, north) = (0.0 - metres(at.y + rows as i64), 0.0 - metres(at.y));
    [[west, south], [east, south], [east, north], [west, north], [west, south]].map(|[x, y]| [x, y, 0.0]).to_vec()
}

/// Converts a value to the form in which a database keeps it.
pub(crate) fn kept(value: &Value) -> ToSqlOutput<'_> {
    ToSqlOutput::Borrowed(match value {
        Value::Nothing => ValueRef::Null,
        Value::Integer(number) => ValueRef::Integer(*number),
        Value::Real(number) => ValueRef::Real(*number),
        Value::Real32(number) => ValueRef::Real(f64::from(*number)),
        Value::Text(text) => ValueRef::Text(text.as_bytes()),
    })
}

/// Converts a value back from the form in which a database keeps it.
fn value(head: &Head, kept: ValueRef) -> Value {
    match (kept, head.kind) {
        (ValueRef::Integer(number), _) => Value::Integer(number),
        (ValueRef::Real(number), ValueKind::Real32) => Value::Real32(number as f32),
        (ValueRef::Real(number), _) => Value::Real(number),
        (ValueRef::Text(text), _) => Value::Text(String::from_utf8_lossy(text).into_owned()),
        (ValueRef::Null | ValueRef::Blob(_), _) => Value::Nothing,
    }
}

/// Converts a value back from JSON.
fn of_json(value: &serde_json::Value, head: &Head) -> Value {
    match (value, head.kind) {
        (serde_json::Value::String(text), _) => Value::Text(text.clone()),
        (number, ValueKind::Integer) => number.as_i64().map_or(Value::Nothing, Value::Integer),
        (number, ValueKind::Real32) => number.as_f64().map_or(Value::Nothing, |number| Value::Real32(number as f32)),
        (number, _) => number.as_f64().map_or(Value::Nothing, Value::Real),
    }
}

/// Packs lines as bytes: for each line the number of its points, and then the points.
fn packed(lines: &[Vec<[f64; 3]>], dimensions: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    for line in lines {
        bytes.extend((line.len() as u64).to_le_bytes());
        bytes.extend(line.iter().flat_map(|point| point[..dimensions].iter().flat_map(|number| number.to_le_bytes())));
    }
    bytes
}

fn unpacked(bytes: &[u8], dimensions: usize) -> Vec<Vec<[f64; 3]>> {
    let mut words = bytes.as_chunks::<8>().0.iter();
    let mut lines = Vec::new();
    while let Some(count) = words.next() {
        let mut number = || words.next().map_or(0.0, |word| f64::from_le_bytes(*word));
        let mut point = || {
            let mut point = [0.0; 3];
            // Layers without heights have 0 there, which is not stored.
            point[..dimensions].fill_with(&mut number);
            point
        };
        lines.push((0..u64::from_le_bytes(*count)).map(|_| point()).collect());
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_out_as_they_went_in() {
        let lines = vec![vec![[1.0, -2.5, 0.0], [f64::MIN_POSITIVE, 1e300, 0.0]], vec![[3.0, 4.0, 0.0]]];
        assert_eq!(unpacked(&packed(&lines, 2), 2), lines);
        let lines = vec![vec![[1.0, -2.5, 7.25]]];
        assert_eq!(unpacked(&packed(&lines, 3), 3), lines);
    }
}
