//! The probe: tests whether a GPU gives the bits of the CPU, because no rule guarantees it.

use std::sync::Arc;

use serde::Deserialize;

use super::adapter::{Adapter, Gpu};
use super::bands::LandJob;
use super::noise::NoiseMaker;
use crate::area::{Area, MAX_COORDINATE, Stride, TileId};
use crate::clock::Clock;
use crate::device::GROUP_SIDE;
use crate::grid::Grid;
use crate::land::Land;
use crate::lines::{self, Bed, Imprint, Line, LineEnd, LineId, LineKind, LinePoint};
use crate::preset::ground::GroundSettings;
use crate::relief::NoiseRelief;
use crate::relief::settings::{LandMask, NoiseTerm, WarpSettings};
use crate::tile::{GroundRule, RUBBLE_REACH, TileSurface};

/// Sides of the compared tiles: they contain whole blocks and parts of blocks.
const SIDES: [usize; 2] = [200, 100];

/// Width in vertices of the land around a tile: the reach of rubble, and one more for the slope of the rock where it
/// comes from.
const PAD: usize = RUBBLE_REACH + 1;

/// Tests whether a GPU makes land of noise and tiles of it with the bits of the CPU: with every kind of fractal and
/// waves of all lengths, warped, through curves and masks; with rivers and roads, and with every kind of ground that
/// needs no water.
///
/// # Errors
/// A sentence that names the first difference, or the limit of the GPU that is exceeded.
pub fn probe(adapter: &Adapter) -> Result<(), String> {
    let gpu = Arc::new(Gpu::open(adapter, GROUP_SIDE)?);
    let Probed { relief, ground } = toml::from_str(include_str!("probe.toml")).expect("what a preset may say");
    let rule = GroundRule::new(&ground, Some(0.0), 1.0, 9);
    relief.into_iter().try_for_each(|settings| {
        let relief = settings.relief();
        NoiseMaker::new(Arc::clone(&gpu), Arc::new(relief), rule.clone()).probe()
    })
}

/// Settings of land and ground that use every feature of the kernels.
#[derive(Deserialize)]
struct Probed {
    relief: Vec<ReliefSettings>,
    ground: GroundSettings,
}

#[derive(Deserialize)]
struct ReliefSettings {
    noise: Vec<NoiseTerm>,
    warp: Option<WarpSettings>,
    land: Option<LandMask>,
}

impl ReliefSettings {
    fn relief(self) -> NoiseRelief {
        let ReliefSettings { mut noise, warp, land } = self;
        noise.iter_mut().for_each(NoiseTerm::fill_defaults);
        NoiseRelief::new(&noise, warp.as_ref(), land.as_ref(), (1.0, Stride::ONE), 9)
    }
}

/// Makes an agent's line across an area that begins at `origin`, with a bend, and with pieces of zero and of very small
/// length.
fn line(origin: [i64; 2], bed: Bed, floor_m: f64) -> Line {
    let kind = if matches!(bed, Bed::Dug { .. }) { LineKind::River } else { LineKind::Road };
    let places = [[-20.0, 70.0], [3.5, 41.25], [3.5, 41.25], [60.7, 45.1], [61.0, 45.0], [120.3, 11.9], [230.0, 60.0]];
    let point = |(number, place): (usize, &[f64; 2])| LinePoint {
        place: *place,
        level_m: floor_m - number as f64,
        floor_m: floor_m - number as f64,
        half_width_m: 1.0 + 0.5 * number as f64,
        discharge_m3s: 0.0,
        basin_m2: 0.0,
    };
    let points: Vec<LinePoint> = places.iter().enumerate().map(point).collect();
    let id = LineId::Agent { kind, owner: TileId { x: 0, y: 0 } };
    Line {
        id,
        kind,
        class: None,
        name: None,
        course: id,
        origin,
        bounds: lines::bounds(origin, &points, 16.0),
        points,
        structures: Vec::new(),
        end: LineEnd::Nothing,
        bed,
        spacing_m: 1.0,
    }
}

/// A tile to compare.
struct Compared {
    cells: Area,
    lines: Vec<Line>,
}

impl Compared {
    fn land(&self) -> Area {
        self.cells.padded(PAD)
    }

    fn job(&self) -> LandJob {
        NoiseMaker::tile_job(self.cells, self.land(), &self.lines).expect("agents' lines have banks")
    }
}

