//! A queue of requests, and the threads that serve it.
//!
//! Whoever asks gets a [`Ticket`], and may wait for it or drop it. A product that several ask for is made once. Once
//! all its tickets are dropped, a job is removed from the queue, or stopped if it is under way.

use std::collections::{HashMap, VecDeque};
use std::future::Future;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::pin::Pin;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::task::{Context, Poll};
use std::thread;
use std::time::Duration;

use axum::http::StatusCode;
use tokio::sync::oneshot;

use crate::clock::Clock;
use crate::error::Error;
use crate::explore::request::Failure;
use crate::stop::Stop;

/// The bytes that a job makes for the page, in parts.
pub(super) type Product = Arc<Vec<Vec<u8>>>;

/// The result of a job, as a ticket gets it.
pub(super) type Outcome = Result<Product, Failure>;

/// Interval at which a waiting thread checks whether the program is to end.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Largest number of jobs that wait in a lane.
const MOST_WAITING: usize = 256;

/// The group of threads that does a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lane {
    /// For what somebody points at: small jobs, and few of them.
    Pointer,
    /// For jobs of a second or two, which somebody waits for.
    Quick,
    /// For jobs that may take a minute.
    Slow,
}

impl Lane {
    const ALL: [Lane; 3] = [Lane::Pointer, Lane::Quick, Lane::Slow];

    /// Returns the number of threads of the lane, if each lane that draws has `drawing` threads.
    fn threads(self, drawing: usize) -> usize {
        if self == Lane::Pointer { 1 } else { drawing }
    }

    /// Returns the niceness of the lane's threads, in steps of the system: the higher it is, the less of the processor
    /// they get while threads of other lanes have work.
    #[cfg(target_os = "linux")]
    fn nicer(self) -> i32 {
        match self {
            Lane::Pointer => 0,
            Lane::Quick => 5,
            Lane::Slow => 10,
        }
    }
}

/// Three lanes of threads, and the jobs that wait for them.
#[derive(Debug)]
pub(super) struct Queue {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    come: Condvar,
    /// The stop of all jobs and of the threads.
    stop: Stop,
}

#[derive(Debug, Default)]
struct State {
    lanes: [VecDeque<blake3::Hash>; Lane::ALL.len()],
    jobs: HashMap<blake3::Hash, Job>,
    /// Number of jobs and tickets so far, so that each gets a number of its own.
    count: u64,
}

struct Job {
    number: u64,
    lane: Lane,
    /// The work; `None` once a thread has taken it.
    work: Option<Work>,
    stop: Stop,
    waiting: Vec<(u64, oneshot::Sender<Outcome>)>,
}

type Work = Box<dyn FnOnce(&Clock) -> Result<Product, Error> + Send>;

impl std::fmt::Debug for Job {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Job")
            .field("number", &self.number)
            .field("waiting", &self.waiting.len())
            .finish_non_exhaustive()
    }
}

/// A claim to the outcome of a job. Dropping the last ticket of a job stops the job.
#[derive(Debug)]
pub(super) struct Ticket {
    key: blake3::Hash,
    number: u64,
    outcome: oneshot::Receiver<Outcome>,
    shared: Arc<Shared>,
}

impl Queue {
    /// Starts the given number of threads for each lane that draws, and one for the pointer lane. They end with the
    /// queue, or when the process is to end.
    ///
    /// # Errors
    /// When the system cannot start that many threads.
    pub fn start(threads: usize, process: &Stop) -> Result<Queue, Error> {
        let shared = Shared { state: Mutex::default(), come: Condvar::new(), stop: process.child() };
        let queue = Queue { shared: Arc::new(shared) };
        let all: Vec<Lane> =
            Lane::ALL.into_iter().flat_map(|lane| std::iter::repeat_n(lane, lane.threads(threads))).collect();
        for lane in &all {
            let (lane, shared) = (*lane, queue.shared.clone());
            thread::Builder::new().name(format!("{lane:?}")).spawn(move || shared.serve(lane)).map_err(|error| {
                Error::Option {
                    message: format!("{} threads cannot be started: {error}", all.len()),
                    hint: "give fewer with --threads".into(),
                }
            })?;
        }
        Ok(queue)
    }

    /// Tells whether no job waits or is under way.
    pub fn is_idle(&self) -> bool {
        self.shared.state().jobs.is_empty()
    }

