//! What has been computed, kept for a while: a cache of pure functions, which changes nothing but time.

use std::collections::HashMap;
use std::fmt::Debug;
use std::hash::{BuildHasher, BuildHasherDefault, Hash, Hasher};
use std::mem;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, Weak};

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

/// Bytes that any number of memories share, such as those of several worlds: together they hold no more than it has, and what was
/// asked for the longest time ago is forgotten first, whichever of them holds it.
///
/// What is under way counts when it is done, and what somebody still uses stays until then, so a little more may be held.
#[derive(Debug)]
pub struct Budget {
    bytes: usize,
    /// Bytes that all memories hold.
    held: AtomicUsize,
    /// Bytes that they have taken since the beginning: what tells earlier from later.
    taken: AtomicU64,
    members: Mutex<Vec<Weak<dyn Member>>>,
}

/// The part of a budget that is free after something was forgotten: the larger, the rarer all memories are looked through.
const FREED: usize = 8;

impl Budget {
    /// A budget of so many bytes.
    pub fn new(bytes: usize) -> Arc<Budget> {
        Arc::new(Budget { bytes, held: AtomicUsize::new(0), taken: AtomicU64::new(0), members: Mutex::default() })
    }

    /// What all memories hold now, and what they hold at most.
    pub fn usage(&self) -> Usage {
        Usage { held: self.held.load(Ordering::Relaxed), most: self.bytes }
    }

    /// Counts what a memory holds now that held something else before; whether that makes too much.
    fn count(&self, before: usize, after: usize) -> bool {
        if after <= before {
            self.held.fetch_sub(before - after, Ordering::Relaxed);
            return false;
        }
        let more = after - before;
        self.taken.fetch_add(more as u64, Ordering::Relaxed);
        self.held.fetch_add(more, Ordering::Relaxed) + more > self.bytes
    }

    /// Forgets what is old, and, if that is not enough, what has grown old now, from what was asked for the longest time ago on.
    fn forget(&self) {
        // A thread that finds too much waits for the one that forgets already. Otherwise it would take more and more while that one is
        // kept from running.
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

/// A memory, whatever it remembers.
pub trait Remembers {
    /// What it holds now, and what it holds at most.
    fn usage(&self) -> Usage;

    /// Makes the memory share a budget from now on, unless it shares one already.
    fn share(&self, budget: &Arc<Budget>);
}

/// What a budget asks of a memory.
trait Member: Debug + Send + Sync {
    /// The shards that hold something old, and when that was asked for last, in bytes taken.
    fn old(&self) -> Vec<(u64, usize)>;

    /// Makes old what is young.
    fn grow_old(&self);

    /// Forgets what is old in a shard.
    fn forget(&self, shard: usize);
}

/// Remembers the values of a pure function, as many as fit into some bytes: those that were asked for last.
///
/// A value is computed once even if several threads ask at a time; computing it must not ask for the same key again.
#[derive(Debug)]
pub struct Memory<K, V>(Arc<Inner<K, V>>);

/// What the owner of a memory and its budget both hold: the budget weakly, so that a memory is gone with its owner.
#[derive(Debug)]
struct Inner<K, V> {
    shards: Vec<Mutex<Shard<K, V>>>,
    /// Bytes of a generation of a shard.
    room: AtomicUsize,
    /// What it shares with others.
    budget: OnceLock<Arc<Budget>>,
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
    /// When something of it was asked for last, by the bytes that its budget had taken.
    asked: u64,
}

impl<K, V> Default for Generation<K, V> {
    fn default() -> Generation<K, V> {
        Generation { slots: HashMap::default(), bytes: 0, asked: 0 }
    }
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
        let shard = || Mutex::new(Shard { young: Generation::default(), old: Generation::default() });
        Memory(Arc::new(Inner {
            shards: (0..shards).map(|_| shard()).collect(),
            room: AtomicUsize::new(bytes / (2 * shards)),
            budget: OnceLock::new(),
        }))
    }

    /// The same, which shares a budget with others, if there is one.
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

    /// Makes room for so many bytes, if it has less.
    pub fn reserve(&self, bytes: usize) {
        self.0.room.fetch_max(bytes / (2 * self.0.shards.len()), Ordering::Relaxed);
    }

    /// The value of `key`, which is made if it is not remembered.
    ///
    /// What takes long asks for something all the time, so this is where most work is stopped: under no lock, and a value
    /// whose making unwinds is not there for the next who asks.
    pub fn get(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        stop::check();
        // By other bits than those by which the tables of the shards place it.
        let shard = (HashKeys::default().hash_one(key) >> 32) as usize % self.0.shards.len();
        let room = self.0.room.load(Ordering::Relaxed);
        let slot = self.0.look_up(shard, |shard| shard.slot(key, Self::ENTRY_BYTES, room));
        // Not under the lock: making one value may ask for others.
        let mut held = None;
        let value = slot.get_or_init(|| {
            let mut value = make();
            value.shrink();
            held = Some(value.heap_bytes());
            Arc::new(value)
        });
        if let Some(bytes) = held {
            self.0.look_up(shard, |shard| shard.grow(key, &slot, bytes, room));
        }
        Arc::clone(value)
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
            // Nobody else has it yet: a world is given its budget when it is made.
            budget.count(0, self.usage().held);
            let member: Weak<Inner<K, V>> = Arc::downgrade(&self.0);
            budget.members.lock().unwrap_or_else(PoisonError::into_inner).push(member);
            Arc::clone(budget)
        });
    }
}

