//! What has been computed, kept for a while: a cache of pure functions, which changes nothing but time.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hash, RandomState};
use std::sync::{Arc, Mutex};

/// Remembers the values of a pure function, at most twice `capacity` of them, the least recently asked forgotten first.
///
/// Threads that ask for the same key at the same time may both compute it; the values are equal.
#[derive(Debug)]
pub(crate) struct Memory<K, V> {
    shards: Vec<Mutex<Shard<K, V>>>,
    shard_capacity: usize,
    hasher: RandomState,
}

/// Two generations: what is asked for is young; when the young are too many, they grow old and the old are forgotten.
#[derive(Debug)]
struct Shard<K, V> {
    young: HashMap<K, Arc<V>>,
    old: HashMap<K, Arc<V>>,
}

impl<K: Copy + Eq + Hash, V> Memory<K, V> {
    /// A memory of at least `capacity` values.
    pub fn new(capacity: usize) -> Memory<K, V> {
        const SHARDS: usize = 16;
        let shard = || Mutex::new(Shard { young: HashMap::new(), old: HashMap::new() });
        Memory {
            shards: (0..SHARDS).map(|_| shard()).collect(),
            shard_capacity: capacity.div_ceil(SHARDS).max(1),
            hasher: RandomState::new(),
        }
    }

    /// The value of `key`, which is made if it is not remembered.
    pub fn get(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        let shard = &self.shards[self.hasher.hash_one(key) as usize % self.shards.len()];
        {
            let mut shard = shard.lock().expect("no thread panics while it holds the memory");
            if let Some(value) = shard.young.get(&key) {
                return Arc::clone(value);
            }
            if let Some(value) = shard.old.remove(&key) {
                shard.keep(key, Arc::clone(&value), self.shard_capacity);
                return value;
            }
        }
        // Not under the lock: making one value may ask for others.
        let value = Arc::new(make());
        let mut shard = shard.lock().expect("no thread panics while it holds the memory");
        shard.keep(key, Arc::clone(&value), self.shard_capacity);
        value
    }
}

impl<K: Copy + Eq + Hash, V> Shard<K, V> {
    fn keep(&mut self, key: K, value: Arc<V>, capacity: usize) {
        if self.young.len() >= capacity {
            self.old = std::mem::take(&mut self.young);
        }
        self.young.insert(key, value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn what_was_asked_lately_is_not_made_again_and_the_rest_is_forgotten() {
        let memory = Memory::new(64);
        let made = Cell::new(0);
        let get = |key: u64| {
            *memory.get(key, || {
                made.set(made.get() + 1);
                key * 2
            })
        };
        for key in 0..10_000 {
            assert_eq!(get(key), key * 2);
            assert_eq!(get(key), key * 2);
        }
        assert_eq!(made.get(), 10_000);
        let kept: usize = memory
            .shards
            .iter()
            .map(|shard| {
                let shard = shard.lock().unwrap();
                shard.young.len() + shard.old.len()
            })
            .sum();
        assert!((64..=128 + 32).contains(&kept), "{kept} values are kept");
    }
}
