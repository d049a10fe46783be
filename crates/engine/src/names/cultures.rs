//! Cultural regions of a world with a geography: which people live at a place, and the dialect that they speak.
//!
//! Each people has a home, a point of a jittered lattice. A place belongs to the home from which it is reached most
//! easily: on a coarse lattice of nodes, where seas, shores and mountains are hard to cross, so borders run along them.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::geography::Geography;
use crate::geography::biome::Biome;
use crate::grain_point::Point;
use crate::hash::{self, Stream};
use crate::memory::{Memory, Remembers, heap_bytes};

/// Side of the square of a home as a share of the distance between continents: 720 km on Earth.
const SQUARE: f64 = 0.138;

/// Nodes from a square to the next, and the number of squares around a home that its people can reach. Nearest homes of
/// a jittered lattice are at most 1.2 squares away.
const NODES: i64 = 12;
const REACH: i64 = 2;

/// Nodes a side of the square that a people can reach.
const SIDE: i64 = 2 * REACH * NODES + 1;

/// Greatest distance of a home from the middle of its square, along each axis, as a share of the square's side.
const JITTER: f64 = 0.35;

/// Places in its square that a home is chosen from: the first on land.
const CHOICES: u64 = 8;

/// Hardship of a step between nodes on flat land, the addition on the highest mountains, that on the sea, and that of a
/// shore. Chosen by eye on maps of regions: borders leave coasts and crests seldom.
const FLAT: f64 = 10.0;
const MOUNTAINS: f64 = 120.0;
const SEA: f64 = 25.0;
const SHORE: f64 = 80.0;

/// Side of the cells of dialects in nodes: 180 km on Earth.
const DIALECT: i64 = 3;

/// Bytes for the ground, for the ways from homes, for the homes that nodes may belong to, and for lands of homes.
const GROUND_BYTES: usize = 512 << 10;
const WAYS_BYTES: usize = 2 << 20;
const CLAIM_BYTES: usize = 512 << 10;
const LAND_BYTES: usize = 64 << 10;

/// A land that a people comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Homeland {
    /// An island, or the sea with small islands.
    Islands,
    /// Tropical forest.
    RainForest,
    /// Savanna.
    Savanna,
    /// Hot desert or steppe.
    HotDesert,
    /// Cold steppe or desert.
    Steppe,
    /// Land with dry summers.
    DrySummers,
    /// Warm land with rain in summer.
    RainySummers,
    /// Cool land with rain throughout the year.
    Oceanic,
    /// Land with cold winters.
    ColdWinters,
    /// Boreal forest and tundra.
    North,
    /// High mountains.
    Mountains,
}

/// The people of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Culture {
    /// A random number of the people.
    pub people: u64,
    /// The land of its home.
    pub homeland: Homeland,
    /// A random number of the dialect.
    pub dialect: u64,
}

/// A square of nodes, by its column and row, or a node.
type CultureCell = (i64, i64);

/// The cultural regions of a world.
#[derive(Debug)]
pub struct Cultures {
    geography: Arc<Geography>,
    seed: u64,
    /// Grains from node to node.
    step: i64,
    /// `continent` and uplift at the nodes of a square.
    ground: Memory<CultureCell, Vec<[f32; 2]>>,
    /// Hardship of the ways from a home to the nodes that its people can reach.
    ways: Memory<CultureCell, Vec<u32>>,
    /// Homes to which places between a node and the next in the south-east may belong.
    claims: Memory<CultureCell, Vec<Claim>>,
    homelands: Memory<CultureCell, u8>,
}

/// A home to which places between four nodes may belong.
#[derive(Clone, Copy, Debug)]
struct Claim {
    home: CultureCell,
    /// Hardship of the ways to the four nodes, row by row.
    ways: [u32; 4],
}

heap_bytes!(Claim);

impl Homeland {
    /// All lands.
    pub(super) const ALL: [Homeland; 11] = [
        Homeland::Islands,
        Homeland::RainForest,
        Homeland::Savanna,
        Homeland::HotDesert,
        Homeland::Steppe,
        Homeland::DrySummers,
        Homeland::RainySummers,
        Homeland::Oceanic,
        Homeland::ColdWinters,
        Homeland::North,
        Homeland::Mountains,
    ];

