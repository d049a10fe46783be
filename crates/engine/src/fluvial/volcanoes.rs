//! Volcanoes: where they stand in a whole world, and their sizes.
//!
//! A volcano stands upon a node of the trunk lattice, and no water flows through this node: the trunks around it run
//! past it, and all channels near it away from it. Within its foot the rain sinks into young lava: channels are dry
//! there, and their springs lie along the foot. So [cones](super::volcanic_cones) can rise upon dry land, and no river
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

/// Nodes of the trunk lattice a side of a volcano's cell: one volcano stands in a cell, at most. And the nodes of these,
/// on each axis, that may have it, so that two nodes lie between two volcanoes.
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
    height: (0.24, 0.1),
    rim: (0.025, 0.04),
    beyond: (0.5, 0.2),
    cinder_cones: (0.0, 5.0),
    cinder_m: (180.0, 220.0),
    flows: (2.0, 6.0),
    hill_slope: 0.12,
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
    hill_slope: 0.11,
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
    hill_slope: 0.12,
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
    hill_slope: 0.09,
    bed_slope: 0.015,
};

/// Slope of hillsides within the foot of a volcano, below its cone: so gentle that the cone alone gives the land its
/// shape.
const CORE_HILL_SLOPE: f64 = 0.085;

impl VolcanoKind {
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
    /// For each cell, the volcanoes that may shape the country somewhere in it.
    near: Memory<VolcanoCell, Vec<Volcano>>,
}

impl Volcanoes {
    /// Makes the volcanoes of a world with a geography.
    pub fn new(seed: u64) -> Volcanoes {
        Volcanoes { seed: hash::stream(seed, Stream::Volcanoes), near: Memory::new(2 << 20) }
    }

    /// Returns the cache.
    pub fn memory(&self) -> &dyn Remembers {
        &self.near
    }

    /// Returns the volcano of a cell, if there is one.
    fn of(&self, fields: &Fields, cell: VolcanoCell) -> Option<Volcano> {
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
            around.filter_map(|cell| self.of(fields, cell)).collect()
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

    /// Tells whether the rain sinks into the ground at an offset in metres from the volcano's middle: within its foot,
    /// but not on the floor of a caldera.
    pub fn is_porous(&self, off: DVec2) -> bool {
        let distance_m = off.length();
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
        cells.filter_map(|cell| volcanoes.of(self, cell)).filter(|volcano| inside(volcano.middle)).collect()
    }

    /// Returns the middle of the volcano that stands upon a node of the trunk lattice.
    pub fn volcano_at(&self, node: NodeId) -> Option<Point> {
        let side = self.side(0);
        let near = self.volcanoes_near(Point { x: node.0 * side, y: node.1 * side });
        near.iter().find(|volcano| volcano.node == node).map(|volcano| volcano.middle)
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

    /// Tells whether the rain sinks into the ground of a volcano at a point.
    pub(super) fn is_porous(&self, at: Point) -> bool {
        let off = |volcano: &Volcano| at.from(volcano.middle) * self.metres_a_grain();
        self.volcanoes_near(at).iter().any(|volcano| volcano.is_porous(off(volcano)))
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

    #[test]
    #[ignore = "temporary"]
    fn list() {
        let fields = Fields::of_preset("world", 3, |_| {});
        let km = 1e3 / fields.metres_a_grain();
        let side = (4000.0 * km) as i64;
        let start = std::time::Instant::now();
        let all = fields.volcanoes_in([Point { x: -side, y: -side }, Point { x: side, y: side }]);
        println!("{} volcanoes {:?}", all.len(), start.elapsed());
        for v in &all {
            let land = fields.geography().unwrap().land_at_large(&[v.middle])[0];
            println!(
                "{:?} at {:.1},{:.1} km R {:.0} H {:.0} age {:.2} cones {} flows {} volcanism {:.2} rift {:.2} uplift {:.2} inland {:.0} km",
                v.kind,
                v.middle.x as f64 / km,
                v.middle.y as f64 / km,
                v.radius_m,
                v.height_m,
                v.age,
                v.cinder_cones.len(),
                v.flows.len(),
                land.volcanism,
                land.rift,
                land.uplift,
                fields.inland_m(v.middle) / 1e3
            );
        }
    }
}
