//! Memories: caches of pure functions. They change how long work takes, and nothing else.

use std::collections::HashMap;
use std::convert::Infallible;
use std::fmt::Debug;
use std::hash::{BuildHasher, BuildHasherDefault, Hash, Hasher};
use std::mem;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};

use crate::hash;

/// The heap memory of a value, beside the bytes of the value itself.
pub trait HeapBytes {
    /// Returns the number of bytes that the value holds on the heap. Shared data counts for each value that shares it,
    /// so sums are never too low.
    fn heap_bytes(&self) -> usize;

    /// Frees heap memory that the value does not need, such as the spare capacity of a vector.
    fn shrink(&mut self);
}

/// Implements `HeapBytes` for a type, given the fields that hold something on the heap, if any:
/// `heap_bytes!(Type: field, field)`.
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

    /// Leaves data alone that others share.
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

/// Bytes of the two reference counts that an [`Arc`] keeps beside its value.
const COUNTS: usize = 2 * size_of::<usize>();

/// Bytes that an allocator keeps beside a block: a typical value for current allocators.
const BLOCK: usize = 8;

/// Memory use of a [`Memory`] in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Usage {
    /// Bytes held at present.
    pub held: usize,
    /// Largest number of bytes that may be held.
    pub most: usize,
}

/// A number of bytes that any number of memories share, such as those of several worlds. Together they hold no more
/// than this; beyond it, the values that were last asked for the longest time ago are forgotten first, in whichever
/// memory they are.
///
/// A value counts once it has been computed, and a value in use stays until it is dropped, so slightly more may be
/// held.
#[derive(Debug)]
pub struct Budget {
    bytes: usize,
    /// Bytes that all memories hold together.
    held: AtomicUsize,
    /// Bytes that the memories have taken since the beginning: a clock that orders the times at which values were asked
    /// for.
    taken: AtomicU64,
    members: Mutex<Vec<Weak<dyn Member>>>,
}

/// Part of a budget, one over this, that is free after forgetting. The more is freed, the more rarely all memories are
/// searched.
const FREED: usize = 8;

impl Budget {
    /// Returns a budget of so many bytes.
    pub fn new(bytes: usize) -> Arc<Budget> {
        Arc::new(Budget { bytes, held: AtomicUsize::new(0), taken: AtomicU64::new(0), members: Mutex::default() })
    }

    /// Returns how many bytes all memories hold together, and how many they may hold.
    pub fn usage(&self) -> Usage {
        Usage { held: self.held.load(Ordering::Relaxed), most: self.bytes }
    }

    /// Updates the count for a memory that held `before` bytes and holds `after`. Returns true if this exceeds the
    /// budget.
    fn count(&self, before: usize, after: usize) -> bool {
        if after <= before {
            self.held.fetch_sub(before - after, Ordering::Relaxed);
            return false;
        }
        let more = after - before;
        self.taken.fetch_add(more as u64, Ordering::Relaxed);
        self.held.fetch_add(more, Ordering::Relaxed) + more > self.bytes
    }

    /// Forgets old generations until enough is free, beginning with those last asked for the longest time ago. If this
    /// does not suffice, makes the young generations old and goes on with them.
    fn forget(&self) {
        // A thread that finds too much waits for the one that forgets already. Otherwise it would take more and more
        // while that one is kept from running.
        let mut members = self.members.lock().unwrap_or_else(PoisonError::into_inner);
        if self.held.load(Ordering::Relaxed) <= self.bytes {
            return;
        }
        members.retain(|member| member.strong_count() > 0);
        let members: Vec<Arc<dyn Member>> = members.iter().filter_map(Weak::upgrade).collect();
        let is_enough = || self.held.load(Ordering::Relaxed) <= self.bytes - self.bytes / FREED;
        let forget_old = || {
            let of = |at: usize| members[at].old().into_iter().map(move |(asked, shard)| (asked, at, shard));
            let mut old: Vec<(u64, usize, usize)> = (0..members.len()).flat_map(of).collect();
            old.sort_unstable();
            old.into_iter().take_while(|_| !is_enough()).for_each(|(_, member, shard)| members[member].forget(shard));
        };
        forget_old();
        if !is_enough() {
            for member in &members {
                member.grow_old();
            }
            forget_old();
        }
    }
}

