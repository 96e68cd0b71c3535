//! `observer` and `observer+rest` in `float`.

use stretch_core::{Calibration, RestLevel};
use stretch_receptor::{ObserverReceptor, model::Observer};

use crate::{ExportError, constants::Constants, part::Part};

/// A secant is taken over at least this share of the way between knots, as in the receptor.
const LEAST_RUN: f32 = 0.01;

/// The constants and the step of an observer.
pub(crate) fn observer_float(calibration: &Calibration) -> Result<Part, ExportError> {
    let receptor = ObserverReceptor::<f32>::new(calibration)?;
    let o = receptor.model();
    let follows = o.rest.follows();
    let mut constants = Constants::default();
    constants
        .define("SIGN", o.sign, "-1 where the signal falls as the target rises")
        .define("PERIOD_S", o.period_s, "from a sample to the next")
        .define("KNOTS", o.knots as i32, "of the curve from drive to signal")
        .array("float", "curve", &o.curve[..o.knots])
        .define("DRIVE_LOW", o.drive_low, "the drive of the first knot")
        .define("DRIVE_STEP", o.drive_step, "from knot to knot")
        .define("PER_STEP", o.per_step, "its reciprocal")
        .define("LEAST_RUN", LEAST_RUN * o.drive_step, "the least that a secant is taken over");
    memory(&mut constants, o);
    constants
        .define("SLOPES", o.gains.len() as i32, "that there are gains for")
        .array("float", "ends", &o.ends)
        .rows("float", "gains", &o.gains)
        .define("LOW", o.low, "the least target")
        .define("HIGH", o.high, "the greatest")
        .define("DEAD_BAND", o.dead_band, "the largest rate of the target that keeps the branch")
        .define("ZERO", o.zero, "the reference at a target of 0")
        .define("GAIN", o.gain, "the reference per target")
        .define("FOLLOWS_REST", i32::from(follows), "whether a baseline is followed");
    if follows {
        let RestLevel { level, pull, leak, average, furthest, most } = o.rest;
        constants
            .define("AT_REST", o.at_rest, "the signal where the target rests, memory settled")
            .define("REST_LEVEL", level, "the resting signal")
            .define("REST_PULL", pull, "the share of an excess below rest that is taken up")
            .define("REST_LEAK", leak, "what the baseline rises by otherwise")
            .define("REST_AVERAGE", average, "share of a sample in the running average")
            .define("REST_MOST", most, "what an excess counts for at most")
            .define("REST_FURTHEST", furthest, "the furthest that the baseline goes");
    }
    Ok(Part {
        model: if follows { "observer+rest" } else { "observer" }.into(),
        constants: constants.into_text(),
        step: vec![
            include_str!("../c/float.h"),
            include_str!("../c/float_reading.h"),
            include_str!("../c/observer_float.h"),
            include_str!("../c/float_end.h"),
        ],
        has: Vec::new(),
    })
}

/// What the gauge remembers. C has no arrays of nothing: those that are not used stay, as zeros.
fn memory(constants: &mut Constants, o: &Observer<f32>) {
    constants
        .define("LEAD_S", o.lead_s, "seconds by which the signal leads")
        .define("RELAXATIONS", o.relaxations as i32, "")
        .array("float", "shares", &o.shares)
        .array("float", "amplitudes", &o.amplitudes)
        .define("PLAYS", o.plays as i32, "")
        .array("float", "radii", &o.radii)
        .array("float", "play_weights", &o.play_weights);
}
