//! Volcanoes: where they stand in a whole world, and their sizes.
//!
//! A volcano stands upon a node of the trunk lattice, and no water flows through this node: the trunks around it run
//! past it, and all channels near it away from it. Within its foot the rain sinks into young lava: channels are dry
//! there, and their springs lie along the foot. So cones can rise upon dry land, and no river
//! rises with them.
//!
//! To judge the numbers chosen by eye, look at hillshades of arcs of islands and of the ranges beside oceans.
//!
//! Based on: P. Francis, C. Oppenheimer, Volcanoes, 2004 (kinds and sizes).

use std::sync::Arc;

use glam::DVec2;

use super::fields::Fields;
use super::laws::Laws;
use super::trunk_nodes::NodeId;
use crate::geometry::smooth;
use crate::grain_point::Point;
use crate::hash::{self, Stream};
use crate::memory::{Memory, Remembers, heap_bytes};

/// Nodes of the trunk lattice a side of a volcano's cell, in which one volcano stands at most; and the number of them on
/// each axis that may have it, so that volcanoes stand two nodes apart and more.
const CELL: i64 = 4;
const NODES: i64 = 3;

/// Greatest distance of a volcano from the middle of its node's cell along each axis, as a share of the cell's side.
const OFF_MIDDLE: f64 = 0.15;

/// Greatest chance of a cell to have a volcano. With it, volcanoes of arcs are 70 km apart on the mean.
const MOST_CHANCE: f64 = 0.65;

/// Least distance in metres of a volcano's middle from the lowstand's shore, about.
const INLAND_M: f64 = 1500.0;

/// Rise of the potential of trunks' nodes towards a volcano: in its middle, and the addition at the volcano's own node,
/// which then is the highest of all around it. Neighbouring nodes of continents differ by a twentieth.
const RISE: f64 = 0.35;
const OWN_RISE: f64 = 0.6;

/// Greatest number of lava flows.
const FLOWS: usize = 9;

/// The kind of a volcano.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolcanoKind {
    /// A steep cone of ash and lava.
    Stratovolcano,
    /// A wide and gentle one of thin lava.
    Shield,
    /// A ring of walls around the floor of a volcano whose top has gone.
    Caldera,
    /// A field of small cones upon a low rise.
    CinderField,
}

/// A volcano.
#[derive(Clone, Debug, PartialEq)]
pub struct Volcano {
    /// The column and row of its node in the trunk lattice, which no other volcano has.
    pub node: NodeId,
    /// Its kind.
    pub kind: VolcanoKind,
    /// Its middle, in the plane of the network.
    pub middle: Point,
    /// Distance in metres from the middle to the foot, about.
    pub radius_m: f64,
    /// Height in metres of its top, or of the ring of a caldera, above the country at its foot, about.
    pub height_m: f64,
    /// Its age, from 0 for smooth to 1 for deeply furrowed slopes.
    pub age: f64,
    /// Distance in metres from its middle up to which it shapes the country.
    pub reach_m: f64,
    /// Radius of the crater or of the caldera's ring, as a share of the radius.
    pub rim: f64,
    /// Unit vector towards the gap in the crater's rim.
    pub gap: DVec2,
    /// Chance of its own, for noise.
    pub seed: u64,
    /// Its cinder cones.
    pub cinder_cones: Vec<CinderCone>,
    /// Its lava flows.
    pub flows: Vec<LavaFlow>,
}

/// A small cone of cinders, with a crater.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CinderCone {
    /// Metres east and south from the volcano's middle.
    pub off: DVec2,
    /// Radius of its foot in metres.
    pub radius_m: f64,
    /// Unit vector towards the gap in its rim.
    pub gap: DVec2,
}

/// A tongue of lava.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LavaFlow {
    /// Unit vector down the flow.
    pub down: DVec2,
    /// Its beginning and end, as shares of the volcano's radius.
    pub ends: [f64; 2],
    /// Half of its width in metres, at its end.
    pub half_m: f64,
    /// Its height in metres.
    pub height_m: f64,
}

heap_bytes!(CinderCone);
heap_bytes!(LavaFlow);
heap_bytes!(Volcano: cinder_cones, flows);

/// A cell of volcanoes: its column and row.
type VolcanoCell = (i64, i64);

