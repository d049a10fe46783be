//! The experiment of the thesis: a camera walks, missing tiles are made around it, and each such expansion of the
//! terrain is timed.
//!
//! ```text
//!   walker/camera.rs                   time -> place: the path is fixed, so every configuration makes the same walk
//!   baseline.rs                        tile id -> the tile by the thesis' plain method: scalar, on one thread
//!   mod.rs                             options -> a WalkResult for each tile size: all timings, and the picture
//!   statistics.rs, summary.rs          WalkResults -> Report: means and deviations, t-tests, fit into a frame's time
//!   thesis.rs                          the thesis' own results
//!   machine.rs                         the machine that the experiment runs on
//!   report.rs, chart.rs, picture.rs    Report, WalkResults -> files: tables, a bar chart, the walk from above
//! ```
//!
//! All configurations of a tile size make the same step, one after another, before any makes the next step. Those of
//! terrane take turns to be first; the baseline is always last. So other work on the machine slows all configurations
//! alike, and the ratio of the times of two configurations is meaningful even on a busy machine.
//!
//! Based on: Grelsson (2014), chapters 5 to 7.

mod baseline;
mod chart;
mod machine;
mod picture;
mod report;
mod statistics;
mod summary;
mod thesis;

pub use baseline::{Baseline, BaselineTile, TableNoise};
pub use machine::Machine;
pub use report::{FILES, write_files};
pub use statistics::{Summary, TTest};
pub use summary::{Comparison, MethodRecord, RealTime, Report, StageRecord, WalkRecord};
pub use thesis::{FRAME_RATES, THESIS, ThesisRow};

use std::collections::BTreeMap;
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::ThreadPool;
use schemars::JsonSchema;
use serde::Serialize;

use crate::clock::Clock;
use crate::device::{Device, LandMaker};
use crate::error::Error;
use crate::preset::{Preset, TILE_CELLS};
use crate::stop::{Stop, Stopped};
use crate::threads::thread_pool;
use crate::walker::{Camera, Expansion, FRAMES_A_SECOND, LAYERS, Walker, WalkerOptions};
use crate::world::World;
use picture::WalkPicture;

/// Options of an experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct ExperimentOptions {
    /// Tile sizes to measure, in cells per side, each 16 to 4096. Default: those of the thesis, 64, 128, 256 and 512.
    pub sizes: Vec<u32>,
    /// Methods to measure: with agents, without, or both. Default: both.
    pub agents: Vec<bool>,
    /// Minutes that the camera walks, above 0 and up to [`MOST_MINUTES`](Camera::MOST_MINUTES), in virtual time, which
    /// stands still while tiles are made. Default: 5.
    pub minutes: f64,
    /// Speed of the camera in metres per second of virtual time. The camera may move by at most the width of the
    /// smallest tile per frame. Default: 128.
    ///
    /// The thesis does not state its camera's speed. In five minutes at 128 m/s the camera crosses about 820 edges if
    /// tiles are 64 m wide, and about 100 edges if tiles are 512 m wide: still enough for a 99th percentile.
    pub speed_m_s: f64,
    /// Devices that compute the land of tiles, each measured. Default: the CPU.
    pub engines: Vec<Engine>,
    /// Numbers of layers of tiles around the camera's tile, each 1 to 16. Default: 1, as in the thesis.
    pub layers: Vec<u32>,
    /// Numbers of tiles that a step makes. Default: all that are missing, as in the thesis.
    pub steps: Vec<Step>,
    /// Numbers of threads; `None` stands for those of the current rayon pool. Default: those of the pool.
    pub threads: Vec<Option<usize>>,
    /// True if the baseline is measured too. Default: true.
    pub baseline: bool,
}

impl Default for ExperimentOptions {
    fn default() -> ExperimentOptions {
        ExperimentOptions {
            sizes: vec![64, 128, 256, 512],
            agents: vec![true, false],
            minutes: 5.0,
            speed_m_s: 128.0,
            engines: vec![Engine::Cpu],
            layers: vec![1],
            steps: vec![Step::All],
            threads: vec![None],
            baseline: true,
        }
    }
}

