//! How far one column trails another.

/// Longest lag that is looked for, s.
const REACH_S: f64 = 1.0;

/// Time by which `y` trails `x`, s: the lag within [`REACH_S`] at which `x` and `y` correlate best.
pub(super) fn lag(x: &[f64], y: &[f64], dt_s: f64) -> f64 {
    let reach = ((REACH_S / dt_s) as usize).min(x.len() / 4);
    if reach == 0 {
        return 0.0;
    }
    let centre = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let middle = centre(&y[reach..y.len() - reach]);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let size = |shift: usize| {
        let there = centre(&x[shift..shift + middle.len()]);
        let power = dot(&there, &there).max(f64::MIN_POSITIVE);
        dot(&there, &middle).powi(2) / power
    };
    let best = (0..=2 * reach).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(reach);
    (reach as f64 - best as f64) * dt_s
}