/// The sizes and numbers of a kind of volcano: its least value, and the addition by chance.
struct KindSizes {
    /// Radius as a share of the distance between trunks' nodes: no larger than that the trunks around pass by.
    radius: (f64, f64),
    /// Height as a share of the radius.
    height: (f64, f64),
    /// Radius of the crater or ring, as a share of the radius.
    rim: (f64, f64),
    /// Reach beyond the foot, as a share of the distance between trunks' nodes.
    beyond: (f64, f64),
    /// Number of cinder cones, and their least radius in metres with its addition.
    cinder_cones: (f64, f64),
    cinder_m: (f64, f64),
    /// Number of lava flows, up to [`FLOWS`].
    flows: (f64, f64),
    /// Slopes of hillsides and of beds around the foot.
    hill_slope: f64,
    bed_slope: f64,
}

const STRATOVOLCANO: KindSizes = KindSizes {
    radius: (0.34, 0.13),
    height: (0.28, 0.1),
    rim: (0.025, 0.04),
    beyond: (0.5, 0.2),
    cinder_cones: (0.0, 5.0),
    cinder_m: (180.0, 220.0),
    flows: (2.0, 6.0),
    hill_slope: 0.18,
    bed_slope: 0.03,
};

const SHIELD: KindSizes = KindSizes {
    radius: (0.42, 0.06),
    height: (0.07, 0.04),
    rim: (0.05, 0.08),
    beyond: (1.6, 0.8),
    cinder_cones: (6.0, 18.0),
    cinder_m: (180.0, 220.0),
    flows: (4.0, 5.0),
    hill_slope: 0.15,
    bed_slope: 0.065,
};

const CALDERA: KindSizes = KindSizes {
    radius: (0.4, 0.08),
    height: (0.07, 0.06),
    rim: (0.36, 0.16),
    beyond: (0.6, 0.3),
    cinder_cones: (0.0, 6.0),
    cinder_m: (200.0, 250.0),
    flows: (0.0, 0.0),
    hill_slope: 0.17,
    bed_slope: 0.02,
};

const CINDER_FIELD: KindSizes = KindSizes {
    radius: (0.34, 0.14),
    height: (0.01, 0.015),
    rim: (0.01, 0.0),
    beyond: (0.3, 0.2),
    cinder_cones: (8.0, 32.0),
    cinder_m: (200.0, 350.0),
    flows: (2.0, 7.0),
    hill_slope: 0.14,
    bed_slope: 0.015,
};

/// Slope of hillsides within the foot of a volcano, below its cone: so gentle that the cone gives the land its shape,
/// and steeper than the country falls from one side of the volcano to the other, where brooks would find no room.
const CORE_HILL_SLOPE: f64 = 0.15;

impl VolcanoKind {
    /// Returns the name of the kind, as in `cinder field`.
    pub fn name(self) -> &'static str {
        match self {
            VolcanoKind::Stratovolcano => "stratovolcano",
            VolcanoKind::Shield => "shield",
            VolcanoKind::Caldera => "caldera",
            VolcanoKind::CinderField => "cinder field",
        }
    }

    fn sizes(self) -> &'static KindSizes {
        match self {
            VolcanoKind::Stratovolcano => &STRATOVOLCANO,
            VolcanoKind::Shield => &SHIELD,
            VolcanoKind::Caldera => &CALDERA,
            VolcanoKind::CinderField => &CINDER_FIELD,
        }
    }

    /// Draws a kind: `rift` is the strength of a rift at the place, and `luck` a number from 0 to 1.
    fn drawn(rift: f64, luck: f64) -> VolcanoKind {
        // Steep cones stand where plates sink; where they part, lava is thin.
        let shares = match rift > 0.1 {
            true => [0.2, 0.5, 0.65],
            false => [0.55, 0.68, 0.84],
        };
        match shares {
            [cones, ..] if luck < cones => VolcanoKind::Stratovolcano,
            [_, shields, _] if luck < shields => VolcanoKind::Shield,
            [.., calderas] if luck < calderas => VolcanoKind::Caldera,
            _ => VolcanoKind::CinderField,
        }
    }
}

/// The volcanoes of a world.
#[derive(Debug)]
pub struct Volcanoes {
    seed: u64,
    /// The volcano of each cell.
    own: Memory<VolcanoCell, Option<Volcano>>,
    /// For each cell, the volcanoes that may shape the country somewhere in it.
    near: Memory<VolcanoCell, Vec<Volcano>>,
}

