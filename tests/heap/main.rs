//! What a world says that it remembers is what the allocator has handed out for it. A binary of its own, since it
//! counts all that is allocated.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use terrane::area::TileId;
use terrane::clock::Clock;
use terrane::preset::Preset;
use terrane::tile::Tile;
use terrane::world::World;

/// The system's allocator, which counts the bytes that are in use.
struct Counting;

static IN_USE: AtomicUsize = AtomicUsize::new(0);

#[expect(unsafe_code, reason = "the trait of allocators is unsafe; all is handed on to the system's")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        IN_USE.fetch_add(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn worlds_remember_as_many_bytes_as_they_say() {
    for name in ["alps", "archipelago", "thesis"] {
        let (_, mut preset) = Preset::load(name).unwrap();
        preset.tile_cells = 128;
        if name == "thesis" {
            preset.rivers = Some(terrane::agents::settings::RiverAgents::default());
            preset.roads = Some(terrane::agents::settings::RoadAgents::default());
        }
        let world = World::new(preset, Some(1)).unwrap();
        let before = IN_USE.load(Ordering::Relaxed);
        for x in 0..2 {
            let tile = Tile::new(&world, TileId { x, y: 0 });
            drop((
                world.lines(&tile.area(), &Clock::default()).unwrap(),
                world.lakes(&tile.area(), &Clock::default()).unwrap(),
                world.coasts(&tile.area(), &Clock::default()).unwrap(),
            ));
            drop((
                world.peaks(&tile.area(), &Clock::default()).unwrap(),
                world.sites(&tile.area(), &Clock::default()).unwrap(),
            ));
        }
        let taken = (IN_USE.load(Ordering::Relaxed) - before) as f64;
        let told = world.remembered_bytes() as f64;
        assert!(taken > 1e6, "{name} remembers only {taken} bytes");
        assert!(told >= 0.95 * taken && told <= 1.25 * taken, "{name} says {told} bytes, and has taken {taken}");
        assert!(world.remembered_bytes() <= world.memory_bytes(1), "{name}");
    }
}
