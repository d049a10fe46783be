//! Layers: all features of one kind, and the one description of their attributes from which every table comes.

use serde::Serialize;

use crate::area::Area;
use crate::world::World;

/// The features of one kind. `S` is what the world has of one, `F` the feature.
pub struct Layer<S: 'static, F: 'static> {
    /// The table of a database, and the file of a format that has one a layer.
    pub name: &'static str,
    /// What it shows and in which units.
    pub about: &'static str,
    /// What its geometries are.
    pub shape: Shape,
    /// Its attributes.
    pub columns: &'static [Column<F>],
    /// What the world has in an area.
    pub(super) sources: fn(&World, &Area) -> Vec<S>,
    /// What the features of a layer are sorted by; no two have the same.
    pub(super) key: fn(&S) -> Vec<u8>,
    /// Makes a feature of what the world has.
    pub(super) feature: fn(&World, &S) -> F,
    /// The geometry of a feature.
    pub(super) lines: fn(F) -> Geometry,
}

/// A line, the rings of a polygon, or a point alone: metres east, north and up, with 0 up where the layer has no heights.
pub type Geometry = Vec<Vec<[f64; 3]>>;

/// What the geometries of a layer are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A point.
    Point,
    /// A line.
    Line,
    /// A line whose points have heights.
    LineZ,
    /// A polygon: its outer ring, then its holes.
    Polygon,
}

impl Shape {
    /// Numbers a point.
    pub fn dimensions(self) -> usize {
        if self == Shape::LineZ { 3 } else { 2 }
    }
}

/// An attribute of the features of a layer.
pub struct Column<F> {
    head: Head,
    value: fn(&F) -> Value,
}

/// What an attribute is called and holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Its column in a table.
    pub name: &'static str,
    /// Its key in an object. Neighbours of the same key are an array.
    pub key: &'static str,
    /// What it holds.
    pub kind: Kind,
    /// Whether each feature has it.
    pub required: bool,
}

/// What an attribute holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A whole number.
    Integer,
    /// A number of 64 bits.
    Real,
    /// A number that 32 bits hold, and whose text has no more digits than they need.
    Real32,
    /// A text.
    Text,
}

/// A value of an attribute. In JSON it is the bare number or text, or null for nothing.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// No value: the feature does not have the attribute.
    Nothing,
    /// The value of an attribute of [`Kind::Integer`].
    Integer(i64),
    /// The value of an attribute of [`Kind::Real`].
    Real(f64),
    /// The value of an attribute of [`Kind::Real32`].
    Real32(f32),
    /// The value of an attribute of [`Kind::Text`].
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
    /// An attribute that each feature has.
    pub(super) const fn new(name: &'static str, kind: Kind, value: fn(&F) -> Value) -> Column<F> {
        Column { head: Head { name, key: name, kind, required: true }, value }
    }

    /// An attribute that some features do not have.
    pub(super) const fn optional(name: &'static str, kind: Kind, value: fn(&F) -> Value) -> Column<F> {
        Column { head: Head { name, key: name, kind, required: false }, value }
    }

    /// An attribute that each feature has, with another key in objects than in tables.
    pub(super) const fn keyed(name: &'static str, key: &'static str, kind: Kind, value: fn(&F) -> Value) -> Column<F> {
        Column { head: Head { name, key, kind, required: true }, value }
    }
}

/// A feature as a table has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The values of the layer's columns.
    pub values: Vec<Value>,
    /// The geometry.
    pub lines: Geometry,
}

/// Takes a feature's key, by which a layer is sorted, and what makes its row.
pub type Visit<'a> = dyn FnMut(Vec<u8>, &dyn Fn() -> Row) + 'a;

impl<S, F> Layer<S, F> {
    fn row(&self, world: &World, source: &S) -> Row {
        let feature = (self.feature)(world, source);
        let values = self.columns.iter().map(|column| (column.value)(&feature)).collect();
        Row { values, lines: (self.lines)(feature) }
    }

    /// Shows the feature of what the world, or a tile of a walk, has of one.
    pub(super) fn show(&self, world: &World, source: &S, visit: &mut Visit<'_>) {
        visit((self.key)(source), &|| self.row(world, source));
    }

    /// All features of which a part lies in the rectangle that the outer vertices of an area span, whole, sorted by key.
    pub fn find(&self, world: &World, area: &Area) -> Vec<F> {
        self.features(world, (self.sources)(world, area))
    }

    /// The features of what the world has, sorted by key.
    pub fn features(&self, world: &World, sources: Vec<S>) -> Vec<F> {
        let mut sources: Vec<_> = sources.into_iter().map(|it| ((self.key)(&it), it)).collect();
        sources.sort_by(|a, b| a.0.cmp(&b.0));
        // An area may come upon a source twice, such as a settlement in it at which its roads end too.
        sources.dedup_by(|a, b| a.0 == b.0);
        sources.iter().map(|(_, source)| (self.feature)(world, source)).collect()
    }
}

/// A layer, whatever its features are, for what writes them all alike.
pub trait AnyLayer: Sync {
    /// [`Layer::name`].
    fn name(&self) -> &'static str;

    /// [`Layer::about`].
    fn about(&self) -> &'static str;

    /// [`Layer::shape`].
    fn shape(&self) -> Shape;

    /// What its attributes are called and hold.
    fn heads(&self) -> Vec<Head>;

    /// Shows the features of which a part lies in an area, in any order, one perhaps several times. A row is made only
    /// if it is wanted.
    fn visit(&self, world: &World, area: &Area, visit: &mut Visit<'_>);
}

impl<S, F> AnyLayer for Layer<S, F> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn shape(&self) -> Shape {
        self.shape
    }

    fn heads(&self) -> Vec<Head> {
        self.columns.iter().map(|column| column.head).collect()
    }

    fn visit(&self, world: &World, area: &Area, visit: &mut Visit<'_>) {
        for source in (self.sources)(world, area) {
            self.show(world, &source, visit);
        }
    }
}

/// The geometry of a point.
pub(super) fn point([east, north]: [f64; 2]) -> Geometry {
    vec![vec![[east, north, 0.0]]]
}

/// The geometry of a line without heights, or a ring of such a polygon.
pub(super) fn flat(line: &[[f64; 2]]) -> Vec<[f64; 3]> {
    line.iter().map(|[east, north]| [*east, *north, 0.0]).collect()
}
