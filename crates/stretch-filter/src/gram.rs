//! Discrete orthogonal (Gram) polynomials and the Savitzky-Golay taps that they give.
//!
//! On the `n` equidistant points x = -(n-1)/2 .. (n-1)/2 the orthonormal
//! polynomials obey, with b(k) = k^2 (n^2 - k^2) / (4 (4 k^2 - 1)),
//!
//! ```text
//! q(0) = 1/sqrt(n),   sqrt(b(k+1)) q(k+1) = x q(k) - sqrt(b(k)) q(k-1)
//! ```
//!
//! and their s-th derivatives obey the same recurrence plus `s q^(s-1)(k)`. A least-squares fit is
//! then a sum of products, without forming or solving a matrix. Source: Gorry 1990,
//! doi:10.1021/ac00205a007.

/// The highest degree of a local polynomial.
///
/// A fit of higher degree follows the noise. Its bias is smaller, but its noise gain is many times
/// larger.
pub const MAX_SG_DEGREE: usize = 10;

pub(crate) type Basis = [f64; MAX_SG_DEGREE + 1];

/// Returns the square root of the recurrence coefficient b(k) of `window` points.
fn root_b(window: usize, k: usize) -> f64 {
    let (n, k) = (window as f64, k as f64);
    libm::sqrt(k * k * (n - k) * (n + k) / (4.0 * (4.0 * k * k - 1.0)))
}

/// Returns the `order`-th derivatives of the orthonormal polynomials of degree 0 ..= `degree`, at a point that is `x`
/// samples from the middle.
///
/// Needs `degree < window`, `degree <= MAX_SG_DEGREE` and `order <= MAX_SG_DEGREE`.
pub(crate) fn basis(window: usize, degree: usize, order: usize, x: f64) -> Basis {
    let mut values = [0.0; MAX_SG_DEGREE + 1];
    let mut before = [0.0; MAX_SG_DEGREE + 1];
    let mut current = [0.0; MAX_SG_DEGREE + 1];
    current[0] = 1.0 / libm::sqrt(window as f64);
    let mut root = 0.0;
    for (k, value) in values.iter_mut().enumerate().take(degree + 1) {
        *value = current[order];
        if k == degree {
            break; // b(window) is zero: there is no next polynomial to divide for
        }
        let next_root = root_b(window, k + 1);
        let mut next = [0.0; MAX_SG_DEGREE + 1];
        for s in 0..=order {
            let lower = if s == 0 { 0.0 } else { s as f64 * current[s - 1] };
            next[s] = (x * current[s] + lower - root * before[s]) / next_root;
        }
        before = current;
        current = next;
        root = next_root;
    }
    values
}

/// Calls `write(lag, tap)` for each sample of the window, newest first. The taps give the
/// `order`-th derivative (per sample^order) of the least-squares polynomial, `delay` samples before
/// the newest, multiplied by `scale`.
pub(crate) fn taps_into(
    window: usize,
    degree: usize,
    order: usize,
    delay: usize,
    scale: f64,
    mut write: impl FnMut(usize, f64),
) {
    let half = (window as f64 - 1.0) / 2.0;
    let at = basis(window, degree, order, half - delay as f64);
    for lag in 0..window {
        let here = basis(window, degree, 0, half - lag as f64);
        let tap: f64 = at.iter().zip(&here).map(|(a, b)| a * b).sum();
        write(lag, tap * scale);
    }
}
