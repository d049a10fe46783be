//! The warp: a displacement of the plane that bends the straight lines of the network, and crests and hillsides with
//! them.
//!
//! The land at a vertex is the land of the network's plane at that vertex displaced by smooth noise. The displacement
//! changes by less than a vertex from one vertex to the next, so the plane is bent but never folded: lines that do not
//! cross in the network do not cross in the world.

use std::sync::Arc;

use glam::DVec2;

use crate::area::{Area, Stride};
use crate::fluvial::fields::Fields;
use crate::geometry::bilinear;
use crate::grain_point::{GRAINS, Point};
use crate::hash::{self, Stream};
use crate::memory::{Memory, Remembers};
use crate::noise::{Fractal, FractalKind, FractalSpec};

/// Displacements east and south of all vertices.
#[derive(Debug)]
pub struct Warp {
    /// Noise on the lattice of the vertices, of every second vertex, every fourth and so on, each with the octaves that
    /// its nodes can show. Coarser lattices have no entry and are not displaced.
    axes: Vec<[Fractal; 2]>,
    distance_m: f32,
    spacing_m: f64,
    patches: Memory<(i64, i64), [Vec<f32>; 2]>,
}

/// Nodes of an area, with the displacement at which each is read in the network's plane.
#[derive(Clone, Debug)]
pub struct Displaced {
    /// The nodes.
    pub area: Area,
    /// Vertices from one node to the next, a power of two; with 1 the nodes are the vertices.
    pub step: i64,
    /// Metres by which each node is displaced, east and south.
    pub metres: [Vec<f32>; 2],
}

impl Displaced {
    /// Returns the metres by which a node is displaced, given its number in the order of the area's vertices.
    pub fn displacement_m(&self, index: usize) -> DVec2 {
        DVec2::new(self.metres[0][index].into(), self.metres[1][index].into())
    }

    /// Returns the least and the greatest displacement in metres of the nodes of a part, east and south.
    pub fn extremes(&self, part: Area) -> [[f32; 2]; 2] {
        const LANES: usize = 8;
        let (mut least, mut greatest) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
        for axis in [0, 1] {
            let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
            let mut take = |values: &[f32]| {
                for ((low, high), value) in low.iter_mut().zip(&mut high).zip(values) {
                    // Not `min` and `max`, which also check for NaN.
                    *low = if *value < *low { *value } else { *low };
                    *high = if *value > *high { *value } else { *high };
                }
            };
            for y in part.y0..part.y1 {
                let first = self.area.index(part.x0, y);
                let mut groups = self.metres[axis][first..first + part.width()].chunks_exact(LANES);
                groups.by_ref().for_each(&mut take);
                take(groups.remainder());
            }
            least[axis] = low.into_iter().fold(f32::INFINITY, f32::min);
            greatest[axis] = high.into_iter().fold(f32::NEG_INFINITY, f32::max);
        }
        [least, greatest]
    }
}

/// Octaves of the displacement, and wavelength of the longest in cells of the finest level: from the valleys of the
/// middle levels down to little more than those of the finest. With H above 1, each octave bends the plane less than
/// the one before.
const OCTAVES: u32 = 5;
const LONGEST: f64 = 16.0;
const H: f64 = 1.6;

/// Least wavelength, in nodes, of an octave that nodes show: the shortest octaves move a place by only a few metres.
const LEAST_WAVE: f64 = 1.0;

/// Cells a side of a cached patch of displacements.
const PATCH: i64 = 64;

impl Warp {
    pub fn new(fields: &Fields, seed: u64) -> Warp {
        let spacing_m = fields.spacing_m();
        let finest_m = fields.side(fields.levels() - 1) as f64 * fields.metres_a_grain();
        let wavelength_m = LONGEST * finest_m;
        let axes = |power: u32| {
            let node_m = spacing_m * f64::from(1 << power);
            let shown = |octaves: &u32| wavelength_m / f64::from(1 << (octaves - 1)) >= LEAST_WAVE * node_m;
            let octaves = (1..=OCTAVES).take_while(shown).last()?;
            let spec = FractalSpec { kind: FractalKind::Fbm, octaves, wavelength_m, lacunarity: 2.0, h: H };
            let fractal = |stream: Stream| Fractal::new(&spec, node_m, hash::stream(seed, stream));
            Some([fractal(Stream::FluvialWarpEast), fractal(Stream::FluvialWarpSouth)])
        };
        Warp {
            axes: (0..=Stride::MAX_POWER).map_while(axes).collect(),
            distance_m: (1.1 * fields.settings().bend * finest_m) as f32,
            spacing_m,
            patches: Memory::new(24 << 20),
        }
    }

    /// Returns the caches of the warp.
    pub(super) fn memories(&self) -> Vec<&dyn Remembers> {
        vec![&self.patches]
    }

    /// Returns the displacements in metres of the nodes of an area, east and south. Nodes are every `step`th vertex, a
    /// power of two.
    pub fn fill(&self, area: Area, step: i64) -> Displaced {
        let mut metres = [vec![0.0; area.len()], vec![0.0; area.len()]];
        if let Some(axes) = self.axes.get(step.trailing_zeros() as usize) {
            for (fractal, metres) in axes.iter().zip(&mut metres) {
                fractal.fill(area, None, metres);
                for metres in metres {
                    *metres *= self.distance_m;
                }
            }
        }
        Displaced { area, step, metres }
    }

