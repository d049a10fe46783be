//! What has been computed, kept for a while: a cache of pure functions, which changes nothing but time.

use std::collections::HashMap;
use std::hash::{BuildHasher, BuildHasherDefault, Hash, Hasher};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use crate::{hash, stop};

/// What a value takes beside its own place.
pub trait HeapBytes {
    /// Bytes that the value holds on the heap. What several values share counts for each, so that sums are never short.
    fn heap_bytes(&self) -> usize;

    /// Gives back what the value holds without need, as vectors do that have grown.
    fn shrink(&mut self);
}

/// Says of a type which of its fields hold something on the heap: `heap_bytes!(Type: field, field)`, or none.
#[macro_export]
macro_rules! heap_bytes {
    ($type:ty $(: $($field:ident),+)?) => {
        impl $crate::memory::HeapBytes for $type {
            fn heap_bytes(&self) -> usize {
                0 $($(+ $crate::memory::HeapBytes::heap_bytes(&self.$field))+)?
            }

            fn shrink(&mut self) {
                $($($crate::memory::HeapBytes::shrink(&mut self.$field);)+)?
            }
        }
    };
}
pub use crate::heap_bytes;

heap_bytes!(bool);
heap_bytes!(u8);
heap_bytes!(u32);
heap_bytes!(u64);
heap_bytes!(i64);
heap_bytes!(f32);
heap_bytes!(f64);

impl<A: HeapBytes, B: HeapBytes> HeapBytes for (A, B) {
    fn heap_bytes(&self) -> usize {
        self.0.heap_bytes() + self.1.heap_bytes()
    }

    fn shrink(&mut self) {
        self.0.shrink();
        self.1.shrink();
    }
}

impl<T: HeapBytes> HeapBytes for Option<T> {
    fn heap_bytes(&self) -> usize {
        self.as_ref().map_or(0, T::heap_bytes)
    }

    fn shrink(&mut self) {
        self.iter_mut().for_each(T::shrink);
    }
}

impl<T: HeapBytes, const N: usize> HeapBytes for [T; N] {
    fn heap_bytes(&self) -> usize {
        self.iter().map(T::heap_bytes).sum()
    }

    fn shrink(&mut self) {
        self.iter_mut().for_each(T::shrink);
    }
}

impl<T: HeapBytes> HeapBytes for Vec<T> {
    fn heap_bytes(&self) -> usize {
        self.capacity() * size_of::<T>() + self.iter().map(T::heap_bytes).sum::<usize>()
    }

    fn shrink(&mut self) {
        self.shrink_to_fit();
        self.iter_mut().for_each(T::shrink);
    }
}

impl<T: HeapBytes> HeapBytes for Arc<T> {
    fn heap_bytes(&self) -> usize {
        COUNTS + size_of::<T>() + T::heap_bytes(self)
    }

    /// What others share is left as it is.
    fn shrink(&mut self) {
        if let Some(own) = Arc::get_mut(self) {
            own.shrink();
        }
    }
}

impl HeapBytes for String {
    fn heap_bytes(&self) -> usize {
        self.capacity()
    }

    fn shrink(&mut self) {
        self.shrink_to_fit();
    }
}

/// Bytes that an [`Arc`] keeps beside its value, to count who shares it.
const COUNTS: usize = 2 * size_of::<usize>();

/// Bytes that an allocator keeps beside a block, as a middle of what those of today do.
const BLOCK: usize = 8;

/// How full a [`Memory`] is, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Usage {
    /// What is held now.
    pub held: usize,
    /// What is held at most.
    pub most: usize,
}

/// Remembers the values of a pure function, as many as fit into some bytes: those that were asked for last.
///
/// A value is computed once even if several threads ask at a time; computing it must not ask for the same key again.
#[derive(Debug)]
pub struct Memory<K, V> {
    shards: Vec<Mutex<Shard<K, V>>>,
    /// Bytes of a generation of a shard.
    room: AtomicUsize,
}

/// Hashes keys, which are a few numbers that nobody chooses to do harm: in a fraction of the time that the standard library
/// takes so that nobody can.
#[derive(Debug, Default)]
pub struct KeyHasher(u64);

/// What makes a map hash its keys so.
pub type HashKeys = BuildHasherDefault<KeyHasher>;

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for bytes in bytes.chunks(8) {
            let mut number = [0; 8];
            number[..bytes.len()].copy_from_slice(bytes);
            self.write_u64(u64::from_le_bytes(number));
        }
    }

    fn write_u32(&mut self, number: u32) {
        self.write_u64(number.into());
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = hash::combine(self.0, number);
    }

    fn write_usize(&mut self, number: usize) {
        self.write_u64(number as u64);
    }
}

/// A value under way or done.
type Slot<V> = Arc<OnceLock<Arc<V>>>;

/// Two generations: what is asked for is young; when the young are too large, they grow old and the old are forgotten.
#[derive(Debug)]
struct Shard<K, V> {
    young: Generation<K, V>,
    old: Generation<K, V>,
}

#[derive(Debug)]
struct Generation<K, V> {
    /// Each with its bytes.
    slots: HashMap<K, (Slot<V>, usize), HashKeys>,
    bytes: usize,
}

impl<K: Copy + Eq + Hash, V: HeapBytes> Memory<K, V> {
    /// Bytes of an entry without what its value holds: its place in a table that is filled to two thirds in the middle,
    /// its slot, and its value.
    const ENTRY_BYTES: usize = (size_of::<(K, (Slot<V>, usize))>() + 1) * 3 / 2
        + (COUNTS + size_of::<OnceLock<Arc<V>>>() + BLOCK)
        + (COUNTS + size_of::<V>() + BLOCK);

