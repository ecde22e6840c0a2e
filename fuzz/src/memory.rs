//! Counts what is allocated: an execution gives back all it took, and never takes much.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicIsize, AtomicUsize, Ordering::Relaxed};

/// Executions after which everything that is made once (tables, threads) is there.
const WARM_UP: usize = 2_000;
/// By how much the memory held between two executions may grow over a whole run, in bytes: what is
/// made once, but late. The smallest leak per execution exceeds it within a million executions.
const GROWTH: isize = 64 << 10;
/// Most memory that one execution may hold, in bytes.
const MOST: isize = 64 << 20;

static LIVE: AtomicIsize = AtomicIsize::new(0);
static PEAK: AtomicIsize = AtomicIsize::new(0);
static BASE: AtomicIsize = AtomicIsize::new(0);
static EXECUTIONS: AtomicUsize = AtomicUsize::new(0);

/// The allocator of the system, with a count. The corpus is the fuzzer's and does not count.
struct Counting;

// SAFETY: all is left to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let live = LIVE.fetch_add(layout.size() as isize, Relaxed) + layout.size() as isize;
        PEAK.fetch_max(live, Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size() as isize, Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Runs one execution and looks at what memory it held and left.
pub fn execution(body: impl FnOnce()) {
    let before = LIVE.load(Relaxed);
    PEAK.store(before, Relaxed);
    body();
    let held = PEAK.load(Relaxed) - before;
    assert!(held <= MOST, "one execution held {held} bytes");
    let live = LIVE.load(Relaxed);
    if EXECUTIONS.fetch_add(1, Relaxed) < WARM_UP {
        BASE.store(live, Relaxed);
    }
    let grown = live - BASE.load(Relaxed);
    assert!(grown <= GROWTH, "memory has grown by {grown} bytes");
}