impl ExperimentOptions {
    /// Checks that there is something to measure and that all values are in their ranges.
    ///
    /// # Errors
    /// When a value is out of its range, or nothing would be measured; the hint names values that are allowed.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |message: String, hint: String| Err(Error::Option { message, hint });
        if let Some(size) = self.sizes.iter().find(|size| !TILE_CELLS.contains(size)) {
            return refuse(
                format!("a tile of {size} x {size} cells cannot be measured"),
                format!("give sizes from {} to {}, such as 64,128,256,512", TILE_CELLS.start(), TILE_CELLS.end()),
            );
        }
        if self.sizes.is_empty() || self.configurations().is_empty() {
            return refuse("there is nothing to measure".into(), "give sizes such as 64,128, and agents on,off".into());
        }
        if let Some(layers) = self.layers.iter().find(|layers| !LAYERS.contains(layers)) {
            return refuse(
                format!("{layers} layers of tiles cannot be measured"),
                format!("give {} to {}, such as 1,2", LAYERS.start(), LAYERS.end()),
            );
        }
        let smallest = self.sizes.iter().min().copied().unwrap_or(*TILE_CELLS.start());
        // In the thesis' world a cell is one metre wide, so the side of a tile in cells is its side in metres.
        Camera::check(self.minutes, self.speed_m_s, f64::from(smallest))
    }

    /// Returns the configurations to measure, in the order of the tables.
    fn configurations(&self) -> Vec<Configuration> {
        let mut all = Vec::new();
        for method in [Method::Agents, Method::NoAgents] {
            if !self.agents.contains(&(method == Method::Agents)) {
                continue;
            }
            for &engine in &self.engines {
                for (&layers, &step) in
                    self.layers.iter().flat_map(|layers| self.steps.iter().map(move |step| (layers, step)))
                {
                    let of_threads =
                        |threads: &Option<usize>| Configuration { method, engine, layers, step, threads: *threads };
                    all.extend(self.threads.iter().map(of_threads));
                }
            }
        }
        all.extend(self.baseline.then(|| self.first(Method::Baseline)));
        all
    }

    /// Returns the configuration of a method on the CPU, with the first of the layers and the first of the steps.
    fn first(&self, method: Method) -> Configuration {
        let (layers, step) =
            (self.layers.first().copied().unwrap_or(1), self.steps.first().copied().unwrap_or(Step::All));
        Configuration { method, engine: Engine::Cpu, layers, step, threads: None }
    }
}

/// The device that computes the land of tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Engine {
    /// The CPU.
    Cpu,
    /// A GPU, whose threads work in square groups.
    Gpu {
        /// Threads along a side of a group: 8, 16 or 32.
        group_side: u32,
    },
}

impl Engine {
    /// Returns the maker of a world's land.
    fn maker(self, world: &World) -> Result<Arc<dyn LandMaker>, Error> {
        let (device, group_side) = match self {
            Engine::Cpu => (Device::Cpu, 0),
            Engine::Gpu { group_side } => (Device::Gpu, group_side),
        };
        device.maker(world, group_side).map(|(maker, _)| maker)
    }
}

/// Number of tiles that a step of the camera makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// All missing tiles.
    All,
    /// Only the nearest missing tile. Other missing tiles are made at the following frames, one at each.
    One,
}

/// A configuration to measure: the way tiles are made, how many at once, and on what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Configuration {
    /// Method that makes the tiles.
    pub method: Method,
    /// Device that computes their land.
    pub engine: Engine,
    /// Number of layers of tiles around the camera's tile.
    pub layers: u32,
    /// Number of tiles that a step makes.
    pub step: Step,
    /// Number of threads that the configuration may use; `None` stands for all threads of the current rayon pool. The
    /// baseline has `None` too, but uses one thread.
    pub threads: Option<usize>,
}

