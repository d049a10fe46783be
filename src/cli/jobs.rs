//! Jobs that bake in shards, as the programs that run jobs take them. Each shard is baked by the same command, which may be run as
//! often as it takes; what a shard is follows from its number alone, so none has to know of another.

use std::fmt::Write;

use crate::cli::args::Engine;
use crate::export::Bytes;
use crate::shell::quoted;

/// A bake in shards, and what each takes.
pub(super) struct Job {
    /// The command that bakes all of it, but for the folder, as words.
    pub bake: Vec<String>,
    /// The folder of the bake.
    pub out: String,
    pub shards: u64,
    /// What a shard takes: threads, bytes of memory at most, and about how many seconds.
    pub threads: usize,
    pub memory_bytes: u64,
    pub seconds: f64,
    /// Bytes of memory that the merge takes at most.
    pub merge_memory_bytes: u64,
    /// What pods are made of, and the volume that they share.
    pub image: String,
    pub claim: String,
}

/// Jobs of an array that Slurm takes by default are fewer than 1,001.
const ARRAY: u64 = 1000;

/// How often a shard is begun that does not come to its end.
const TRIES: u64 = 4;

impl Job {
    /// The job for a program.
    pub fn text(&self, engine: Engine) -> String {
        match engine {
            Engine::Slurm => self.slurm(),
            Engine::Kubernetes => self.kubernetes(),
            Engine::Parallel => self.parallel(),
            Engine::Make => self.make(),
        }
    }

    /// Lines that say what it is, and how it is run.
    fn head(&self, run: &str) -> String {
        let Job { shards, threads, memory_bytes, seconds, out, .. } = self;
        let minutes = (seconds / 60.0).ceil();
        format!(
            "# Shards: {shards}, of about {minutes} min and at most {} of memory on {threads} threads each; then the merge into {}.\n\
             # {run}\n# It may be run again: what is baked is not baked again.\n",
            Bytes(*memory_bytes),
            quoted(out)
        )
    }

    /// The folder of a shard, for the shell to put its number in.
    fn folder(&self, number: &str) -> String {
        format!("{}/{number}of{}", quoted(&self.shards_folder()), self.shards)
    }

    fn shards_folder(&self) -> String {
        format!("{}.shards", self.out)
    }

    /// The command of a shard whose number the shell puts in.
    fn shard(&self, number: &str) -> String {
        let words: Vec<String> = self.bake.iter().map(|word| quoted(word)).collect();
        let (words, of, folder) = (words.join(" "), self.shards, self.folder(number));
        format!("terrane {words} --shard {number}/{of} --resume --quiet --out {folder}")
    }

    fn merge(&self) -> String {
        format!("terrane merge {} --resume --quiet --out {}", self.folder("*"), quoted(&self.out))
    }

