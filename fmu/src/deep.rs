//! Calls at the bottom of a deep stack, so that their stack frames are not overwritten.
//!
//! `fmi2Instantiate` takes its callbacks as a pointer to a struct. Some FMUs keep this pointer and
//! dereference it during their whole life. The library used here keeps the struct on its stack,
//! where later calls would overwrite it. Therefore an instance is created at the bottom of a deep
//! stack, and everything else is called from its top. The distance equals the whole stack of a
//! usual program.

use std::{hint::black_box, mem::MaybeUninit};

/// Distance on the stack between the call that creates an instance and all other calls, bytes. It
/// is the usual stack size of a program.
const DEPTH: usize = 8 << 20;
/// Stack size of a thread that makes deep calls, bytes.
pub(crate) const STACK: usize = 3 * DEPTH;
/// Size of one frame, bytes.
const FRAME: usize = 64 << 10;

/// Calls a function [`DEPTH`] bytes further down the stack.
pub(crate) fn deep<T>(call: impl FnOnce() -> T) -> Option<T> {
    let mut call = Some(call);
    let mut out = None;
    sink(DEPTH / FRAME, &mut || out = call.take().map(|call| call()));
    out
}

#[inline(never)]
fn sink(frames: usize, call: &mut dyn FnMut()) {
    let frame = MaybeUninit::<[u8; FRAME]>::uninit();
    black_box(&frame);
    match frames {
        0 => call(),
        _ => sink(frames - 1, call),
    }
    // This use of `frame` prevents a tail call, which would need no additional stack.
    black_box(&frame);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_called_deep_lies_below_by_the_depth() {
        let place = || {
            let here = black_box(0_u8);
            black_box(&raw const here) as usize
        };
        let run = move || {
            let top = place();
            assert!(top - deep(place).unwrap() > DEPTH);
        };
        std::thread::Builder::new().stack_size(STACK).spawn(run).unwrap().join().unwrap();
    }
}
