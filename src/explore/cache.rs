//! A cache of drawn tiles on the disk, under the digest of all that they depend on.
//!
//! A file holds a hash and then the hashed bytes, so that a half-written or damaged file is not taken for a tile. Any
//! number of programs may share a folder, for a digest stands for the same bytes in all of them.

use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, SystemTime};

use crate::error::Error;
use crate::file::make_folder;

/// Number of bytes of the hash that a file begins with.
const HASH: usize = blake3::OUT_LEN;

/// Time since the last use within which a file is not marked as used again.
const JUST_USED: Duration = Duration::from_mins(1);

/// Files that together stay within a limit of bytes: the least recently used ones are removed.
#[derive(Debug)]
pub(super) struct Cache {
    folder: PathBuf,
    limit: u64,
    known: Mutex<Known>,
}

/// The files in the folder, as far as this program knows.
#[derive(Debug, Default)]
struct Known {
    files: HashMap<blake3::Hash, Entry>,
    /// The keys of the same files by their last use, as a running number.
    by_use: BTreeMap<u64, blake3::Hash>,
    uses: u64,
    bytes: u64,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    bytes: u64,
    used: u64,
}

impl Known {
    fn insert(&mut self, key: blake3::Hash, bytes: u64) {
        self.remove(&key);
        self.uses += 1;
        self.files.insert(key, Entry { bytes, used: self.uses });
        self.by_use.insert(self.uses, key);
        self.bytes += bytes;
    }

    fn remove(&mut self, key: &blake3::Hash) {
        if let Some(entry) = self.files.remove(key) {
            self.by_use.remove(&entry.used);
            self.bytes -= entry.bytes;
        }
    }
}

impl Cache {
    /// Opens the cache in a folder, which is made if it does not exist.
    ///
    /// # Errors
    /// When the folder cannot be made or read.
    pub fn open(folder: &Path, limit: u64) -> Result<Cache, Error> {
        make_folder(folder)?;
        let mut found = Vec::new();
        for shelf in fs::read_dir(folder).map_err(Error::io(folder))?.filter_map(Result::ok) {
            // Skip what is no folder or file of the cache, and what another program removes meanwhile.
            for file in fs::read_dir(shelf.path()).into_iter().flatten().filter_map(Result::ok) {
                let name = file.file_name();
                let key = name.to_str().and_then(|name| blake3::Hash::from_hex(name).ok());
                let (Some(key), Ok(about)) = (key, file.metadata()) else { continue };
                found.push((about.modified().unwrap_or(SystemTime::UNIX_EPOCH), key, about.len()));
            }
        }
        found.sort_by_key(|(used, ..)| *used);
        let mut known = Known::default();
        for (_, key, bytes) in found {
            known.insert(key, bytes);
        }
        let cache = Cache { folder: folder.to_owned(), limit, known: Mutex::new(known) };
        cache.tidy();
        Ok(cache)
    }

    /// Returns the bytes kept under a digest, if the file is there and whole.
    pub fn get(&self, key: &blake3::Hash) -> Option<Vec<u8>> {
        let path = self.path(key);
        let mut file = fs::read(&path).ok()?;
        let is_whole = file.len() >= HASH && blake3::hash(&file[HASH..]).as_bytes() == &file[..HASH];
        if !is_whole {
            _ = fs::remove_file(&path);
            self.known().remove(key);
            return None;
        }
        self.known().insert(*key, file.len() as u64);
        // Mark the file as used, for programs that open the cache later.
        let now = SystemTime::now();
        let used = path.metadata().and_then(|about| about.modified());
        if used.is_ok_and(|used| now.duration_since(used).is_ok_and(|ago| ago > JUST_USED)) {
            _ = File::options().append(true).open(&path).and_then(|file| file.set_modified(now));
        }
        file.drain(..HASH);
        Some(file)
    }

    /// Keeps bytes under their digest. If the disk refuses, the tile is drawn again another time.
    pub fn put(&self, key: &blake3::Hash, bytes: &[u8]) {
        let path = self.path(key);
        let shelf = path.parent().expect("a file lies in a folder");
        let write = || -> std::io::Result<()> {
            fs::create_dir_all(shelf)?;
            let mut part = tempfile::NamedTempFile::new_in(shelf)?;
            part.write_all(blake3::hash(bytes).as_bytes())?;
            part.write_all(bytes)?;
            part.persist(&path)?;
            Ok(())
        };
        if write().is_ok() {
            self.known().insert(*key, (HASH + bytes.len()) as u64);
            self.tidy();
        }
    }

    /// Removes the least recently used files until the rest is within the limit.
    fn tidy(&self) {
        let mut known = self.known();
        while known.bytes > self.limit {
            let Some((_, key)) = known.by_use.first_key_value() else { break };
            let key = *key;
            _ = fs::remove_file(self.path(&key));
            known.remove(&key);
        }
    }

    fn path(&self, key: &blake3::Hash) -> PathBuf {
        let name = key.to_hex();
        self.folder.join(&name[..2]).join(name.as_str())
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().expect("no thread panics while it counts files")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(number: u32) -> blake3::Hash {
        blake3::hash(&number.to_le_bytes())
    }

    fn bytes_in(folder: &Path) -> u64 {
        let shelves = fs::read_dir(folder).unwrap().map(|shelf| shelf.unwrap().path());
        shelves.flat_map(|shelf| fs::read_dir(shelf).unwrap()).map(|file| file.unwrap().metadata().unwrap().len()).sum()
    }

    #[test]
    fn what_was_used_lately_is_kept_within_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::open(folder.path(), 10_000).unwrap();
        for number in 0..100 {
            cache.put(&key(number), &[number as u8; 968]);
            assert!(cache.get(&key(0)).is_some(), "it is used all the time: {number}");
            assert!(bytes_in(folder.path()) <= 10_000);
        }
        assert_eq!(cache.get(&key(99)), Some(vec![99; 968]));
        assert_eq!(cache.get(&key(50)), None);
        drop(cache);
        // The next program to open the folder finds the files, and keeps to its own limit.
        let smaller = Cache::open(folder.path(), 5_000).unwrap();
        assert_eq!(bytes_in(folder.path()), 5_000);
        assert_eq!(smaller.get(&key(99)), Some(vec![99; 968]));
    }

    #[test]
    fn what_is_damaged_is_not_taken_for_a_tile() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::open(folder.path(), 1 << 20).unwrap();
        let damages: [fn(&mut Vec<u8>); 3] = [|file| file[40] ^= 1, |file| file.truncate(60), |file| file.truncate(3)];
        for (number, damage) in damages.into_iter().enumerate() {
            let key = key(number as u32);
            cache.put(&key, &[7; 100]);
            let path = cache.path(&key);
            let mut file = fs::read(&path).unwrap();
            damage(&mut file);
            fs::write(&path, file).unwrap();
            assert_eq!(cache.get(&key), None);
            assert!(!path.exists());
            cache.put(&key, &[8; 100]);
            assert_eq!(cache.get(&key), Some(vec![8; 100]));
        }
        // A folder that cannot be written to is no reason to stop.
        fs::remove_dir_all(folder.path()).unwrap();
        fs::write(folder.path(), "in the way").unwrap();
        cache.put(&key(9), &[9]);
        assert_eq!(cache.get(&key(9)), None);
    }
}