    /// Asks for the product that a digest names. `work` makes it, unless somebody else has asked for the same product.
    ///
    /// # Errors
    /// When too many jobs wait in the lane.
    pub fn ask(
        &self,
        lane: Lane,
        key: blake3::Hash,
        work: impl FnOnce(&Clock) -> Result<Product, Error> + Send + 'static,
    ) -> Result<Ticket, Failure> {
        let mut state = self.shared.state();
        if !state.jobs.contains_key(&key) {
            if state.lanes[lane as usize].len() >= MOST_WAITING {
                return Err(Failure::new(
                    StatusCode::SERVICE_UNAVAILABLE,
                    "too much is asked for at once",
                    "ask again in a second",
                ));
            }
            state.count += 1;
            let number = state.count;
            let (work, stop): (Work, _) = (Box::new(work), self.shared.stop.child());
            state.jobs.insert(key, Job { number, lane, work: Some(work), stop, waiting: Vec::new() });
            state.lanes[lane as usize].push_back(key);
        }
        state.count += 1;
        let number = state.count;
        let (sender, outcome) = oneshot::channel();
        state.jobs.get_mut(&key).expect("it is there now").waiting.push((number, sender));
        drop(state);
        self.shared.come.notify_all();
        Ok(Ticket { key, number, outcome, shared: self.shared.clone() })
    }
}

impl Drop for Queue {
    fn drop(&mut self) {
        self.shared.stop.request();
        self.shared.come.notify_all();
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no thread panics while it looks at the queue")
    }

    /// Does the jobs of a lane until the program is to end.
    fn serve(&self, lane: Lane) {
        #[cfg(target_os = "linux")]
        // If the system refuses, all lanes get the same share of the processor.
        let _ = rustix::process::nice(lane.nicer());
        // Drawing uses rayon. Give it a pool of this thread alone, so that a job takes no time of other lanes.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        let _pool = pool.expect("a pool of one thread that is there already starts none");
        loop {
            let mut state = self.state();
            let (key, number, work, stop) = loop {
                if self.stop.is_requested() {
                    return;
                }
                // If the job of a key was removed, go on with the next key.
                if let Some(key) = state.lanes[lane as usize].pop_front() {
                    let taken = state.jobs.get_mut(&key).and_then(|job| {
                        let work = job.work.take()?;
                        Some((key, job.number, work, job.stop.clone()))
                    });
                    match taken {
                        Some(taken) => break taken,
                        None => continue,
                    }
                }
                let waited = self.come.wait_timeout(state, LOOK_INTERVAL);
                state = waited.expect("no thread panics while it looks at the queue").0;
            };
            drop(state);
            // A panic must not end the thread: it has other jobs to do.
            let done = catch_unwind(AssertUnwindSafe(|| work(&Clock::stopped_by(&stop))));
            let outcome = match done {
                Ok(done) => done.map_err(Failure::from),
                Err(_) => Err(Failure::broken("this could not be drawn: that is a fault of the program")),
            };
            let mut state = self.state();
            // If all tickets were dropped and somebody asked anew, the job of this key is another one.
            if state.jobs.get(&key).is_some_and(|job| job.number == number) {
                let job = state.jobs.remove(&key).expect("it was there");
                drop(state);
                for (_, sender) in job.waiting {
                    // An error means that the ticket was dropped: nobody is left to tell.
                    _ = sender.send(outcome.clone());
                }
            }
        }
    }
}

