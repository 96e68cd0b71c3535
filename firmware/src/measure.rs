//! Replays the trial through a receptor and prints the cost of a step.

use semihosting::{eprintln, println};
use stretch_core::Millimetres;
use stretch_receptor::{
    Reading, Withheld,
    code::{AdcCode, CodeReading},
};

use crate::{
    checksum::{Bits, Checksum},
    count, stack, trial,
};

/// The answer of a step.
pub type Answer<E> = Result<CodeReading<E>, Withheld>;

/// An estimate that can be converted to a length.
pub trait Length: Bits + Copy {
    /// Returns the length in millimetres.
    fn length(self) -> Millimetres<f32>;
}

impl Length for i32 {
    fn length(self) -> Millimetres<f32> {
        Millimetres(self as f32 / 1000.0)
    }
}

impl Length for f32 {
    fn length(self) -> Millimetres<f32> {
        Millimetres(self)
    }
}

/// Keeps length, branch and domain of a reading, but not its rate, so that the compiler removes the
/// computation of the rate.
#[inline(always)]
pub fn length_only(answer: Result<Reading<f32>, Withheld>) -> Answer<f32> {
    answer.map(|Reading { estimate, branch, domain, .. }| CodeReading { estimate, branch, domain })
}

/// Replays every sample through `step`, a function that is not inlined, and prints one line.
///
/// `input` makes the sample, and `answer` converts the result to an answer; the instructions of both are not counted.
/// Counted are passing the arguments, the call, the step, and the return: the code between two readings of the counter,
/// without the readings themselves.
#[inline(never)]
pub fn replay<D, M: ?Sized, I, R, E: Length>(
    model: &str,
    design: &D,
    memory: &mut M,
    input: impl Fn(AdcCode) -> I,
    step: impl Fn(&D, &mut M, I) -> R,
    answer: impl Fn(R) -> Answer<E>,
) {
    // A program with several models starts the counter only once.
    if let Some(mut core) = cortex_m::Peripherals::take() {
        count::start(&mut core.SYST);
    }
    let ((), empty) = count::bracket(|| ());
    let (mut samples, mut total, mut max) = (0u32, 0u32, 0u32);
    let mut checksum = Checksum::default();
    let mut length = None;
    let sp = stack::paint();
    for code in trial::codes() {
        let sample = input(code);
        let (reading, count) = count::bracket(|| step(design, memory, sample));
        let (answer, count) = (answer(reading), count - empty);
        samples += 1;
        total += count;
        max = max.max(count);
        checksum.answer(answer);
        length = answer.ok().map(|reading| reading.estimate).or(length);
    }
    let stack = stack::depth(sp);
    let tenths = (total * 10 + samples / 2) / samples;
    println!(
        "model={model} mean={}.{} max={max} text_bytes={} stack_bytes={stack} state_bytes={} checksum={:08x}",
        tenths / 10,
        tenths % 10,
        text_bytes(),
        size_of_val(memory),
        checksum.0,
    );
    if let Some(length) = length {
        eprintln!("{model}: {samples} samples, the last length {} mm", length.length().0 as i32);
    }
}

/// Loads a calibration from flash and checks its checksum.
pub fn load<'a, T: serde::Deserialize<'a>>(record: &'a [u8]) -> T {
    stretch_core::record::load(record).expect("a sound record")
}

/// Generates the `main` of a program that replays the trial through a design, once for each model
/// and its calibration. The samples are converter codes, or volts in `f32`.
///
/// The arguments are `codes, Design, |record| design` or
/// `volts, Design, |calibration| design`, followed by `"model" from "record"` for each model.
#[macro_export]
macro_rules! program {
    (volts, $design:ty, $make:expr, $($model:literal from $record:literal),+ $(,)?) => {
        $crate::program!(
            @ $design, stretch_core::Volts<f32>, f32,
            |code| stretch_core::Volts($crate::trial::volts(code)),
            $crate::measure::length_only,
            $make, $($model from $record),+
        );
    };
    (codes, $design:ty, $make:expr, $($model:literal from $record:literal),+ $(,)?) => {
        $crate::program!(
            @ $design, stretch_receptor::code::AdcCode, i32,
            |code| code, core::convert::identity,
            $make, $($model from $record),+
        );
    };
    (@ $design:ty, $sample:ty, $estimate:ty, $input:expr, $answer:expr, $make:expr,
     $($model:literal from $record:literal),+) => {
        #[inline(never)]
        fn step(
            design: &$design,
            memory: &mut <$design as stretch_core::Design>::Memory,
            sample: $sample,
        ) -> $crate::measure::Answer<$estimate> {
            $answer(stretch_core::Stage::step(design, memory, sample))
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            $({
                static RECORD: &[u8] = include_bytes!(concat!(
                    env!("CARGO_MANIFEST_DIR"), "/data/", $record, ".postcard"
                ));
                let make = $make;
                let design: $design = make($crate::measure::load(RECORD));
                let mut memory = stretch_core::Design::memory(&design);
                let as_is = core::convert::identity;
                $crate::measure::replay($model, &design, &mut memory, $input, step, as_is);
            })+
            semihosting::process::exit(0)
        }
    };
}

/// Bytes of code in flash, from the linker.
fn text_bytes() -> usize {
    unsafe extern "C" {
        static __stext: u8;
        static __etext: u8;
    }
    (&raw const __etext as usize) - (&raw const __stext as usize)
}