impl Volcanoes {
    /// Makes the volcanoes of a world with a geography.
    pub fn new(seed: u64) -> Volcanoes {
        let [own, near] = [3 << 20, 4 << 20];
        Volcanoes { seed: hash::stream(seed, Stream::Volcanoes), own: Memory::new(own), near: Memory::new(near) }
    }

    /// Returns the caches.
    pub fn memories(&self) -> [&dyn Remembers; 2] {
        [&self.own, &self.near]
    }

    /// Returns the volcano of a cell, if there is one.
    fn of(&self, fields: &Fields, cell: VolcanoCell) -> Arc<Option<Volcano>> {
        self.own.get(cell, || self.make(fields, cell))
    }

    fn make(&self, fields: &Fields, cell: VolcanoCell) -> Option<Volcano> {
        let own = hash::lattice(self.seed, cell.0, cell.1);
        let luck = |part: u64| hash::share(hash::combine(own, part));
        let by_chance = |(least, more): (f64, f64), part| least + more * luck(part);
        let node_in = |first: i64, part| CELL * first + (NODES as f64 * luck(part)) as i64;
        let node = (node_in(cell.0, 0), node_in(cell.1, 1));
        let side = fields.side(0);
        let corner = Point { x: node.0 * side, y: node.1 * side };
        let off = DVec2::new(luck(2), luck(3)) - 0.5;
        let middle = corner.moved((0.5 + 2.0 * OFF_MIDDLE * off) * side as f64);
        let land = fields.geography()?.land_at_large(&[middle])[0];
        if luck(4) >= MOST_CHANCE * land.volcanism || fields.inland_m(middle) < INLAND_M {
            return None;
        }
        let kind = VolcanoKind::drawn(land.rift, luck(5));
        let (sizes, side_m) = (kind.sizes(), side as f64 * fields.metres_a_grain());
        let radius_m = side_m * by_chance(sizes.radius, 6);
        let count = |range, part| by_chance(range, part) as u64;
        let cinder_cone = |number: u64| {
            let luck = |part| hash::share(hash::combine(own, 100 + 8 * number + part));
            let size = luck(3);
            CinderCone {
                // The square root would spread them evenly; without it they are denser towards the middle.
                off: direction(&luck, 0) * (radius_m * (0.12 + 0.78 * luck(2))),
                radius_m: sizes.cinder_m.0 + sizes.cinder_m.1 * size * size,
                gap: direction(&luck, 4),
            }
        };
        let flow = |number: u64| {
            let luck = |part| hash::share(hash::combine(own, 1000 + 8 * number + part));
            let start = 0.05 + 0.3 * luck(2);
            LavaFlow {
                down: direction(&luck, 0),
                ends: [start, (start + 0.25 + 0.5 * luck(3)).min(0.95)],
                half_m: 120.0 + 300.0 * luck(4),
                height_m: 6.0 + 14.0 * luck(5),
            }
        };
        Some(Volcano {
            node,
            kind,
            middle,
            radius_m,
            height_m: radius_m * by_chance(sizes.height, 7),
            age: luck(8),
            reach_m: radius_m + side_m * by_chance(sizes.beyond, 9),
            rim: by_chance(sizes.rim, 10),
            gap: direction(&luck, 11),
            seed: own,
            cinder_cones: (0..count(sizes.cinder_cones, 13)).map(cinder_cone).collect(),
            flows: (0..count(sizes.flows, 14).min(FLOWS as u64)).map(flow).collect(),
        })
    }

    /// Returns the cell of a point.
    fn cell(fields: &Fields, at: Point) -> VolcanoCell {
        let side = CELL * fields.side(0);
        (at.x.div_euclid(side), at.y.div_euclid(side))
    }

    /// Returns the volcanoes that may shape the country in a cell, each time in the same order.
    fn near(&self, fields: &Fields, cell: VolcanoCell) -> Arc<Vec<Volcano>> {
        self.near.get(cell, || {
            let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| (cell.0 + i, cell.1 + j)));
            around.filter_map(|cell| self.of(fields, cell).as_ref().clone()).collect()
        })
    }
}

/// Returns a unit vector in a random direction, from two numbers of `luck` from `part` on.
fn direction(luck: &impl Fn(u64) -> f64, part: u64) -> DVec2 {
    let way = 2.0 * DVec2::new(luck(part), luck(part + 1)) - 1.0;
    let length = way.length();
    if length > 1e-3 { way / length } else { DVec2::X }
}

