//! Realms: continents, seas, islands, deserts, plains and ranges, each as one thing with an area and a middle.
//!
//! ```text
//! coarse nodes --> nodes of a kind --> connected parts --+--> as they are, up to a largest length
//!                                                        |
//!                                                        +--> cut into basins if longer: a lattice's nearest points
//! ```
//!
//! A realm is a connected part of the nodes of its kind. A part that is too long, such as an ocean, is cut along the
//! borders of basins. So each realm lies within a known distance of each of its nodes, and a search of bounded size
//! finds it: realms are traced block by block, and the block in which a realm's middle lies owns it.

use std::fmt;
use std::sync::Arc;

use super::biome::Biome;
use super::climate::PlannedLand;
use super::settings::GeographySettings;
use super::spline::SplineLattice;
use super::{Geography, LAND_NUMBERS, LandAtLarge};

use crate::grain_point::Point;
use crate::hash::{self, Stream};
use crate::memory::{Memory, Remembers, heap_bytes};

/// Nodes a side of a patch of ground or of biomes that is computed and cached together.
const PATCH: i64 = 16;

/// Bytes for the ground, the biomes, the land below them, and the realms.
const GROUND_BYTES: usize = 2 << 20;
const BIOME_BYTES: usize = 1 << 20;
const LAND_BYTES: usize = 8 << 20;
const REALM_BYTES: usize = 1 << 20;

/// Greatest distance of a basin's point from the middle of its cell along each axis, as a share of the cell's side.
const JITTER: f64 = 0.3;

/// Uplift of mountains, and the greatest of plains.
const MOUNTAINS: f64 = 0.3;
const PLAINS: f64 = 0.04;

/// Greatest planned height of plains in metres.
const PLAINS_M: f64 = 400.0;

/// Nodes around a node that must all be sea for open sea: bays are at most twice as wide, 260 km on Earth.
const OPEN: i64 = 4;

/// Nodes of the smallest continent, of the smallest ocean, and of the smallest sea.
const CONTINENT_NODES: usize = 60;
const OCEAN_NODES: usize = 300;
const SEA_NODES: usize = 4;

/// Islands of fewer nodes are measured on nodes this many times as dense.
const FEW_NODES: usize = 24;
const DENSER: i64 = 4;

/// A kind of realms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RealmKind {
    /// Land of a million square kilometres and more on Earth. Where several hang together in a length of more than
    /// 8,000 km, they are cut apart.
    Continent,
    /// Land in the sea that is smaller than continents.
    Island,
    /// Salt water of five million square kilometres and more on Earth.
    Ocean,
    /// Salt water that is smaller than oceans.
    Sea,
    /// A bay, gulf or strait: a part of the sea that is less than 260 km wide on Earth.
    Bay,
    /// Land with the climate of a desert.
    Desert,
    /// Low and flat land.
    Plain,
    /// Mountains.
    Range,
}

/// A continent, sea, island and so on.
#[derive(Clone, Debug, PartialEq)]
pub struct Realm {
    /// Its kind.
    pub kind: RealmKind,
    /// The node at its middle, by column and row in the lattice of its kind.
    pub node: [i64; 2],
    /// Its middle: the place that lies farthest from its edge.
    pub middle: Point,
    /// Its area in square kilometres.
    pub area_km2: f64,
    /// Corners of its bounding box.
    pub bounds: [Point; 2],
}

heap_bytes!(Realm);

/// The lattice on which realms of a kind are traced.
#[derive(Clone, Copy, Debug)]
struct Tracing {
    /// Grains from node to node.
    step: i64,
    /// Nodes a side of a block.
    block: i64,
    /// Length in nodes, along each axis, up to which a part stays whole.
    longest: i64,
    /// Nodes a side of the cells of the basins that cut longer parts; none if longer parts are left out. A place lies
    /// at most `(0.5 + JITTER) * sqrt(2)` sides from the point of its basin, so a basin is at most 2.27 sides long.
    basin: Option<i64>,
}

