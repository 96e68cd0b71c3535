//! A whole power.

/// x^n by multiplication, which gives the same bits everywhere: `powi` may differ from platform to platform, and a general power costs a
/// firmware some kilobytes.
///
/// ```
/// use stretch_core::power;
/// assert_eq!([0, 1, 3].map(|n| power(1.5, n)), [1.0, 1.5, 3.375]);
/// ```
pub fn power(x: f64, n: u8) -> f64 {
    (0..n).map(|_| x).product()
}