impl Volcano {
    /// Returns the share of a volcano's laws in those of the country, at a distance in metres from its middle.
    fn share(&self, distance_m: f64) -> f64 {
        smooth((self.reach_m - distance_m) / (self.reach_m - self.radius_m))
    }

    /// Tells whether the rain sinks into the ground at a point: within the volcano's foot, but not on the floor of a
    /// caldera.
    pub fn is_porous(&self, fields: &Fields, at: Point) -> bool {
        let distance_m = at.distance(self.middle) * fields.metres_a_grain();
        distance_m < self.radius_m && (self.kind != VolcanoKind::Caldera || distance_m > self.floor_m())
    }

    /// Returns the radius in metres of a caldera's level floor.
    pub fn floor_m(&self) -> f64 {
        (self.rim * self.radius_m - self.height_m / super::volcanic_cones::WALL).max(0.0)
    }

    /// Changes the laws of the country at a distance in metres from the volcano's middle.
    fn shape(&self, laws: &mut Laws, distance_m: f64) {
        let (share, sizes) = (self.share(distance_m), self.kind.sizes());
        let core = 1.0 - smooth((distance_m / self.radius_m - 0.6) / 0.5);
        let hill_slope = sizes.hill_slope + (CORE_HILL_SLOPE - sizes.hill_slope) * core;
        let mix = |value: &mut f64, to: f64| *value += (to - *value) * share;
        mix(&mut laws.hill_slope, hill_slope);
        mix(&mut laws.bed_slope, sizes.bed_slope);
        for law in [&mut laws.lakes, &mut laws.old_arms, &mut laws.braids, &mut laws.levees] {
            mix(law, 0.0);
        }
    }
}

impl Fields {
    /// Returns the volcanoes that may shape the country around a point; none without a geography.
    pub fn volcanoes_near(&self, at: Point) -> Arc<Vec<Volcano>> {
        match &self.volcanoes {
            Some(volcanoes) => volcanoes.near(self, Volcanoes::cell(self, at)),
            None => Arc::default(),
        }
    }

    /// Returns the volcanoes whose middles lie in a rectangle, in the plane of the network, row by row of their cells.
    pub fn volcanoes_in(&self, [low, high]: [Point; 2]) -> Vec<Volcano> {
        let Some(volcanoes) = &self.volcanoes else { return Vec::new() };
        let (first, last) = (Volcanoes::cell(self, low), Volcanoes::cell(self, high));
        let cells = (first.1..=last.1).flat_map(|j| (first.0..=last.0).map(move |i| (i, j)));
        let inside = |at: Point| at.x >= low.x && at.x <= high.x && at.y >= low.y && at.y <= high.y;
        cells
            .filter_map(|cell| volcanoes.of(self, cell).as_ref().clone())
            .filter(|volcano| inside(volcano.middle))
            .collect()
    }

    /// Returns the volcano that stands upon a node of the trunk lattice, if there is one.
    pub(super) fn volcano_at(&self, node: NodeId) -> Option<Volcano> {
        let cell = (node.0.div_euclid(CELL), node.1.div_euclid(CELL));
        let volcano = self.volcanoes.as_ref()?.of(self, cell);
        volcano.as_ref().as_ref().filter(|volcano| volcano.node == node).cloned()
    }

    /// Returns the rise of the potential by which trunks flow, at a node and its place.
    pub(super) fn volcanic_rise(&self, node: NodeId, at: Point) -> f64 {
        let rise = |volcano: &Volcano| {
            let distance_m = at.distance(volcano.middle) * self.metres_a_grain();
            let left = (1.0 - distance_m / volcano.reach_m).max(0.0);
            RISE * left * left + if volcano.node == node { OWN_RISE } else { 0.0 }
        };
        self.volcanoes_near(at).iter().map(rise).sum()
    }