    fn of(biome: Biome) -> Homeland {
        match biome.code().as_bytes() {
            b"Af" | b"Am" => Homeland::RainForest,
            b"Aw" => Homeland::Savanna,
            b"BWh" | b"BSh" => Homeland::HotDesert,
            [b'B', ..] => Homeland::Steppe,
            [b'C', b's', _] | b"Dsa" | b"Dsb" => Homeland::DrySummers,
            [b'C', b'w', _] | b"Cfa" => Homeland::RainySummers,
            b"Cfb" => Homeland::Oceanic,
            [b'D', _, b'a' | b'b'] => Homeland::ColdWinters,
            _ => Homeland::North,
        }
    }
}

impl Cultures {
    /// Makes the cultural regions of a geography, from the seed of its world's chance.
    pub fn new(geography: Arc<Geography>, metres_a_grain: f64, seed: u64) -> Cultures {
        let square_m = SQUARE * geography.settings().continent_km * 1000.0;
        Cultures {
            step: (square_m / NODES as f64 / metres_a_grain).round().max(1.0) as i64,
            geography,
            seed,
            ground: Memory::new(GROUND_BYTES),
            ways: Memory::new(WAYS_BYTES),
            claims: Memory::new(CLAIM_BYTES),
            homelands: Memory::new(LAND_BYTES),
        }
    }