    /// Returns the rectangle of the network's plane in which the nodes of an area are read, those past its edges
    /// included.
    pub fn input(&self, area: Area, step: i64) -> [Point; 2] {
        let pad = (DVec2::from(self.most_m()) / self.spacing_m * GRAINS as f64).ceil();
        let [low, high] = [(area.x0, area.y0), (area.x1, area.y1)].map(|(x, y)| Point::at_vertex(x * step, y * step));
        [low.moved(-pad), high.moved(pad)]
    }

    /// Greatest displacement in metres, east and south.
    pub fn most_m(&self) -> [f64; 2] {
        self.axes[0].each_ref().map(|fractal| {
            let (low, high) = fractal.bounds();
            (low.abs().max(high.abs()) * self.distance_m) as f64
        })
    }

    /// Returns a reader for the displacement of single points.
    pub fn points(&self) -> WarpPoints<'_> {
        WarpPoints { warp: self, last: None }
    }
}

/// The displacement of single points close to each other: it keeps the last patch.
#[derive(Debug)]
pub struct WarpPoints<'a> {
    warp: &'a Warp,
    last: Option<LastPatch>,
}

/// The column and row of a patch, and its displacements in metres east and south.
type LastPatch = ((i64, i64), Arc<[Vec<f32>; 2]>);

impl WarpPoints<'_> {
    /// Returns the point of the world that is displaced to a point of the network.
    ///
    /// Solved by Newton's method: where the plane is bent most, a fixed-point iteration diverges.
    pub fn undo(&mut self, network: Point) -> Point {
        self.undo_from(network, network)
    }

    /// Does the same, starting from a place: the closer it is, the fewer steps are needed.
    pub fn undo_from(&mut self, network: Point, mut world: Point) -> Point {
        const STEPS: usize = 40;
        const SHORTEST: f64 = 1.0 / 64.0;
        const LEAST_AREA: f64 = 1.0 / 64.0;
        let missing = |world: Point, by: DVec2| network.from(world) - by;
        let mut by = self.at(world);
        let mut left = missing(world, by);
        for _ in 0..STEPS {
            // The derivatives: how the displaced point changes one vertex east and one vertex south of here.
            let vertex = GRAINS as f64;
            let [east, south] =
                [DVec2::X, DVec2::Y].map(|axis| (axis * vertex + self.at(world.moved(axis * vertex)) - by) / vertex);
            // A least determinant, so that no step leaves the world where the plane is nearly folded.
            let area = east.perp_dot(south).max(LEAST_AREA);
            let way = DVec2::new(left.perp_dot(south), east.perp_dot(left)) / area;
            // Shorten the step while the whole step would overshoot.
            let shares = std::iter::successors(Some(1.0), |share| Some(share / 2.0));
            let nexts = shares.take_while(|share| *share >= SHORTEST).map(|share| world.moved(way * share));
            let nearer = nexts.take_while(|next| *next != world).find_map(|next| {
                let by = self.at(next);
                let still = missing(next, by);
                (still.length() < left.length()).then_some((next, by, still))
            });
            let Some(nearer) = nearer else { break };
            (world, by, left) = nearer;
        }
        world
    }

    /// Returns the displacement in grains of any point, interpolated between the four vertices around it.
    fn at(&mut self, point: Point) -> DVec2 {
        let vertex = (point.x.div_euclid(GRAINS), point.y.div_euclid(GRAINS));
        let patch = (vertex.0.div_euclid(PATCH), vertex.1.div_euclid(PATCH));
        let side = PATCH as usize + 1;
        let metres = match &mut self.last {
            Some((last, metres)) if *last == patch => metres,
            last => {
                let area = Area::new(patch.0 * PATCH, patch.1 * PATCH, side, side);
                let metres = self.warp.patches.get(patch, || self.warp.fill(area, 1).metres);
                &mut last.insert((patch, metres)).1
            }
        };
        let first = (vertex.1.rem_euclid(PATCH) as usize) * side + vertex.0.rem_euclid(PATCH) as usize;
        let [u, v] = [point.x, point.y].map(|grains| grains.rem_euclid(GRAINS) as f64 / GRAINS as f64);
        let corners = [first, first + 1, first + side, first + side + 1];
        let metres = metres.each_ref().map(|metres| bilinear(corners.map(|corner| metres[corner].into()), [u, v]));
        DVec2::from(metres) / self.warp.spacing_m * GRAINS as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_displaced_is_found_again() {
        for (name, seed) in [("highlands", 2), ("plains", 3), ("archipelago", 1)] {
            let warp = Warp::new(&Fields::of_preset(name, seed, |_| {}), seed);
            let mut points = warp.points();
            // The test covers a whole region, as the plane is bent most in few places.
            for place in 0..64 * 64 {
                let world = Point::at_vertex(place % 64 * 32, place / 64 * 32);
                let network = world.moved(points.at(world));
                let again = points.undo(network);
                let off = again.moved(points.at(again)).distance(network);
                assert!(off < 4.0, "{name}, seed {seed}: {world:?} is missed by {off} grains");
            }
        }
    }
}
