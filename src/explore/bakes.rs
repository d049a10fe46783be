//! Bakes that the page asks for: the command line, what it would take, and how far one is.
//!
//! The command that the page shows is the one that runs, as a program of its own: what it needs, and what becomes of it, is no matter of
//! those who look at the map.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::explore::request::{Failure, Status};
use crate::explore::worlds::{Opened, Recipe};
use crate::export::{Export, Profile};
use crate::shell::quoted;

/// Bakes that run at a time.
const MOST_RUNNING: usize = 2;

/// Tiles a side of what a page bakes at most.
const MOST_TILES: u64 = 1 << 20;

/// A rectangle that is to be baked.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Order {
    /// The identity of its world.
    pub world: String,
    /// Its north-western tile, and its size in tiles.
    pub at: [i64; 2],
    pub size: [u64; 2],
    /// Every how manyth vertex.
    #[serde(default = "one")]
    pub scale: u32,
    /// The program that the files are for, if it is a certain one.
    #[serde(default)]
    pub profile: Option<String>,
    /// Files beside those of the profile; without one they are the files of any bake.
    #[serde(default)]
    pub exports: Option<String>,
    /// What becomes of a bake that is in the folder.
    #[serde(default)]
    pub mode: Mode,
    /// Whether the command alone is wanted, without what it takes.
    #[serde(default)]
    pub quick: bool,
}

/// What becomes of a bake that is in the folder already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Mode {
    /// There must be none.
    #[default]
    New,
    /// It is replaced.
    Overwrite,
    /// It was cut off, and goes on.
    Resume,
}

impl Mode {
    fn option(self) -> Option<&'static str> {
        match self {
            Mode::New => None,
            Mode::Overwrite => Some("--overwrite"),
            Mode::Resume => Some("--resume"),
        }
    }
}

fn one() -> u32 {
    1
}

/// What is known of a bake.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Progress {
    state: &'static str,
    stage: Option<String>,
    done: u64,
    of: Option<u64>,
    seconds_left: Option<f64>,
    /// The folder, when it is there.
    out: Option<String>,
    error: Option<Failure>,
}

/// States of a bake whose program has not ended.
const RUNNING: &str = "running";
const STOPPING: &str = "stopping";

impl Progress {
    fn is_alive(&self) -> bool {
        [RUNNING, STOPPING].contains(&self.state)
    }
}

struct Running {
    child: Child,
    progress: Progress,
}

/// All bakes since the explorer was started, by their number from 1.
pub(super) struct Bakes {
    program: PathBuf,
    all: Arc<Mutex<Vec<Running>>>,
}

impl Bakes {
    pub fn new(program: PathBuf) -> Bakes {
        Bakes { program, all: Arc::default() }
    }

    /// The arguments of the command that bakes a rectangle of a world.
    ///
    /// # Errors
    /// When it is none.
    pub fn arguments(order: &Order, opened: &Opened) -> Result<Vec<String>, Failure> {
        let Order { at, size, scale, profile, exports, .. } = order;
        if size.iter().any(|side| !(1..=MOST_TILES).contains(side)) {
            return Err(Failure::new(Status::Malformed, format!("size: expected 1 to {MOST_TILES} tiles a side"), ""));
        }
        // What is no export, or no profile, would be an option to the command.
        let of = |error| Failure::of(&error);
        exports.as_deref().map(Export::parse_list).transpose().map_err(of)?;
        let profile = profile.as_deref().map(Profile::from_str).transpose().map_err(of)?;
        let Recipe { seed, set, .. } = &opened.recipe;
        let mut arguments = vec!["bake".to_owned(), opened.source.clone()];
        if seed.is_some() {
            arguments.extend(["--seed".to_owned(), opened.world.seed().to_string()]);
        }
        arguments.extend(set.iter().flat_map(|setting| ["--set".to_owned(), setting.clone()]));
        arguments.push(format!("--at={},{}", at[0], at[1]));
        arguments.extend(["--size".to_owned(), format!("{}x{}", size[0], size[1])]);
        if *scale != 1 {
            arguments.extend(["--scale".to_owned(), format!("1/{scale}")]);
        }
        if let Some(profile) = profile {
            arguments.extend(["--profile".to_owned(), profile.name().to_owned()]);
        }
        if let Some(exports) = exports.as_ref().filter(|exports| profile.is_some() || *exports != Export::DEFAULT) {
            arguments.extend(["--export".to_owned(), exports.clone()]);
        }
        Ok(arguments)
    }

    /// What a bake would take, as a dry run tells it; and why it may not be baked as things are, if that is so: as a rule the folder
    /// holds something.
    ///
    /// # Errors
    /// When it cannot be baked at all.
    pub fn plan(&self, arguments: &[String]) -> Result<(Value, Option<Failure>), Failure> {
        let output = self.command(arguments).arg("--dry-run").output().map_err(|error| cannot_start(&error))?;
        let messages = String::from_utf8_lossy(&output.stdout);
        let messages: Vec<Value> = messages.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let of = |kind: &str| messages.iter().find(|message| message["type"] == kind);
        match (of("plan"), of("error")) {
            (Some(plan), error) => Ok((plan.clone(), error.map(said))),
            (None, Some(error)) => Err(said(error)),
            (None, None) => Err(Failure::new(Status::Broken, "the command has said nothing", "")),
        }
    }

