//! Progress of long work, for display while it runs.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::clock::Clock;
use crate::stop::Stop;

/// Progress of a bake or a map, and where its time goes. Workers report it from any thread, and a waiting thread reads
/// it.
#[derive(Debug, Default)]
pub struct Watch {
    stage: Mutex<Option<CurrentStage>>,
    done: AtomicU64,
    /// Number of things that an earlier run has done: they count as done, but not towards the rate.
    skipped: AtomicU64,
    /// Processor time by stage.
    pub clock: Clock,
    /// Durations of the stages that have ended.
    ended: Clock,
}

/// The stage under way.
#[derive(Clone, Copy, Debug)]
struct CurrentStage {
    name: &'static str,
    of: Option<(u64, &'static str)>,
    /// When the stage began, and how many things were done by then.
    since: Instant,
    first: u64,
}

/// Progress of a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// The stage's activity, such as `planning roads`.
    pub stage: &'static str,
    /// Number of things done.
    pub done: u64,
    /// Number of things in all and their name, such as `tiles`; `None` where nothing is counted.
    pub of: Option<(u64, &'static str)>,
    /// Things done per second since the stage began; `None` in its first second and where nothing is counted.
    pub rate: Option<f64>,
}

/// Least duration of a stage after which its rate means anything.
const LEAST: Duration = Duration::from_secs(1);

impl Watch {
    /// Creates the watch of work that a stop ends.
    pub fn stopped_by(stop: &Stop) -> Watch {
        Watch { clock: Clock::stopped_by(stop), ..Watch::default() }
    }

    /// Begins a stage with nothing done, of so many things if they are counted.
    pub fn begin(&self, name: &'static str, of: Option<(u64, &'static str)>) {
        let mut stage = self.stage.lock().expect("no thread panics while it names a stage");
        self.done.store(0, Ordering::Relaxed);
        self.skipped.store(0, Ordering::Relaxed);
        let old = stage.replace(CurrentStage { name, of, since: Instant::now(), first: 0 });
        self.end(old);
    }

    /// Begins a stage that continues the count of the stage before it, at a rate of its own.
    pub fn go_on(&self, name: &'static str) {
        let mut stage = self.stage.lock().expect("no thread panics while it names a stage");
        let first = self.done.load(Ordering::Relaxed);
        let of = stage.and_then(|stage| stage.of);
        let old = stage.replace(CurrentStage { name, of, since: Instant::now(), first });
        self.end(old);
    }

    fn end(&self, stage: Option<CurrentStage>) {
        if let Some(CurrentStage { name, since, .. }) = stage {
            self.ended.book(name, since.elapsed());
        }
    }

    /// Returns where the time has gone, the longest first: processor time where it is known, else the durations of the
    /// stages, of which the latest ends here.
    pub fn stages(&self) -> Vec<(String, Duration)> {
        let known = self.clock.stages();
        if !known.is_empty() {
            return known;
        }
        let last = self.stage.lock().expect("no thread panics while it names a stage").take();
        self.end(last);
        self.ended.stages()
    }

    /// Counts so many things as done. Returns how many were done before.
    pub fn add(&self, done: u64) -> u64 {
        self.done.fetch_add(done, Ordering::Relaxed)
    }

    /// Counts so many things as done by an earlier run: they do not enter the rate of this run.
    pub fn skip(&self, done: u64) {
        self.skipped.fetch_add(done, Ordering::Relaxed);
    }

    /// Returns the progress of the latest stage, or `None` before the first.
    pub fn progress(&self) -> Option<Progress> {
        let stage = self.stage.lock().expect("no thread panics while it names a stage");
        let CurrentStage { name, of, since, first } = (*stage)?;
        let (done, elapsed) = (self.done.load(Ordering::Relaxed), since.elapsed());
        let rate = (of.is_some() && elapsed >= LEAST).then(|| (done - first) as f64 / elapsed.as_secs_f64());
        let done = done + self.skipped.load(Ordering::Relaxed);
        Some(Progress { stage: name, done, of, rate })
    }
}

impl Progress {
    /// Returns the share of things done, 0 to 1; `None` where nothing is counted.
    pub fn share(&self) -> Option<f64> {
        self.of.map(|(of, _)| self.done as f64 / of.max(1) as f64)
    }

    /// Returns the seconds until all is done at the stage's own rate; `None` while the rate is unknown or 0.
    pub fn seconds_left(&self) -> Option<f64> {
        let rate = self.rate.filter(|rate| *rate > 0.0)?;
        self.of.map(|(of, _)| of.saturating_sub(self.done) as f64 / rate)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn a_stage_counts_anew_unless_it_goes_on() {
        let watch = Watch::default();
        assert_eq!(watch.progress(), None);
        watch.begin("planning roads", Some((8, "tiles")));
        assert_eq!(watch.add(2), 0);
        watch.go_on("baking tiles");
        assert_eq!(watch.add(1), 2);
        let tiles = watch.progress().unwrap();
        assert_eq!((tiles.stage, tiles.done, tiles.of), ("baking tiles", 3, Some((8, "tiles"))));
        watch.begin("finishing files", None);
        let files = watch.progress().unwrap();
        assert_eq!((files.done, files.share(), files.seconds_left()), (0, None, None));
        // Without processor time the stages themselves are told.
        let told = watch.stages().into_iter().map(|(stage, _)| stage).collect::<BTreeSet<String>>();
        assert_eq!(told, ["planning roads", "baking tiles", "finishing files"].map(String::from).into());
        watch.clock.book("relief", Duration::from_secs(1));
        assert_eq!(watch.stages(), [("relief".to_owned(), Duration::from_secs(1))]);
    }

    #[test]
    fn time_left_is_known_from_the_rate_of_the_stage_alone() {
        let watch = Watch::default();
        watch.begin("planning roads", Some((8, "tiles")));
        watch.add(2);
        watch.go_on("baking tiles");
        let begun = watch.progress().unwrap();
        assert_eq!((begun.share(), begun.rate, begun.seconds_left()), (Some(0.25), None, None));
        assert_eq!(Progress { rate: Some(0.0), ..begun }.seconds_left(), None);
        assert_eq!(Progress { rate: Some(0.5), ..begun }.seconds_left(), Some(12.0));
        // Neither the things done before the stage began nor those of an earlier run enter its rate.
        watch.skip(3);
        let mut stage = watch.stage.lock().unwrap();
        let long_ago = stage.unwrap().since.checked_sub(Duration::from_secs(10));
        stage.as_mut().unwrap().since = long_ago.unwrap();
        drop(stage);
        watch.add(1);
        assert!((0.09..=0.1).contains(&watch.progress().unwrap().rate.unwrap()));
    }
}
