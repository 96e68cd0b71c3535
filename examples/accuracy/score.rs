//! Errors, and ratios of errors with block-bootstrap intervals.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stretch_calibrate::{apply, evaluate};
use stretch_core::Calibration;
use stretch_data::Trial;

/// Samples in a block: half a second.
const BLOCK: usize = 50;
/// Samples of warm-up that are not evaluated.
const SETTLE: usize = 20;
const DRAWS: usize = 2000;

/// Mean squared errors of blocks, over any number of trials.
#[derive(Clone, Default)]
pub(crate) struct Blocks(pub(crate) Vec<f64>);

impl Blocks {
    pub(crate) fn of(calibration: &Calibration, trials: &[Trial]) -> anyhow::Result<Self> {
        let mut blocks = Self::default();
        for trial in trials {
            let readings = apply(calibration, trial)?.readings;
            let values: Vec<f64> =
                readings.iter().map(|r| r.as_ref().map_or(f64::NAN, |r| r.estimate)).collect();
            blocks.push(trial.require(calibration.spec().reference.as_str())?, &values);
        }
        Ok(blocks)
    }

    /// Errors of the signal, scaled so that its extremes equal those of the reference.
    pub(crate) fn raw(calibration: &Calibration, trials: &[Trial]) -> anyhow::Result<Self> {
        let mut blocks = Self::default();
        for trial in evaluate(&[("x", calibration)], trials)?.trials {
            blocks.push(&trial.reference, &trial.estimates[0]);
        }
        Ok(blocks)
    }

    pub(crate) fn push(&mut self, truth: &[f64], estimate: &[f64]) {
        let start = SETTLE.min(truth.len());
        for (truth, estimate) in truth[start..].chunks(BLOCK).zip(estimate[start..].chunks(BLOCK)) {
            let errors = truth.iter().zip(estimate).map(|(t, e)| (t - e).powi(2));
            let (sum, n) =
                errors.filter(|e| e.is_finite()).fold((0.0, 0.0), |(sum, n), e| (sum + e, n + 1.0));
            // A block without any estimate becomes NaN, so that blocks of two methods still
            // correspond.
            self.0.push(if n > 0.0 { sum / n } else { f64::NAN });
        }
    }

    pub(crate) fn extend(&mut self, other: &Self) {
        self.0.extend(&other.0);
    }

    pub(crate) fn rmse(&self) -> f64 {
        let good: Vec<f64> = self.0.iter().copied().filter(|b| b.is_finite()).collect();
        (good.iter().sum::<f64>() / good.len() as f64).sqrt()
    }

    /// Returns the ratio of this root mean square to another one, and its 95 % interval.
    pub(crate) fn over(&self, other: &Self) -> (f64, f64, f64) {
        let pairs: Vec<(f64, f64)> = (self.0.iter().zip(&other.0))
            .map(|(a, b)| (*a, *b))
            .filter(|(a, b)| a.is_finite() && b.is_finite())
            .collect();
        let ratio = |(a, b): (f64, f64)| (a / b).sqrt();
        let sum = |(a, b): (f64, f64), (c, d): &(f64, f64)| (a + c, b + d);
        let whole = ratio(pairs.iter().fold((0.0, 0.0), sum));
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut draws: Vec<f64> = (0..DRAWS)
            .map(|_| {
                let drawn = (0..pairs.len()).map(|_| &pairs[random.random_range(0..pairs.len())]);
                ratio(drawn.fold((0.0, 0.0), sum))
            })
            .collect();
        draws.sort_by(f64::total_cmp);
        (whole, draws[DRAWS / 40], draws[DRAWS - 1 - DRAWS / 40])
    }
}

pub(crate) fn number(x: f64) -> String {
    format!("{x:.3}")
}

pub(crate) fn interval((x, low, high): (f64, f64, f64)) -> String {
    format!("{x:.2} ({low:.2} .. {high:.2})")
}