impl NoiseMaker {
    /// Compares land, normals and ground of several tiles, near to the origin and far from it, with those of the CPU.
    ///
    /// # Errors
    /// A sentence that names the first difference.
    pub fn probe(&self) -> Result<(), String> {
        let near = [(0, 0), (-517, 211), (70_001, -40_003)];
        let far = [(1 << 31, -(1 << 33)), (-(1 << 47) - 5, 1 << 50), (MAX_COORDINATE - 300, -MAX_COORDINATE + 77)];
        let [width, height] = SIDES;
        let tile = |(number, (x, y)): (usize, (i64, i64))| {
            let beds = [
                Bed::Dug { bank_m: 9.0 },
                Bed::Trodden { shoulder_m: 4.0, graded: true },
                Bed::Trodden { shoulder_m: 2.5, graded: false },
            ];
            // None, one, two or three lines.
            let lines = beds.into_iter().take(number % 4).zip([[x, y], [x + 7, y - 9], [x + 30, y + 2]]);
            let lines = lines.map(|(bed, origin)| line(origin, bed, 40.0)).collect();
            Compared { cells: Area::new(x, y, width, height), lines }
        };
        let tiles: Vec<Compared> = near.into_iter().chain(far).enumerate().map(tile).collect();
        self.compare(&tiles)
    }

    /// Calls `compare` with each tile as the GPU makes it, and as the CPU makes it.
    fn each(
        &self,
        tiles: &[Compared],
        mut compare: impl FnMut((Grid<f32>, TileSurface), (Grid<f32>, TileSurface)) -> Result<(), String>,
    ) -> Result<(), String> {
        let jobs: Vec<LandJob> = tiles.iter().map(Compared::job).collect();
        let nothing = || self.gpu.trouble().unwrap_or_else(|| format!("{}: does not take tiles", self.gpu.name));
        for (tile, made) in tiles.iter().zip(Clock::unstopped(|clock| self.make(&jobs, clock)).ok_or_else(nothing)?) {
            let mut heights = Clock::unstopped(|clock| self.relief.heights(tile.land(), clock));
            let imprint = Imprint::new(&heights, None, &tile.lines);
            if let Some(imprint) = &imprint {
                imprint.shape(&mut heights, None);
            }
            let land = Land { heights, water: None };
            let surface =
                Clock::unstopped(|clock| TileSurface::new(&self.rule, None, &land, imprint, tile.cells, clock));
            compare(made.into_parts(&tile.lines), (land.heights, surface))?;
        }
        Ok(())
    }

    fn compare(&self, tiles: &[Compared]) -> Result<(), String> {
        let gpu = self.gpu.name.as_str();
        self.each(tiles, |(made_m, made), (reference_m, surface)| {
            equal((gpu, "height"), &made_m, &reference_m, f32::to_bits)?;
            let axes = ["east", "up", "south"].into_iter().zip(made.normals.axes()).zip(surface.normals.axes());
            for ((name, made), reference) in axes {
                equal((gpu, &format!("normal ({name})")), made, reference, f32::to_bits)?;
            }
            equal((gpu, "slope"), made.normals.slope(), surface.normals.slope(), f32::to_bits)?;
            equal((gpu, "ground"), made.blend.ground(), surface.blend.ground(), |word| word)?;
            equal((gpu, "cover"), made.blend.cover(), surface.blend.cover(), |word| word)?;
            if let (Some(made), Some(reference)) = (&made.imprint, &surface.imprint) {
                if let (Some(made), Some(reference)) = (made.sand(), reference.sand()) {
                    equal((gpu, "sand"), made, reference, f32::to_bits)?;
                }
                for (made, reference) in made.dirt().zip(reference.dirt()) {
                    equal((gpu, "dirt"), made, reference, f32::to_bits)?;
                }
                if let (Some(made), Some(reference)) = (made.dug(), reference.dug()) {
                    equal((gpu, "cut"), &made.cut_m, &reference.cut_m, f32::to_bits)?;
                    equal((gpu, "water"), &made.water, &reference.water, f32::to_bits)?;
                }
            }
            Ok(())
        })
    }
}

/// Compares a grid made by a GPU with that of the CPU, bit by bit.
fn equal<T: Copy + std::fmt::Display>(
    (gpu, what): (&str, &str),
    made: &Grid<T>,
    reference: &Grid<T>,
    bits: fn(T) -> u32,
) -> Result<(), String> {
    let pairs = made.area().vertices().zip(made.values().iter().zip(reference.values()));
    for ((x, y), (made, reference)) in pairs {
        if bits(*made) != bits(*reference) {
            return Err(format!("{gpu}: the {what} at {x}, {y} is {made} there, and {reference} on the CPU"));
        }
    }
    Ok(())
}