/// A memory, whatever the types of its keys and values.
pub trait Remembers {
    /// Returns how many bytes the memory holds, and how many it may hold.
    fn usage(&self) -> Usage;

    /// Makes the memory share a budget from then on, unless it shares one already.
    fn share(&self, budget: &Arc<Budget>);
}

/// The operations of a memory that a budget needs.
trait Member: Debug + Send + Sync {
    /// Returns the shards that have an old generation, each with the time at which this was last asked for, in bytes
    /// taken by the budget.
    fn old(&self) -> Vec<(u64, usize)>;

    /// Makes the young generation of every shard old.
    fn grow_old(&self);

    /// Forgets the old generation of a shard.
    fn forget(&self, shard: usize);
}

/// Remembers the values of a pure function: as many as fit into a number of bytes, those last asked for.
///
/// A value is computed once even if several threads ask for it at the same time. Computing a value must not ask for its
/// own key again.
#[derive(Debug)]
pub struct Memory<K, V>(Arc<Inner<K, V>>);

/// The part that the owner of a memory and its budget share. The budget holds it weakly, so that a memory ends with its
/// owner.
#[derive(Debug)]
struct Inner<K, V> {
    shards: Vec<Mutex<Generations<K, V>>>,
    /// Bytes that one generation of a shard may hold.
    room: AtomicUsize,
    /// The budget that the memory shares with others, if any.
    budget: OnceLock<Arc<Budget>>,
}

/// Hashes keys quickly. Keys are a few numbers that no attacker chooses, so the slower hash of the standard library,
/// which withstands chosen keys, is not needed.
#[derive(Debug, Default)]
pub struct KeyHasher(u64);

/// Builds a [`KeyHasher`] for each hash of a map.
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

/// A value that is being computed or has been computed.
type LazyValue<V> = Arc<Mutex<Option<Arc<V>>>>;

/// Two generations. A value that is asked for moves to the young one; when this grows too large, it becomes the old
/// one, and the old one is forgotten.
#[derive(Debug)]
struct Generations<K, V> {
    young: Generation<K, V>,
    old: Generation<K, V>,
}

#[derive(Debug)]
struct Generation<K, V> {
    /// The entries, each with its bytes.
    slots: HashMap<K, (LazyValue<V>, usize), HashKeys>,
    bytes: usize,
    /// Time at which one of its values was last asked for, in bytes taken by the budget.
    asked: u64,
}

impl<K, V> Default for Generation<K, V> {
    fn default() -> Generation<K, V> {
        Generation { slots: HashMap::default(), bytes: 0, asked: 0 }
    }
}

impl<K: Copy + Eq + Hash, V: HeapBytes> Memory<K, V> {
    /// Bytes of an entry without the heap memory of its value: its place in a hash table, which is two thirds full on
    /// average, its slot, and its value.
    const ENTRY_BYTES: usize = (size_of::<(K, (LazyValue<V>, usize))>() + 1) * 3 / 2
        + (COUNTS + size_of::<Mutex<Option<Arc<V>>>>() + BLOCK)
        + (COUNTS + size_of::<V>() + BLOCK);

    /// Returns a memory of at most so many bytes. It may hold more where a single value is about as large as its whole
    /// room.
    pub fn new(bytes: usize) -> Memory<K, V> {
        // The number of shards limits how many threads look up at once; shards of a small memory would hold too few
        // values.
        let shards = (bytes >> 18).clamp(1, 16);
        let shard = || Mutex::new(Generations { young: Generation::default(), old: Generation::default() });
        Memory(Arc::new(Inner {
            shards: (0..shards).map(|_| shard()).collect(),
            room: AtomicUsize::new(bytes / (2 * shards)),
            budget: OnceLock::new(),
        }))
    }