    fn slurm(&self) -> String {
        let Job { shards, threads, .. } = self;
        let (folder, memory) = (quoted(&self.shards_folder()), mebibytes(self.memory_bytes));
        let merge_memory = mebibytes(self.merge_memory_bytes);
        // Nodes may be slower than this machine, and others may be at work there.
        let minutes = (3.0 * self.seconds / 60.0).ceil() as u64 + 15;
        let (shard, merge) = (self.shard("\"$number\""), self.merge());
        let head = self.head("Run it where sbatch is: bash FILE");
        format!(
            "#!/usr/bin/env bash
{head}set -euo pipefail
mkdir -p {folder}
jobs=
# An array has no more than {ARRAY} jobs unless Slurm is told otherwise.
for ((first = 0; first < {shards}; first += {ARRAY})); do
    last=$(({shards} - first < {ARRAY} ? {shards} - first : {ARRAY}))
    job=$(
        sbatch --parsable --job-name=terrane-shards --array=1-$last --requeue --open-mode=append --cpus-per-task={threads} \\
            --mem={memory}M --time={minutes} --output={folder}/slurm-%A_%a.txt --export=ALL,TERRANE_FIRST=$first <<'SHARD'
#!/bin/sh
number=$((TERRANE_FIRST + SLURM_ARRAY_TASK_ID))
{shard} && exit
code=$?
# What was in the way may not be there next time: a node, or one who was thought to be gone and still writes here.
if [ \"${{SLURM_RESTART_COUNT:-0}}\" -lt {tries} ]; then
    scontrol requeue \"$SLURM_JOB_ID\"
fi
exit $code
SHARD
    )
    jobs=$jobs:${{job%%;*}}
done
sbatch --parsable --job-name=terrane-merge --dependency=afterok$jobs --kill-on-invalid-dep=yes --requeue --open-mode=append \\
    --cpus-per-task={threads} --mem={merge_memory}M --output={folder}/slurm-%j.txt <<'MERGE'
#!/bin/sh
exec {merge}
MERGE
",
            tries = TRIES - 1
        )
    }

    fn kubernetes(&self) -> String {
        let Job { shards, threads, image, claim, .. } = self;
        let number = "\"$((JOB_COMPLETION_INDEX + 1))\"";
        let mut text = self.head(
            "kubectl apply -f FILE; and when job/terrane-shards is complete:\n\
             # kubectl patch job terrane-merge --patch '{\"spec\":{\"suspend\":false}}'",
        );
        let json = |text: &str| serde_json::to_string(text).expect("a text is JSON");
        let pod = |name: &str, command: &str, bytes: u64| {
            let memory = mebibytes(bytes);
            format!(
                "  template:
    spec:
      restartPolicy: Never
      containers:
      - name: {name}
        image: {}
        workingDir: /work
        command: [\"sh\", \"-c\", {}]
        resources:
          requests: {{cpu: \"{threads}\", memory: {memory}Mi}}
          limits: {{memory: {memory}Mi}}
        volumeMounts:
        - {{name: work, mountPath: /work}}
      volumes:
      - name: work
        persistentVolumeClaim: {{claimName: {}}}
",
                json(image),
                json(command),
                json(claim)
            )
        };
        _ = write!(
            text,
            "apiVersion: batch/v1
kind: Job
metadata:
  name: terrane-shards
spec:
  completionMode: Indexed
  completions: {shards}
  parallelism: {shards}
  backoffLimitPerIndex: {}
{}---
apiVersion: batch/v1
kind: Job
metadata:
  name: terrane-merge
spec:
  suspend: true
  backoffLimit: {}
{}",
            TRIES - 1,
            pod("shard", &format!("exec {}", self.shard(number)), self.memory_bytes),
            TRIES - 1,
            pod("merge", &format!("exec {}", self.merge()), self.merge_memory_bytes),
        );
        text
    }

    fn parallel(&self) -> String {
        let head = self.head("bash FILE [options of parallel, such as --jobs 4, or --sshloginfile FILE --workdir .]");
        let (shards, shard, merge, folder) =
            (self.shards, self.shard("\"$1\""), self.merge(), quoted(&self.shards_folder()));
        format!(
            "#!/usr/bin/env bash
{head}set -euo pipefail
shard() {{
    {shard}
}}
export -f shard
# The shell that knows of functions.
export SHELL=$BASH
mkdir -p {folder}
seq {shards} | parallel --env shard --jobs 1 --retries {TRIES} --line-buffer \"$@\" shard
{merge}
"
        )
    }

    fn make(&self) -> String {
        let head = self.head("make --jobs 1 --keep-going --file FILE");
        let for_make = |command: String| command.replace('$', "$$").replace('\u{1}', "$*");
        let (shards, folder) = (self.shards, for_make(quoted(&self.shards_folder())));
        let (shard, merge) = (for_make(self.shard("\u{1}")), for_make(self.merge()));
        format!(
            "{head}shards := $(addprefix shard-,$(shell seq {shards}))
.PHONY: merge $(shards)
merge: $(shards)
\t{merge}
$(shards): shard-%:
\tmkdir -p {folder}
\t{shard}
"
        )
    }
}

/// Mebibytes that hold so many bytes.
fn mebibytes(bytes: u64) -> u64 {
    bytes.div_ceil(1 << 20)
}
