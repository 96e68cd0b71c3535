//! Computes how many samples count as one observation of a residual's mean square, with the change
//! that an effect makes added to the residual.
//!
//! The number is that of [`samples_per_observation`](crate::fit::score::samples_per_observation).
//! To save time, only the first lags and every fourth of the later ones are summed; each of the
//! latter stands for four lags. If noise and change are independent, their autocorrelation sums add
//! up.

use crate::{fit::comparison::Comparison, numerics::linear::dot, problem::sample_roles::Role};

/// The first [`EACH`] lags are all summed; later ones only in steps of [`APART`].
const EACH: usize = 8;
const APART: usize = 4;

/// Autocorrelation sums of a signal over the fitted samples, by lag.
#[derive(Debug, Clone)]
pub(super) struct Lags {
    square: f64,
    /// By summed lag: the number of lags that it stands for, and the sum of products at this lag.
    sums: Vec<(f64, f64)>,
}

impl Lags {
    /// Computes the sums of a residual in multiples of the noise, without nuisances, up to a lag of
    /// two blocks.
    pub(super) fn of(compare: &Comparison<'_>, clean: &[f64]) -> Self {
        let parts = || compare.roles.of_role(Role::Fit).map(|s| &clean[s.from..s.to]);
        let product = |lag: usize| -> f64 {
            let long = parts().filter(|p| p.len() > lag);
            long.map(|p| dot(&p[lag..], &p[..p.len() - lag])).sum()
        };
        let most = 2 * compare.roles.block;
        let each = (1..=EACH.min(most)).map(|lag| (1.0, product(lag)));
        let far = (EACH + APART / 2..=most).step_by(APART);
        let far = far.map(|lag| (APART as f64, product(lag)));
        Self { square: product(0), sums: each.chain(far).collect() }
    }

    /// Returns the number of samples that count as one observation, at most a block. `change` holds
    /// the sums of a change that is added to the residual, and its amplitude.
    pub(super) fn per_observation(&self, change: Option<(&Self, f64)>, block: usize) -> f64 {
        let more = change.map_or(0.0, |(c, amplitude)| amplitude * amplitude * c.square);
        let power = (self.square + more).max(f64::MIN_POSITIVE);
        let mut sum = 0.0;
        for (i, (times, own)) in self.sums.iter().enumerate() {
            let more = change.map_or(0.0, |(c, amplitude)| amplitude * amplitude * c.sums[i].1);
            sum += times * ((own + more) / power).powi(2);
        }
        (1.0 + 2.0 * sum).min(block as f64)
    }
}
