//! A place on the stack that stays as it is.
//!
//! `fmi2Instantiate` takes its callbacks as a pointer to a struct. Some FMUs keep the pointer and
//! follow it as long as they live. The library that calls it here keeps the struct on its stack,
//! and the next calls would overwrite it. Therefore an instance is made at the bottom of a deep
//! stack, and everything else is called from its top. The distance is larger than the whole stack
//! of a usual program.

use std::{hint::black_box, mem::MaybeUninit};

/// Distance between deep calls and calls from the top, bytes: the usual stack of a whole program.
const DEPTH: usize = 8 << 20;
/// Stack of a thread that calls deep, bytes.
pub(crate) const STACK: usize = 3 * DEPTH;
/// Bytes of one frame.
const FRAME: usize = 64 << 10;

/// Calls a function [`DEPTH`] bytes further down.
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
    // Something has to be done after the call, because otherwise it would be a tail call and take
    // no stack.
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
