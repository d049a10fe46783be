//! The results of all walks as one record, from which tables, charts and the JSON file are made.

use std::time::Duration;

use serde::Serialize;

use crate::experiment::{
    Configuration, ExperimentOptions, FRAME_RATES, Machine, Method, Series, Summary, TTest, ThesisRow, WalkResult,
};

/// All results of an experiment.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The version of terrane.
    pub terrane: &'static str,
    /// The GPU that has computed the land of some tiles, if any.
    pub gpu: Option<String>,
    /// The machine that the experiment ran on.
    #[serde(flatten)]
    pub machine: Machine,
    /// Threads that terrane's own configurations may use unless they name fewer; the baseline has one.
    pub threads: usize,
    /// Minutes that the camera walks, in its own time.
    pub minutes: f64,
    /// Speed of the camera in metres a second.
    pub speed_m_s: f64,
    /// One record for each tile size.
    pub walks: Vec<WalkRecord>,
}

/// The results for a tile size.
#[derive(Clone, Debug, Serialize)]
pub struct WalkRecord {
    /// Cells a tile side.
    pub tile_cells: u32,
    /// One record for each configuration.
    pub methods: Vec<MethodRecord>,
    /// Tests of pairs of configurations: each pair that differs in one thing, and the baseline with each configuration
    /// that makes the same tiles.
    pub comparisons: Vec<Comparison>,
}

/// The results of a configuration.
#[derive(Clone, Debug, Serialize)]
pub struct MethodRecord {
    /// The configuration: method, engine, layers, step and threads.
    #[serde(flatten)]
    pub configuration: Configuration,
    /// Number of tiles of an expansion, on average.
    pub tiles: f64,
    /// Milliseconds of an expansion.
    pub milliseconds: Summary,
    /// The thesis' result for a similar configuration, in milliseconds of an expansion.
    pub thesis_ms: Option<f64>,
    /// Mean of the baseline divided by the mean of this configuration.
    pub speedup: Option<f64>,
    /// Median of the baseline divided by the median of this configuration, which a busy machine disturbs least.
    pub speedup_of_medians: Option<f64>,
    /// Tells for each frame rate whether an expansion fits into a frame.
    pub real_time: Vec<RealTime>,
    /// Processor time of each stage, the longest first.
    pub stages: Vec<StageRecord>,
}

/// Verdict on a frame rate: whether an expansion fits into a frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct RealTime {
    /// Frames a second.
    pub frames_a_second: u32,
    /// Milliseconds that a frame may take, as the thesis rounds them.
    pub frame_ms: f64,
    /// True if an expansion fits on average.
    pub by_mean: bool,
    /// True if 99 of 100 expansions fit.
    pub by_percentile_99: bool,
}

/// A stage's share of the processor time.
#[derive(Clone, Debug, Serialize)]
pub struct StageRecord {
    /// Name of the stage.
    pub stage: String,
    /// Milliseconds of processor time in an expansion.
    pub milliseconds: f64,
    /// Share of the time of all stages, 0 to 1.
    pub share: f64,
}

/// Two configurations compared.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Comparison {
    /// The first configuration.
    pub first: Configuration,
    /// The second one.
    pub second: Configuration,
    /// Student's test, as in the thesis; none where the test says nothing.
    pub student: Option<TTest>,
    /// Welch's test; none where the test says nothing.
    pub welch: Option<TTest>,
}

impl Report {
    /// Sums up walks that were made with `options` on `threads` threads.
    pub fn new(options: &ExperimentOptions, threads: usize, walks: &[WalkResult]) -> Report {
        Report {
            terrane: env!("CARGO_PKG_VERSION"),
            gpu: walks.iter().find_map(|walk| walk.gpu.clone()),
            machine: Machine::here(),
            threads,
            minutes: options.minutes,
            speed_m_s: options.speed_m_s,
            walks: walks.iter().map(WalkRecord::new).collect(),
        }
    }
}

impl WalkRecord {
    fn new(walk: &WalkResult) -> WalkRecord {
        let baseline = walk.series.iter().find(|series| series.configuration.method == Method::Baseline);
        let methods: Vec<MethodRecord> =
            walk.series.iter().map(|series| MethodRecord::new(series, walk.tile_cells, baseline)).collect();
        // Compare each pair that differs in one thing, in the order of the tables, and the baseline with each
        // configuration that makes the same tiles.
        let pairs = (0..methods.len()).flat_map(|a| (a + 1..methods.len()).map(move |b| (a, b)));
        let pairs = pairs.filter(|(a, b)| {
            let [first, second] = [a, b].map(|index| methods[*index].configuration);
            match second.method {
                Method::Baseline => first.expands_as(second),
                _ => first.differences(second) == 1,
            }
        });
        let comparisons = pairs.map(|(a, b)| {
            let (first, second) = (&methods[a], &methods[b]);
            Comparison {
                first: first.configuration,
                second: second.configuration,
                student: TTest::student(&first.milliseconds, &second.milliseconds),
                welch: TTest::welch(&first.milliseconds, &second.milliseconds),
            }
        });
        WalkRecord { tile_cells: walk.tile_cells, comparisons: comparisons.collect(), methods }
    }
}

impl MethodRecord {
    fn new(series: &Series, tile_cells: u32, baseline: Option<&Series>) -> MethodRecord {
        let milliseconds = summary_of(series);
        // A speedup needs timings and a baseline that makes the same tiles. The baseline itself has none.
        let is_like = |baseline: &&Series| {
            series.configuration.method != Method::Baseline && series.configuration.expands_as(baseline.configuration)
        };
        let baseline = baseline.filter(is_like).filter(|_| milliseconds.n > 0).map(summary_of);
        let real_time = |(frames_a_second, frame_ms)| RealTime {
            frames_a_second,
            frame_ms,
            by_mean: milliseconds.mean <= frame_ms,
            by_percentile_99: milliseconds.percentile_99 <= frame_ms,
        };
        let stages = &series.stages;
        let total_s: f64 = stages.iter().map(|(_, spent)| spent.as_secs_f64()).sum();
        let stage = |(stage, spent): &(String, Duration)| StageRecord {
            stage: stage.clone(),
            milliseconds: spent.as_secs_f64() * 1e3 / milliseconds.n.max(1) as f64,
            share: spent.as_secs_f64() / total_s,
        };
        let thesis_ms = ThesisRow::of(tile_cells).and_then(|row| row.milliseconds(series.configuration));
        let tiles: usize = series.timings.iter().map(|timing| timing.tiles).sum();
        MethodRecord {
            configuration: series.configuration,
            tiles: tiles as f64 / series.timings.len() as f64,
            milliseconds,
            thesis_ms,
            speedup: baseline.as_ref().map(|baseline| baseline.mean / milliseconds.mean),
            speedup_of_medians: baseline.map(|baseline| baseline.median / milliseconds.median),
            real_time: FRAME_RATES.into_iter().map(real_time).collect(),
            stages: stages.iter().map(stage).collect(),
        }
    }
}

fn summary_of(series: &Series) -> Summary {
    let values: Vec<f64> = series.timings.iter().map(|timing| timing.elapsed_ms).collect();
    Summary::of(&values)
}
