//! What has been computed, kept for a while: a cache of pure functions, which changes nothing but time.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hash, RandomState};
use std::sync::{Arc, Mutex, OnceLock};

/// Remembers the values of a pure function: the last `capacity` that were asked for in any case, twice that at most.
///
/// A value is computed once even if several threads ask at a time; computing it must not ask for the same key again.
#[derive(Debug)]
pub(crate) struct Memory<K, V> {
    shards: Vec<Mutex<Shard<K, V>>>,
    shard_capacity: usize,
    hasher: RandomState,
}

/// A value under way or done.
type Slot<V> = Arc<OnceLock<Arc<V>>>;

/// Two generations: what is asked for is young; when the young are too many, they grow old and the old are forgotten.
#[derive(Debug)]
struct Shard<K, V> {
    young: HashMap<K, Slot<V>>,
    old: HashMap<K, Slot<V>>,
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
        let slot = shard.lock().expect("no thread panics while it looks up").slot(key, self.shard_capacity);
        // Not under the lock: making one value may ask for others.
        Arc::clone(slot.get_or_init(|| Arc::new(make())))
    }
}

impl<K: Copy + Eq + Hash, V> Shard<K, V> {
    fn slot(&mut self, key: K, capacity: usize) -> Slot<V> {
        if let Some(slot) = self.young.get(&key) {
            return Arc::clone(slot);
        }
        if self.young.len() >= capacity {
            self.old = std::mem::take(&mut self.young);
        }
        let slot = self.old.remove(&key).unwrap_or_default();
        self.young.insert(key, Arc::clone(&slot));
        slot
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
