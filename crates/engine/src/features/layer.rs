//! Layers: all features of one kind, with a single description of their attributes from which every output table
//! follows.

use serde::Serialize;

use crate::area::Area;
use crate::clock::Clock;
use crate::stop::Stopped;
use crate::world::World;

/// The features of one kind. `S` is the object that the world holds, `F` the feature made of it.
pub struct Layer<S: 'static, F: 'static> {
    /// Name of the layer: names its table in a database, and its file in formats with one file per layer.
    pub name: &'static str,
    /// Description of the contents, with units.
    pub about: &'static str,
    /// Type of the geometries.
    pub shape: GeometryType,
    /// Attributes of the features.
    pub columns: &'static [Column<F>],
    /// Collects the world's objects in an area.
    pub(super) sources: fn(&World, &Area, &Clock) -> Result<Vec<S>, Stopped>,
    /// Returns the sort key of an object, unique within the layer.
    pub(super) key: fn(&S) -> Vec<u8>,
    /// Makes the feature of an object.
    pub(super) feature: fn(&World, &S, &Clock) -> Result<F, Stopped>,
    /// Returns the geometry of a feature.
    pub(super) lines: fn(F) -> Geometry,
}

/// A single line, the rings of a polygon, or a single point: metres east, north and up, with 0 up in layers without
/// heights.
pub type Geometry = Vec<Vec<[f64; 3]>>;

/// Geometry type of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GeometryType {
    /// A point.
    Point,
    /// A line.
    Line,
    /// A line with a height at each point.
    LineZ,
    /// A polygon: its outer ring, then its holes.
    Polygon,
}

impl GeometryType {
    /// Returns the number of coordinates per point.
    pub fn dimensions(self) -> usize {
        if self == GeometryType::LineZ { 3 } else { 2 }
    }
}

/// An attribute of the features of a layer.
pub struct Column<F> {
    head: Head,
    value: fn(&F) -> Value,
}

/// Name and type of an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Column name in a table.
    pub name: &'static str,
    /// Key in a JSON object. Neighbouring attributes with the same key together make an array.
    pub key: &'static str,
    /// Type of the values.
    pub kind: ValueKind,
    /// True if every feature has a value.
    pub required: bool,
}

/// Type of an attribute's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueKind {
    /// A whole number.
    Integer,
    /// A 64-bit floating-point number.
    Real,
    /// A 32-bit floating-point number, written with no more digits than 32 bits need.
    Real32,
    /// A text.
    Text,
}

/// A value of an attribute, serialized as a bare number, a text, or null for [`Value::Nothing`].
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// No value: the feature does not have the attribute.
    Nothing,
    /// The value of an attribute of [`ValueKind::Integer`].
    Integer(i64),
    /// The value of an attribute of [`ValueKind::Real`].
    Real(f64),
    /// The value of an attribute of [`ValueKind::Real32`].
    Real32(f32),
    /// The value of an attribute of [`ValueKind::Text`].
    Text(String),
}

macro_rules! values_from {
    ($($type:ty => $variant:ident;)+) => {
        $(impl From<$type> for Value {
            fn from(value: $type) -> Value {
                Value::$variant(value.into())
            }
        })+
    };
}

values_from! {
    i64 => Integer;
    f64 => Real;
    f32 => Real32;
    &str => Text;
    String => Text;
}

impl<T: Into<Value>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Value {
        value.map_or(Value::Nothing, Into::into)
    }
}

impl<F> Column<F> {
    /// Describes an attribute that every feature has.
    pub(super) const fn new(name: &'static str, kind: ValueKind, value: fn(&F) -> Value) -> Column<F> {
        Column { head: Head { name, key: name, kind, required: true }, value }
    }

    /// Describes an attribute that some features lack.
    pub(super) const fn optional(name: &'static str, kind: ValueKind, value: fn(&F) -> Value) -> Column<F> {
        Column { head: Head { name, key: name, kind, required: false }, value }
    }