    /// Returns a new memory that also shares a budget, if there is one.
    pub fn within(bytes: usize, budget: Option<&Arc<Budget>>) -> Memory<K, V>
    where
        Memory<K, V>: Remembers,
    {
        let memory = Memory::new(bytes);
        if let Some(budget) = budget {
            memory.share(budget);
        }
        memory
    }

    /// Enlarges the memory to so many bytes, if it has less room.
    pub fn reserve(&self, bytes: usize) {
        self.0.room.fetch_max(bytes / (2 * self.0.shards.len()), Ordering::Relaxed);
    }

    /// Returns the value of `key`, computing it if it is not remembered.
    pub fn get(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        let Ok(value) = self.try_get(key, || Ok::<_, Infallible>(make()));
        value
    }

    /// Returns the value of `key`, computing it if it is not remembered.
    ///
    /// # Errors
    /// The error of `make`. Then nothing is stored, and the next thread that asks computes the value.
    pub fn try_get<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        // The tables of the shards use the other bits of the hash.
        let shard = (HashKeys::default().hash_one(key) >> 32) as usize % self.0.shards.len();
        let room = self.0.room.load(Ordering::Relaxed);
        let slot = self.0.look_up(shard, |shard| shard.slot(key, Self::ENTRY_BYTES, room));
        // The lock of the shard is released first, since computing one value may ask for others. A panic while a value
        // was computed has left nothing.
        let mut made = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(value) = &*made {
            return Ok(Arc::clone(value));
        }
        let mut value = make()?;
        value.shrink();
        let bytes = value.heap_bytes();
        let value = Arc::clone(made.insert(Arc::new(value)));
        drop(made);
        self.0.look_up(shard, |shard| shard.grow(key, &slot, bytes, room));
        Ok(value)
    }
}

impl<K, V> Remembers for Memory<K, V>
where
    K: Debug + Send + 'static,
    V: Debug + Send + Sync + 'static,
{
    fn usage(&self) -> Usage {
        let held = (0..self.0.shards.len()).map(|shard| self.0.shard(shard).bytes()).sum();
        Usage { held, most: 2 * self.0.shards.len() * self.0.room.load(Ordering::Relaxed) }
    }

    fn share(&self, budget: &Arc<Budget>) {
        self.0.budget.get_or_init(|| {
            // Nothing else uses the memory yet: a world gets its budget when it is made.
            budget.count(0, self.usage().held);
            let member: Weak<Inner<K, V>> = Arc::downgrade(&self.0);
            budget.members.lock().unwrap_or_else(PoisonError::into_inner).push(member);
            Arc::clone(budget)
        });
    }
}

impl<K, V> Inner<K, V> {
    fn shard(&self, shard: usize) -> MutexGuard<'_, Generations<K, V>> {
        self.shards[shard].lock().expect("no thread panics while it looks up")
    }

    /// Looks something up in a shard, and makes the budget forget values if it is exceeded.
    fn look_up<T>(&self, shard: usize, look: impl FnOnce(&mut Generations<K, V>) -> T) -> T {
        let budget = self.budget.get();
        let (found, is_too_much) = self.change(shard, |shard| {
            let found = look(shard);
            if let Some(budget) = budget {
                shard.young.asked = budget.taken.load(Ordering::Relaxed);
            }
            found
        });
        // No lock is held here, since the values to forget may lie in this shard.
        if let Some(budget) = budget.filter(|_| is_too_much) {
            budget.forget();
        }
        found
    }

    /// Changes the contents of a shard. Also tells whether this exceeds the budget.
    fn change<T>(&self, shard: usize, change: impl FnOnce(&mut Generations<K, V>) -> T) -> (T, bool) {
        let mut shard = self.shard(shard);
        let before = shard.bytes();
        let done = change(&mut shard);
        let after = shard.bytes();
        (done, self.budget.get().is_some_and(|budget| budget.count(before, after)))
    }
}

