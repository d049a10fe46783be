//! Where the time of a bake goes, stage by stage.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::stop;

/// The names of the stages of a tile, wherever they are shown.
pub mod stage {
    /// Heights of relief of noise.
    pub const RELIEF: &str = "relief";
    /// The channels around an area.
    pub const NETWORK: &str = "network";
    /// Where vertices are read in the network's plane.
    pub const WARP: &str = "warp";
    /// The sides that rise from the channels.
    pub const VALLEYS: &str = "valleys";
    /// What runs down the hillsides between the channels.
    pub const GULLIES: &str = "gullies";
    /// Walls around the ends of glaciers that have gone.
    pub const MORAINES: &str = "moraines";
    /// Bars of sand across drowned valleys.
    pub const BARRIERS: &str = "barriers";
    /// Ice in the heads of high valleys.
    pub const GLACIERS: &str = "glaciers";
    /// The edge of the land and the floor of the sea.
    pub const COAST: &str = "coast";
    /// Cuts through which the land's hollows drain.
    pub const BREACHES: &str = "breaches";
    /// Beds, lakes and the sea, cut into the land.
    pub const WATER: &str = "water";
    /// Rivers, roads and settlements, found or planned.
    pub const LINES: &str = "lines";
    /// The land, shaped to the beds of lines.
    pub const IMPRINT: &str = "imprint";
    /// What a GPU is told of land and tiles.
    pub const GPU_LOADS: &str = "GPU: told";
    /// Until a GPU has made what is asked for next.
    pub const GPU_WAITS: &str = "GPU: waited for";
    /// What a GPU has made, taken over.
    pub const GPU_READS: &str = "GPU: read";
    /// Normals.
    pub const NORMALS: &str = "normals";
    /// Blend weights.
    pub const BLEND: &str = "blend";
}

/// Processor time per named stage, added up over all threads.
///
/// Stages themselves are pure functions; whoever calls them holds the clock.
#[derive(Debug, Default)]
pub struct Clock {
    stages: Mutex<BTreeMap<String, Duration>>,
}

impl Clock {
    /// What `work` returns, its time booked under `stage`. No stage begins when all is to [stop](stop::check).
    pub fn time<R>(&self, stage: &str, work: impl FnOnce() -> R) -> R {
        stop::check();
        let start = Instant::now();
        let result = work();
        self.book(stage, start.elapsed());
        result
    }

    /// Books a time under a stage.
    pub fn book(&self, stage: &str, spent: Duration) {
        let mut stages = self.stages.lock().expect("no thread panics while it books a time");
        match stages.get_mut(stage) {
            Some(total) => *total += spent,
            None => _ = stages.insert(stage.to_owned(), spent),
        }
    }

    /// The time booked so far per stage, the longest first.
    pub fn stages(&self) -> Vec<(String, Duration)> {
        let stages = self.stages.lock().expect("no thread panics while it books a time");
        let mut list: Vec<_> = stages.iter().map(|(stage, spent)| (stage.clone(), *spent)).collect();
        list.sort_by_key(|(_, spent)| std::cmp::Reverse(*spent));
        list
    }
}
