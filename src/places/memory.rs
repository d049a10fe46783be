//! What has been computed is remembered for a while, which changes nothing but time.

use std::collections::{BTreeMap, HashMap};
use std::hash::Hash;
use std::sync::{Arc, Mutex, OnceLock};

/// The values of the keys that were last asked for, at most a stated number. Each value is computed once even if several
/// threads ask at a time.
#[derive(Debug)]
pub(super) struct Memory<K, T> {
    most: usize,
    values: Mutex<Remembered<K, T>>,
}

/// A value under way or done, and the last time that it was asked for.
type Slot<T> = (u64, Arc<OnceLock<Arc<T>>>);

#[derive(Debug)]
struct Remembered<K, T> {
    by_key: HashMap<K, Slot<T>>,
    by_age: BTreeMap<u64, K>,
    clock: u64,
}

impl<K: Copy + Eq + Hash, T> Memory<K, T> {
    /// A memory of at most so many values.
    pub fn new(most: usize) -> Memory<K, T> {
        Memory { most, values: Mutex::new(Remembered { by_key: HashMap::new(), by_age: BTreeMap::new(), clock: 0 }) }
    }

    /// The value of a key, computed if it is not remembered; `compute` must not ask this memory for the same key.
    pub fn get(&self, key: K, compute: impl FnOnce() -> T) -> Arc<T> {
        let cell = {
            let mut values = self.values.lock().expect("no thread panics while it looks up");
            let Remembered { by_key, by_age, clock } = &mut *values;
            *clock += 1;
            let (used, cell) = by_key.entry(key).or_insert_with(|| (*clock, Arc::default()));
            by_age.remove(used);
            *used = *clock;
            let cell = Arc::clone(cell);
            by_age.insert(*clock, key);
            if by_key.len() > self.most
                && let Some((_, oldest)) = by_age.pop_first()
            {
                by_key.remove(&oldest);
            }
            cell
        };
        // Outside the lock, so that other keys do not wait.
        Arc::clone(cell.get_or_init(|| Arc::new(compute())))
    }

    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.values.lock().expect("no thread panics while it looks up").by_key.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_give_way() {
        let memory = Memory::new(3);
        for key in [1, 2, 3, 1, 4] {
            assert_eq!(*memory.get(key, || key * 10), key * 10);
        }
        assert_eq!(memory.len(), 3);
        assert_eq!(*memory.get(1, || unreachable!("it was asked for lately")), 10);
        assert_eq!(*memory.get(2, || 99), 99);
    }
}
