//! Measures the depth of the stack.

const DEPTH: usize = 4096;
const PAINT: u32 = 0xa5c3_5a3c;

/// Fills [`DEPTH`] bytes below the caller's frame with a pattern.
///
/// This function is inlined, so that none of its data lies in that area.
#[inline(always)]
pub fn paint() -> usize {
    let sp: usize;
    // SAFETY: reads a register.
    unsafe { core::arch::asm!("mov {}, sp", out(reg) sp, options(nomem, nostack)) };
    let mut at = sp - DEPTH;
    while at < sp {
        // SAFETY: free stack, aligned, inside RAM; the compiler keeps nothing below sp.
        unsafe { (at as *mut u32).write_volatile(PAINT) };
        at += 4;
    }
    sp
}

/// Returns the depth of the stack: the distance from `sp` down to the deepest byte that was written since [`paint`].
pub fn depth(sp: usize) -> usize {
    let mut at = sp - DEPTH;
    // SAFETY: as above, read only.
    while at < sp && unsafe { (at as *const u32).read_volatile() } == PAINT {
        at += 4;
    }
    sp - at
}
