//! Processor time of a bake, stage by stage.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::stop::{Stop, Stopped};

/// The stages of a tile, by the names under which reports show them.
pub mod stage {
    /// Heights of noise relief.
    pub const RELIEF: &str = "relief";
    /// Channels in and around an area.
    pub const NETWORK: &str = "network";
    /// Domain warp: positions of the vertices in the plane of the network.
    pub const WARP: &str = "warp";
    /// Valley sides that rise from the channels.
    pub const VALLEYS: &str = "valleys";
    /// Gullies in the hillsides between the channels.
    pub const GULLIES: &str = "gullies";
    /// Moraines around the ends of glaciers that have gone.
    pub const MORAINES: &str = "moraines";
    /// The cones of volcanoes.
    pub const CONES: &str = "cones";
    /// Barriers: bars of sand across drowned valleys.
    pub const BARRIERS: &str = "barriers";
    /// Glaciers in the heads of high valleys.
    pub const GLACIERS: &str = "glaciers";
    /// Coast and sea floor.
    pub const COAST: &str = "coast";
    /// Breaches: cuts through which hollows of the land drain.
    pub const BREACHES: &str = "breaches";
    /// Dunes of sand seas.
    pub const DUNES: &str = "dunes";
    /// Drumlins, eskers and dolines.
    pub const GROUND_FORMS: &str = "ground forms";
    /// Ice sheets of whole countries.
    pub const ICE_SHEETS: &str = "ice sheets";
    /// River beds, lakes and the sea, cut into the land.
    pub const WATER: &str = "water";
    /// Rivers, roads and settlements: tracing or planning them, or finding those that are remembered.
    pub const LINES: &str = "lines";
    /// Imprint: the land shaped to the beds of rivers and roads.
    pub const IMPRINT: &str = "imprint";
    /// Upload of data about land and tiles to a GPU.
    pub const GPU_LOADS: &str = "GPU: told";
    /// Waiting for a GPU to finish its work.
    pub const GPU_WAITS: &str = "GPU: waited for";
    /// Reading results back from a GPU.
    pub const GPU_READS: &str = "GPU: read";
    /// Normals.
    pub const NORMALS: &str = "normals";
    /// Blend weights.
    pub const BLEND: &str = "blend";
}

/// Processor time per named stage, added up over all threads, and the [stop](crate::stop) of the work.
///
/// Stages themselves are pure functions; their callers hold the clock.
#[derive(Debug, Default)]
pub struct Clock {
    stages: Mutex<BTreeMap<String, Duration>>,
    stop: Stop,
}

impl Clock {
    /// Creates the clock of work that a stop ends.
    pub fn stopped_by(stop: &Stop) -> Clock {
        Clock { stop: stop.clone(), ..Clock::default() }
    }

    /// Does work that nobody stops, and returns its result.
    pub fn unstopped<R>(work: impl FnOnce(&Clock) -> Result<R, Stopped>) -> R {
        work(&Clock::default()).expect("nobody has the stop of this clock")
    }

    /// Returns the stop of the work.
    pub fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Looks at the stop of the work.
    ///
    /// # Errors
    /// When the work is to end.
    #[inline]
    pub fn check(&self) -> Result<(), Stopped> {
        self.stop.check()
    }

    /// Runs `work`, books its duration under `stage` and returns its result.
    ///
    /// # Errors
    /// When the work is to end, before it begins.
    pub fn time<R>(&self, stage: &str, work: impl FnOnce() -> R) -> Result<R, Stopped> {
        self.check()?;
        let start = Instant::now();
        let result = work();
        self.book(stage, start.elapsed());
        Ok(result)
    }

    /// Books a time under a stage.
    pub fn book(&self, stage: &str, spent: Duration) {
        let mut stages = self.stages.lock().expect("no thread panics while it books a time");
        match stages.get_mut(stage) {
            Some(total) => *total += spent,
            None => _ = stages.insert(stage.to_owned(), spent),
        }
    }

    /// Returns the time booked so far per stage, the longest first.
    pub fn stages(&self) -> Vec<(String, Duration)> {
        let stages = self.stages.lock().expect("no thread panics while it books a time");
        let mut list: Vec<_> = stages.iter().map(|(stage, spent)| (stage.clone(), *spent)).collect();
        list.sort_by_key(|(_, spent)| std::cmp::Reverse(*spent));
        list
    }
}