impl Configuration {
    /// Returns the name in tables: the method, and each other choice that differs from the thesis.
    pub fn name(self) -> String {
        let mut name = self.method.name().to_owned();
        if self.method == Method::Baseline {
            return name;
        }
        let mut add = |text: String| name += &text;
        if let Engine::Gpu { group_side } = self.engine {
            add(format!(" gpu {group_side}x{group_side}"));
        }
        if self.layers != 1 {
            add(format!(" {} layers", self.layers));
        }
        if self.step == Step::One {
            add(" tile by tile".to_owned());
        }
        match self.threads {
            None => {}
            Some(1) => add(" 1 thread".to_owned()),
            Some(threads) => add(format!(" {threads} threads")),
        }
        name
    }

    /// Returns the number of choices in which two configurations differ.
    fn differences(self, other: Configuration) -> usize {
        let differs = [
            self.method != other.method,
            self.engine != other.engine,
            self.layers != other.layers,
            self.step != other.step,
            self.threads != other.threads,
        ];
        differs.into_iter().filter(|differs| *differs).count()
    }

    /// True if both configurations make the same tiles at each step, so that their times can be compared.
    fn expands_as(self, other: Configuration) -> bool {
        (self.layers, self.step) == (other.layers, other.step)
    }
}

/// The method that makes tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// terrane's own, with rivers and roads.
    Agents,
    /// terrane's own, without rivers and roads.
    NoAgents,
    /// The thesis' plain method, without rivers and roads: [`Baseline`].
    Baseline,
}

impl Method {
    /// Returns the name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Method::Agents => "agents",
            Method::NoAgents => "no agents",
            Method::Baseline => "baseline",
        }
    }
}

/// One expansion of the terrain: the tiles that a step of the camera makes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Moment of the expansion in seconds since the start of the walk, in the camera's virtual time.
    pub time_s: f64,
    /// Number of tiles that were made.
    pub tiles: usize,
    /// Time that making them took, in milliseconds.
    pub elapsed_ms: f64,
}

/// All expansions of one configuration.
#[derive(Debug)]
pub struct Series {
    /// The configuration that is measured.
    pub configuration: Configuration,
    /// The expansions, in order.
    pub timings: Vec<Timing>,
    /// Processor time of each stage over all expansions.
    pub stages: Vec<(String, Duration)>,
}

/// The walk over tiles of one size, in all configurations.
#[derive(Debug)]
pub struct WalkResult {
    /// Cells per side of a tile.
    pub tile_cells: u32,
    /// The results of each configuration.
    pub series: Vec<Series>,
    /// The GPU that computed some of the configurations.
    pub gpu: Option<String>,
    picture: WalkPicture,
}

