//! C code for the models `linear` and `poly13`, in integers and in `float`, and for `curve` in
//! `float`.

use stretch_core::{
    Branch, Calibration, Poly13, RateEstimator, SampleRate, fixed::FixedPoly13, record::SCHEMA,
};
use stretch_filter::{FixedSgIntegers, SgFilter, SgShape};
use stretch_receptor::{
    ReceptorError, StretchReceptor,
    code::{CodeMap, CodeSurface, FixedNumbers, Scaled, Span},
    numbers::{Line, Map, RangedSurface},
};

use crate::{
    ExportError,
    constants::{Constants, Literal},
    part::Part,
};

/// Returns the constants and the step (the C code for one sample) of a calibration in integers.
pub(crate) fn surfaces_fixed(numbers: &FixedNumbers, rate_hz: SampleRate) -> Part {
    let FixedNumbers { adc_bits, falling, dead_band, surfaces, rate } = numbers;
    let adc_bits = u32::from((*adc_bits).min(16));
    let mut constants = Constants::default();
    constants.define("CODES", 1u32 << adc_bits, "number of codes").define(
        "ALIGN",
        1u32 << (16 - adc_bits),
        "factor that shifts a code to the upper end of 16 bits",
    );
    rate_constants(&mut constants, rate);
    let rate_bits = rate_hz.hz().to_bits();
    constants
        .define("DEAD_BAND", *dead_band as u32, "the branch changes only at a rate above this one")
        .define(
            "MIRROR",
            if *falling { u32::MAX } else { 0 },
            "all ones if a rising signal means a falling target",
        )
        .define("RATE_LOW", rate_bits as u32, "bits of the sample rate as a double, in hertz")
        .define("RATE_HIGH", (rate_bits >> 32) as u32, "")
        .define("SCHEMA", SCHEMA, "version of the binary calibration files that can be loaded");
    let (model, surface, has) = match surfaces {
        CodeMap::Line(ranged) => {
            let Scaled { of, thousandths } = ranged.surface;
            let (intercept, slope) = <(i32, i32)>::from(of);
            let signal = span(&ranged.signal);
            let line = [thousandths, intercept, slope].map(|n| n.c()).join(", ");
            constants
                .define("SURFACE_COUNT", 1, "")
                .surfaces(&[format!("{{{}, {signal}, {line}}}", ranged.centre)]);
            ("linear", include_str!("../c/line_fixed.h"), "static")
        }
        CodeMap::Poly13([inflation, deflation]) => {
            constants
                .define("SURFACE_COUNT", 2, "one for each branch")
                .surfaces(&[poly13_fixed(inflation), poly13_fixed(deflation)]);
            ("poly13", include_str!("../c/poly13_fixed.h"), "moving")
        }
    };
    Part {
        model: model.into(),
        constants,
        step: vec![
            include_str!("../c/surfaces_fixed.h"),
            surface,
            include_str!("../c/surfaces_fixed_load.h"),
            include_str!("../c/surfaces_fixed_step.h"),
        ],
        has: vec![has],
    }
}

/// Writes the integers of the rate estimator.
fn rate_constants(constants: &mut Constants, rate: &FixedSgIntegers) {
    constants.define("WINDOW", rate.window as i32, "samples").define(
        "DEGREE",
        rate.degree as i32,
        "of the polynomial that gives the rate",
    );
    for k in 0..=rate.degree {
        constants.define(&format!("WEIGHT_{k}"), rate.weights[k], "");
    }
    for k in 1..=rate.degree {
        constants.define(&format!("CHOOSE_{k}"), rate.choose[k] as u32, "");
    }
    let half = if rate.shift == 0 { 0 } else { 1i64 << (rate.shift - 1) };
    constants
        .define("SHIFT", rate.shift as i32, "low bits of the weighted sum that are rounded away")
        .define("HALF", half, "")
        .define("CHANGE", rate.change_factor, "from a rate to a change per sample")
        .define("CHANGE_SHIFT", rate.change_shift as i32, "");
}

fn span(span: &Span) -> String {
    format!("{{{}, {}, {}}}", span.min.c(), span.width.c(), span.factor.c())
}

/// Returns the C initialiser of the surface of one branch (direction of motion), with its ranges.
fn poly13_fixed(ranged: &CodeSurface<Scaled<FixedPoly13>>) -> String {
    let Scaled { of, thousandths } = ranged.surface;
    // the coefficients are integers of 32 bits, so the casts lose nothing
    let Poly13 { p00, p10, p01, p11, p02, p12, p03 } = of.coefficients();
    let ordered = [p11, p12, p10, p00, p02, p03, p01].map(|p| p as i32);
    let ordered = ordered.map(|p| p.c()).join(", ");
    let (signal, rate) = (span(&ranged.signal), span(&ranged.rate));
    let domain = format!("{}, {signal}, {rate}, {}", ranged.centre, thousandths.c());
    format!("{{{domain}, \\\n         {{{ordered}}}}}")
}

