//! Checks that a line or surface stays within `f32` after folding. A live estimator folds a model when it is created:
//! it multiplies the scales of normalisation and units into the coefficients.

use crate::{
    BranchSurface, DesignError, Interval, LinearMap, MAX_DEGREE, Range,
    arithmetic::power,
    sizes::{MOST_PRODUCT, MOST_SLOPE, range, size},
};

/// The scales that are folded into a model.
pub(crate) struct Scales {
    /// Change of the reference per normalised target.
    pub(crate) gain: f64,
    /// The reference at a normalised target of 0.
    pub(crate) zero: f64,
    /// Range that normalises the signal.
    pub(crate) signal: Range,
}

/// Returns the largest distance between the offset and a point of the domain.
fn reach(domain: Interval, offset: f64) -> f64 {
    (domain.min - offset).abs().max((domain.max - offset).abs())
}

/// # Errors
/// `DesignError` for a line whose slope or largest output is too large.
pub(crate) fn line_holds(scales: &Scales, line: &LinearMap) -> Result<(), DesignError> {
    let Scales { gain, zero, signal } = scales;
    let (gain, zero) = (gain.abs(), zero.abs());
    let slope = gain * line.slope.abs() / signal.span();
    DesignError::check("linear.slope", line.slope, slope <= MOST_SLOPE)?;
    let furthest =
        zero + gain * line.intercept.abs() + slope * reach(line.signal_domain, signal.offset());
    DesignError::check("linear.intercept", line.intercept, furthest <= MOST_PRODUCT).map(|_| ())
}

/// Checks a surface by Horner's rule over the magnitudes of the folded coefficients. When the surface is evaluated, no
/// intermediate sum is larger than the sums computed here.
pub(crate) fn surface_holds(scales: &Scales, branch: &BranchSurface) -> Result<(), DesignError> {
    const FIELD: &str = "surface.coefficients";
    const RATE: [&str; 2] = ["rate_range", "span of rate_range"];
    range(RATE, &branch.rate_range)?;
    let Scales { gain, zero, signal } = scales;
    let (gain, zero, rate) = (gain.abs(), zero.abs(), &branch.rate_range);
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
            // folded: per unit of signal and of rate, not per range
            let scale = power(signal.span(), j) * power(rate.span(), i);
            let c = gain * branch.surface.coefficient(i, j).abs() / scale;
            rise = rise * v + row;
            row = row * v + c;
            // each intermediate result must be within the limits, even if a small factor follows
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