/// Walks over tiles of one size and measures all configurations, on the threads of the current rayon pool.
///
/// Each configuration except the baseline keeps its own tiles around the camera in memory: nine tiles if it has one
/// layer, and about 45 bytes for each vertex of a tile.
///
/// # Errors
/// When an option is out of its range, when a GPU or threads that the options name are not available, or when the work
/// is stopped.
pub fn walk(options: &ExperimentOptions, tile_cells: u32, stop: &Stop) -> Result<WalkResult, Error> {
    options.check()?;
    let world = world(tile_cells)?;
    let side_m = tile_cells as f64 * world.spacing_m();
    let camera = Camera::new([side_m / 2.0; 2], options.speed_m_s);
    let frames = (options.minutes * 60.0 * FRAMES_A_SECOND).round() as u64;
    let place = |frame: u64| camera.position_m(frame as f64 / FRAMES_A_SECOND);
    let series = |configuration| Series { configuration, timings: Vec::new(), stages: Vec::new() };
    let mut series: Vec<Series> = options.configurations().into_iter().map(series).collect();
    let makers = options.engines.iter().map(|engine| Ok((*engine, engine.maker(&world)?)));
    let makers = makers.collect::<Result<Vec<_>, Error>>()?;
    // A new walker makes the tiles around its start at once, so the time of these tiles is in no step.
    let walker = |configuration: Configuration| {
        let of = makers.iter().find(|(engine, _)| *engine == configuration.engine);
        let maker = of.map_or_else(|| Engine::Cpu.maker(&world), |(_, maker)| Ok(Arc::clone(maker)))?;
        let Configuration { method, layers, step, threads, .. } = configuration;
        let walker_options = WalkerOptions {
            agents: method == Method::Agents,
            layers,
            one_tile_a_step: step == Step::One,
            ..WalkerOptions::default()
        };
        let walker = Walker::with_maker(&world, walker_options, maker, stop)?;
        Ok(Walking { configuration, walker, pool: threads.map(thread_pool).transpose()? })
    };
    let ours = series.iter().map(|series| series.configuration).filter(|it| it.method != Method::Baseline);
    let mut walkers = ours.map(walker).collect::<Result<Vec<Walking>, Error>>()?;
    if walkers.is_empty() {
        // Only the baseline is measured. This walker is not measured: it tells which tiles the baseline has to make at
        // each step.
        walkers.push(walker(options.first(Method::NoAgents))?);
    }
    let stages_at_start: Vec<_> = walkers.iter().map(|walking| walking.walker.clock().stages()).collect();
    let baseline_clock = Clock::stopped_by(stop);
    let baseline = options.baseline.then(|| Baseline::new(&world));
    let track = (0..=frames).step_by(FRAMES_A_SECOND as usize).map(place);
    let mut picture = WalkPicture::new(track, side_m, options.first(Method::Agents).layers);
    picture.add(0, walkers[0].walker.tiles(), world.spacing_m());
    let (mut turns, mut pictured) = (0, 0);
    for frame in 1..=frames {
        let place_m = place(frame);
        let time_s = frame as f64 / FRAMES_A_SECOND;
        let mut is_idle = true;
        let mut entered_by_first = Vec::new();
        // The baseline comes last in a step, and replaces the walkers' data in the CPU's caches. This slows the first
        // walker of the next step, so the walkers take turns to be first.
        for turn in 0..walkers.len() {
            let index = (turn + turns) % walkers.len();
            let walking = &mut walkers[index];
            let configuration = walking.configuration;
            let Some(expansion) = walking.move_to(place_m)? else { continue };
            is_idle = false;
            if let Some(series) = series.iter_mut().find(|series| series.configuration == configuration) {
                let elapsed_ms = expansion.elapsed.as_secs_f64() * 1e3;
                series.timings.push(Timing { time_s, tiles: expansion.entered.len(), elapsed_ms });
            }
            if index == 0 {
                pictured += 1;
                let tiles = expansion.entered.iter().filter_map(|id| walkers[0].walker.tile(*id));
                picture.add(pictured, tiles, world.spacing_m());
                entered_by_first = expansion.entered;
            }
        }
        turns += usize::from(!is_idle);
        // If the baseline is measured, the last series is that of the baseline. The baseline makes the same tiles that
        // walker 0 has made at this step.
        if let (Some(baseline), Some(series)) = (&baseline, series.last_mut())
            && !entered_by_first.is_empty()
        {
            let start = Instant::now();
            for id in &entered_by_first {
                // Nobody reads the tile, and without `black_box` the compiler could leave out its making.
                black_box(baseline.tile(*id, &baseline_clock)?);
            }
            let elapsed_ms = start.elapsed().as_secs_f64() * 1e3;
            series.timings.push(Timing { time_s, tiles: entered_by_first.len(), elapsed_ms });
        }
    }
    if let Some(message) = makers.iter().find_map(|(_, maker)| maker.trouble()) {
        return Err(Error::Device { message, hint: "measure without it: --device cpu".into() });
    }
    // Take the time of each stage since the start.
    for series in &mut series {
        let mut walked = walkers.iter().zip(&stages_at_start);
        series.stages = match walked.find(|(walking, _)| walking.configuration == series.configuration) {
            Some((walking, before)) => since(before, walking.walker.clock().stages()),
            None => baseline_clock.stages(),
        };
    }
    let gpu = makers.iter().find(|(engine, _)| *engine != Engine::Cpu).map(|(_, maker)| maker.name());
    Ok(WalkResult { tile_cells, series, gpu, picture })
}

