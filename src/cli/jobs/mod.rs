//! Jobs that bake a region in shards: from a template for each of the job schedulers Slurm and Kubernetes, and as plain
//! commands for any other program. The commands of two shards differ only in the number of the shard. A command that
//! fails may be run again until it succeeds, and no shard waits for another.

use std::fmt::Write;

use crate::cli::args::Scheduler;
use crate::export::Bytes;
use crate::shell::quoted;

/// A bake in shards, and the resources that each shard takes.
pub(super) struct ShardedBake {
    /// Words of the command that bakes the whole region, without the option `--out`.
    pub bake: Vec<String>,
    /// The folder of the bake.
    pub out: String,
    /// Number of shards.
    pub shards: u64,
    /// Number of threads of a shard.
    pub threads: usize,
    /// Largest number of bytes of memory that a shard takes.
    pub memory_bytes: u64,
    /// Estimated number of seconds that a shard takes.
    pub seconds: f64,
    /// Largest number of bytes of memory that the merge takes.
    pub merge_memory_bytes: u64,
    /// Name of the container image that the pods run, for Kubernetes only.
    pub image: String,
    /// Name of the persistent volume claim whose volume all pods share, for Kubernetes only.
    pub claim: String,
}

/// Largest size of a job array that Slurm accepts by default.
const ARRAY: u64 = 1000;

/// Number of times that a failed shard is started again.
const RETRIES: u64 = 3;

impl ShardedBake {
    /// Returns the text of the job for a scheduler.
    pub fn text(&self, engine: Scheduler) -> String {
        match engine {
            Scheduler::Slurm => self.slurm(),
            Scheduler::Kubernetes => self.kubernetes(),
            Scheduler::Commands => self.commands(),
        }
    }

    fn slurm(&self) -> String {
        // Ask for more time than estimated: nodes may be slower than this machine, or busy with other jobs.
        let minutes = (3.0 * self.seconds / 60.0).ceil() as u64 + 15;
        let head = self.head("Run it where sbatch is: bash FILE");
        let fields = [
            ("minutes", minutes.to_string()),
            ("array", ARRAY.to_string()),
            ("folder", quoted(&self.shards_folder())),
            ("shard", self.shard("\"$number\"")),
            ("merge", self.merge()),
        ];
        self.filled(include_str!("slurm.sh"), &head, &fields)
    }

    fn kubernetes(&self) -> String {
        let head = self.head(
            "kubectl apply -f FILE; and when job/terrane-shards is complete:\n\
             # kubectl patch job terrane-merge --patch '{\"spec\":{\"suspend\":false}}'",
        );
        let json = |text: &str| serde_json::to_string(text).expect("a text is JSON");
        let shard = self.shard("\"$((JOB_COMPLETION_INDEX + 1))\"");
        let fields = [
            ("image", json(&self.image)),
            ("claim", json(&self.claim)),
            ("shard", json(&format!("exec {shard}"))),
            ("merge", json(&format!("exec {}", self.merge()))),
        ];
        self.filled(include_str!("kubernetes.yaml"), &head, &fields)
    }

    /// Returns one command per line: first one for each shard, then the merge. The commands of shards may run in any
    /// order and in parallel; the merge must run after all of them.
    fn commands(&self) -> String {
        let mut text =
            self.head("Any program may run the lines, in any order and side by side, but for the last: the merge.");
        text.push('\n');
        for number in 1..=self.shards {
            _ = writeln!(text, "{}", self.shard(&number.to_string()));
        }
        text + &self.merge() + "\n"
    }

    /// Fills in the fields of a template: the given ones, and those that all templates share.
    fn filled(&self, template: &str, head: &str, fields: &[(&str, String)]) -> String {
        let shared = [
            ("head", head.to_owned()),
            ("shards", self.shards.to_string()),
            ("threads", self.threads.to_string()),
            ("retries", RETRIES.to_string()),
            ("memory_mib", self.memory_bytes.div_ceil(1 << 20).to_string()),
            ("merge_memory_mib", self.merge_memory_bytes.div_ceil(1 << 20).to_string()),
        ];
        // Go through the template once, from start to end. The values that are filled in are not searched for fields,
        // because a name that the user chose, such as the folder's, may look like a field.
        let mut text = String::new();
        let mut rest = template;
        while let Some(at) = rest.find('{') {
            let (before, after) = rest.split_at(at);
            text += before;
            let name = after[1..].split('}').next().expect("there is a first part");
            let field = shared.iter().chain(fields).find(|(field, _)| *field == name);
            let (shown, passed) = field.map_or(("{", 1), |(field, value)| (value, field.len() + 2));
            text += shown;
            rest = &after[passed..];
        }
        text + rest
    }

    /// Returns the comment lines at the top: what the job does, and how to run it.
    fn head(&self, run: &str) -> String {
        let ShardedBake { shards, threads, memory_bytes, seconds, out, .. } = self;
        let minutes = (seconds / 60.0).ceil();
        format!(
            "# Shards: {shards}, of about {minutes} min and at most {} of memory on {threads} threads each; then the merge into {}.\n\
             # {run}\n# It may be run again: what is baked is not baked again.",
            Bytes(*memory_bytes),
            quoted(out)
        )
    }

    /// Returns the command of a shard. `number` is pasted into the command, so it is a number or a shell variable.
    fn shard(&self, number: &str) -> String {
        let words: Vec<String> = self.bake.iter().map(|word| quoted(word)).collect();
        let (words, of, folder) = (words.join(" "), self.shards, self.folder(number));
        format!("terrane {words} --shard {number}/{of} --resume --quiet --out {folder}")
    }

    fn merge(&self) -> String {
        format!("terrane merge {} --resume --quiet --out {}", self.folder("*"), quoted(&self.out))
    }

    /// Returns the folder of a shard, quoted for a shell. `number` stands outside the quotes: it is a number, a shell
    /// variable, or `*` for the folders of all shards.
    fn folder(&self, number: &str) -> String {
        format!("{}/{number}of{}", quoted(&self.shards_folder()), self.shards)
    }

    fn shards_folder(&self) -> String {
        format!("{}.shards", self.out)
    }
}
