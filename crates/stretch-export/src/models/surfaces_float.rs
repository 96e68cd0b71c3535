//! `linear`, `poly13` and `curve` in `float`.

use stretch_core::{Branch, Calibration, Poly13, RateEstimator};
use stretch_filter::{SgFilter, SgShape};
use stretch_receptor::{
    ReceptorError, StretchReceptor,
    numbers::{Line, Map, RangedSurface},
};

use crate::{
    ExportError,
    constants::{Constants, Literal},
    part::Part,
};

/// What stands before and after the surface.
const RATE: &str = include_str!("../c/surfaces_float.h");
const STEP: &str = include_str!("../c/surfaces_float_step.h");

/// The constants and the step of a line, of surfaces without a term beyond poly13, or of a curve.
pub(crate) fn surfaces_float(calibration: &Calibration) -> Result<Part, ExportError> {
    let receptor = StretchReceptor::<f32>::new(calibration)?;
    let RateEstimator::SavitzkyGolay { window, degree, delay } = calibration.spec().rate_estimator
    else {
        return Err(ExportError::Rate { rate: format!("{:?}", calibration.spec().rate_estimator) });
    };
    let [window, degree, delay] = [window, degree.into(), delay].map(usize::from);
    let shape = SgShape { window, degree, order: 1, delay };
    // the filter that the receptor runs: see `RateFilter`
    let filter = SgFilter::<f32>::new(shape, calibration.spec().sample_rate_hz);
    let filter = filter.map_err(ReceptorError::from)?;
    let model = receptor.model();
    let direction = model.direction();
    let [rising, falling] = match direction.rising {
        Branch::Inflation => ["STRETCH_INFLATION", "STRETCH_DEFLATION"],
        Branch::Deflation => ["STRETCH_DEFLATION", "STRETCH_INFLATION"],
    };
    let mut constants = Constants::default();
    constants
        .define("WINDOW", window as i32, "samples")
        .array("float", "taps", filter.taps())
        .define("PERIOD_S", model.period_s(), "from a sample to the next")
        .define("DEAD_BAND", direction.dead_band, "the largest rate that keeps the branch")
        .word("RISING", rising, "the branch of a rising signal")
        .word("FALLING", falling, "");
    let (name, surface) = match model.map() {
        Map::Line(line) => {
            let Line { signal, offset, slope, intercept } = line;
            constants
                .define("SIGNAL_MIN", signal.min, "the signal that the fit saw")
                .define("SIGNAL_MAX", signal.max, "")
                .define("OFFSET", *offset, "")
                .define("SLOPE", *slope, "")
                .define("INTERCEPT", *intercept, "");
            ("linear", include_str!("../c/line_float.h"))
        }
        Map::Poly13([inflation, deflation]) => {
            constants.surfaces(&[poly13(inflation), poly13(deflation)]);
            ("poly13", include_str!("../c/poly13_float.h"))
        }
        Map::Surface([curve, _]) if calibration.spec().model.needs_signal_only() => {
            let degree = curve.surface.degree();
            let coefficients = curve.surface.coefficients();
            constants
                .define("SIGNAL_MIN", curve.signal.min, "the signal that the fit saw")
                .define("SIGNAL_MAX", curve.signal.max, "")
                .define("RATE_MIN", curve.rate.min, "its rate")
                .define("RATE_MAX", curve.rate.max, "")
                .define("OFFSET", curve.offset, "")
                .define("DEGREE", i32::from(degree.volts()), "")
                .array("float", "curve", &coefficients[..degree.terms()]);
            ("curve", include_str!("../c/curve_float.h"))
        }
        Map::Surface([ranged, _]) => {
            return Err(ExportError::NoForm { model: ranged.surface.degree().to_string() });
        }
    };
    Ok(Part {
        model: name.into(),
        constants: constants.into_text(),
        step: vec![
            include_str!("../c/float.h"),
            include_str!("../c/float_reading.h"),
            RATE,
            surface,
            STEP,
            include_str!("../c/float_end.h"),
        ],
        has: Vec::new(),
    })
}

/// The surface of one branch with its ranges.
fn poly13(ranged: &RangedSurface<f32, Poly13<f32>>) -> String {
    let RangedSurface { signal, rate, offset, rate_offset, surface } = *ranged;
    let Poly13 { p00, p10, p01, p11, p02, p12, p03 } = surface;
    let join = |numbers: &[f32]| numbers.iter().map(Literal::c).collect::<Vec<_>>().join(", ");
    let domain = join(&[signal.min, signal.max, rate.min, rate.max, offset, rate_offset]);
    format!("{{{domain}, \\\n         {}}}", join(&[p00, p10, p01, p11, p02, p12, p03]))
}
