//! `terrane shard-plan`.

use std::env;
use std::ffi::OsString;

use serde_json::json;

use crate::bake::Shard;
use crate::cli::args::{BakeArguments, FolderArguments, Manner, RunOptions, ShardPlanArguments, WriteArguments};
use crate::cli::bake::{announce_trial, requested};
use crate::cli::console::Console;
use crate::cli::jobs::ShardedBake;
use crate::cli::thread_pool;
use crate::error::Error;
use crate::export::{Plan, Trial};

/// Options left out of the shards' commands, each with a value: those that `bake` does not know, and `--out`, as each
/// shard has its own folder.
const OWN: [&str; 7] = ["--engine", "--shards", "--shard-minutes", "--minutes", "--image", "--claim", "--out"];

/// Options of the same kind that take no value: they are about what is said here.
const SAID: [&str; 5] = ["--json", "--quiet", "-q", "--verbose", "-v"];

/// Prints a job.
pub(super) fn run(arguments: ShardPlanArguments, console: &Console) -> Result<(), Error> {
    let ShardPlanArguments { world, engine, shards, shard_minutes, image, claim, place, common, out, threads, device } =
        arguments;
    if world.preset == "-" {
        return Err(Error::Option {
            message: "shard-plan takes no preset from standard input".into(),
            hint: "name a file that all machines have".into(),
        });
    }
    let bake = bake_words()?;
    let manner = Manner { run: RunOptions { threads, dry_run: false }, device };
    let write = WriteArguments { folder: FolderArguments { out, ..FolderArguments::default() }, add: false, manner };
    let arguments = BakeArguments { world, place, shard: None, common, write };
    let threads = threads.count();
    let (request, out) = requested(&arguments, console)?;
    let plan = request.plan()?;
    announce_trial(console, plan.world());
    // One trial serves all numbers of shards: a second trial would measure other times.
    let trial = thread_pool(threads)?.install(|| plan.trial(&console.stop))?;
    let shards = match shards {
        Some(shards) => shards,
        None => fitting(&plan, &trial, shard_minutes * 60.0)?,
    };
    let merge_memory_bytes = plan.cost(threads).memory_bytes();
    let shard = plan.with_shard(Shard::new(1, shards).expect("there is a first one"))?;
    let job = ShardedBake {
        bake,
        out: out.to_string_lossy().into_owned(),
        shards,
        threads,
        memory_bytes: shard.cost(threads).memory_bytes(),
        merge_memory_bytes,
        seconds: seconds_of(&shard, &trial),
        image,
        claim,
    };
    let text = job.text(engine);
    let object = json!({
        "type": "job", "shards": shards, "threads": threads, "seconds": job.seconds, "memory_bytes": job.memory_bytes, "text": text,
    });
    console.message(object, &text)
}

/// Returns the smallest number of shards that each take at most `seconds`, or one shard per tile if even a single tile
/// takes longer.
fn fitting(plan: &Plan<'_>, trial: &Trial, seconds: f64) -> Result<u64, Error> {
    let fits = |shards: u64| {
        let shard = plan.clone().with_shard(Shard::new(1, shards).expect("there is a first one"))?;
        Ok::<_, Error>(seconds_of(&shard, trial) <= seconds)
    };
    let (mut least, mut most) = (1, plan.region().tiles());
    while least < most {
        let middle = least + (most - least) / 2;
        (least, most) = if fits(middle)? { (least, middle) } else { (middle + 1, most) };
    }
    Ok(least)
}

/// Estimates the seconds that a shard takes.
fn seconds_of(shard: &Plan<'_>, trial: &Trial) -> f64 {
    trial.forecast(shard).time.map_or(0.0, |time| time.as_secs_f64())
}

/// Returns the words of the command line that bakes a shard, from `bake` on.
fn bake_words() -> Result<Vec<String>, Error> {
    let mut words = vec!["bake".to_owned()];
    let text = |word: OsString| {
        word.into_string().map_err(|word| Error::Option {
            message: format!("{:?} is no UTF-8, and a script is a text", word.to_string_lossy()),
            hint: "give the file or the folder another name".into(),
        })
    };
    let given = env::args_os().map(text).collect::<Result<Vec<_>, _>>()?;
    let mut given = given.into_iter().skip_while(|word| word != "shard-plan").skip(1);
    while let Some(word) = given.next() {
        if OWN.contains(&&word[..]) {
            given.next();
        } else if !OWN.iter().any(|own| word.strip_prefix(own).is_some_and(|rest| rest.starts_with('=')))
            && !SAID.contains(&&word[..])
        {
            words.push(word);
        }
    }
    Ok(words)
}