impl Future for Ticket {
    type Output = Outcome;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Outcome> {
        let closed = || Err(Failure::new(StatusCode::SERVICE_UNAVAILABLE, "the explorer is closing", ""));
        Pin::new(&mut self.outcome).poll(context).map(|outcome| outcome.unwrap_or_else(|_| closed()))
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        let mut state = self.shared.state();
        let Some(job) = state.jobs.get_mut(&self.key) else { return };
        let before = job.waiting.len();
        job.waiting.retain(|(number, _)| *number != self.number);
        if job.waiting.is_empty() && before > 0 {
            let job = state.jobs.remove(&self.key).expect("it was there");
            job.stop.request();
            state.lanes[job.lane as usize].retain(|key| *key != self.key);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::mpsc::channel;
    use std::time::Instant;

    fn key(number: u32) -> blake3::Hash {
        blake3::hash(&number.to_le_bytes())
    }

    fn wait(ticket: Ticket) -> Outcome {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        runtime.block_on(async { tokio::time::timeout(Duration::from_secs(20), ticket).await.unwrap() })
    }

    fn product(byte: u8) -> Product {
        Arc::new(vec![vec![byte]])
    }

    #[test]
    fn what_several_ask_for_is_made_once() {
        let queue = Queue::start(1, &Stop::default()).unwrap();
        let made = Arc::new(AtomicUsize::new(0));
        let (go, gone) = channel();
        let count = made.clone();
        let first = queue.ask(Lane::Quick, key(1), move |_| {
            gone.recv().unwrap();
            count.fetch_add(1, Ordering::Relaxed);
            Ok(product(1))
        });
        let second = queue.ask(Lane::Quick, key(1), |_| unreachable!("somebody else has asked"));
        go.send(()).unwrap();
        assert_eq!(wait(first.unwrap()).unwrap()[0], [1]);
        assert_eq!(wait(second.unwrap()).unwrap()[0], [1]);
        assert_eq!(made.load(Ordering::Relaxed), 1);
        // A later request makes the product anew.
        assert_eq!(wait(queue.ask(Lane::Quick, key(1), |_| Ok(product(2))).unwrap()).unwrap()[0], [2]);
    }

    #[test]
    fn what_nobody_waits_for_is_stopped_or_never_begun() {
        let queue = Queue::start(1, &Stop::default()).unwrap();
        let (begun, begins) = channel();
        let endless = move |clock: &Clock| {
            begun.send(()).unwrap();
            loop {
                clock.check()?;
                thread::sleep(Duration::from_millis(1));
            }
        };
        let running = queue.ask(Lane::Slow, key(1), endless).unwrap();
        begins.recv().unwrap();
        let waiting = queue.ask(Lane::Slow, key(2), |_| unreachable!("nobody wants it")).unwrap();
        let last = queue.ask(Lane::Slow, key(3), |_| Ok(product(3))).unwrap();
        // The other lane does not wait for the endless job.
        assert!(wait(queue.ask(Lane::Quick, key(4), |_| Ok(product(4))).unwrap()).is_ok());
        drop(waiting);
        drop(running);
        let since = Instant::now();
        assert_eq!(wait(last).unwrap()[0], [3]);
        assert!(since.elapsed() < Duration::from_secs(5));
        assert!(queue.shared.state().jobs.is_empty());
    }

    #[test]
    fn what_is_pointed_at_waits_for_nothing_that_is_drawn() {
        let queue = Queue::start(2, &Stop::default()).unwrap();
        let (go, gone) = channel::<()>();
        let gone = Arc::new(Mutex::new(gone));
        // More jobs than threads in both lanes that draw.
        let lanes = [Lane::Quick, Lane::Slow].into_iter().flat_map(|lane| [lane; 4]);
        let drawn: Vec<Ticket> = lanes
            .zip(0..)
            .map(|(lane, number)| {
                let gone = gone.clone();
                let wait = move |_: &Clock| {
                    _ = gone.lock().unwrap().recv();
                    Ok(product(0))
                };
                queue.ask(lane, key(number), wait).unwrap()
            })
            .collect();
        assert_eq!(wait(queue.ask(Lane::Pointer, key(100), |_| Ok(product(1))).unwrap()).unwrap()[0], [1]);
        drop(go);
        for ticket in drawn {
            assert!(wait(ticket).is_ok());
        }
    }

    #[test]
    fn what_is_wrong_is_told_and_the_rest_goes_on() {
        let queue = Queue::start(1, &Stop::default()).unwrap();
        let refused = |_: &Clock| Err(Error::Option { message: "no such thing".into(), hint: "another".into() });
        let failure = wait(queue.ask(Lane::Quick, key(1), refused).unwrap()).unwrap_err();
        assert_eq!(failure.status, StatusCode::UNPROCESSABLE_ENTITY);
        let panic = queue.ask(Lane::Quick, key(2), |_| std::panic::resume_unwind(Box::new("a bug"))).unwrap();
        assert_eq!(wait(panic).unwrap_err().status, StatusCode::INTERNAL_SERVER_ERROR);
        assert!(wait(queue.ask(Lane::Quick, key(3), |_| Ok(product(1))).unwrap()).is_ok());
    }

    #[test]
    fn no_more_waits_than_there_is_room_for() {
        let queue = Queue::start(1, &Stop::default()).unwrap();
        let (go, gone) = channel::<()>();
        let (begun, begins) = channel();
        let first = queue.ask(Lane::Slow, key(0), move |_| {
            begun.send(()).unwrap();
            _ = gone.recv();
            Ok(product(0))
        });
        begins.recv().unwrap();
        let ask = |number| queue.ask(Lane::Slow, key(number), |_| Ok(product(1)));
        let tickets: Vec<Ticket> = (1..=MOST_WAITING as u32).map(|number| ask(number).unwrap()).collect();
        assert_eq!(ask(9999).unwrap_err().status, StatusCode::SERVICE_UNAVAILABLE);
        assert!(ask(5).is_ok(), "that is asked for already");
        drop(go);
        assert!(wait(first.unwrap()).is_ok());
        for ticket in tickets {
            assert!(wait(ticket).is_ok());
        }
    }
}
