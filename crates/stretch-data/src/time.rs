//! Times without the digits that rounding made up.

/// A time that was computed from others of up to `largest_s`, with the fewest decimals that say it: two units in the last
/// place of the largest are nobody's measurement.
///
/// ```
/// use stretch_data::tidy_time;
/// assert_eq!(1.01_f64 - 1.0, 0.010000000000000009);
/// assert_eq!(tidy_time(1.01 - 1.0, 1.01), 0.01);
/// assert_eq!(tidy_time(1.0 / 3.0, 0.0), 1.0 / 3.0);
/// ```
pub fn tidy_time(time_s: f64, largest_s: f64) -> f64 {
    let noise_s = 2.0 * f64::EPSILON * largest_s.abs();
    let scales = std::iter::successors(Some(1.0), |scale| Some(10.0 * scale)).take(16);
    let mut decimals = scales.map(|scale: f64| (time_s * scale).round() / scale);
    decimals.find(|near| (near - time_s).abs() <= noise_s).unwrap_or(time_s)
}
