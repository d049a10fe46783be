//! Bakes that the page starts: the command line, the plan of a dry run, and the progress.
//!
//! A bake runs as a process of its own, with exactly the command that the page shows, so that its use of memory and its
//! failures do not affect those who look at the map.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::str::FromStr;
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;

use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::explore::request::Failure;
use crate::explore::worlds::{Opened, WorldRecipe};
use crate::export::{Export, Profile};
use crate::shell::quoted;

/// Largest number of bakes that run at the same time.
const MOST_RUNNING: usize = 2;

/// Largest side of a bake of the page, in tiles.
const MOST_TILES: u64 = 1 << 20;

/// A request to bake a rectangle.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Order {
    /// Identity of the world to bake.
    pub world: String,
    /// Column and row of the north-western tile; `size` is the number of columns and rows.
    pub at: [i64; 2],
    pub size: [u64; 2],
    /// Stride of the vertices: with n, the bake has every n-th vertex.
    #[serde(default = "one")]
    pub scale: u32,
    /// Name of the profile, if the files are for a certain program.
    #[serde(default)]
    pub profile: Option<String>,
    /// Exports beside those of the profile. Without a profile they replace the default exports of a bake.
    #[serde(default)]
    pub exports: Option<String>,
    /// Treatment of a bake that is already in the folder.
    #[serde(default)]
    pub mode: FolderMode,
    /// True if only the command is wanted, without the plan of a dry run.
    #[serde(default)]
    pub quick: bool,
}

/// Treatment of a bake that is already in the folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum FolderMode {
    /// Refuse: the folder must hold no bake.
    #[default]
    New,
    /// Replace the bake.
    Overwrite,
    /// Continue the bake, which was interrupted.
    Resume,
}

impl FolderMode {
    fn option(self) -> Option<&'static str> {
        match self {
            FolderMode::New => None,
            FolderMode::Overwrite => Some("--overwrite"),
            FolderMode::Resume => Some("--resume"),
        }
    }
}

fn one() -> u32 {
    1
}

/// State of a bake, as the page gets it.
#[derive(Clone, Debug, Serialize)]
pub(super) struct BakeProgress {
    state: &'static str,
    stage: Option<String>,
    done: u64,
    of: Option<u64>,
    seconds_left: Option<f64>,
    /// The folder, once the bake has reported that it is done.
    out: Option<String>,
    error: Option<Failure>,
}

/// States of a bake whose process has not ended.
const RUNNING: &str = "running";
const STOPPING: &str = "stopping";

impl BakeProgress {
    fn is_alive(&self) -> bool {
        [RUNNING, STOPPING].contains(&self.state)
    }
}

struct Running {
    child: Child,
    progress: BakeProgress,
}

/// All bakes since the explorer was started; the number of a bake is its index plus 1.
pub(super) struct Bakes {
    program: PathBuf,
    all: Arc<Mutex<Vec<Running>>>,
}

impl Bakes {
    pub fn new(program: PathBuf) -> Bakes {
        Bakes { program, all: Arc::default() }
    }

