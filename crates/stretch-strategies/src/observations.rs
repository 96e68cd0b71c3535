//! Noisy samples on surfaces.

use std::ops::Range;

use proptest::{collection::vec, prelude::*};
use stretch_core::{Degree, Surface};
use stretch_fit::Sample;

use crate::surface_of;

/// Samples of a known surface.
#[derive(Debug, Clone)]
pub struct Observations {
    /// The true surface.
    pub surface: Surface<f64>,
    /// Rate in -1 to 1, volts in 0 to 1.
    pub samples: Vec<Sample<f64>>,
}

/// Samples of a random surface of `degree` with uniform noise up to `noise`. They are spread over
/// the whole rectangle by stratified sampling, so that every term is determined if there are a few
/// times more samples than terms.
///
/// ```
/// use proptest::prelude::*;
/// use stretch_core::Degree;
/// use stretch_fit::SurfaceAccumulator;
/// use stretch_strategies::observations;
///
/// proptest!(|(log in observations(Degree::POLY13, 0.0, 50..200))| {
///     let mut sums = SurfaceAccumulator::<f64>::new(log.surface.degree());
///     sums.extend(log.samples.iter().copied())?;
///     prop_assert!(sums.fit()?.rmse().unwrap() < 1e-10);
/// });
/// ```
pub fn observations(
    degree: Degree,
    noise: f64,
    samples: Range<usize>,
) -> impl Strategy<Value = Observations> {
    let jitter = (0.0..1.0_f64, 0.0..1.0_f64, -1.0..1.0_f64);
    (surface_of(degree), vec(jitter, samples)).prop_map(move |(surface, jitters)| {
        let cells = jitters.len() as f64;
        let samples = jitters.iter().enumerate().map(|(k, &(across, along, error))| {
            // The voltage is in cell k; the golden ratio spreads the rates.
            let volts = (k as f64 + along) / cells;
            let rate = 2.0 * (k as f64 * 0.618_033_988_749_894_9 + 0.3 * across).fract() - 1.0;
            Sample { rate, volts, value: surface.eval(rate, volts) + noise * error }
        });
        Observations { surface, samples: samples.collect() }
    })
}