/// The ground at a node, as bits.
const LAND: u8 = 1;
const HIGH: u8 = 2;
const FLAT: u8 = 4;

/// The biome of a node in the sea.
const NO_BIOME: u8 = u8::MAX;

/// A patch of nodes: the grains from node to node, its column and its row.
type PatchKey = (i64, i64, i64);

/// A finder of realms.
#[derive(Debug)]
pub(super) struct Realms {
    seed: u64,
    /// Grains from node to node for continents and seas, and for all that is smaller than they are.
    far: i64,
    near: i64,
    metres_a_grain: f64,
    ground: Memory<PatchKey, Vec<u8>>,
    /// Biomes at near nodes, and the land that their climates depend on.
    biomes: Memory<PatchKey, Vec<u8>>,
    land: SplineLattice<LAND_NUMBERS>,
    traced: Memory<(RealmKind, i64, i64), Vec<Realm>>,
}

impl RealmKind {
    /// All kinds, the largest first.
    pub const ALL: [RealmKind; 8] = [
        RealmKind::Continent,
        RealmKind::Ocean,
        RealmKind::Sea,
        RealmKind::Range,
        RealmKind::Desert,
        RealmKind::Plain,
        RealmKind::Island,
        RealmKind::Bay,
    ];

    /// Returns the word for a realm of this kind.
    pub fn name(self) -> &'static str {
        match self {
            RealmKind::Continent => "continent",
            RealmKind::Island => "island",
            RealmKind::Ocean => "ocean",
            RealmKind::Sea => "sea",
            RealmKind::Bay => "bay",
            RealmKind::Desert => "desert",
            RealmKind::Plain => "plain",
            RealmKind::Range => "range",
        }
    }

    /// Returns the kind together with which this one is traced: oceans are seas of a certain size.
    fn traced(self) -> RealmKind {
        if self == RealmKind::Ocean { RealmKind::Sea } else { self }
    }
}

impl Realm {
    /// Returns the length in grains of the longer side of the bounding box.
    pub fn longest(&self) -> i64 {
        let [low, high] = self.bounds;
        (high.x - low.x).max(high.y - low.y)
    }
}

impl fmt::Display for Realm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.kind.name(), self.node[0], self.node[1])
    }
}

impl Geography {
    /// Returns the side in grains of the blocks in which realms of a kind are searched.
    pub fn realm_block(&self, kind: RealmKind) -> i64 {
        let Tracing { step, block, .. } = self.realms.tracing(kind);
        step * block
    }

    /// Returns the greatest length in grains of a realm of a kind, along each axis.
    pub fn longest_realm(&self, kind: RealmKind) -> i64 {
        let Tracing { step, longest, .. } = self.realms.tracing(kind);
        step * longest
    }

    /// Returns the realms of a kind whose middles lie in a block, by its column and row.
    pub fn realms_of_block(&self, kind: RealmKind, (i, j): (i64, i64)) -> Vec<Realm> {
        let traced = kind.traced();
        let realms = self.realms.traced.get((traced, i, j), || {
            let tracing = self.realms.tracing(kind);
            self.realms.trace(self, traced, tracing, (i, j))
        });
        realms.iter().filter(|realm| realm.kind == kind).cloned().collect()
    }

    /// Returns the realms of a kind whose middles lie in a rectangle, given by its corners.
    pub fn realms_within(&self, kind: RealmKind, [low, high]: [Point; 2]) -> Vec<Realm> {
        let side = self.realm_block(kind);
        let [columns, rows] =
            [(low.x, high.x), (low.y, high.y)].map(|(from, to)| from.div_euclid(side)..=to.div_euclid(side));
        let blocks = rows.flat_map(|j| columns.clone().map(move |i| (i, j)));
        let within = |at: Point| (low.x..=high.x).contains(&at.x) && (low.y..=high.y).contains(&at.y);
        blocks.flat_map(|block| self.realms_of_block(kind, block)).filter(|realm| within(realm.middle)).collect()
    }