    /// A memory that takes at most so many bytes, unless single values are so large that there is hardly room for one.
    pub fn new(bytes: usize) -> Memory<K, V> {
        // So many threads can look up at once; a shard of a small memory would have room for too few values.
        let shards = (bytes >> 18).clamp(1, 16);
        let generation = || Generation { slots: HashMap::default(), bytes: 0 };
        let shard = || Mutex::new(Shard { young: generation(), old: generation() });
        Memory { shards: (0..shards).map(|_| shard()).collect(), room: AtomicUsize::new(bytes / (2 * shards)) }
    }

    /// What it holds now, and what it holds at most.
    pub fn usage(&self) -> Usage {
        let held = |shard: &Mutex<Shard<K, V>>| {
            let shard = shard.lock().expect("no thread panics while it looks up");
            shard.young.bytes + shard.old.bytes
        };
        let most = 2 * self.shards.len() * self.room.load(Ordering::Relaxed);
        Usage { held: self.shards.iter().map(held).sum(), most }
    }

    /// Makes room for so many bytes, if it has less.
    pub fn reserve(&self, bytes: usize) {
        self.room.fetch_max(bytes / (2 * self.shards.len()), Ordering::Relaxed);
    }

    /// The value of `key`, which is made if it is not remembered.
    ///
    /// What takes long asks for something all the time, so this is where most work is stopped: under no lock, and a value
    /// whose making unwinds is not there for the next who asks.
    pub fn get(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        stop::check();
        // By other bits than those by which the tables of the shards place it.
        let shard = (HashKeys::default().hash_one(key) >> 32) as usize % self.shards.len();
        let shard = &self.shards[shard];
        let lock = || shard.lock().expect("no thread panics while it looks up");
        let room = self.room.load(Ordering::Relaxed);
        let slot = lock().slot(key, Self::ENTRY_BYTES, room);
        // Not under the lock: making one value may ask for others.
        let mut held = None;
        let value = slot.get_or_init(|| {
            let mut value = make();
            value.shrink();
            held = Some(value.heap_bytes());
            Arc::new(value)
        });
        if let Some(bytes) = held {
            lock().grow(key, &slot, bytes, room);
        }
        Arc::clone(value)
    }
}

impl<K: Copy + Eq + Hash, V> Shard<K, V> {
    /// The slot of a key, which is young from now on; a new one takes so many bytes.
    fn slot(&mut self, key: K, bytes: usize, room: usize) -> Slot<V> {
        if let Some((slot, _)) = self.young.slots.get(&key) {
            return Arc::clone(slot);
        }
        let (slot, bytes) = self.old.remove(&key).unwrap_or_else(|| (Slot::default(), bytes));
        self.hold(key, (Arc::clone(&slot), bytes), room);
        slot
    }

    /// Counts what a value has turned out to hold, unless it is forgotten already.
    fn grow(&mut self, key: K, slot: &Slot<V>, more: usize, room: usize) {
        let held = self.young.remove(&key).or_else(|| self.old.remove(&key));
        if let Some((own, bytes)) = held {
            let more = if Arc::ptr_eq(&own, slot) { more } else { 0 };
            self.hold(key, (own, bytes + more), room);
        }
    }

    fn hold(&mut self, key: K, entry: (Slot<V>, usize), room: usize) {
        if self.young.bytes + entry.1 > room && !self.young.slots.is_empty() {
            let empty = Generation { slots: HashMap::default(), bytes: 0 };
            self.old = std::mem::replace(&mut self.young, empty);
        }
        self.young.bytes += entry.1;
        self.young.slots.insert(key, entry);
    }
}

impl<K: Eq + Hash, V> Generation<K, V> {
    fn remove(&mut self, key: &K) -> Option<(Slot<V>, usize)> {
        let entry = self.slots.remove(key)?;
        self.bytes -= entry.1;
        Some(entry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn what_is_kept_takes_no_more_than_it_needs() {
        let memory: Memory<u64, Vec<Arc<Vec<u64>>>> = Memory::new(1 << 20);
        let grown = |value: u64| {
            let mut values = Vec::with_capacity(1000);
            values.push(value);
            values
        };
        memory.get(0, || vec![Arc::new(grown(1)), Arc::new(grown(2))]);
        assert!(memory.usage().held < 1000, "{} bytes are kept", memory.usage().held);
    }

    #[test]
    fn what_was_asked_lately_is_not_made_again_and_the_rest_is_forgotten() {
        let memory: Memory<u64, Vec<u64>> = Memory::new(1 << 20);
        let made = Cell::new(0);
        let get = |key: u64| {
            memory.get(key, || {
                made.set(made.get() + 1);
                vec![key; 100]
            })[99]
        };
        for key in 0..10_000 {
            assert_eq!(get(key), key);
            assert_eq!(get(key), key);
            assert!(memory.usage().held <= 1 << 20);
        }
        assert_eq!(made.get(), 10_000);
        assert!(memory.usage().held > 1 << 19, "{} bytes are kept", memory.usage().held);
        // A quarter of the bytes is room for two hundred of them.
        for key in 9_800..10_000 {
            get(key);
        }
        assert_eq!(made.get(), 10_000);
        memory.reserve(20 << 20);
        for key in (0..10_000).chain(0..10_000) {
            get(key);
        }
        // Some of the first round were still there, all of the second were.
        assert!((18_900..20_000).contains(&made.get()), "{}", made.get());
    }

    #[test]
    fn a_value_larger_than_the_room_for_it_is_remembered_alone() {
        let memory: Memory<u64, Vec<u64>> = Memory::new(1 << 10);
        for key in [1, 1, 2, 2, 1] {
            assert_eq!(memory.get(key, || vec![key; 1 << 10])[0], key);
        }
        assert!(memory.usage().held < 5 << 13, "{} bytes are kept", memory.usage().held);
    }
}