    /// Changes the laws at points near volcanoes.
    pub(super) fn shape_by_volcanoes(&self, points: &[Point], laws: &mut [Laws]) {
        let mut last: Option<(VolcanoCell, Arc<Vec<Volcano>>)> = None;
        for (at, laws) in points.iter().zip(laws) {
            let cell = Volcanoes::cell(self, *at);
            let near = last.take().filter(|(own, _)| *own == cell);
            let near = near.map_or_else(|| self.volcanoes_near(*at), |(_, near)| near);
            for volcano in near.iter() {
                let distance_m = at.distance(volcano.middle) * self.metres_a_grain();
                if distance_m < volcano.reach_m {
                    volcano.shape(laws, distance_m);
                }
            }
            last = Some((cell, near));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::area::{Area, Stride};
    use crate::clock::Clock;
    use crate::fluvial::Fluvial;
    use crate::land::Land;
    use crate::preset::Preset;
    use crate::world::World;

    fn world(seed: u64, stride: u64) -> World {
        let (_, preset) = Preset::load("world").unwrap();
        World::strided(preset, Some(seed), Stride::new(stride).unwrap()).unwrap()
    }

    fn fluvial(world: &World) -> &Fluvial {
        world.relief().fluvial().unwrap()
    }

    /// Returns the square around the origin whose sides are so many kilometres away.
    fn square(fields: &Fields, km: f64) -> [Point; 2] {
        Point::default().square(km * 1000.0 / fields.metres_a_grain())
    }

    /// Returns the volcanoes of a kind without ice sheets within 5,000 km of the origin, in the plane of the network.
    fn all_of(fields: &Fields, kind: VolcanoKind) -> Vec<Volcano> {
        let geography = fields.geography().unwrap();
        let is_bare = |volcano: &Volcano| geography.settings_at(&[volcano.middle])[0].is_under_ice() == 0.0;
        let all = fields.volcanoes_in(square(fields, 5000.0)).into_iter();
        all.filter(|volcano| volcano.kind == kind && is_bare(volcano)).collect()
    }

    /// Returns the land at the nodes of a world in a square around a point, with sides so many metres away.
    fn land(world: &World, around: Point, metres: f64) -> Land {
        let node = world.spacing_m();
        let half = (metres / node) as i64;
        let grains = world.stride().vertices() * crate::grain_point::GRAINS;
        let area = Area::new(around.x / grains - half, around.y / grains - half, 2 * half as usize, 2 * half as usize);
        world.relief().land(area, &Clock::default()).unwrap()
    }

    #[test]
    fn volcanoes_stand_where_plates_ask_for_them_and_nowhere_else() {
        let mut kinds = Vec::new();
        for seed in 1..=3 {
            let world = world(seed, 1);
            let fields = fluvial(&world).fields();
            let all = fields.volcanoes_in(square(fields, 5000.0));
            assert!((50..1200).contains(&all.len()), "seed {seed} has {} volcanoes", all.len());
            for volcano in &all {
                let land = world.geography().unwrap().land_at_large(&[volcano.middle])[0];
                assert!(land.volcanism > 0.0 && fields.inland_m(volcano.middle) >= INLAND_M, "{volcano:?}: {land:?}");
                kinds.push(volcano.kind);
                assert!(all.iter().all(|other| {
                    let apart = other.middle.distance(volcano.middle);
                    other.node == volcano.node || apart > 1.5 * fields.side(0) as f64
                }));
            }
            let km = 1000.0 / fields.metres_a_grain();
            let places = (0..10_000).map(|n| Point { x: (n % 100 - 50), y: (n / 100 - 50) });
            let places: Vec<Point> = places
                .map(|at| Point { x: (at.x as f64 * 100.0 * km) as i64, y: (at.y as f64 * 100.0 * km) as i64 })
                .collect();
            let lands = world.geography().unwrap().land_at_large(&places);
            let is_shield = |land: &&crate::geography::LandAtLarge| {
                land.continent > 0.5 && land.youth < 0.05 && land.rift < 0.01 && land.uplift < 0.1
            };
            let shields: Vec<_> = lands.iter().filter(is_shield).collect();
            assert!(shields.len() > 20, "{} places on shields", shields.len());
            let quiet = shields.iter().filter(|land| land.volcanism < 0.02).count();
            assert!(quiet as f64 > 0.99 * shields.len() as f64, "{quiet} of {} are quiet", shields.len());
        }
        use VolcanoKind::{Caldera, CinderField, Shield, Stratovolcano};
        for kind in [Stratovolcano, Shield, Caldera, CinderField] {
            assert!(kinds.iter().filter(|own| **own == kind).count() > 20, "{kind:?}");
        }
    }

    #[test]
    fn laws_near_volcanoes_keep_their_bounds() {
        let world = world(3, 1);
        let fields = fluvial(&world).fields();
        let [least, most] = [fields.least_laws(), fields.most_laws()];
        for volcano in fields.volcanoes_in(square(fields, 4000.0)) {
            let step = volcano.reach_m / 12.0 / fields.metres_a_grain();
            let places: Vec<Point> = (0..16)
                .map(|n| volcano.middle.moved(DVec2::new(f64::from(n) * step, f64::from(n % 4) * step)))
                .collect();
            for laws in fields.all_laws(&places) {
                for of in [
                    (|laws: &Laws| laws.hill_slope) as fn(&Laws) -> f64,
                    |laws| laws.bed_slope,
                    |laws| laws.lakes,
                    |laws| laws.old_arms,
                    |laws| laws.braids,
                    |laws| laws.levees,
                ] {
                    assert!((of(least)..=of(most)).contains(&of(&laws)), "{laws:?} at {volcano:?}");
                }
            }
        }
    }

    #[test]
    fn a_stratovolcano_rises_a_thousand_metres_above_its_foot_at_every_stride() {
        let [near, far] = [4, 32].map(|stride| world(3, stride));
        let fields = fluvial(&near).fields();
        for volcano in all_of(fields, VolcanoKind::Stratovolcano).iter().step_by(16) {
            let middle = fluvial(&near).in_world(volcano.middle);
            let tops_m = [&near, &far].map(|world| {
                let land = land(world, middle, 1.4 * volcano.radius_m);
                let vertices = world.stride().vertices();
                let (mut foot_m, mut top_m) = (Vec::new(), f32::NEG_INFINITY);
                for (x, y) in land.heights.area().vertices() {
                    let at = Point::at_vertex(x * vertices, y * vertices);
                    let away = at.distance(middle) * fields.metres_a_grain() / volcano.radius_m;
                    if (away - 1.2).abs() < 0.1 {
                        foot_m.push(land.heights.at(x, y));
                    }
                    if away < 0.2 {
                        top_m = top_m.max(land.heights.at(x, y));
                    }
                }
                foot_m.sort_unstable_by(f32::total_cmp);
                let rise_m = top_m - foot_m[foot_m.len() / 2];
                assert!(rise_m > 1000.0, "{volcano:?} rises {rise_m} m at {:?}", world.stride());
                top_m
            });
            // The country around is higher from near than from afar, where it is high.
            assert!((tops_m[0] - tops_m[1]).abs() < 0.25 * tops_m[0], "{volcano:?}: {tops_m:?}");
        }
    }

    /// Water runs away from a volcano, and none through it.
    #[test]
    fn rivers_run_outwards_from_volcanoes() {
        let world = world(3, 1);
        let (network, fields) = (fluvial(&world).network(), fluvial(&world).fields());
        let (mut outwards, mut all) = (0, 0);
        for volcano in all_of(fields, VolcanoKind::Stratovolcano).iter().step_by(12) {
            let away_m = |at: Point| at.distance(volcano.middle) * fields.metres_a_grain();
            let around = volcano.middle.square(1.6 * volcano.radius_m / fields.metres_a_grain());
            for level in 0..3 {
                network.channels(level, around, |channel| {
                    let wet: Vec<Point> = channel
                        .knots
                        .iter()
                        .filter(|knot| fields.holds_water(knot.discharge_m3s))
                        .map(|knot| knot.at)
                        .collect();
                    let Some((first, last)) = wet.first().zip(wet.last()) else { return };
                    if level > 0 {
                        // A river's curves may come a little nearer than its course.
                        let nearest_m = wet.iter().map(|at| away_m(*at)).fold(f64::INFINITY, f64::min);
                        assert!(nearest_m > 0.9 * volcano.radius_m, "{:?}: {nearest_m} m from {volcano:?}", channel.id);
                    }
                    if away_m(*first) < 1.5 * volcano.radius_m {
                        all += 1;
                        outwards += i32::from(away_m(*last) > away_m(*first));
                    }
                });
            }
        }
        assert!(all > 20 && f64::from(outwards) > 0.9 * f64::from(all), "{outwards} of {all} rivers run outwards");
    }

    #[test]
    fn a_volcano_is_the_same_in_every_window() {
        let world = world(3, 4);
        let fields = fluvial(&world).fields();
        for kind in [VolcanoKind::Stratovolcano, VolcanoKind::Caldera, VolcanoKind::CinderField] {
            let volcano = &all_of(fields, kind)[3];
            let middle = fluvial(&world).in_world(volcano.middle);
            let whole = land(&world, middle, 0.5 * volcano.radius_m);
            for part in whole.heights.area().halves() {
                let other = self::world(3, 4);
                let own = other.relief().land(part, &Clock::default()).unwrap();
                assert_eq!(own.heights, whole.heights.part(part), "{volcano:?}");
            }
        }
    }
}
