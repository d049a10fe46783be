//! A temporary folder in which tests run the command, and what it has left behind.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use serde_json::Value;
use tempfile::TempDir;
use terrane::export::Manifest;

/// A world that bakes in milliseconds. Tests replace lines of it by number, so the numbers matter.
pub const SMALL: &str = "\
# A small world for tests
tile_cells = 16

[[noise]]
kind = \"ridged\"
height_m = 200.0
wavelength_m = 300.0
octaves = 4
";

/// A temporary folder in which the command runs, with the small world as `small.toml`.
pub struct Desk(TempDir);

/// What a run of the command has left behind.
pub struct Outcome {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Desk {
    pub fn new() -> Desk {
        let desk = Desk(tempfile::tempdir().unwrap());
        desk.write("small.toml", SMALL);
        desk
    }

    pub fn root(&self) -> &Path {
        self.0.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.root().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), content).unwrap();
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_terrane"));
        command.args(arguments).current_dir(self.0.path()).stdin(Stdio::null());
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Outcome {
        self.command(arguments).output().unwrap().into()
    }

    /// Runs what must succeed.
    pub fn done(&self, arguments: &[&str]) -> Outcome {
        let outcome = self.run(arguments);
        assert_eq!(outcome.code, Some(0), "{arguments:?}\n{outcome}");
        outcome
    }

    /// Runs what must be refused as the user's mistake, with all of `words` in the message and nothing written.
    pub fn refused(&self, arguments: &[&str], words: &[&str]) -> Outcome {
        self.refuses(&mut self.command(arguments), words)
    }

    pub fn refuses(&self, command: &mut Command, words: &[&str]) -> Outcome {
        let before = self.everything();
        let outcome = Outcome::from(command.output().unwrap());
        outcome.check_refusal(command, words);
        assert_eq!(self.everything(), before, "{command:?} has written something\n{outcome}");
        outcome
    }

    /// All files and folders, with the size and the time of the last change of each file.
    pub fn everything(&self) -> BTreeMap<PathBuf, Option<(u64, SystemTime)>> {
        let mut found = BTreeMap::new();
        walk(self.0.path(), &mut |path| {
            let metadata = fs::symlink_metadata(path).unwrap();
            let file = metadata.is_file().then(|| (metadata.len(), metadata.modified().unwrap()));
            found.insert(path.to_owned(), file);
        });
        found
    }

    pub fn manifest(&self, folder: &str) -> Manifest {
        let text = fs::read(self.path(folder).join("bake.json")).expect("the bake has left its manifest");
        serde_json::from_slice(&text).expect("a manifest can be read back")
    }
}

impl From<Output> for Outcome {
    fn from(output: Output) -> Outcome {
        let text = |bytes| String::from_utf8(bytes).expect("messages are UTF-8");
        Outcome { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

impl Outcome {
    pub fn check_refusal(&self, command: &Command, words: &[&str]) {
        assert_eq!(self.code, Some(2), "{command:?}\n{self}");
        for word in words {
            assert!(self.stderr.contains(word), "{command:?} does not say {word:?}\n{self}");
        }
    }

    /// Standard output as one JSON object.
    pub fn object(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{error}\n{self}"))
    }

    /// What there is to say in the end: on a busy machine progress comes before it.
    pub fn last_object(&self) -> Value {
        self.objects().pop().unwrap_or_else(|| panic!("nothing is said\n{self}"))
    }

    /// Standard output as JSON objects, one a line.
    pub fn objects(&self) -> Vec<Value> {
        let object = |line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error} in {line:?}\n{self}"));
        self.stdout.lines().map(object).collect()
    }
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "exit code {:?}\n--- stdout\n{}\n--- stderr\n{}", self.code, self.stdout, self.stderr)
    }
}

/// Calls `visit` for everything in a folder and in its folders.
pub fn walk(folder: &Path, visit: &mut impl FnMut(&Path)) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        visit(&path);
        if path.is_dir() && !path.is_symlink() {
            walk(&path, visit);
        }
    }
}

/// The files in a folder and in its folders, with `/` between the parts of their paths, but for the log of a bake's
/// runs, which no two bakes have the same.
pub fn files_in(folder: &Path) -> BTreeSet<String> {
    let mut files = BTreeSet::new();
    walk(folder, &mut |path| {
        if path.is_file() && !path.ends_with("runs.jsonl") {
            let inside = path.strip_prefix(folder).unwrap();
            let parts: Vec<_> = inside.iter().map(|part| part.to_str().unwrap()).collect();
            files.insert(parts.join("/"));
        }
    });
    files
}

/// No command takes this long unless it hangs.
pub const PATIENCE: Duration = Duration::from_mins(1);

/// A running command, killed when the test is done with it.
pub struct Running(pub Child);

impl Running {
    #[cfg(unix)]
    pub fn signal(&self, name: &str) {
        // The shell's own `kill`: no other program is needed. One that is no more is no fault here.
        let kill = format!("kill -{name} {}", self.0.id());
        Command::new("sh").args(["-c", &kill]).stderr(Stdio::null()).status().unwrap();
    }

    pub fn exit_code(&mut self) -> Option<i32> {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Some(status) = self.0.try_wait().unwrap() {
                return status.code();
            }
            thread::sleep(Duration::from_millis(2));
        }
        panic!("the command still runs after {PATIENCE:?}");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        _ = self.0.kill();
        _ = self.0.wait();
    }
}
