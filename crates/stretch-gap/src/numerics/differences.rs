//! The rate of a signal that was sampled at equal times.

/// Central differences, one-sided at both ends; a single sample has no rate.
pub(crate) fn central(x: &[f64], dt_s: f64) -> Vec<f64> {
    let rate = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(x.len() - 1));
        if b > a { (x[b] - x[a]) / ((b - a) as f64 * dt_s) } else { 0.0 }
    };
    (0..x.len()).map(rate).collect()
}