impl<K, V> Member for Inner<K, V>
where
    K: Debug + Send,
    V: Debug + Send + Sync,
{
    fn old(&self) -> Vec<(u64, usize)> {
        let asked = |number| {
            let old = &self.shard(number).old;
            (old.bytes > 0).then_some((old.asked, number))
        };
        (0..self.shards.len()).filter_map(asked).collect()
    }

    fn grow_old(&self) {
        (0..self.shards.len()).for_each(|number| drop(self.change(number, Generations::grow_old)));
    }

    fn forget(&self, shard: usize) {
        // Dropping a generation may take long, so it is dropped after the shard's lock is released.
        drop(self.change(shard, |shard| mem::take(&mut shard.old)));
    }
}

impl<K, V> Drop for Inner<K, V> {
    fn drop(&mut self) {
        let held = |shard: &mut Mutex<Generations<K, V>>| shard.get_mut().map_or(0, |shard| shard.bytes());
        let held = self.shards.iter_mut().map(held).sum();
        if let Some(budget) = self.budget.get() {
            budget.count(held, 0);
        }
    }
}

impl<K, V> Generations<K, V> {
    fn bytes(&self) -> usize {
        self.young.bytes + self.old.bytes
    }

    /// Makes the young generation old, and returns the former old one, which is forgotten.
    fn grow_old(&mut self) -> Generation<K, V> {
        mem::replace(&mut self.old, mem::take(&mut self.young))
    }
}

impl<K: Copy + Eq + Hash, V> Generations<K, V> {
    /// Returns the slot of a key and makes it young; a new slot counts as so many bytes.
    fn slot(&mut self, key: K, bytes: usize, room: usize) -> LazyValue<V> {
        if let Some((slot, _)) = self.young.slots.get(&key) {
            return Arc::clone(slot);
        }
        let (slot, bytes) = self.old.remove(&key).unwrap_or_else(|| (LazyValue::default(), bytes));
        self.hold(key, (Arc::clone(&slot), bytes), room);
        slot
    }

    /// Adds the bytes of a value that has been computed, unless its entry is forgotten already.
    fn grow(&mut self, key: K, slot: &LazyValue<V>, more: usize, room: usize) {
        let held = self.young.remove(&key).or_else(|| self.old.remove(&key));
        if let Some((own, bytes)) = held {
            let more = if Arc::ptr_eq(&own, slot) { more } else { 0 };
            self.hold(key, (own, bytes + more), room);
        }
    }

    fn hold(&mut self, key: K, entry: (LazyValue<V>, usize), room: usize) {
        if self.young.bytes + entry.1 > room && !self.young.slots.is_empty() {
            self.grow_old();
        }
        self.young.bytes += entry.1;
        self.young.slots.insert(key, entry);
    }
}

impl<K: Eq + Hash, V> Generation<K, V> {
    fn remove(&mut self, key: &K) -> Option<(LazyValue<V>, usize)> {
        let entry = self.slots.remove(key)?;
        self.bytes -= entry.1;
        Some(entry)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::stop::Stopped;

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
        // A quarter of the bytes has room for two hundred of the values.
        for key in 9_800..10_000 {
            get(key);
        }
        assert_eq!(made.get(), 10_000);
        memory.reserve(20 << 20);
        for key in (0..10_000).chain(0..10_000) {
            get(key);
        }
        // Some values of the first round were still there, and all values of the second round.
        assert!((18_900..20_000).contains(&made.get()), "{}", made.get());
    }

    #[test]
    fn a_maker_that_fails_leaves_nothing() {
        let memory: Memory<u64, Vec<u64>> = Memory::new(1 << 10);
        assert_eq!(memory.try_get(1, || Err(Stopped)), Err(Stopped));
        assert_eq!(*memory.get(1, || vec![7]), [7]);
        assert_eq!(memory.try_get(1, || Err(Stopped)).as_deref(), Ok(&vec![7]));
    }

    #[test]
    fn a_value_larger_than_the_room_for_it_is_remembered_alone() {
        let memory: Memory<u64, Vec<u64>> = Memory::new(1 << 10);
        for key in [1, 1, 2, 2, 1] {
            assert_eq!(memory.get(key, || vec![key; 1 << 10])[0], key);
        }
        assert!(memory.usage().held < 5 << 13, "{} bytes are kept", memory.usage().held);
    }