    /// Returns the arguments of the command that bakes a rectangle of a world.
    ///
    /// # Errors
    /// When the size, the profile or the exports are not valid.
    pub fn arguments(order: &Order, opened: &Opened) -> Result<Vec<String>, Failure> {
        let Order { at, size, scale, profile, exports, .. } = order;
        if size.iter().any(|side| !(1..=MOST_TILES).contains(side)) {
            return Err(Failure::malformed(format!("size: expected 1 to {MOST_TILES} tiles a side")));
        }
        // Check both: the command would take a text that is no export or profile for an option.
        exports.as_deref().map(Export::parse_list).transpose()?;
        let profile = profile.as_deref().map(Profile::from_str).transpose()?;
        let WorldRecipe { seed, set, .. } = &opened.recipe;
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

    /// Returns the plan of a bake from a dry run, and a failure if the bake cannot start as things are: as a rule
    /// because the folder holds something.
    ///
    /// # Errors
    /// When the rectangle cannot be baked at all.
    pub fn plan(&self, arguments: &[String]) -> Result<(Value, Option<Failure>), Failure> {
        let output = self.command(arguments).arg("--dry-run").output().map_err(|error| cannot_start(&error))?;
        let messages = String::from_utf8_lossy(&output.stdout);
        let messages: Vec<Value> = messages.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let of = |kind: &str| messages.iter().find(|message| message["type"] == kind);
        match (of("plan"), of("error")) {
            (Some(plan), error) => Ok((plan.clone(), error.map(said))),
            (None, Some(error)) => Err(said(error)),
            (None, None) => Err(Failure::broken("the command has said nothing")),
        }
    }

    /// Starts a bake and returns its number.
    ///
    /// # Errors
    /// When too many bakes run, or the command cannot be started.
    pub fn begin(&self, arguments: &[String], mode: FolderMode) -> Result<usize, Failure> {
        self.begin_on(thread::Builder::new(), arguments, mode)
    }

    /// Starts a bake whose messages are read by the given thread.
    fn begin_on(&self, listener: thread::Builder, arguments: &[String], mode: FolderMode) -> Result<usize, Failure> {
        let mut all = self.all();
        let running = all.iter().filter(|bake| bake.progress.is_alive()).count();
        if running >= MOST_RUNNING {
            return Err(Failure::new(
                StatusCode::CONFLICT,
                format!("{running} bakes are under way"),
                "wait, or cancel one",
            ));
        }
        let mut command = self.command(arguments);
        command.args(mode.option());
        command.stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().map_err(|error| cannot_start(&error))?;
        let messages = child.stdout.take().expect("it is piped");
        // The thread cannot look for the bake before it is there, since this function holds the lock.
        let (index, shared) = (all.len(), self.all.clone());
        if let Err(error) = listener.spawn(move || listen(messages, &shared, index)) {
            // Nobody would see the bake end: it would count as running for ever.
            _ = child.kill();
            _ = child.wait();
            return Err(cannot_start(&error));
        }
        let progress =
            BakeProgress { state: RUNNING, stage: None, done: 0, of: None, seconds_left: None, out: None, error: None };
        all.push(Running { child, progress });
        Ok(index + 1)
    }

    /// Returns the progress of a bake.
    ///
    /// # Errors
    /// When there is no bake of that number.
    pub fn progress(&self, number: u64) -> Result<BakeProgress, Failure> {
        let all = self.all();
        let index = (number as usize).wrapping_sub(1);
        all.get(index).map(|bake| bake.progress.clone()).ok_or_else(Failure::missing)
    }

    /// Stops a bake as an interrupt does: finished work is kept, and the same command with `--resume` goes on with it.
    ///
    /// # Errors
    /// When there is no bake of that number.
    pub fn cancel(&self, number: u64) -> Result<BakeProgress, Failure> {
        let mut all = self.all();
        let bake = all.get_mut((number as usize).wrapping_sub(1)).ok_or_else(Failure::missing)?;
        if bake.progress.state == RUNNING {
            bake.progress.state = STOPPING;
            interrupt(&mut bake.child);
        }
        Ok(bake.progress.clone())
    }

    /// Returns the path of the map in the folder of a finished bake.
    ///
    /// # Errors
    /// When the bake is not done, or has no map.
    pub fn map(&self, number: u64) -> Result<PathBuf, Failure> {
        let progress = self.progress(number)?;
        let out = progress.out.filter(|_| progress.state == "done");
        let out = out.ok_or_else(|| Failure::new(StatusCode::CONFLICT, "this bake is not done", ""))?;
        let map = Path::new(&out).join("map/map.png");
        map.is_file()
            .then_some(map)
            .ok_or_else(|| Failure::new(StatusCode::NOT_FOUND, "this bake has no map", "export map"))
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
    /// Interrupts all running bakes and does not wait for them. Finished work stays in their folders.
    fn drop(&mut self) {
        self.all().iter_mut().filter(|bake| bake.progress.state == RUNNING).for_each(|bake| interrupt(&mut bake.child));
    }
}

#[cfg(unix)]
fn interrupt(child: &mut Child) {
    use rustix::process::{Pid, Signal, kill_process};
    // An error is ignored: a process that has ended already needs no signal.
    if let Some(id) = Pid::from_raw(child.id() as i32) {
        _ = kill_process(id, Signal::INT);
    }
}

/// Kills the process, for lack of an interrupt. A bake leaves nothing that looks whole, whatever ends it.
#[cfg(not(unix))]
fn interrupt(child: &mut Child) {
    _ = child.kill();
}

/// Reads the messages of a bake until it ends, and updates its progress.
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
            // The bake may have been done before it was told to stop.
            _ if is_good && progress.out.is_some() => "done",
            STOPPING => "cancelled",
            _ => {
                let silent = || Failure::broken("the bake has ended without a word");
                progress.error.get_or_insert_with(silent);
                "failed"
            }
        };
        progress.seconds_left = None;
    });
}

/// Converts an error message of the command to a failure.
fn said(error: &Value) -> Failure {
    Failure::new(
        StatusCode::UNPROCESSABLE_ENTITY,
        error["message"].as_str().unwrap_or_default(),
        error["hint"].as_str().unwrap_or_default(),
    )
}

fn cannot_start(error: &std::io::Error) -> Failure {
    Failure::broken(format!("the command cannot be started: {error}"))
}

/// Returns the command line as somebody would type it.
pub(super) fn typed(arguments: &[String]) -> String {
    let mut text = "terrane".to_owned();
    for argument in arguments {
        write!(text, " {}", quoted(argument)).expect("a String takes everything");
    }
    text
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_bake_to_which_nobody_can_listen_takes_no_place() {
        let bakes = Bakes::new("sh".into());
        let arguments = ["-c", "exec sleep 60"].map(str::to_owned);
        for _ in 0..=MOST_RUNNING {
            // No system has room for such a stack.
            let listener = thread::Builder::new().stack_size(usize::MAX / 2);
            let failure = bakes.begin_on(listener, &arguments, FolderMode::New).unwrap_err();
            assert_eq!(failure.status, StatusCode::INTERNAL_SERVER_ERROR, "{}", failure.error);
        }
        assert_eq!(bakes.begin(&arguments, FolderMode::New), Ok(1));
    }
}
