//! C code for the models `observer` and `observer+rest`, in integers and in `float`.

use stretch_core::{Calibration, RestLevel};
use stretch_receptor::{
    ObserverReceptor,
    code::{IntegerObserver, RestNumbers},
};

use crate::{
    ExportError,
    constants::{Constants, Literal},
    part::Part,
};

/// Returns the constants and the step (the C code for one sample) of an observer in integers.
pub(crate) fn observer_fixed(observer: &IntegerObserver) -> Part {
    let IntegerObserver { numbers: n, recips, recip_bits, tangents, at_rest } = observer;
    let adc_bits = u32::from(n.adc_bits.min(16));
    let per_code = 1i32 << (16 - adc_bits + 12);
    let knots = usize::from(n.knots);
    let follows = n.rest.pull != 0;
    let mut constants = Constants::default();
    constants
        .define("CODES", 1u32 << adc_bits, "number of codes")
        .define("SIGNAL_PER_CODE", if n.falling { -per_code } else { per_code }, "")
        .define("KNOTS", knots as i32, "knots of the curve from drive to signal")
        .array("int32_t", "curve", &n.curve[..knots])
        .array("int32_t", "recips", &recips[..knots])
        .define(
            "RECIP_BITS",
            *recip_bits as i32,
            "recips are positions on the curve per unit of signal, times 2^RECIP_BITS",
        )
        .array(
            "int32_t",
            "tangents",
            &tangents[..knots].iter().map(|&t| t.into()).collect::<Vec<i32>>(),
        )
        .define("DRIVE_LOW", n.drive_low, "the drive of the first knot")
        .define("PER_STEP", n.per_step, "places per drive");
    constants.define("LEAD", n.lead, "samples by which the signal leads");
    define_memory(
        &mut constants,
        "int32_t",
        [n.relaxations.into(), n.plays.into()],
        [&n.shares, &n.amplitudes, &n.radii, &n.play_weights],
    );
    constants
        .define("SLOPES", n.gains.len() as i32, "number of slopes with gains")
        .array("int32_t", "ends", &n.ends)
        .rows("int32_t", "gains", &n.gains)
        .define("GAIN_BITS", i32::from(n.gain_bits), "gains: state per signal, times 2^this")
        .define("GAIN_HALF", (1i64 << n.gain_bits) >> 1, "")
        .define("LOW", n.low, "smallest target")
        .define("HIGH", n.high, "largest target")
        .define("DEAD_BAND", n.dead_band, "the branch changes only at a rate above this one")
        .define("ZERO", n.zero, "output at a target of 0")
        .define("GAIN", n.gain, "output per target")
        .define("OUTPUT_SHIFT", 26 + i32::from(n.output_bits), "")
        .define("FOLLOWS_REST", i32::from(follows), "1 if a drifting baseline is tracked, else 0");
    if follows {
        let RestNumbers { level, pull, leak, average, most, furthest } = n.rest;
        let rest = RestLevel { level, pull, leak, average, furthest, most };
        define_rest(&mut constants, *at_rest, rest);
    }
    Part {
        model: if follows { "observer+rest" } else { "observer" }.into(),
        constants,
        step: vec![include_str!("../c/observer_fixed.h")],
        has: Vec::new(),
    }
}

/// Smallest length of a secant of the curve, as a share of the distance between knots. The receptor
/// uses the same value.
const LEAST_RUN: f32 = 0.01;

/// Returns the constants and the step of an observer in `float`.
pub(crate) fn observer_float(calibration: &Calibration) -> Result<Part, ExportError> {
    let receptor = ObserverReceptor::<f32>::new(calibration)?;
    let o = receptor.model();
    let follows = o.rest.follows();
    let mut constants = Constants::default();
    constants
        .define("SIGN", o.sign, "-1 if the signal falls as the target rises")
        .define("PERIOD_S", o.period_s, "from a sample to the next")
        .define("KNOTS", o.curve.knots as i32, "knots of the curve from drive to signal")
        .array("float", "curve", &o.curve.values[..o.curve.knots])
        .define("DRIVE_LOW", o.curve.low, "the drive of the first knot")
        .define("DRIVE_STEP", o.curve.step, "distance of knots")
        .define("PER_STEP", o.curve.per_step, "1 / DRIVE_STEP")
        .define(
            "LEAST_RUN",
            LEAST_RUN * o.curve.step,
            "smallest change of the drive for which a secant is computed",
        );
    constants.define("LEAD_S", o.lead_s, "seconds by which the signal leads");
    define_memory(
        &mut constants,
        "float",
        [o.relaxations as i32, o.plays as i32],
        [&o.shares, &o.amplitudes, &o.radii, &o.play_weights],
    );
    constants
        .define("SLOPES", o.gains.len() as i32, "number of slopes with gains")
        .array("float", "ends", &o.ends)
        .rows("float", "gains", &o.gains)
        .define("LOW", o.low, "smallest target")
        .define("HIGH", o.high, "largest target")
        .define("DEAD_BAND", o.dead_band, "the branch changes only at a target rate above this one")
        .define("ZERO", o.zero, "reference at a target of 0")
        .define("GAIN", o.gain, "reference per target")
        .define("FOLLOWS_REST", i32::from(follows), "1 if a drifting baseline is tracked, else 0");
    if follows {
        define_rest(&mut constants, o.at_rest, o.rest);
    }
    Ok(Part {
        model: if follows { "observer+rest" } else { "observer" }.into(),
        constants,
        step: vec![include_str!("../c/observer_float.h")],
        has: Vec::new(),
    })
}

/// Writes the constants of the gauge's memory. Unused arrays are written as zeros, because C has no
/// empty arrays.
fn define_memory<L: Literal>(
    constants: &mut Constants,
    kind: &str,
    [relaxations, plays]: [i32; 2],
    [shares, amplitudes, radii, play_weights]: [&[L]; 4],
) {
    constants
        .define("RELAXATIONS", relaxations, "")
        .array(kind, "shares", shares)
        .array(kind, "amplitudes", amplitudes)
        .define("PLAYS", plays, "")
        .array(kind, "radii", radii)
        .array(kind, "play_weights", play_weights);
}

/// Writes the constants with which the step tracks the baseline.
pub(super) fn define_rest<L: Literal>(constants: &mut Constants, at_rest: L, rest: RestLevel<L>) {
    let RestLevel { level, pull, leak, average, furthest, most } = rest;
    constants
        .define("AT_REST", at_rest, "signal at rest, with settled memory")
        .define("REST_LEVEL", level, "signal at rest in the calibration")
        .define("REST_PULL", pull, "share of a negative excess that is followed")
        .define("REST_LEAK", leak, "rise of the baseline per sample if the excess is not negative")
        .define("REST_AVERAGE", average, "share of a sample in the running average")
        .define("REST_MOST", most, "largest excess that counts")
        .define("REST_FURTHEST", furthest, "largest size of the baseline");
}
