//! `observer` and `observer+rest` in integers.

use stretch_receptor::code::{IntegerObserver, ObserverNumbers, RestNumbers};

use crate::{constants::Constants, part::Part};

/// The constants and the step of a converted observer.
pub(crate) fn observer_fixed(observer: &IntegerObserver) -> Part {
    let IntegerObserver { numbers: n, recips, recip_bits, tangents, at_rest } = observer;
    let adc_bits = u32::from(n.adc_bits.min(16));
    let per_code = 1i32 << (16 - adc_bits + 12);
    let knots = usize::from(n.knots);
    let follows = n.rest.pull != 0;
    let mut constants = Constants::default();
    constants
        .define("CODES", 1u32 << adc_bits, "the first number that is no code")
        .define("SIGNAL_PER_CODE", if n.falling { -per_code } else { per_code }, "")
        .define("KNOTS", knots as i32, "of the curve from drive to signal")
        .array("int32_t", "curve", &n.curve[..knots])
        .array("int32_t", "recips", &recips[..knots])
        .define("RECIP_BITS", *recip_bits as i32, "places per signal, times 2 to this: recips")
        .array(
            "int32_t",
            "tangents",
            &tangents[..knots].iter().map(|&t| t.into()).collect::<Vec<i32>>(),
        )
        .define("DRIVE_LOW", n.drive_low, "the drive of the first knot")
        .define("PER_STEP", n.per_step, "places per drive");
    memory(&mut constants, n);
    constants
        .define("SLOPES", n.gains.len() as i32, "that there are gains for")
        .array("int32_t", "ends", &n.ends)
        .rows("int32_t", "gains", &n.gains)
        .define("GAIN_BITS", i32::from(n.gain_bits), "state per signal, times 2 to this: gains")
        .define("GAIN_HALF", (1i64 << n.gain_bits) >> 1, "")
        .define("LOW", n.low, "the least target")
        .define("HIGH", n.high, "the greatest")
        .define("DEAD_BAND", n.dead_band, "the largest rate that keeps the branch")
        .define("ZERO", n.zero, "the output at a target of 0")
        .define("GAIN", n.gain, "the output per target")
        .define("OUTPUT_SHIFT", 26 + i32::from(n.output_bits), "")
        .define("FOLLOWS_REST", i32::from(follows), "whether a baseline is followed");
    if follows {
        let RestNumbers { level, pull, leak, average, most, furthest } = n.rest;
        constants
            .define("AT_REST", *at_rest, "the signal where the target rests, memory settled")
            .define("REST_LEVEL", level, "the resting signal")
            .define("REST_PULL", pull, "the share of an excess below rest that is taken up")
            .define("REST_LEAK", leak, "what the baseline rises by otherwise")
            .define("REST_AVERAGE", average, "share of a sample in the running average")
            .define("REST_MOST", most, "what an excess counts for at most")
            .define("REST_FURTHEST", furthest, "the furthest that the baseline goes");
    }
    Part {
        model: if follows { "observer+rest" } else { "observer" }.into(),
        constants: constants.into_text(),
        step: vec![include_str!("../c/fixed.h"), include_str!("../c/observer_fixed.h")],
        has: Vec::new(),
    }
}

/// What the gauge remembers. C has no arrays of nothing: those that are not used stay, as zeros.
fn memory(constants: &mut Constants, n: &ObserverNumbers) {
    constants
        .define("LEAD", n.lead, "samples by which the signal leads")
        .define("RELAXATIONS", i32::from(n.relaxations), "")
        .array("int32_t", "shares", &n.shares)
        .array("int32_t", "amplitudes", &n.amplitudes)
        .define("PLAYS", i32::from(n.plays), "")
        .array("int32_t", "radii", &n.radii)
        .array("int32_t", "play_weights", &n.play_weights);
}
