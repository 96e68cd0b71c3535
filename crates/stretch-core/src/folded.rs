//! What a receptor makes of a line or a surface, before it does: no product may leave `f32`.

use crate::{
    BranchSurface, DesignError, Interval, LinearMap, MAX_DEGREE, Range,
    arithmetic::power,
    sizes::{MOST_PRODUCT, MOST_SLOPE, range, size},
};

/// What a model is scaled with.
pub(crate) struct Scales {
    /// Reference per normalised target.
    pub(crate) gain: f64,
    /// The reference at a normalised target of 0.
    pub(crate) zero: f64,
    /// Normalises the signal.
    pub(crate) signal: Range,
}

/// The furthest that a domain lies from an offset.
fn reach(domain: Interval, offset: f64) -> f64 {
    (domain.min - offset).abs().max((domain.max - offset).abs())
}

/// # Errors
/// A line that is too steep, or leads too far.
pub(crate) fn line_holds(scales: &Scales, line: &LinearMap) -> Result<(), DesignError> {
    let Scales { gain, zero, signal } = scales;
    let (gain, zero) = (gain.abs(), zero.abs());
    let slope = gain * line.slope.abs() / signal.span();
    DesignError::check("linear.slope", line.slope, slope <= MOST_SLOPE)?;
    let furthest =
        zero + gain * line.intercept.abs() + slope * reach(line.signal_domain, signal.offset());
    DesignError::check("linear.intercept", line.intercept, furthest <= MOST_PRODUCT).map(|_| ())
}

/// Horner's rule over the magnitudes of the folded coefficients: no intermediate sum is larger than these.
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
            // as they are folded: per signal and per rate, not per range
            let scale = power(signal.span(), j) * power(rate.span(), i);
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