    /// Begins to bake; returns the number of the bake.
    ///
    /// # Errors
    /// When too many bakes run, or it cannot be started.
    pub fn begin(&self, arguments: &[String], mode: Mode) -> Result<usize, Failure> {
        let mut all = self.all();
        let running = all.iter().filter(|bake| bake.progress.is_alive()).count();
        if running >= MOST_RUNNING {
            return Err(Failure::new(
                Status::Conflict,
                format!("{running} bakes are under way"),
                "wait, or cancel one",
            ));
        }
        let mut command = self.command(arguments);
        command.args(mode.option());
        command.stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().map_err(|error| cannot_start(&error))?;
        let messages = child.stdout.take().expect("it is piped");
        let progress =
            Progress { state: RUNNING, stage: None, done: 0, of: None, seconds_left: None, out: None, error: None };
        all.push(Running { child, progress });
        let (index, shared) = (all.len() - 1, self.all.clone());
        drop(all);
        let listen = move || listen(messages, &shared, index);
        // Where no thread can be started nobody listens, and it is not known how far it is.
        _ = thread::Builder::new().spawn(listen);
        Ok(index + 1)
    }

    /// How far a bake is.
    ///
    /// # Errors
    /// When there is none of that number.
    pub fn progress(&self, number: u64) -> Result<Progress, Failure> {
        let all = self.all();
        let index = (number as usize).wrapping_sub(1);
        all.get(index).map(|bake| bake.progress.clone()).ok_or_else(Failure::missing)
    }

    /// Stops a bake, as an interrupt does: what it has made is kept, and the same command with `--resume` goes on with it.
    ///
    /// # Errors
    /// When there is none of that number.
    pub fn cancel(&self, number: u64) -> Result<Progress, Failure> {
        let mut all = self.all();
        let bake = all.get_mut((number as usize).wrapping_sub(1)).ok_or_else(Failure::missing)?;
        if bake.progress.state == RUNNING {
            bake.progress.state = STOPPING;
            interrupt(&mut bake.child);
        }
        Ok(bake.progress.clone())
    }

    /// The map in the folder of a bake that is done.
    ///
    /// # Errors
    /// When it is not done, or has no map.
    pub fn map(&self, number: u64) -> Result<PathBuf, Failure> {
        let progress = self.progress(number)?;
        let out = progress.out.filter(|_| progress.state == "done");
        let out = out.ok_or_else(|| Failure::new(Status::Conflict, "this bake is not done", ""))?;
        let map = Path::new(&out).join("map/map.png");
        map.is_file().then_some(map).ok_or_else(|| Failure::new(Status::Missing, "this bake has no map", "export map"))
    }

    fn command(&self, arguments: &[String]) -> Command {
        let mut command = Command::new(&self.program);
        command.args(arguments).args(["--json"]).stdin(Stdio::null());
        command
    }

    fn all(&self) -> MutexGuard<'_, Vec<Running>> {
        self.all.lock().expect("no thread panics while it looks at bakes")
    }
}

impl Drop for Bakes {
    /// Who closes the explorer does not wait for bakes, and finds what they have made.
    fn drop(&mut self) {
        self.all().iter_mut().filter(|bake| bake.progress.state == RUNNING).for_each(|bake| interrupt(&mut bake.child));
    }
}

#[cfg(unix)]
fn interrupt(child: &mut Child) {
    use rustix::process::{Pid, Signal, kill_process};
    // One that has ended already needs no signal.
    if let Some(id) = Pid::from_raw(child.id() as i32) {
        _ = kill_process(id, Signal::INT);
    }
}

/// Bakes leave nothing that looks whole, whatever ends them.
#[cfg(not(unix))]
fn interrupt(child: &mut Child) {
    _ = child.kill();
}

/// Takes in what a bake says of itself until it ends.
fn listen(messages: impl Read, all: &Mutex<Vec<Running>>, index: usize) {
    let change = |change: &dyn Fn(&mut Running)| {
        change(&mut all.lock().expect("no thread panics while it looks at bakes")[index]);
    };
    for line in BufReader::new(messages).lines().map_while(Result::ok) {
        let Ok(message) = serde_json::from_str::<Value>(&line) else { continue };
        change(&|bake| {
            let progress = &mut bake.progress;
            match message["type"].as_str() {
                Some("progress") => {
                    progress.stage = message["stage"].as_str().map(str::to_owned);
                    progress.done = message["done"].as_u64().unwrap_or(0);
                    progress.of = message["of"].as_u64();
                    progress.seconds_left = message["seconds_left"].as_f64();
                }
                Some("done") => progress.out = message["out"].as_str().map(str::to_owned),
                Some("error") => progress.error = Some(said(&message)),
                _ => {}
            }
        });
    }
    change(&|bake| {
        let is_good = bake.child.wait().is_ok_and(|status| status.success());
        let progress = &mut bake.progress;
        progress.state = match progress.state {
            // It may have been done before it was told to stop.
            _ if is_good && progress.out.is_some() => "done",
            STOPPING => "cancelled",
            _ => {
                let silent = || Failure::new(Status::Broken, "the bake has ended without a word", "");
                progress.error.get_or_insert_with(silent);
                "failed"
            }
        };
        progress.seconds_left = None;
    });
}

/// What a command says is wrong.
fn said(error: &Value) -> Failure {
    Failure::new(
        Status::Faulty,
        error["message"].as_str().unwrap_or_default(),
        error["hint"].as_str().unwrap_or_default(),
    )
}

fn cannot_start(error: &std::io::Error) -> Failure {
    Failure::new(Status::Broken, format!("the command cannot be started: {error}"), "")
}

/// A command as one types it.
pub(super) fn typed(arguments: &[String]) -> String {
    let mut text = "terrane".to_owned();
    for argument in arguments {
        write!(text, " {}", quoted(argument)).expect("a String takes everything");
    }
    text
}