    /// Returns the side in grains of the squares of [`Geography::biome_nodes`].
    pub fn biome_square(&self) -> i64 {
        PATCH * self.realms.near
    }

    /// Returns the nodes in a square, by its column and row, that probably have a biome which `is_asked` accepts, each
    /// with the neighbouring node in the sea if there is one. Between nodes lie 32 km on Earth.
    pub fn biome_nodes(&self, (i, j): (i64, i64), is_asked: impl Fn(Biome) -> bool) -> Vec<(Point, Option<Point>)> {
        let (realms, step) = (&self.realms, self.realms.near);
        let biomes = realms.biomes_of((i, j), self);
        let side = PATCH + 2;
        let ground = realms.ground_of(self, step, [i * PATCH - 1, j * PATCH - 1], side);
        let at = |column: i64, row: i64| Point { x: (i * PATCH + column) * step, y: (j * PATCH + row) * step };
        let mut found = Vec::new();
        for node in 0..PATCH * PATCH {
            let (column, row) = (node % PATCH, node / PATCH);
            if !Biome::all().nth(biomes[node as usize].into()).is_some_and(&is_asked) {
                continue;
            }
            let is_sea = |(x, y): &(i64, i64)| ground[((row + 1 + y) * side + column + 1 + x) as usize] & LAND == 0;
            let sea = [(0, -1), (-1, 0), (1, 0), (0, 1)].into_iter().find(is_sea);
            found.push((at(column, row), sea.map(|(x, y)| at(column + x, row + y))));
        }
        found
    }
}

impl Realms {
    /// Makes the finder for the geography of checked settings, in a world with so many metres a grain.
    pub fn new(settings: &GeographySettings, metres_a_grain: f64, seed: u64) -> Realms {
        let grains = |km: f64| (km * 1000.0 / metres_a_grain).round().max(2.0) as i64;
        let near = grains(settings.plate_km / 50.0);
        Realms {
            seed,
            far: grains(settings.continent_km / 40.0),
            near,
            metres_a_grain,
            ground: Memory::new(GROUND_BYTES),
            biomes: Memory::new(BIOME_BYTES),
            land: SplineLattice::new(near as f64, LAND_BYTES),
            traced: Memory::new(REALM_BYTES),
        }
    }