/// Returns the constants and the step in `float` of a line, of surfaces without a term beyond
/// poly13, or of a curve.
pub(crate) fn surfaces_float(calibration: &Calibration) -> Result<Part, ExportError> {
    let receptor = StretchReceptor::<f32>::new(calibration)?;
    let RateEstimator::SavitzkyGolay { window, degree, delay } = calibration.spec().rate_estimator
    else {
        return Err(ExportError::Refused(format!(
            "the rate estimator {:?} cannot be exported to C; calibrate with --rate savgol:WINDOW,DEGREE such as savgol:11,2",
            calibration.spec().rate_estimator
        )));
    };
    let [window, degree, delay] = [window, degree.into(), delay].map(usize::from);
    let shape = SgShape { window, degree, order: 1, delay };
    // the same filter as in the receptor: see `RateFilter`
    let filter = SgFilter::<f32>::new(shape, calibration.spec().sample_rate_hz);
    let filter = filter.map_err(ReceptorError::from)?;
    let model = receptor.model();
    let direction = model.direction();
    let [rising, falling] = match direction.rising {
        Branch::Inflation => ["STRETCH_TARGET_RISES", "STRETCH_TARGET_FALLS"],
        Branch::Deflation => ["STRETCH_TARGET_FALLS", "STRETCH_TARGET_RISES"],
    };
    let mut constants = Constants::default();
    constants
        .define("WINDOW", window as i32, "samples")
        .array("float", "taps", filter.taps())
        .define("PERIOD_S", model.period_s(), "from a sample to the next")
        .define(
            "DEAD_BAND",
            direction.dead_band,
            "the branch changes only at a rate above this one",
        )
        .word("SIGNAL_RISES", rising, "the branch of a rising signal")
        .word("SIGNAL_FALLS", falling, "");
    let is_static = calibration.spec().model.needs_signal_only();
    let (name, surface) = match model.map() {
        Map::Line(line) => {
            let Line { signal, offset, slope, intercept } = line;
            constants
                .define("SIGNAL_MIN", signal.min, "range of the signal in the fitted data")
                .define("SIGNAL_MAX", signal.max, "")
                .define("OFFSET", *offset, "")
                .define("SLOPE", *slope, "")
                .define("INTERCEPT", *intercept, "");
            ("linear", include_str!("../c/line_float.h"))
        }
        Map::Poly13([inflation, deflation]) => {
            constants.surfaces(&[poly13_float(inflation), poly13_float(deflation)]);
            (if is_static { "curve" } else { "poly13" }, include_str!("../c/poly13_float.h"))
        }
        Map::Surface([curve, _]) if is_static => {
            let degree = curve.surface.degree();
            let coefficients = curve.surface.coefficients();
            constants
                .define("SIGNAL_MIN", curve.signal.min, "range of the signal in the fitted data")
                .define("SIGNAL_MAX", curve.signal.max, "")
                .define("RATE_MIN", curve.rate.min, "range of its rate in the fitted data")
                .define("RATE_MAX", curve.rate.max, "")
                .define("OFFSET", curve.offset, "")
                .define("DEGREE", i32::from(degree.volts()), "")
                .array("float", "curve", &coefficients[..degree.terms()]);
            ("curve", include_str!("../c/curve_float.h"))
        }
        Map::Surface([ranged, _]) => {
            return Err(ExportError::no_form(&ranged.surface.degree().to_string()));
        }
    };
    Ok(Part {
        model: name.into(),
        constants,
        step: vec![
            include_str!("../c/surfaces_float.h"),
            surface,
            include_str!("../c/surfaces_float_step.h"),
        ],
        has: vec![if is_static { "static" } else { "moving" }],
    })
}

/// Returns the C initialiser of the surface of one branch (direction of motion), with its ranges.
fn poly13_float(ranged: &RangedSurface<f32, Poly13<f32>>) -> String {
    let RangedSurface { signal, rate, offset, rate_offset, surface } = *ranged;
    let Poly13 { p00, p10, p01, p11, p02, p12, p03 } = surface;
    let join = |numbers: &[f32]| numbers.iter().map(Literal::c).collect::<Vec<_>>().join(", ");
    let domain = join(&[signal.min, signal.max, rate.min, rate.max, offset, rate_offset]);
    format!("{{{domain}, \\\n         {}}}", join(&[p00, p10, p01, p11, p02, p12, p03]))
}
