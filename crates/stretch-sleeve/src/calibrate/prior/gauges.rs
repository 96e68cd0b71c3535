//! Checks from the signals alone whether gauges have the same places and directions as in the sessions of a prior.

use nalgebra::{DMatrix, DVector};
use stretch_calibrate::toolkit::extent;
use stretch_data::Trial;

use crate::{
    SleeveError,
    calibrate::{bank::Bank, channels::Channels, linear::inverse},
};

use super::learnt::Prior;

/// Gauges count as exchanged or reversed if exchanging or reversing their signals reduces the squared distance from the
/// signals of the prior's sessions to less than this share. The distance is then less than half.
const NEARER: f64 = 0.25;

/// Mean and covariance of the signals of several gauges.
struct Moments {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Moments {
    /// Computes the moments of a prior's sessions from `X'X/n`.
    fn of_prior(prior: &Prior) -> Self {
        let term = |k: usize| 1 + k * Bank::terms_a_channel();
        let count = prior.domains.len();
        let half = |k: usize| 0.5 * (prior.domains[k][0].max - prior.domains[k][0].min);
        let gram = |a: usize, b: usize| prior.gram[(a, b)] / prior.gram[(0, 0)];
        let covariance = DMatrix::from_fn(count, count, |a, b| {
            let [i, j] = [term(a), term(b)];
            half(a) * half(b) * (gram(i, j) - gram(0, i) * gram(0, j))
        });
        let mean = |k: usize, _| prior.domains[k][0].min + half(k) * (1.0 + gram(0, term(k)));
        Self { mean: DVector::from_fn(count, mean), covariance }
    }

    fn of(channels: &Channels, count: usize) -> Self {
        let samples = channels.reference().count().max(1) as f64;
        let mean = DVector::from_fn(count, |k, _| channels.signal(k).sum::<f64>() / samples);
        let covariance = DMatrix::from_fn(count, count, |a, b| {
            let pairs = channels.signal(a).zip(channels.signal(b));
            pairs.map(|(x, y)| (x - mean[a]) * (y - mean[b])).sum::<f64>() / samples
        });
        Self { mean, covariance }
    }

    /// Returns the mean over the samples of `(x - m)' C^-1 (x - m)`, with `m` and `C^-1` of a prior.
    fn distance(&self, mean: &DVector<f64>, precision: &DMatrix<f64>) -> f64 {
        let off = &self.mean - mean;
        precision.component_mul(&self.covariance).sum() + off.dot(&(precision * &off))
    }

    fn exchanged(&self, a: usize, b: usize) -> Self {
        let mut covariance = self.covariance.clone();
        covariance.swap_rows(a, b);
        covariance.swap_columns(a, b);
        let mut mean = self.mean.clone();
        mean.swap_rows(a, b);
        Self { mean, covariance }
    }

    fn reversed(&self, k: usize) -> Self {
        let mut covariance = self.covariance.clone();
        covariance.row_mut(k).neg_mut();
        covariance.column_mut(k).neg_mut();
        Self { mean: self.mean.clone(), covariance }
    }
}

impl Prior {
    /// Returns the session with all gauges reversed, in two ways: about zero, the effect of exchanged wires, and about
    /// the middle of each signal.
    pub(crate) fn mirrored(
        &self,
        trials: &[Trial],
        signals: &[String],
        channels: &Channels,
    ) -> Result<[Channels; 2], SleeveError> {
        let about = |twice_middle: &dyn Fn(usize) -> f64| {
            let mut mirrored = trials.to_vec();
            for channel in mirrored.iter_mut().flat_map(|trial| &mut trial.channels) {
                if let Some(k) = signals.iter().position(|name| *name == channel.name) {
                    let sum = twice_middle(k);
                    channel.values.iter_mut().for_each(|x| *x = sum - *x);
                }
            }
            Channels::without_reference(&mirrored, signals)
        };
        let ends = |k: usize| extent(channels.signal(k));
        Ok([about(&|_| 0.0)?, about(&|k| ends(k).min + ends(k).max)?])
    }

    /// Returns a description of the mistake if the signals resemble those of the prior's sessions only after two gauges
    /// are exchanged or one is reversed.
    pub(crate) fn misplaced(&self, channels: &Channels) -> Option<String> {
        let prior = Moments::of_prior(self);
        let precision = inverse(&prior.covariance)?;
        let count = self.signals.len();
        let own = Moments::of(channels, count);
        let distance = |of: &Moments, mean: &DVector<f64>| of.distance(mean, &precision);
        // The zero of a reversed gauge is unknown, so its own mean is used.
        let reversed = (0..count).map(|k| {
            let without = own.reversed(k);
            // With two gauges it cannot be known which one is reversed.
            let which =
                if count == 2 { self.signals.join(" or ") } else { self.signals[k].clone() };
            let says =
                format!("relative to the other gauges, {which} rises where it fell in the sessions of the prior");
            (distance(&without, &without.mean), distance(&own, &own.mean), says)
        });
        let pairs = (0..count).flat_map(|a| (0..a).map(move |b| (b, a)));
        let exchanged = pairs.map(|(a, b)| {
            let without = own.exchanged(a, b);
            let [first, second] = [&self.signals[a], &self.signals[b]];
            let says = format!(
                "{first} behaves as {second} did in the sessions of the prior, and {second} as {first} did"
            );
            (distance(&without, &prior.mean), distance(&own, &prior.mean), says)
        });
        let found = reversed.chain(exchanged).filter(|(without, is, _)| *without < NEARER * is);
        let (_, _, says) = found.min_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)))?;
        Some(format!(
            "{says}: are gauges exchanged or reversed? Swap the wires, or give the columns the names and signs that they had (stretch convert)"
        ))
    }
}