    /// Returns the caches.
    pub fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.ground, &self.biomes, self.land.memory(), &self.traced]
    }

    /// Returns the lattice of a kind: on Earth 130 km from node to node for continents and seas, 16 for islands, which
    /// may be small, and 32 for all else.
    fn tracing(&self, kind: RealmKind) -> Tracing {
        match kind {
            RealmKind::Continent | RealmKind::Ocean | RealmKind::Sea => {
                Tracing { step: self.far, block: 64, longest: 64, basin: Some(28) }
            }
            RealmKind::Island => Tracing { step: self.near / 2, block: 48, longest: 96, basin: None },
            RealmKind::Bay | RealmKind::Desert | RealmKind::Plain | RealmKind::Range => {
                Tracing { step: self.near, block: 24, longest: 48, basin: Some(20) }
            }
        }
    }

    /// Returns the nodes of the smallest realm of a kind.
    fn least_nodes(kind: RealmKind) -> usize {
        match kind {
            RealmKind::Continent => CONTINENT_NODES,
            RealmKind::Ocean | RealmKind::Sea => SEA_NODES,
            RealmKind::Island => 1,
            RealmKind::Desert => 3,
            RealmKind::Bay | RealmKind::Plain | RealmKind::Range => 10,
        }
    }

    /// Returns the ground of a square of nodes with its first column and row, row by row.
    fn ground_of(&self, geography: &Geography, step: i64, [x0, y0]: [i64; 2], side: i64) -> Vec<u8> {
        let make = |nodes: &[Point]| {
            let ground = |land: LandAtLarge| match land.continent > 0.0 {
                false => 0,
                true if land.uplift > MOUNTAINS => LAND | HIGH,
                true if land.uplift < PLAINS && land.planned_m() < PLAINS_M => LAND | FLAT,
                true => LAND,
            };
            geography.land_apart(nodes).into_iter().map(ground).collect()
        };
        let patch = |i: i64, j: i64| self.ground.get((step, i, j), || make(&patch_nodes((i, j), step)));
        square_of(patch, [x0, y0], side)
    }

    /// Returns the biomes of a patch of near nodes.
    fn biomes_of(&self, patch: (i64, i64), geography: &Geography) -> Arc<Vec<u8>> {
        self.biomes.get((self.near, patch.0, patch.1), || {
            let afar = LandAfar { geography, land: &self.land };
            let nodes = patch_nodes(patch, self.near);
            let heights_m = afar.planned_all(&nodes);
            let is_land: Vec<Point> =
                nodes.iter().zip(&heights_m).filter(|(_, height_m)| **height_m > 0.0).map(|(at, _)| *at).collect();
            let mut climates = geography.climate.at_all(&is_land, &afar).into_iter();
            let biome = |height_m: f64| match height_m > 0.0 {
                true => climates.next().expect("there is one for each node on land").biome(height_m) as u8,
                false => NO_BIOME,
            };
            heights_m.into_iter().map(biome).collect()
        })
    }

    /// Marks the nodes of a kind in a square of nodes.
    fn marked(&self, geography: &Geography, kind: RealmKind, step: i64, [x0, y0]: [i64; 2], side: i64) -> Vec<bool> {
        let ground = || self.ground_of(geography, step, [x0, y0], side);
        let with = |bit: u8| ground().into_iter().map(|ground| ground & bit != 0).collect();
        match kind {
            RealmKind::Continent | RealmKind::Island => with(LAND),
            RealmKind::Ocean | RealmKind::Sea => ground().into_iter().map(|ground| ground & LAND == 0).collect(),
            RealmKind::Range => with(HIGH),
            RealmKind::Plain => with(FLAT),
            RealmKind::Desert => {
                let biomes = square_of(|i, j| self.biomes_of((i, j), geography), [x0, y0], side);
                let [hot, cold] = [Biome::BWh as u8, Biome::BWk as u8];
                biomes.into_iter().map(|biome| biome == hot || biome == cold).collect()
            }
            RealmKind::Bay => {
                let wide = side + 4 * OPEN;
                let ground = self.ground_of(geography, step, [x0 - 2 * OPEN, y0 - 2 * OPEN], wide);
                let sea: Vec<bool> = ground.into_iter().map(|ground| ground & LAND == 0).collect();
                let land_near = spread(&sea.iter().map(|is_sea| !is_sea).collect::<Vec<_>>(), wide, OPEN);
                let open = spread(&land_near.iter().map(|is_near| !is_near).collect::<Vec<_>>(), wide, OPEN);
                let inner = |n: i64| ((n / side + 2 * OPEN) * wide + n % side + 2 * OPEN) as usize;
                (0..side * side).map(inner).map(|n| sea[n] && !open[n]).collect()
            }
        }
    }

    /// Finds the realms whose middles lie in a block.
    fn trace(&self, geography: &Geography, kind: RealmKind, tracing: Tracing, (i, j): (i64, i64)) -> Vec<Realm> {
        let Tracing { step, block, longest, basin } = tracing;
        let margin = longest + 1;
        let side = block + 2 * margin;
        let corner = [i * block - margin, j * block - margin];
        let window = NodeWindow { side, marked: self.marked(geography, kind, step, corner, side) };
        let is_own = |node: i64| {
            let own = margin..margin + block;
            own.contains(&(node % side)) && own.contains(&(node / side))
        };
        let mut parts: Vec<Vec<i64>> = Vec::new();
        for part in window.parts() {
            if !part.iter().any(|node| is_own(*node)) {
                continue;
            }
            if window.is_inside(&part) && window.length(&part) <= longest {
                parts.push(part);
            } else if let Some(basin) = basin {
                parts.extend(window.cut(&part, |x, y| self.basin(kind, basin, corner[0] + x, corner[1] + y)));
            }
        }
        let mut realms = Vec::new();
        for part in parts.into_iter().filter(|part| part.len() >= Realms::least_nodes(kind)) {
            let middle = window.middle(&part);
            if is_own(middle) {
                realms.extend(self.realm(geography, kind, step, corner, &window, &part, middle));
            }
        }
        realms
    }

    /// Describes a part of a window, if it is a realm of the kind.
    #[expect(clippy::too_many_arguments, reason = "a part is known by its window and its lattice")]
    fn realm(
        &self,
        geography: &Geography,
        kind: RealmKind,
        step: i64,
        corner: [i64; 2],
        window: &NodeWindow,
        part: &[i64],
        middle: i64,
    ) -> Option<Realm> {
        let side = window.side;
        let km2 = |nodes: usize, step: i64| {
            let km = step as f64 * self.metres_a_grain / 1000.0;
            nodes as f64 * km * km
        };
        let at = |node: i64| [corner[0] + node % side, corner[1] + node / side];
        let place = |[x, y]: [i64; 2]| Point { x: x * step, y: y * step };
        let [low, high] = window.bounds(part);
        let bounds =
            [place([corner[0] + low[0], corner[1] + low[1]]), place([corner[0] + high[0], corner[1] + high[1]])];
        let mut realm =
            Realm { kind, node: at(middle), middle: place(at(middle)), area_km2: km2(part.len(), step), bounds };
        let land_at = |places: &[Point]| geography.land_apart(places).into_iter().map(|land| land.continent > 0.0);
        match kind {
            RealmKind::Bay => {
                // Water without open sea beside it is a small sea.
                let beside = part.iter().flat_map(|node| window.beside(*node)).flatten();
                let outside = beside.filter(|node| !window.marked[*node as usize]).map(|node| place(at(node)));
                if land_at(&outside.collect::<Vec<_>>()).all(|is_land| is_land) {
                    return None;
                }
            }
            RealmKind::Sea if part.len() >= OCEAN_NODES => realm.kind = RealmKind::Ocean,
            RealmKind::Island if realm.area_km2 >= km2(CONTINENT_NODES, self.far) => return None,
            RealmKind::Island if part.len() < FEW_NODES => {
                // All places around that are nearer to a node of the island, or of the sea, than to other land.
                let dense = step / DENSER;
                let around = |axis: usize| ((low[axis] - 1) * DENSER)..=((high[axis] + 1) * DENSER);
                let own = |x: i64, y: i64| {
                    let node = (y + DENSER / 2).div_euclid(DENSER) * side + (x + DENSER / 2).div_euclid(DENSER);
                    part.contains(&node) || !window.marked[node as usize]
                };
                let origin = place(corner);
                let places: Vec<Point> = around(1)
                    .flat_map(|y| around(0).map(move |x| (x, y)))
                    .filter(|(x, y)| own(*x, *y))
                    .map(|(x, y)| Point { x: origin.x + x * dense, y: origin.y + y * dense })
                    .collect();
                realm.area_km2 = km2(land_at(&places).filter(|is_land| *is_land).count(), dense);
            }
            _ => {}
        }
        Some(realm)
    }

    /// Returns a number for the basin of a node: that of the nearest point of a jittered lattice.
    fn basin(&self, kind: RealmKind, cell: i64, x: i64, y: i64) -> u64 {
        let stream = hash::stream(self.seed, Stream::Realms.of(kind as u64));
        let (column, row) = (x.div_euclid(cell), y.div_euclid(cell));
        let cells = (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))).map(|(di, dj)| {
            let hash = hash::lattice(stream, column + di, row + dj);
            let luck = |part: u64| 0.5 + 2.0 * JITTER * (hash::share(hash::combine(hash, part)) - 0.5);
            // Whole numbers of hundredths of a node, so that no rounding depends on where the node lies.
            let off = |cells: i64, luck: f64, within: i64| {
                ((cells as f64 + luck) * cell as f64 * 100.0) as i64 - within * 100
            };
            let (east, south) = (off(di, luck(0), x.rem_euclid(cell)), off(dj, luck(1), y.rem_euclid(cell)));
            (east * east + south * south, hash)
        });
        cells.min().expect("there are nine cells").1
    }
}

