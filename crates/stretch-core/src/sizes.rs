//! What sizes the numbers of a record may have, so that no finite sample gives a reading that is none.
//!
//! A board computes in `f32`, which ends at 3.4e38, and an estimator takes samples up to 1e18 at up
//! to 1e7 a second: a rate of 2e25. What is multiplied with that must stay below 1e11 to leave a
//! hundred over; what is not, below 1e30. Numbers with a unit may be up to 1e9 and what is divided
//! by down to 1e-9: a record in nanometres and microvolts fits.

use crate::{
    BranchSurface, CalibrationSpec, DesignError, LinearMap, MAX_DEGREE, Model, Range, Target,
};

/// The largest number with a unit, and the largest that has none.
pub(crate) const MOST: f64 = 1e9;
/// The least that is divided by.
pub(crate) const LEAST: f64 = 1e-9;
/// The largest product on the way to an estimate.
const MOST_PRODUCT: f64 = 1e30;
/// The largest change of the reference per change of the signal.
const MOST_SLOPE: f64 = 1e11;
/// The least and the most samples a second.
const RATES_HZ: core::ops::RangeInclusive<f64> = 1e-3..=1e7;

/// A number of a size that can be computed with.
pub(crate) fn size(field: &'static str, x: f64) -> Result<f64, DesignError> {
    DesignError::check(field, x, x.abs() <= MOST)
}

/// A number above zero that can be divided by.
pub(crate) fn extent(field: &'static str, x: f64) -> Result<f64, DesignError> {
    DesignError::check(field, x, (LEAST..=MOST).contains(&x))
}

/// Neighbours on a curve that `f32` still tells apart: what lies between them is divided by.
pub(crate) fn apart(field: &'static str, pair: &[f64]) -> Result<f64, DesignError> {
    let step = pair[1] - pair[0];
    DesignError::check(field, step, step.abs() >= LEAST && pair[1] as f32 != pair[0] as f32)
}

fn range(fields: [&'static str; 2], range: &Range) -> Result<(), DesignError> {
    for x in [range.min(), range.max(), range.offset()] {
        size(fields[0], x)?;
    }
    extent(fields[1], range.span()).map(|_| ())
}

/// Every size in a calibration that is not its model's alone.
pub(crate) fn check(spec: &CalibrationSpec) -> Result<(), DesignError> {
    let hz = spec.sample_rate_hz.hz();
    DesignError::check("sample_rate_hz", hz, RATES_HZ.contains(&hz))?;
    if let Target::Contraction { rest_length } = spec.target {
        extent("target.rest_length", rest_length)?;
    }
    range(["signal_range", "span of signal_range"], &spec.signal_range)?;
    range(["target_range", "span of target_range"], &spec.target_range)?;
    // the largest signal in a sample; and a band that can be divided by, or none
    let band = spec.dead_band;
    let fits = band == 0.0 || (LEAST * LEAST..=MOST * RATES_HZ.end()).contains(&band);
    DesignError::check("dead_band", band, fits)?;
    match &spec.model {
        Model::Linear(line) => line_holds(spec, line),
        Model::Surfaces { inflation, deflation } | Model::Blended { inflation, deflation } => {
            surface_holds(spec, inflation)?;
            surface_holds(spec, deflation)
        }
        _ => Ok(()),
    }
}

/// Reference per normalised target, and the reference at a normalised target of 0.
fn output(spec: &CalibrationSpec) -> (f64, f64) {
    let range = &spec.target_range;
    let gain = spec.target.reference_per_target() * range.span();
    (gain.abs(), spec.target.to_reference(range.offset()).abs())
}

/// The furthest that a domain lies from an offset.
fn reach(domain: crate::Interval, offset: f64) -> f64 {
    (domain.min - offset).abs().max((domain.max - offset).abs())
}

fn line_holds(spec: &CalibrationSpec, line: &LinearMap) -> Result<(), DesignError> {
    let (gain, zero) = output(spec);
    let range = &spec.signal_range;
    let slope = gain * line.slope.abs() / range.span();
    DesignError::check("linear.slope", line.slope, slope <= MOST_SLOPE)?;
    let furthest =
        zero + gain * line.intercept.abs() + slope * reach(line.signal_domain, range.offset());
    DesignError::check("linear.intercept", line.intercept, furthest <= MOST_PRODUCT).map(|_| ())
}

/// Horner's rule over the magnitudes of the folded coefficients: no intermediate sum is larger than these.
fn surface_holds(spec: &CalibrationSpec, branch: &BranchSurface) -> Result<(), DesignError> {
    const FIELD: &str = "surface.coefficients";
    const RATE: [&str; 2] = ["rate_range", "span of rate_range"];
    range(RATE, &branch.rate_range)?;
    let (gain, zero) = output(spec);
    let (signal, rate) = (&spec.signal_range, &branch.rate_range);
    for domain in [branch.signal_domain, branch.rate_domain] {
        size("surface's domain", domain.min)?;
        size("surface's domain", domain.max)?;
    }
    let v = reach(branch.signal_domain, signal.offset());
    let r = reach(branch.rate_domain, rate.offset());
    let holds = |x: f64, most: f64| DesignError::check(FIELD, x, x <= most).map(|_| ());
    let (mut estimate, mut slope) = (0.0, 0.0);
    for i in (0..=MAX_DEGREE as u8).rev() {
        let (mut row, mut rise) = (0.0, 0.0);
        for j in (0..=MAX_DEGREE as u8).rev() {
            // as they are folded: per signal and per rate, not per range
            let scale = libm::pow(signal.span(), j.into()) * libm::pow(rate.span(), i.into());
            let c = gain * branch.surface.coefficient(i, j).abs() / scale;
            rise = rise * v + row;
            row = row * v + c;
            // a sum that is later multiplied with little is a number, too
            for x in [c, rise, row] {
                holds(x, MOST_PRODUCT)?;
            }
        }
        estimate = estimate * r + row;
        slope = slope * r + rise;
        holds(estimate, MOST_PRODUCT)?;
        holds(slope, MOST_PRODUCT)?;
    }
    holds(estimate + zero, MOST_PRODUCT)?;
    holds(slope, MOST_SLOPE)
}