    /// Describes an attribute that every feature has, with a key in objects that differs from its column name.
    pub(super) const fn keyed(
        name: &'static str,
        key: &'static str,
        kind: ValueKind,
        value: fn(&F) -> Value,
    ) -> Column<F> {
        Column { head: Head { name, key, kind, required: true }, value }
    }
}

/// A feature as a row of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The values of the layer's columns.
    pub values: Vec<Value>,
    /// The geometry.
    pub lines: Geometry,
}

/// Makes the row of a feature.
pub type MakeRow<'a> = dyn Fn() -> Result<Row, Stopped> + 'a;

/// Callback that takes a feature's sort key and a function that makes its row.
pub type Visit<'a> = dyn FnMut(Vec<u8>, &MakeRow<'_>) -> Result<(), Stopped> + 'a;

#[expect(clippy::missing_errors_doc, reason = "the only error of what takes a clock is that this stops it")]
impl<S, F> Layer<S, F> {
    fn row(&self, world: &World, source: &S, clock: &Clock) -> Result<Row, Stopped> {
        let feature = (self.feature)(world, source, clock)?;
        let values = self.columns.iter().map(|column| (column.value)(&feature)).collect();
        Ok(Row { values, lines: (self.lines)(feature) })
    }

    /// Hands the feature of an object, which is the world's or a walked tile's, to the callback.
    pub(super) fn show(&self, world: &World, source: &S, clock: &Clock, visit: &mut Visit<'_>) -> Result<(), Stopped> {
        visit((self.key)(source), &|| self.row(world, source, clock))
    }

    /// Returns all features of which a part lies in the rectangle spanned by the outer vertices of an area, uncut and
    /// sorted by key.
    pub fn find(&self, world: &World, area: &Area, clock: &Clock) -> Result<Vec<F>, Stopped> {
        self.features(world, (self.sources)(world, area, clock)?, clock)
    }

    /// Makes the features of some objects, sorted by key.
    pub fn features(&self, world: &World, sources: Vec<S>, clock: &Clock) -> Result<Vec<F>, Stopped> {
        let mut sources: Vec<_> = sources.into_iter().map(|it| ((self.key)(&it), it)).collect();
        sources.sort_by(|a, b| a.0.cmp(&b.0));
        // An area may yield an object twice, such as a settlement that lies in the area and also ends one of its roads.
        sources.dedup_by(|a, b| a.0 == b.0);
        sources.iter().map(|(_, source)| (self.feature)(world, source, clock)).collect()
    }
}

/// A layer with its feature type erased, so that writers treat all layers alike.
pub trait AnyLayer: Sync {
    /// [`Layer::name`].
    fn name(&self) -> &'static str;

    /// [`Layer::about`].
    fn about(&self) -> &'static str;

    /// [`Layer::shape`].
    fn shape(&self) -> GeometryType;

    /// Returns name and type of each attribute.
    fn heads(&self) -> Vec<Head>;

    /// Calls `visit` for each feature of which a part lies in an area, in any order and perhaps several times. The row
    /// is made only if the callback asks for it.
    ///
    /// # Errors
    /// When `clock` stops the work, or `visit` fails.
    fn visit(&self, world: &World, area: &Area, clock: &Clock, visit: &mut Visit<'_>) -> Result<(), Stopped>;
}

impl<S, F> AnyLayer for Layer<S, F> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn shape(&self) -> GeometryType {
        self.shape
    }

    fn heads(&self) -> Vec<Head> {
        self.columns.iter().map(|column| column.head).collect()
    }

    fn visit(&self, world: &World, area: &Area, clock: &Clock, visit: &mut Visit<'_>) -> Result<(), Stopped> {
        (self.sources)(world, area, clock)?.iter().try_for_each(|source| self.show(world, source, clock, visit))
    }
}

/// Returns the geometry of a single point.
pub(super) fn point([east, north]: [f64; 2]) -> Geometry {
    vec![vec![[east, north, 0.0]]]
}

/// Gives a line or a ring of a polygon the height 0.
pub(super) fn flat(line: &[[f64; 2]]) -> Vec<[f64; 3]> {
    line.iter().map(|[east, north]| [*east, *north, 0.0]).collect()
}