/// A walker that is measured, with its own pool of threads, if it has one.
struct Walking<'w> {
    configuration: Configuration,
    walker: Walker<'w>,
    pool: Option<ThreadPool>,
}

impl Walking<'_> {
    /// Moves the walker to a place in metres east and south. `None` where no tile is made.
    fn move_to(&mut self, [east_m, south_m]: [f64; 2]) -> Result<Option<Expansion>, Stopped> {
        let Walking { walker, pool, .. } = self;
        let expansion = match pool {
            Some(pool) => pool.install(|| walker.move_to(east_m, south_m)),
            None => walker.move_to(east_m, south_m),
        }?;
        Ok(expansion.filter(|expansion| !expansion.entered.is_empty()))
    }
}

/// Returns the time that each stage spent between two readings of a clock, the longest first.
fn since(before: &[(String, Duration)], after: Vec<(String, Duration)>) -> Vec<(String, Duration)> {
    let before: BTreeMap<&str, Duration> = before.iter().map(|(stage, spent)| (&stage[..], *spent)).collect();
    let spent = |(stage, spent): (String, Duration)| {
        let earlier = before.get(&stage[..]).copied().unwrap_or_default();
        (stage, spent.saturating_sub(earlier))
    };
    let mut stages: Vec<_> = after.into_iter().map(spent).collect();
    stages.sort_by_key(|(_, spent)| std::cmp::Reverse(*spent));
    stages
}