/// The land of a geography, as known at near nodes.
struct LandAfar<'a> {
    geography: &'a Geography,
    land: &'a SplineLattice<LAND_NUMBERS>,
}

impl PlannedLand for LandAfar<'_> {
    fn planned_all(&self, places: &[Point]) -> Vec<f64> {
        let land = self.land.at_all(places, |nodes| self.geography.nodes(nodes));
        land.into_iter().map(|node| LandAtLarge::of(node).planned_m()).collect()
    }
}

/// Returns the places of the nodes of a patch, row by row.
fn patch_nodes((i, j): (i64, i64), step: i64) -> Vec<Point> {
    let node = |n: i64| Point { x: (i * PATCH + n % PATCH) * step, y: (j * PATCH + n / PATCH) * step };
    (0..PATCH * PATCH).map(node).collect()
}

/// Puts a square of nodes together from patches.
fn square_of(patch: impl Fn(i64, i64) -> Arc<Vec<u8>>, [x0, y0]: [i64; 2], side: i64) -> Vec<u8> {
    let mut square = vec![0; (side * side) as usize];
    let patches = |from: i64| from.div_euclid(PATCH)..=(from + side - 1).div_euclid(PATCH);
    for j in patches(y0) {
        for i in patches(x0) {
            let nodes = patch(i, j);
            for y in (j * PATCH).max(y0)..((j + 1) * PATCH).min(y0 + side) {
                let (first, last) = ((i * PATCH).max(x0), ((i + 1) * PATCH).min(x0 + side));
                let from = ((y - j * PATCH) * PATCH + first - i * PATCH) as usize;
                let to = ((y - y0) * side + first - x0) as usize;
                let count = (last - first) as usize;
                square[to..to + count].copy_from_slice(&nodes[from..from + count]);
            }
        }
    }
    square
}

