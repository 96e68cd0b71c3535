//! Pairs of truth and estimate, good and faulty.

use std::ops::Range;

use proptest::{collection::vec, prelude::*};

/// Lengths of a muscle in mm and estimates of them, with the truth in 100..200 and an error with a
/// bias of up to 5 and a spread of up to 10.
///
/// ```
/// use proptest::prelude::*;
/// use stretch_metrics::{ErrorStats, Pair};
///
/// proptest!(|(pairs in stretch_strategies::pairs(1..50))| {
///     let mut stats = ErrorStats::new();
///     for &(truth, estimate) in &pairs {
///         stats.push(Pair { truth, estimate });
///     }
///     prop_assert_eq!(stats.count(), pairs.len() as u64);
/// });
/// ```
pub fn pairs(count: Range<usize>) -> impl Strategy<Value = Vec<(f64, f64)>> {
    (-5.0..5.0, 0.01..10.0, vec((100.0..200.0, -1.0..1.0), count)).prop_map(
        |(bias, spread, raw)| {
            raw.into_iter()
                .map(|(truth, x): (f64, f64)| (truth, truth + bias + spread * x))
                .collect()
        },
    )
}

/// Pairs of arbitrary `f64` values, including very large and very small numbers.
pub fn faulty_pairs(count: Range<usize>) -> impl Strategy<Value = Vec<(f64, f64)>> {
    vec((any::<f64>(), any::<f64>()), count)
}

/// A lag in -8..8 samples, a smooth truth, and an estimate with this lag, a gain and an offset. The
/// truth is the sum of two sines whose periods have no small common multiple.
pub fn lagged(count: usize) -> impl Strategy<Value = (f64, Vec<f64>, Vec<f64>)> {
    (-8.0..8.0, 0.0..6.0, 0.5..2.0, -10.0..10.0).prop_map(
        move |(lag, phase, gain, offset): (f64, f64, f64, f64)| {
            let at = |i: f64| libm::sin(0.11 * i + phase) + 0.6 * libm::sin(0.0437 * i);
            let truth = (0..count).map(|i| at(i as f64)).collect();
            let estimate = (0..count).map(|i| offset + gain * at(i as f64 - lag)).collect();
            (lag, truth, estimate)
        },
    )
}
