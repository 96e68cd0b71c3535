//! Counts instructions in the emulator.
//!
//! Under `-icount shift=7` an instruction takes 128 ns of virtual time. SysTick counts this time at
//! 25 MHz, which is exactly 3.2 ticks per instruction.

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

/// Returns the result of `body` and the number of its instructions, including the reading of the
/// counter.
#[inline(always)]
pub fn bracket<R>(body: impl FnOnce() -> R) -> (R, u32) {
    compiler_fence(SeqCst);
    let before = SYST::get_current();
    compiler_fence(SeqCst);
    let result = body();
    compiler_fence(SeqCst);
    let after = SYST::get_current();
    compiler_fence(SeqCst);
    // The counter counts down.
    let ticks = before.wrapping_sub(after) & RELOAD;
    (result, (ticks * 10 + 16) / 32)
}
