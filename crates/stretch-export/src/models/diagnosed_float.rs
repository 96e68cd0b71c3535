//! C code in `float` for the models `diagnosed` and `diagnosed+rest`.

use stretch_core::Calibration;
use stretch_receptor::{
    Defects, DiagnosedReceptor,
    model::Diagnosed,
    numbers::{Bound, LEAST_ANSWER, LEAST_RUN, SMOOTH},
};

use super::observer::define_rest;
use crate::{ExportError, constants::Constants, part::Part};

/// Returns the constants and the step (the C code for one sample) of a gauge with named defects.
/// The code for other defects is left out.
pub(crate) fn diagnosed_float(calibration: &Calibration) -> Result<Part, ExportError> {
    let receptor = DiagnosedReceptor::<f32>::new(calibration)?;
    let model = receptor.model();
    let mut constants = Constants::default();
    filter(&mut constants, model);
    let mut has = vec!["sd"];
    defects(&mut constants, &mut has, &model.defects);
    if model.slip > 0.0 {
        has.push("slip");
        constants
            .define("SLIP", model.slip, "half-width of the sensor's slip")
            .define("SMOOTH", SMOOTH as f32, "share of a sample in the smoothed signal")
            .define("TURN_THRESHOLD", model.turn_threshold, "smallest signal change of a turn")
            .define("SLIP_VARIANCE", model.slip_variance, "SLIP^2/3: target anywhere in the slip")
            .define("SLIP_VARIANCE_SHARE", model.slip_variance_share, "low-pass gain per sample");
    }
    if has.contains(&"slip") || has.contains(&"hysteresis") {
        has.push("initial_hysteresis");
        let [initial, slope] = model.defects.initial_hysteresis;
        constants
            .define("INITIAL_HYSTERESIS", initial, "initial play state (-1..1) at a target of 0")
            .define("INITIAL_HYSTERESIS_SLOPE", slope, "change of that state per target");
    }
    if model.ahead_s != 0.0 {
        has.push("skew");
        constants.define("AHEAD_S", model.ahead_s, "lead of the estimate over the signal, s");
    }
    if model.rest.follows() {
        has.push("rest");
        define_rest(&mut constants, model.at_rest, model.rest);
    }
    Ok(Part {
        model: if model.rest.follows() { "diagnosed+rest" } else { "diagnosed" }.into(),
        constants,
        step: vec![include_str!("../c/diagnosed_float.h")],
        has,
    })
}

/// Writes the constants of the curve, the filter and the output.
fn filter(constants: &mut Constants, model: &Diagnosed<f32>) {
    let curve = &model.curve;
    let span = model.high - model.low;
    let tenth = 0.1 * span;
    constants
        .word("TELLS_SD", 1, "stretch_reading.sd")
        .define("SIGN", model.sign, "-1 if the signal falls as the target rises")
        .define("PERIOD_S", model.period_s, "from a sample to the next")
        .define("KNOTS", curve.knots as i32, "knots of the curve from drive to signal")
        .array("float", "curve", &curve.values[..curve.knots])
        .define("DRIVE_LOW", curve.low, "the drive of the first knot")
        .define("DRIVE_STEP", curve.step, "distance of knots")
        .define("PER_STEP", curve.per_step, "1 / DRIVE_STEP")
        .define(
            "LEAST_RUN",
            LEAST_RUN as f32 * curve.step,
            "smallest change of the drive for which a secant is computed",
        )
        .define("LEAST_ANSWER", LEAST_ANSWER as f32, "least slope of the drive over the target")
        .define("KEPT", model.kept, "share of the rate kept per sample")
        .define("KEPT_TWICE", model.kept_twice, "the same squared")
        .define("PROCESS_NOISE", model.process_noise, "variance added to the rate per sample")
        .define("NOISE", model.noise, "variance of the signal around the model")
        .define("WIDEST", model.widest, "largest variance of a target")
        .define("BEGIN_YY", tenth * tenth, "variance of the first target")
        .define("BEGIN_RR", span * span, "variance of the first rate")
        .define("LOW", model.low, "smallest target")
        .define("HIGH", model.high, "largest target")
        .define("DEAD_BAND", model.dead_band, "the branch changes only at a rate above this one")
        .define("ZERO", model.zero, "reference at a target of 0")
        .define("GAIN", model.gain, "reference per target")
        .define("SPREAD", model.spread, "reference per standard deviation");
}

/// Writes the constants of the defects, first those without memory, then those with memory.
fn defects(constants: &mut Constants, has: &mut Vec<&'static str>, defects: &Defects<f32>) {
    let mut knee = |word: &'static str,
                    name: &str,
                    group: &'static str,
                    bound: Option<Bound<f32>>| {
        let Some(Bound { at, round }) = bound else { return };
        has.extend(["knee", group, word]);
        // the step evaluates an upper bound like a lower one, with the signs of input and output
        // changed
        constants.define(name, at, "a bound").define(&format!("{name}_ROUND"), round, "its knee");
    };
    knee("slack_low", "SLACK_LOW", "slack", defects.slack_low);
    knee("slack_high", "SLACK_HIGH", "slack", defects.slack_high);
    knee("floor", "FLOOR", "bounded", defects.floor);
    knee("ceiling", "CEILING", "bounded", defects.ceiling);
    if let Some([pressed, twice]) = defects.crosstalk {
        has.push("crosstalk");
        constants
            .word("TAKES_PRESSURE", 1, "call stretch_set_pressure before a sample")
            .define("PRESSED", pressed, "drive per pressure")
            .define("PRESSED_TWICE", twice, "drive per squared pressure");
    }
    if let Some(plays) = defects.hysteresis {
        has.extend(["remembers", "hysteresis"]);
        constants.array("float", "radii", &plays.radii).define(
            "PLAYED",
            plays.each,
            "share of each play",
        );
    }
    if let Some(lags) = defects.relaxation {
        has.extend(["remembers", "relaxation"]);
        constants
            .define("OWN", lags.own, "weight of the present sample's drive")
            .array("float", "kept", &lags.kept)
            .array("float", "taken", &lags.taken)
            .array("float", "settled", &lags.settled);
    }
    if let Some(worn) = defects.worn {
        has.extend(["remembers", "worn"]);
        constants
            .define("WORN_M", worn.m, "share of the response that is lost after infinite travel")
            .define("WORN_N", worn.n, "distance travelled at which half of that share is lost")
            .define("WORN_ZERO", worn.zero, "drive at which nothing is lost")
            .define("WORN_REVERSAL", worn.reversal, "turns smaller than this do not count")
            .define("WORN_TRAVELLED", worn.travelled, "distance travelled before");
    }
    // The time shift between signal and reference includes the delay of a slow amplifier. Therefore the live step has
    // no poles for the amplifier.
}