/// Makes the world of the walk: the thesis' preset with rivers and roads, in tiles of a given size.
fn world(tile_cells: u32) -> Result<World, Error> {
    let (_, mut preset) = Preset::load("thesis")?;
    preset.tile_cells = tile_cells;
    // Rivers, banks, roads and shoulders may be at most a quarter of a tile wide. Tiles smaller than those of the
    // thesis need narrower ones than the preset has.
    let most_m = tile_cells as f64 * preset.spacing_m / 4.0;
    let rivers = preset.rivers.get_or_insert_default();
    rivers.width_m = rivers.width_m.map(|width_m| width_m.min(most_m));
    rivers.bank_m = rivers.bank_m.min(most_m);
    let roads = preset.roads.get_or_insert_default();
    roads.width_m = roads.width_m.min(most_m);
    roads.shoulder_m = roads.shoulder_m.min(most_m);
    World::new(preset, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn short(sizes: &[u32]) -> ExperimentOptions {
        ExperimentOptions { sizes: sizes.to_vec(), minutes: 0.1, ..ExperimentOptions::default() }
    }

    #[test]
    fn all_configurations_of_a_walk_expand_together() {
        let options = short(&[16]);
        let walk = walk(&options, 16, &Stop::default()).unwrap();
        assert_eq!(walk.series.len(), 3);
        let steps =
            |series: &Series| -> Vec<_> { series.timings.iter().map(|timing| (timing.time_s, timing.tiles)).collect() };
        for series in &walk.series {
            assert_eq!(steps(series), steps(&walk.series[0]), "{:?}", series.configuration);
            assert!(series.timings.iter().all(|timing| timing.elapsed_ms > 0.0));
            assert!(!series.stages.is_empty(), "{:?}", series.configuration);
        }
        // A path of 768 m at thirty degrees to the tiles' sides crosses (cos + sin) * 768 / 16, about 66 edges. Near a
        // corner two edges may be crossed in one frame, which is one expansion.
        let expansions = walk.series[0].timings.len();
        assert!((55..=66).contains(&expansions), "{expansions} expansions");
        let picture = walk.picture.to_png();
        let report = Report::new(&options, 1, &[walk]);
        // One bar for each configuration; the thesis has none of this size.
        let svg = chart::chart(&report);
        assert_eq!(svg.matches("<rect").count(), 1 + 3 + 3, "the paper, the bars and the legend: {svg}");
        assert!(svg.contains(">16x16<") && svg.ends_with("</svg>\n"), "{svg}");
        // The picture has tiles, the track over them, and empty ground in the middle of the walk and around it.
        let mut reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        let share = |wanted: [u8; 3]| {
            let (pixels, _) = pixels.as_chunks::<3>();
            pixels.iter().filter(|pixel| **pixel == wanted).count() as f64 / pixels.len() as f64
        };
        assert!((0.2..0.9).contains(&share([245, 245, 243])), "{}", share([245, 245, 243]));
        assert!((0.0001..0.1).contains(&share([255; 3])), "{}", share([255; 3]));
        let report = report.to_text();
        for method in ["agents", "no agents", "baseline"] {
            assert!(report.lines().any(|line| line.starts_with("16x16") && line.contains(method)), "{report}");
        }
    }

    #[test]
    fn what_is_not_asked_for_is_not_measured() {
        let methods = |agents: &[bool], baseline| {
            let options = ExperimentOptions { agents: agents.to_vec(), baseline, ..short(&[32]) };
            let walk = walk(&options, 32, &Stop::default()).unwrap();
            walk.series.iter().map(|series| (series.configuration.method, series.timings.len())).collect::<Vec<_>>()
        };
        let count = methods(&[true], false)[0].1;
        assert_eq!(methods(&[true], false), [(Method::Agents, count)]);
        assert_eq!(methods(&[], true), [(Method::Baseline, count)]);
        assert_eq!(methods(&[false], true), [(Method::NoAgents, count), (Method::Baseline, count)]);
    }

    #[test]
    fn what_is_varied_is_measured_side_by_side() {
        let options = ExperimentOptions {
            agents: vec![true],
            layers: vec![1, 2],
            steps: vec![Step::All, Step::One],
            threads: vec![None, Some(1)],
            // The camera is slow enough that one tile a step keeps up with it.
            speed_m_s: 40.0,
            minutes: 0.2,
            ..short(&[16])
        };
        let walk = walk(&options, 16, &Stop::default()).unwrap();
        let of = |name: &str| walk.series.iter().find(|series| series.configuration.name() == name).unwrap();
        let tiles = |name: &str| of(name).timings.iter().map(|timing| timing.tiles).collect::<Vec<_>>();
        assert_eq!(walk.series.len(), 2 * 2 * 2 + 1);
        for name in ["agents", "agents 2 layers", "agents tile by tile", "agents 2 layers tile by tile"] {
            assert_eq!(tiles(name), tiles(&format!("{name} 1 thread")), "{name}");
        }
        assert_eq!(tiles("baseline"), tiles("agents"));
        // The walk that makes all missing tiles at once and the walk that makes one a step make the same tiles, except
        // for the last few, which the second walk has not made when it ends.
        let (all, one) = (tiles("agents 2 layers"), tiles("agents 2 layers tile by tile"));
        assert!(
            one.iter().all(|tiles| *tiles == 1) && all.iter().all(|tiles| (5..=9).contains(tiles)),
            "{all:?} {one:?}"
        );
        assert!(all.iter().sum::<usize>().abs_diff(one.len()) <= 9, "{all:?} {one:?}");
        let report = Report::new(&options, 2, &[walk]);
        let record = &report.walks[0];
        // Pairs that differ in one thing, and pairs with the baseline that make the same tiles.
        let of_baseline = record.comparisons.iter().filter(|it| it.second.method == Method::Baseline).count();
        assert_eq!((record.comparisons.len(), of_baseline), (12 + 2, 2));
        for method in &record.methods {
            let is_like_the_thesis = (method.configuration.layers, method.configuration.step) == (1, Step::All);
            assert_eq!(method.speedup.is_some(), is_like_the_thesis && method.configuration.method == Method::Agents);
        }
        let svg = chart::chart(&report);
        assert_eq!(svg.matches("<rect").count(), 1 + 9 + 9, "{svg}");
        let colours: std::collections::BTreeSet<String> =
            record.methods.iter().map(|method| method.configuration.colour()).collect();
        assert_eq!(colours.len(), 9, "{colours:?}");
    }

    #[test]
    fn every_size_has_a_world() {
        for tile_cells in [*TILE_CELLS.start(), 17, 64, *TILE_CELLS.end()] {
            world(tile_cells).unwrap();
        }
    }
}