/// Marks all nodes of a square that have a marked node within so many columns and rows.
fn spread(marked: &[bool], side: i64, by: i64) -> Vec<bool> {
    let along = |marked: &[bool], stride: i64, across: i64| {
        let mut spread = vec![false; marked.len()];
        for line in 0..side {
            for at in 0..side {
                if marked[(line * across + at * stride) as usize] {
                    for near in (at - by).max(0)..=(at + by).min(side - 1) {
                        spread[(line * across + near * stride) as usize] = true;
                    }
                }
            }
        }
        spread
    };
    along(&along(marked, 1, side), side, 1)
}

/// A square of nodes, some of them marked. Nodes are numbered row by row.
struct NodeWindow {
    side: i64,
    marked: Vec<bool>,
}

impl NodeWindow {
    /// Returns the connected parts of the marked nodes.
    fn parts(&self) -> Vec<Vec<i64>> {
        let mut left = self.marked.clone();
        (0..self.side * self.side).filter_map(|start| self.flood(start, &mut left, |_| true)).collect()
    }

    /// Collects the nodes that hang together with a node among those that are left and that `is_alike` accepts, and
    /// takes them away.
    fn flood(&self, start: i64, left: &mut [bool], is_alike: impl Fn(i64) -> bool) -> Option<Vec<i64>> {
        if !std::mem::take(&mut left[start as usize]) {
            return None;
        }
        let mut part = vec![start];
        let mut next = 0;
        while let Some(&node) = part.get(next) {
            next += 1;
            for beside in self.beside(node).into_iter().flatten() {
                if left[beside as usize] && is_alike(beside) {
                    left[beside as usize] = false;
                    part.push(beside);
                }
            }
        }
        Some(part)
    }

    /// Returns the neighbours of a node.
    fn beside(&self, node: i64) -> [Option<i64>; 4] {
        let (side, x, y) = (self.side, node % self.side, node / self.side);
        [(y > 0, node - side), (x > 0, node - 1), (x + 1 < side, node + 1), (y + 1 < side, node + side)]
            .map(|(is_there, beside)| is_there.then_some(beside))
    }

