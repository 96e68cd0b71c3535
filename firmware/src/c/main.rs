//! The headers of `stretch export`, compiled by a C compiler and replayed in the same way as the
//! Rust steps.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use stretch_core::Branch;
use stretch_firmware::{
    gauges,
    measure::{Answer, Length, replay},
    trial,
};
use stretch_receptor::{Domain, Withheld, code::CodeReading};

/// The C type `stretch_reading` in integers.
#[repr(C)]
struct Fixed {
    estimate: i32,
    status: u8,
    branch: u8,
    domain: u8,
}

/// The C type `stretch_reading` in `float`.
#[repr(C)]
struct Float {
    estimate: f32,
    rate: f32,
    status: u8,
    branch: u8,
    domain: u8,
}

/// The C type `stretch_reading` in `float`, for a model that computes a standard deviation.
#[repr(C)]
struct FloatSd {
    estimate: f32,
    rate: f32,
    sd: f32,
    status: u8,
    branch: u8,
    domain: u8,
}

/// The C type `stretch_reading` for several gauges.
#[repr(C)]
struct Gauges {
    estimate: f32,
    sd: f32,
    lost: u16,
    status: u8,
    clamped: u8,
}

/// Space for any `stretch_state`, in words for alignment.
const WORDS: usize = 64;

fn answer<E: Length>(estimate: E, status: u8, branch: u8, domain: u8) -> Answer<E> {
    match status {
        0 => {
            let branch = if branch == 0 { Branch::Inflation } else { Branch::Deflation };
            let domain = match domain {
                0 => Domain::Inside,
                1 => Domain::SignalClamped,
                2 => Domain::RateClamped,
                _ => Domain::BothClamped,
            };
            Ok(CodeReading { estimate, branch, domain })
        }
        1 => Err(Withheld::Warming),
        _ => Err(Withheld::Missing),
    }
}

/// Replays a header whose readings have this type.
macro_rules! model {
    ($symbol:ident, $name:literal, $reading:ty, $sample:ty, $input:expr) => {
        model!(
            $symbol,
            $name,
            $reading,
            $sample,
            $input,
            |sample: &$sample| *sample,
            |r: $reading| answer(r.estimate, r.status, r.branch, r.domain)
        )
    };
    ($symbol:ident, $name:literal, $reading:ty, $sample:ty, $input:expr, $pass:expr, $answer:expr) => {{
        mod linked {
            use super::*;
            unsafe extern "C" {
                #[link_name = concat!("c_", stringify!($symbol), "_bytes")]
                pub static BYTES: u32;
                #[link_name = concat!("c_", stringify!($symbol), "_init")]
                pub fn init(state: *mut u32);
                #[link_name = concat!("c_", stringify!($symbol), "_step")]
                pub static STEP: unsafe extern "C" fn(*mut u32, $sample) -> $reading;
                #[link_name = concat!("c_", stringify!($symbol), "_self_test")]
                pub fn self_test() -> i32;
            }
        }
        // SAFETY: a constant of the C program.
        let bytes = unsafe { linked::BYTES } as usize;
        assert!(bytes <= 4 * WORDS, "{}: a state of {bytes} bytes", $name);
        // SAFETY: it uses its own state.
        let wrong = unsafe { linked::self_test() };
        assert!(wrong == 0, "{}: the self-test fails at sample {wrong}", $name);
        // SAFETY: a constant of the C program.
        let step = unsafe { linked::STEP };
        let mut room = [0; WORDS];
        let state: &mut [u32] = &mut room[..bytes.div_ceil(4)];
        // SAFETY: the state is aligned and large enough.
        unsafe { linked::init(state.as_mut_ptr()) };
        replay(
            $name,
            &(),
            state,
            $input,
            // SAFETY: as above, and it was initialised.
            |_, state, sample| unsafe { step(state.as_mut_ptr(), $pass(&sample)) },
            $answer,
        );
    }};
}

macro_rules! fixed {
    ($symbol:ident, $name:literal) => {
        model!($symbol, $name, Fixed, i32, |code| code.0)
    };
}

macro_rules! float {
    ($symbol:ident, $name:literal) => {
        model!($symbol, $name, Float, f32, trial::volts)
    };
}

macro_rules! float_sd {
    ($symbol:ident, $name:literal) => {
        model!($symbol, $name, FloatSd, f32, trial::volts)
    };
}

macro_rules! gauges {
    ($symbol:ident, $name:literal) => {
        model!(
            $symbol,
            $name,
            Gauges,
            *const f32,
            |code| gauges::samples(trial::volts(code)),
            |samples: &[f32; gauges::GAUGES]| samples.as_ptr(),
            |r: Gauges| answer(r.estimate, r.status, u8::from(r.lost != 0), r.clamped)
        )
    };
}

#[entry]
fn main() -> ! {
    include!(concat!(env!("OUT_DIR"), "/c_models.rs"));
    semihosting::process::exit(0)
}
