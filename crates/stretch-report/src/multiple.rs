//! The unit of gaps on a page: the root mean square of the residual, in multiples of the noise.

use super::markup::{number, with_unit};

/// Root mean square of the residual over that of the noise, `sqrt(1 + excess)`, where the excess is the reduced
/// chi-square minus one.
pub(crate) fn multiple(excess: f64) -> f64 {
    // the excess may be below zero, but the root mean square may not
    if excess.is_finite() { (1.0 + excess).max(0.0).sqrt() } else { f64::NAN }
}

/// The root mean square of a residual with this excess, as a multiple of the noise: `2.0 ×`.
pub fn times(excess: f64) -> String {
    with_unit(&number(multiple(excess), 2), "\u{d7}")
}

/// The root mean square of a residual with this excess, in the unit of the channel and as a multiple of the noise.
pub(crate) fn both(excess: f64, noise: f64, unit: &str) -> String {
    format!("{} ({})", with_unit(&number(multiple(excess) * noise, 3), unit), times(excess))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_of_squares_becomes_a_ratio_of_roots() {
        assert_eq!((multiple(0.0), multiple(8.0), multiple(-2.0)), (1.0, 3.0, 0.0));
        assert_eq!(both(8.0, 0.002, "V"), "0.00600\u{a0}V (3.0\u{a0}\u{d7})");
        assert!(multiple(f64::NAN).is_nan());
    }
}