    /// Cuts a part along the borders of basins, and returns the connected pieces.
    fn cut(&self, part: &[i64], basin: impl Fn(i64, i64) -> u64) -> Vec<Vec<i64>> {
        let mut left = vec![false; self.marked.len()];
        let mut basins = vec![0; self.marked.len()];
        for &node in part {
            left[node as usize] = true;
            basins[node as usize] = basin(node % self.side, node / self.side);
        }
        let basin_of = |node: i64| basins[node as usize];
        part.iter()
            .filter_map(|&start| self.flood(start, &mut left, |node| basin_of(node) == basin_of(start)))
            .collect()
    }

    /// Returns the least and the greatest column and row of a part.
    fn bounds(&self, part: &[i64]) -> [[i64; 2]; 2] {
        let at = |node: &i64| [node % self.side, node / self.side];
        part.iter().map(at).fold([[i64::MAX; 2], [i64::MIN; 2]], |[low, high], at| {
            [[0, 1].map(|axis| at[axis].min(low[axis])), [0, 1].map(|axis| at[axis].max(high[axis]))]
        })
    }

    /// True if a part does not touch the edge of the window.
    fn is_inside(&self, part: &[i64]) -> bool {
        let [low, high] = self.bounds(part);
        low.iter().all(|low| *low > 0) && high.iter().all(|high| *high < self.side - 1)
    }

    /// Returns the length of a part in nodes along the longer axis.
    fn length(&self, part: &[i64]) -> i64 {
        let [low, high] = self.bounds(part);
        (high[0] - low[0]).max(high[1] - low[1]) + 1
    }