impl<K, V> Inner<K, V> {
    fn shard(&self, shard: usize) -> MutexGuard<'_, Shard<K, V>> {
        self.shards[shard].lock().expect("no thread panics while it looks up")
    }

    /// Looks something up in a shard, and has the budget forget what is too much then.
    fn look_up<T>(&self, shard: usize, look: impl FnOnce(&mut Shard<K, V>) -> T) -> T {
        let budget = self.budget.get();
        let (found, is_too_much) = self.change(shard, |shard| {
            let found = look(shard);
            if let Some(budget) = budget {
                shard.young.asked = budget.taken.load(Ordering::Relaxed);
            }
            found
        });
        // Under no lock: what is forgotten may lie in this shard.
        if let Some(budget) = budget.filter(|_| is_too_much) {
            budget.forget();
        }
        found
    }

    /// Changes what a shard holds; and whether the budget has more than its bytes by that.
    fn change<T>(&self, shard: usize, change: impl FnOnce(&mut Shard<K, V>) -> T) -> (T, bool) {
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
        (0..self.shards.len()).for_each(|number| drop(self.change(number, Shard::grow_old)));
    }

    fn forget(&self, shard: usize) {
        // What is forgotten may take long to give back: that is done when the shard is free.
        drop(self.change(shard, |shard| mem::take(&mut shard.old)));
    }
}

impl<K, V> Drop for Inner<K, V> {
    fn drop(&mut self) {
        let held = |shard: &mut Mutex<Shard<K, V>>| shard.get_mut().map_or(0, |shard| shard.bytes());
        let held = self.shards.iter_mut().map(held).sum();
        if let Some(budget) = self.budget.get() {
            budget.count(held, 0);
        }
    }
}

impl<K, V> Shard<K, V> {
    fn bytes(&self) -> usize {
        self.young.bytes + self.old.bytes
    }

    /// Makes old what is young; what was old is returned, and not remembered any more.
    fn grow_old(&mut self) -> Generation<K, V> {
        mem::replace(&mut self.old, mem::take(&mut self.young))
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
            self.grow_old();
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

    #[test]
    fn memories_share_a_budget_and_forget_what_was_asked_for_the_longest_time_ago() {
        const BYTES: usize = 1 << 20;
        let budget = Budget::new(BYTES);
        // Each alone may hold more than all together.
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
        // One that nobody asks any more gives all of its room to one that is asked.
        (0..10_000).for_each(|key| get(0, key));
        let least = BYTES - BYTES / FREED - 2000;
        assert!(memories[0].usage().held > least, "{:?}", memories[0].usage());
        (0..10_000).for_each(|key| get(1, key));
        assert_eq!(memories[0].usage().held, 0);
        assert!(memories[1].usage().held > least, "{:?}", memories[1].usage());
        // What is asked for all the time stays, whatever else is taken.
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
        // It counts from then on, and once.
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