    #[test]
    fn memories_share_a_budget_and_forget_what_was_asked_for_the_longest_time_ago() {
        const BYTES: usize = 1 << 20;
        let budget = Budget::new(BYTES);
        // Each memory alone may hold more than the budget of all.
        let memories: Vec<Memory<u64, Vec<u64>>> = (0..4).map(|_| Memory::new(16 << 20)).collect();
        for memory in &memories {
            memory.share(&budget);
        }
        let made = Cell::new(0);
        let get = |memory: usize, key: u64| {
            let make = || {
                made.set(made.get() + 1);
                vec![key; 100]
            };
            assert_eq!(memories[memory].get(key, make)[99], key);
            let usage = budget.usage();
            assert!(usage.held <= usage.most && usage.most == BYTES, "{usage:?}");
            assert_eq!(usage.held, memories.iter().map(|memory| memory.usage().held).sum::<usize>());
        };
        // A memory that is not asked any more gives up all of its room to one that is asked.
        (0..10_000).for_each(|key| get(0, key));
        let least = BYTES - BYTES / FREED - 2000;
        assert!(memories[0].usage().held > least, "{:?}", memories[0].usage());
        (0..10_000).for_each(|key| get(1, key));
        assert_eq!(memories[0].usage().held, 0);
        assert!(memories[1].usage().held > least, "{:?}", memories[1].usage());
        // Values that are asked for all the time stay, whatever else is stored.
        (0..100).for_each(|key| get(2, key));
        made.set(0);
        for key in 0..10_000 {
            get(2, key % 100);
            get(3, key);
        }
        assert!((10_000..10_100).contains(&made.get()), "{}", made.get());
    }

    #[test]
    fn what_is_gone_is_nothing_of_the_budget() {
        let budget = Budget::new(1 << 20);
        let [one, other]: [Memory<u64, Vec<u64>>; 2] = [1 << 20, 1 << 20].map(Memory::new);
        one.get(1, || vec![1; 100]);
        // A memory's bytes count from the moment it shares the budget, and only once.
        (0..2).for_each(|_| one.share(&budget));
        assert_eq!(budget.usage().held, one.usage().held);
        other.share(&budget);
        other.get(1, || vec![1; 1000]);
        assert_eq!(budget.usage().held, one.usage().held + other.usage().held);
        drop(one);
        assert_eq!(budget.usage().held, other.usage().held);
        drop(other);
        assert_eq!(budget.usage().held, 0);
    }

    #[test]
    fn no_thread_takes_more_while_another_forgets() {
        const BYTES: usize = 1 << 20;
        let budget = Budget::new(BYTES);
        let memory: Memory<u64, Vec<u64>> = Memory::within(8 * BYTES, Some(&budget));
        std::thread::scope(|scope| {
            // As a thread does that is kept from running while it forgets.
            let forgets = budget.members.lock().unwrap();
            scope.spawn(|| (0..10_000).for_each(|key| drop(memory.get(key, || vec![key; 100]))));
            while budget.usage().held <= BYTES {
                std::thread::yield_now();
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
            let held = budget.usage().held;
            drop(forgets);
            assert!(held <= BYTES + 2000, "{held} bytes are held");
        });
    }

    #[test]
    fn threads_share_a_budget() {
        let budget = Budget::new(1 << 20);
        let memories: Vec<Memory<u64, Vec<u64>>> = (0..3).map(|_| Memory::new(4 << 20)).collect();
        for memory in &memories {
            memory.share(&budget);
        }
        let ask = |first: u64| {
            for number in 0..20_000 {
                let key = hash::combine(first, number) % 3000;
                let memory = &memories[(key % 3) as usize];
                assert_eq!(memory.get(key, || vec![key; (key % 200) as usize + 1])[0], key);
            }
        };
        std::thread::scope(|scope| (0..4).for_each(|first| drop(scope.spawn(move || ask(first)))));
        let held: usize = memories.iter().map(|memory| memory.usage().held).sum();
        assert_eq!(budget.usage().held, held);
        assert!(held <= (1 << 20) + 4 * 2000, "{held} bytes are held");
    }
}
