//! Estimation of the noise of a log in the presence of motion.

/// Returns the second differences `x[i-1] - 2 x[i] + x[i+1]` of a log. Slow motion contributes almost nothing to them.
/// White noise contributes six times its variance.
///
/// ```
/// use stretch_filter::log::second_differences;
/// assert!(second_differences(&[1.0, 2.0, 3.0, 5.0]).eq([0.0, 1.0]));
/// ```
pub fn second_differences(log: &[f64]) -> impl Iterator<Item = f64> + '_ {
    log.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2])
}

/// Estimates the standard deviation of white noise from the second differences `d` of a log, robust to motion:
/// `1.4826 median|d| / sqrt(6)`. `None` if there are no differences.
///
/// The median magnitude of a normal variable is 1/1.4826 of its standard deviation, and 6 is the sum of the squares of
/// 1, -2 and 1. The differences of several logs may be concatenated. The function overwrites the slice with reordered
/// magnitudes.
///
/// ```
/// use stretch_filter::log::{noise_of_differences, second_differences};
/// // a ramp with 3 mV up and down, sample by sample
/// let log: Vec<f64> = (0..100).map(|i| 0.1 * i as f64 + if i % 2 == 0 { 0.003 } else { -0.003 }).collect();
/// let mut differences: Vec<f64> = second_differences(&log).collect();
/// let noise = noise_of_differences(&mut differences).unwrap();
/// assert!((noise - 1.4826 * 0.012 / 6f64.sqrt()).abs() < 1e-12);
/// assert_eq!(noise_of_differences(&mut []), None);
/// ```
#[must_use]
pub fn noise_of_differences(differences: &mut [f64]) -> Option<f64> {
    if differences.is_empty() {
        return None;
    }
    differences.iter_mut().for_each(|d| *d = d.abs());
    let middle = differences.len() / 2;
    let (_, median, _) = differences.select_nth_unstable_by(middle, f64::total_cmp);
    Some(1.4826 * *median / libm::sqrt(6.0))
}