    /// Returns the node of a part that lies farthest from its edge; of several the one nearest to their mean.
    fn middle(&self, part: &[i64]) -> i64 {
        let mut inside = vec![false; self.marked.len()];
        for node in part {
            inside[*node as usize] = true;
        }
        let is_edge = |node: &i64| self.beside(*node).iter().any(|it| it.is_none_or(|it| !inside[it as usize]));
        let mut last: Vec<i64> = part.iter().copied().filter(is_edge).collect();
        let mut left = inside.clone();
        for node in &last {
            left[*node as usize] = false;
        }
        // Goes inwards from the edge, a row of nodes at a time.
        loop {
            let mut next: Vec<i64> = Vec::new();
            for beside in last.iter().flat_map(|node| self.beside(*node)).flatten() {
                if std::mem::take(&mut left[beside as usize]) {
                    next.push(beside);
                }
            }
            if next.is_empty() {
                break;
            }
            last = next;
        }
        let mean =
            |of: fn(i64, i64) -> i64| part.iter().map(|node| of(*node, self.side)).sum::<i64>() / part.len() as i64;
        let (x, y) = (mean(|node, side| node % side), mean(|node, side| node / side));
        let off = |node: &i64| {
            let (east, south) = (node % self.side - x, node / self.side - y);
            (east * east + south * south, *node)
        };
        last.into_iter().min_by_key(off).expect("a part has a node")
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    const METRES_A_GRAIN: f64 = 10.0 / 256.0;

    fn geography(seed: u64) -> Geography {
        Geography::new(&GeographySettings::default(), METRES_A_GRAIN, seed)
    }

    /// The realms of a kind around the origin and around a place far away.
    fn some(geography: &Geography, kind: RealmKind, reach: i64) -> Vec<Realm> {
        let from = 1 << 20;
        let blocks =
            |from: i64| (-reach..=reach).flat_map(move |j| (-reach..=reach).map(move |i| (from + i, j - from)));
        blocks(0).chain(blocks(from)).flat_map(|block| geography.realms_of_block(kind, block)).collect()
    }

    #[test]
    fn realms_are_the_same_from_blocks_of_another_size() {
        let (one, other) = (geography(3), geography(3));
        for kind in [RealmKind::Sea, RealmKind::Range, RealmKind::Bay, RealmKind::Island, RealmKind::Desert] {
            let tracing = one.realms.tracing(kind);
            let whole = Tracing { block: 2 * tracing.block, ..tracing };
            let mut halves: Vec<Realm> =
                (0..4).flat_map(|n| one.realms.trace(&one, kind, tracing, (n % 2 - 2, n / 2 + 4))).collect();
            let mut wholes = other.realms.trace(&other, kind, whole, (-1, 2));
            halves.sort_by_key(|realm| realm.node);
            wholes.sort_by_key(|realm| realm.node);
            assert_eq!(halves, wholes, "{kind:?}");
        }
    }

    #[test]
    fn realms_have_the_sizes_of_their_kinds() {
        let geography = geography(5);
        for kind in RealmKind::ALL {
            let reach = if kind.traced() == RealmKind::Sea || kind == RealmKind::Continent { 0 } else { 2 };
            let realms = some(&geography, kind, reach);
            assert!(realms.len() > 1, "{kind:?}: {realms:?}");
            let ids: HashSet<String> = realms.iter().map(ToString::to_string).collect();
            assert_eq!(ids.len(), realms.len(), "{kind:?}");
            let longest = geography.longest_realm(kind);
            for realm in &realms {
                let [low, high] = realm.bounds;
                assert!(realm.kind == kind && realm.longest() <= longest, "{realm:?}");
                assert!((low.x..=high.x).contains(&realm.middle.x) && (low.y..=high.y).contains(&realm.middle.y));
                let is_right = match kind {
                    RealmKind::Continent => realm.area_km2 > 1e6,
                    RealmKind::Ocean => realm.area_km2 > 5e6,
                    RealmKind::Sea => (5e4..5.5e6).contains(&realm.area_km2),
                    RealmKind::Island => (0.0..1.1e6).contains(&realm.area_km2),
                    RealmKind::Bay | RealmKind::Plain | RealmKind::Range => realm.area_km2 > 1e4,
                    RealmKind::Desert => realm.area_km2 > 3e3,
                };
                assert!(is_right, "{realm:?}");
                let land = geography.land_at_large(&[realm.middle])[0];
                let is_sea = [RealmKind::Ocean, RealmKind::Sea, RealmKind::Bay].contains(&kind);
                let is_small = kind == RealmKind::Island && realm.area_km2 < 2e3;
                assert!(is_small || (land.continent < 0.0) == is_sea, "{realm:?} lies in {land:?}");
            }
        }
    }

    /// Most of the sea and of the land, of the mountains and of the deserts belongs to a realm.
    #[test]
    fn realms_cover_the_world() {
        let geography = geography(2);
        for (kinds, least) in [
            (&[RealmKind::Ocean, RealmKind::Sea][..], 0.95),
            (&[RealmKind::Continent], 0.85),
            (&[RealmKind::Range], 0.8),
            (&[RealmKind::Desert], 0.8),
        ] {
            let Tracing { step, block, longest, .. } = geography.realms.tracing(kinds[0]);
            let traced = kinds[0].traced();
            // Some realms reach across the edge of the square, as many as reach into it. Deserts lie in the south.
            let reach = 2 * longest / block;
            let south = if traced == RealmKind::Desert { 3 } else { 0 };
            let blocks = (-reach..=reach).flat_map(|j| (-reach..=reach).map(move |i| (i, j + south)));
            let realms: Vec<Realm> = kinds
                .iter()
                .flat_map(|kind| blocks.clone().flat_map(|block| geography.realms_of_block(*kind, block)))
                .collect();
            let corner = [-reach * block, (south - reach) * block];
            let nodes = geography.realms.marked(&geography, traced, step, corner, (2 * reach + 1) * block);
            let all = nodes.iter().filter(|is_marked| **is_marked).count() as f64;
            let km = step as f64 * METRES_A_GRAIN / 1000.0;
            let covered = realms.iter().map(|realm| realm.area_km2).sum::<f64>() / (all * km * km);
            assert!((least..1.2).contains(&covered), "{kinds:?} cover {covered}");
        }
    }
}