    /// Returns the caches.
    pub(crate) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.ground, &self.ways, &self.claims, &self.homelands]
    }

    /// Returns the people of a place and its dialect.
    pub fn at(&self, place: Point) -> Culture {
        let home = self.home_of(place);
        let people = self.luck(0, home);
        let homeland = self.homelands.get(home, || self.homeland(home) as u8);
        Culture {
            people,
            homeland: Homeland::ALL[usize::from(*homeland)],
            dialect: hash::combine(people, self.dialect(place)),
        }
    }

    /// Returns the home of a place, by its square.
    fn home_of(&self, place: Point) -> CultureCell {
        let node = (place.x.div_euclid(self.step), place.y.div_euclid(self.step));
        let claims = self.claims.get(node, || self.claims_of(node));
        let share = |at: i64| at.rem_euclid(self.step) as f64 / self.step as f64;
        let (east, south) = (share(place.x), share(place.y));
        let way = |claim: &&Claim| {
            let [a, b, c, d] = claim.ways.map(f64::from);
            let (north_way, south_way) = (a + (b - a) * east, c + (d - c) * east);
            north_way + (south_way - north_way) * south
        };
        let nearest = claims.iter().min_by(|a, b| way(a).total_cmp(&way(b)).then(a.home.cmp(&b.home)));
        nearest.expect("a home is near each place").home
    }

    /// Returns the homes to which places between a node and the next in the south-east may belong.
    fn claims_of(&self, (x, y): CultureCell) -> Vec<Claim> {
        let (i, j) = (x.div_euclid(NODES), y.div_euclid(NODES));
        let homes = (-REACH..=REACH).flat_map(|dj| (-REACH..=REACH).map(move |di| (i + di, j + dj)));
        let claim = |home: CultureCell| {
            let at = self.home_node(home);
            let (east, south) = (x - at.0 + REACH * NODES, y - at.1 + REACH * NODES);
            let is_reached = [east, south].iter().all(|off| (0..SIDE - 1).contains(off));
            is_reached.then(|| {
                let ways = self.ways.get(home, || self.ways_of(home));
                let first = (south * SIDE + east) as usize;
                Claim { home, ways: [0, 1, SIDE as usize, SIDE as usize + 1].map(|by| ways[first + by]) }
            })
        };
        let mut claims: Vec<Claim> = homes.filter_map(claim).collect();
        let sure = claims.iter().map(|claim| claim.ways.into_iter().max()).min().flatten();
        claims.retain(|claim| claim.ways.into_iter().min() <= sure);
        claims
    }

    /// Returns the node at which the home of a square stands.
    fn home_node(&self, home: CultureCell) -> CultureCell {
        let luck = self.luck(1, home);
        let node = |choice: u64| {
            let along = |part: u64, square: i64| {
                let share = 0.5 + 2.0 * JITTER * (hash::share(hash::combine(luck, 2 * choice + part)) - 0.5);
                square * NODES + (share * NODES as f64) as i64
            };
            (along(0, home.0), along(1, home.1))
        };
        let ground = self.ground_of(home);
        let is_land =
            |(x, y): &CultureCell| ground[(y.rem_euclid(NODES) * NODES + x.rem_euclid(NODES)) as usize][0] > 0.0;
        (0..CHOICES).map(node).find(is_land).unwrap_or_else(|| node(0))
    }

    /// Returns the land from which the people of a home comes.
    fn homeland(&self, home: CultureCell) -> Homeland {
        let ground = self.ground_of(home);
        let is_land = ground.iter().filter(|[continent, _]| *continent > 0.0).count();
        if is_land * 4 < ground.len() {
            return Homeland::Islands;
        }
        let (x, y) = self.home_node(home);
        let at = Point { x: x * self.step, y: y * self.step };
        let land = self.geography.land_apart(&[at])[0];
        if land.uplift > 0.5 {
            return Homeland::Mountains;
        }
        Homeland::of(self.geography.climate_apart(at).biome(land.planned_m().max(0.0)))
    }

    fn ground_of(&self, square: CultureCell) -> Arc<Vec<[f32; 2]>> {
        self.ground.get(square, || {
            let node = |n: i64| Point {
                x: (square.0 * NODES + n % NODES) * self.step,
                y: (square.1 * NODES + n / NODES) * self.step,
            };
            let nodes: Vec<Point> = (0..NODES * NODES).map(node).collect();
            let land = self.geography.land_apart(&nodes).into_iter();
            land.map(|land| [land.continent as f32, land.uplift as f32]).collect()
        })
    }

    /// Returns the hardship of the easiest ways from a home to the nodes around it, row by row.
    fn ways_of(&self, home: CultureCell) -> Vec<u32> {
        let (x, y) = self.home_node(home);
        let first = (x - REACH * NODES, y - REACH * NODES);
        let mut ground = Vec::with_capacity((SIDE * SIDE) as usize);
        for row in first.1..first.1 + SIDE {
            for column in first.0..first.0 + SIDE {
                let square = self.ground_of((column.div_euclid(NODES), row.div_euclid(NODES)));
                ground.push(square[(row.rem_euclid(NODES) * NODES + column.rem_euclid(NODES)) as usize]);
            }
        }
        let is_sea = |node: usize| ground[node][0] <= 0.0;
        let hardship = |node: usize| FLAT + if is_sea(node) { SEA } else { MOUNTAINS * f64::from(ground[node][1]) };
        let mut ways = vec![u32::MAX; ground.len()];
        let start = (SIDE * SIDE / 2) as usize;
        ways[start] = 0;
        let mut queue = BinaryHeap::from([Reverse((0, start))]);
        while let Some(Reverse((way, node))) = queue.pop() {
            if way > ways[node] {
                continue;
            }
            for (east, south) in crate::grain_point::AROUND {
                let (column, row) = (node as i64 % SIDE + east, node as i64 / SIDE + south);
                if !(0..SIDE).contains(&column) || !(0..SIDE).contains(&row) {
                    continue;
                }
                let next = (row * SIDE + column) as usize;
                let length = if east != 0 && south != 0 { 1.414_213_562 } else { 1.0 };
                let shore = if is_sea(node) == is_sea(next) { 0.0 } else { SHORE };
                let further = way + (length * 0.5 * (hardship(node) + hardship(next)) + shore).round() as u32;
                if further < ways[next] {
                    ways[next] = further;
                    queue.push(Reverse((further, next)));
                }
            }
        }
        ways
    }

    /// Returns a number for the dialect of a place: that of the nearest point of a jittered lattice.
    fn dialect(&self, place: Point) -> u64 {
        let side = DIALECT * self.step;
        let (i, j) = (place.x.div_euclid(side), place.y.div_euclid(side));
        let cells = (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))).map(|(di, dj)| {
            let luck = self.luck(2, (i + di, j + dj));
            let off = |cells: i64, part: u64, within: i64| {
                let share = cells as f64 + 0.5 + 2.0 * JITTER * (hash::share(hash::combine(luck, part)) - 0.5);
                share - within as f64 / side as f64
            };
            let (east, south) = (off(di, 0, place.x.rem_euclid(side)), off(dj, 1, place.y.rem_euclid(side)));
            (east * east + south * south, luck)
        });
        let nearest = cells.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.expect("there are nine cells").1
    }

    fn luck(&self, part: u64, (i, j): (i64, i64)) -> u64 {
        hash::lattice(hash::stream(self.seed, Stream::Cultures.of(part)), i, j)
    }
}
