//! Counting instructions in the emulator.
//!
//! Under `-icount shift=7` an instruction takes 128 ns of virtual time and
//! SysTick counts 25 MHz of it: 3.2 ticks an instruction, exactly.

use core::sync::atomic::{Ordering::SeqCst, compiler_fence};

use cortex_m::peripheral::{SYST, syst::SystClkSource};

const RELOAD: u32 = 0x00ff_ffff;

/// Starts the counter.
pub fn start(syst: &mut SYST) {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(RELOAD);
    syst.clear_current();
    syst.enable_counter();
}

/// What `body` answers, and how many instructions it took, the reading of the
/// counter included.
#[inline(always)]
pub fn bracket<R>(body: impl FnOnce() -> R) -> (R, u32) {
    compiler_fence(SeqCst);
    let before = SYST::get_current();
    compiler_fence(SeqCst);
    let result = body();
    compiler_fence(SeqCst);
    let after = SYST::get_current();
    compiler_fence(SeqCst);
    // it counts down
    let ticks = before.wrapping_sub(after) & RELOAD;
    (result, (ticks * 10 + 16) / 32)
}
