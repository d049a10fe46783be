//! Carries out a plan: begins sinks, makes every tile, ends files, writes manifest and registry, and moves all to its
//! place.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::area::TileId;
use crate::bake::shard_store::Store;
use crate::bake::{FileRecord, Journal, Sink, bake, walk};
use crate::error::Error;
use crate::export::folder::check::check;
use crate::export::folder::manifest::Manifest;
use crate::export::folder::registry_file;
use crate::export::folder::{Mode, Output};
use crate::export::formats::project;
use crate::export::plan::Plan;
use crate::export::{Export, Rebake};
use crate::file::{link, path_in, sync_folder};
use crate::registry::{self, Registry, TileRow, TileState};
use crate::watch::Watch;

impl Plan<'_> {
    /// Bakes into a prepared folder, on the threads of the current rayon pool.
    ///
    /// All files are made in a separate folder, and move to their places when the last one is whole; the manifest comes
    /// last.
    ///
    /// # Errors
    /// When a file cannot be written, when existing files are not what this program makes, or when the work was
    /// stopped. The earlier contents of the folder are then unchanged, and the bake can be resumed.
    /// When a format cannot hold its contents; then the unfinished bake is discarded.
    pub fn run(&self, output: &Output, watch: &Watch) -> Result<Manifest, Error> {
        if output.mode() == Mode::Repair
            && let Some(old) = output.old()
            && output.has_old_alone()
            && check(output.path(), Rebake::None, watch)?.faults.is_empty()
        {
            return Ok(old.clone());
        }
        let mut journal = None;
        let mut run = || {
            let log = output.begin_log(rayon::current_num_threads(), self.maker().name())?;
            let journal = journal.insert(output.begin(self)?);
            let result = self.bake_into(output, journal, watch);
            let [made, known] = journal.counts();
            // If the disk is full, the log's last entry may be missing.
            let logged = log.end(&result.as_ref().map_or_else(ToString::to_string, |_| "whole".into()), made, known);
            let manifest = result?;
            logged?;
            output.commit(&manifest, &watch.clock)?;
            Ok(manifest)
        };
        let result = run();
        if matches!(result, Err(Error::Export { .. })) {
            // A format cannot hold its contents. A further try would fail as well.
            drop(journal);
            output.discard();
        } else if result.is_err() {
            // Keep the record of finished tiles, whatever the error is.
            _ = journal.as_ref().map(Journal::save);
            output.abandon(journal.as_ref());
        }
        result
    }

    fn bake_into(&self, output: &Output, journal: &Journal, watch: &Watch) -> Result<Manifest, Error> {
        let out = &output.files();
        // Files of the old bake that stay.
        let changed = output.changed(watch)?;
        let mut kept = kept_files(output);
        let request = self.request();
        let is_there =
            |export: &&Export| output.mode() == Mode::Add && output.old().is_some_and(|old| old.has(**export));
        let mut sinks: Vec<Box<dyn Sink + '_>> = Vec::new();
        for export in self.exports().iter().filter(|export| !is_there(export)) {
            sinks.extend(export.0.sinks(&request, out)?);
        }
        if self.shard().is_some() {
            sinks = vec![Box::new(Store::create(*self.region(), sinks, out)?)];
        }
        self.adopt(output, journal, sinks.len(), changed)?;
        // Hand every tile to every sink.
        match (self.walk(), self.shards()) {
            (None, None) => bake((self.world(), self.maker()), &self.made(), &sinks, journal, watch)?,
            (Some(way), _) => walk((self.world(), self.shared_maker()), way, &sinks, journal, watch)?,
            (None, Some(shards)) => kept.extend(shards.hand_on(out, &sinks, journal, watch)?),
        }
        check_tiles(output, journal)?;
        // End all files, and bring them to the disk together.
        watch.begin("finishing files", None);
        let finish = |sink: &(dyn Sink + '_)| {
            if let Some(files) = journal.ended(sink.name(), &watch.clock)? {
                return Ok(files);
            }
            let files = watch.clock.time(&format!("finish {}", sink.name()), || sink.finish(watch))??;
            journal.end(sink.name(), &files)?;
            Ok(files)
        };
        let records = sinks.par_iter().map(|sink| finish(sink.as_ref())).collect::<Result<Vec<_>, Error>>()?;
        let mut records = [records.concat(), journal.tile_files()?, kept].concat();
        // Files that help users to import the bake.
        let mut written = Vec::new();
        if self.shard().is_none() {
            written.extend(project::write(self, out)?);
            if let Some(profile) = self.profile() {
                written.extend(profile.write(&self.request(), out)?);
            }
        }
        records.retain(|record| written.iter().all(|written| written.path != record.path));
        records.extend(written);
        records.sort_by(|a, b| a.path.cmp(&b.path));
        let registry = || registry_file::write(self, journal, &records, out);
        let registry = watch.clock.time("finish registry.sqlite", registry)??;
        records.push(registry);
        for folder in self.folders() {
            sync_folder(&out.join(folder))?;
        }
        Ok(Manifest::new(self, records))
    }

    /// Takes over the tiles of a bake that is extended, with their files renamed to the tiles' places in the larger
    /// region. Does nothing unless all exports leave only files of single tiles; then no tile is made twice, but for
    /// those whose files were changed since.
    fn adopt(&self, output: &Output, journal: &Journal, sinks: usize, changed: &BTreeSet<String>) -> Result<(), Error> {
        let Some(old) = output.old().filter(|_| output.mode() == Mode::Extend && journal.is_empty()) else {
            return Ok(());
        };
        if !self.exports().iter().all(|export| export.0.is_of_tiles_alone()) {
            return Ok(());
        }
        let region = old.region.region()?;
        let records: BTreeMap<&str, &FileRecord> = old.files.iter().map(|file| (&file.path[..], file)).collect();
        Registry::read(&output.path().join(registry::FILE_NAME))?.for_each(|row| {
            let places = region.place(row.tile).zip(self.region().place(row.tile));
            let Some((before, place)) = places else { return Ok(()) };
            let mut files = Vec::new();
            for export in self.exports() {
                let names = export.0.rasters_of(&region, before, self.names()).into_iter();
                for (from, path) in names.zip(export.0.rasters_of(self.region(), place, self.names())) {
                    let as_written = records.get(&from[..]).filter(|_| !changed.contains(&from));
                    let (Some(record), Some(old)) = (as_written, path_in(output.path(), &from)) else {
                        return Ok(());
                    };
                    link(&old, &output.files().join(&path))?;
                    files.push(FileRecord { path, ..(*record).clone() });
                }
            }
            journal.adopt(TileRow { state: TileState::Made, files: Vec::new(), ..row }, files, sinks)
        })?;
        journal.save()
    }
}

/// Returns the files that stay as they are when exports are added to a bake. A larger region keeps none: it has other
/// files of the region, and numbers its tiles anew.
fn kept_files(output: &Output) -> Vec<FileRecord> {
    let old = output.added_to().filter(|_| output.mode() == Mode::Add);
    let files = old.iter().flat_map(|old| &old.files);
    files.filter(|record| record.export != registry::EXPORT).cloned().collect()
}

/// Checks that the tiles of a bake to which something is added are still the same.
fn check_tiles(output: &Output, journal: &Journal) -> Result<(), Error> {
    if output.added_to().is_none() {
        return Ok(());
    }
    let registry = Registry::read(&output.path().join(registry::FILE_NAME))?;
    journal.for_each(|row| match registry.row(row.tile)? {
        Some(known) if known.digest != row.digest => {
            let TileId { x, y } = row.tile;
            Err(output.faulty("", format!("tile {x}, {y} is another one here than when it was baked")))
        }
        _ => Ok(()),
    })
}
