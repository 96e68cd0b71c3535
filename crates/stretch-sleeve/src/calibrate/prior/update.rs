//! Makes a calibration from a prior and some seconds of reference.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use stretch_calibrate::{
    CalibrateError,
    toolkit::{RowAccumulator, extent, provenance},
};
use stretch_data::{Trial, in_digits, resampling, unit_of};

use crate::{
    SleeveError, SleeveFit, SleeveOptions,
    calibrate::{
        array::Still,
        bank::Bank,
        channels::{Channels, correlation},
        linear::{Linear, cholesky, term_correlation},
    },
};

use super::{
    expected::Expected,
    learnt::{Prior, correlated, elsewhere, is_other_unit, paths_in_words, turned},
    tree::Normal,
};

/// Smallest range of a movement, as a share of the prior's range of the reference.
pub(crate) const MOVEMENT: f64 = 0.2;

/// Facts about an updated calibration, and the errors of the prior's left-out sessions with the same duration of
/// reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UpdateSummary {
    /// Duration of the reference that was used, s.
    pub seconds: f64,
    /// Number of steps of the path that the prior knows.
    pub known: usize,
    /// Root mean square error of the left-out sessions ([`Expected`]), in the reference's unit; `None` if the prior has
    /// no such session.
    pub expected_rmse: Option<f64>,
    /// Half of the interval that contains 95 % of these errors, in the same unit.
    pub half_width_95: Option<f64>,
}

/// Returns `X'X/n` for the rest of a session: the weighted mean of `prior`, the matrix of the prior, and `own`, the
/// matrix of the first seconds of the session. Each row of `X` contains the terms of a sample. One minute of the
/// session has the same weight as the prior.
fn mixed_gram(prior: &DMatrix<f64>, own: &DMatrix<f64>, seconds: f64) -> DMatrix<f64> {
    let weight = seconds / 60.0;
    (prior + own * weight) / (1.0 + weight)
}

/// Returns the error of data that do not fit the prior.
fn refused(problem: String) -> Result<(), SleeveError> {
    Err(SleeveError::Prior { file: "the prior".into(), problem })
}

impl Prior {
    /// Makes a calibration from the prior and a reference of ten seconds to a minute, by Bayesian least squares.
    /// Without trials, the calibration comes from the prior alone.
    ///
    /// Let `S = L L'`, and let `s^2` be the variance of a sample. The prior `N(m, S)` of the coefficients is written as
    /// rows `s L^-1` with values `s L^-1 m`, which come before the rows of the data. All rows are reduced to one
    /// triangle `R` by Householder reflections. The posterior is `N(R^-1 q, s^2 (R'R)^-1)`, where `q` are the reduced
    /// values. A sample has weight 1/`n`, where `n` is the number of samples within which errors are correlated.
    ///
    /// For a single gauge, the limit for a shift of the zero comes from the sessions of the prior if at least three of them
    /// have enough movements ([`Turns`](crate::Turns)).
    ///
    /// # Errors
    /// [`SleeveError::Prior`] if the data have other channels, another unit, another rate or another polarity than the
    /// prior. The error states what to do.
    pub fn update(
        &self,
        trials: &[Trial],
        options: &SleeveOptions,
    ) -> Result<SleeveFit<UpdateSummary>, SleeveError> {
        let signals = if options.signals.is_empty() { &self.signals } else { &options.signals };
        let reference =
            if options.reference.is_empty() { &self.reference } else { &options.reference };
        self.refuse_columns(signals, reference)?;
        let mut notes = Vec::new();
        let channels = match trials {
            [] => None,
            trials => Some(Channels::new(trials, signals, reference)?),
        };
        if let Some(channels) = &channels {
            notes.extend(channels.notes.iter().cloned());
            self.refuse(channels)?;
            notes.extend(self.too_little(channels));
        }
        let (normal, known) = self.of(&options.path);
        notes.extend(self.whom(&options.path, known));
        let bank = Bank::new(self.domains.clone());
        let (posterior, gram) = self.posterior(&bank, &normal, channels.as_ref())?;
        let seconds = channels
            .as_ref()
            .map_or(0.0, |channels| channels.reference().count() as f64 / self.sample_rate_hz);
        let predicted = posterior.covariance.component_mul(&gram).sum() + self.noise;
        let [expected_rmse, half_width_95] = self.expect(seconds, known > 0);
        let variance = self.variance(expected_rmse).unwrap_or(predicted);
        let columns = signals.iter().chain([reference]);
        let provenance = provenance(&options.date, trials, columns).with_time(&options.time);
        let linear = Linear {
            signals: signals.clone(),
            reference: reference.clone(),
            samples: channels.as_ref().map_or(0, |c| c.reference().count() as u64),
            still: channels.iter().fold(self.still(), |all, own| all.and(&Still::of(own))),
            ..self.linear(&posterior.mean, gram, variance)
        };
        Ok(SleeveFit {
            calibration: linear.record(channels.as_ref(), None, provenance)?,
            summary: UpdateSummary { seconds, known, expected_rmse, half_width_95 },
            notes,
        })
    }

    /// Returns the model with these coefficients.
    pub(crate) fn linear(
        &self,
        weights: &DVector<f64>,
        gram: DMatrix<f64>,
        variance: f64,
    ) -> Linear {
        Linear {
            signals: self.signals.clone(),
            reference: self.reference.clone(),
            sample_rate_hz: self.sample_rate_hz,
            target: self.target,
            target_range: self.target_range,
            estimate: self.estimate,
            domains: self.domains.clone(),
            weights: weights.iter().copied().collect(),
            gram,
            variance,
            still: self.still(),
            samples: 0,
            zero_moves: self.zero_moves.clone(),
        }
    }

    /// Returns the posterior of the coefficients, and `X'X/n` of the prior and the data together.
    fn posterior(
        &self,
        bank: &Bank,
        normal: &Normal,
        channels: Option<&Channels>,
    ) -> Result<(Normal, DMatrix<f64>), SleeveError> {
        let Some(channels) = channels else { return Ok((normal.clone(), self.gram.clone())) };
        let undetermined = || CalibrateError::Undetermined { model: "prior".into() };
        let terms = bank.terms();
        let lower = cholesky(&normal.covariance).ok_or_else(undetermined)?.l();
        let above = lower.clone().try_inverse().ok_or_else(undetermined)? * self.noise.sqrt();
        let values: DVector<f64> = &above * &normal.mean;
        let mut sums = RowAccumulator::new(terms);
        for (row, value) in above.row_iter().zip(values.iter()) {
            sums.push(&row.iter().copied().collect::<Vec<_>>(), *value);
        }
        let share = correlated(self.sample_rate_hz).sqrt().recip();
        let (mut row, mut scratch) = (Vec::new(), (Vec::new(), Vec::new()));
        let mut own = RowAccumulator::new(terms);
        let mut count = 0.0;
        for stretch in &channels.stretches {
            for sample in stretch.warmed_up() {
                bank.fill(stretch.at(sample), &mut row, &mut scratch);
                let target = self.target.from_reference(stretch.reference[sample]);
                let target = self.target_range.normalise(target);
                own.push(&row, target);
                row.iter_mut().for_each(|x| *x *= share);
                sums.push(&row, share * target);
                count += 1.0;
            }
        }
        let solution = sums.factor().solve(|_, _| 0.0).ok_or_else(undetermined)?;
        let inverse = solution.r.try_inverse().ok_or_else(undetermined)?;
        let covariance = &inverse * inverse.transpose() * self.noise;
        let mean = DVector::from_vec(solution.weights);
        let triangle = own.factor().triangle;
        let all = triangle.tr_mul(&triangle);
        let own = all.view((0, 0), (terms, terms)) / f64::max(count, 1.0);
        let mixed = mixed_gram(&self.gram, &own, count / self.sample_rate_hz);
        Ok((Normal { mean, covariance }, mixed))
    }

    /// Returns the root mean square error of left-out sessions after at most this duration of reference, and half of
    /// the interval that contains 95 % of their errors.
    pub(crate) fn expect(&self, seconds: f64, known: bool) -> [Option<f64>; 2] {
        let of = |e: &Expected| match known {
            true => [e.rmse_known, e.half_width_95_known],
            false => [e.rmse_new, e.half_width_95_new],
        };
        // Allow 1 %, because the duration is computed from a measured sample rate.
        let mut reached = self.expected.iter().filter(|e| e.seconds <= 1.01 * seconds).map(of);
        reached.rfind(|[rmse, _]| rmse.is_some()).unwrap_or([None; 2])
    }

    /// Returns the variance of the normalised target for a root mean square error in the reference's unit.
    pub(crate) fn variance(&self, rmse: Option<f64>) -> Option<f64> {
        rmse.map(|rmse| (rmse / self.unit_of_target()).powi(2))
    }

    pub(crate) fn refuse_columns(
        &self,
        signals: &[String],
        reference: &str,
    ) -> Result<(), SleeveError> {
        if signals.len() != self.signals.len() {
            return refused(format!(
                "it has {} channels ({}), but {} were given: give {0} with --signal, in that order, or learn a new prior from these",
                self.signals.len(),
                self.signals.join(","),
                signals.len()
            ));
        }
        if let Some(name) = elsewhere(signals, &self.signals) {
            return refused(format!(
                "{name} does not have the same position in the signals of the prior ({}) as in {}, and signals are matched by position: name them in \
                 the order of the prior",
                self.signals.join(","),
                signals.join(",")
            ));
        }
        if unit_of(reference) != unit_of(&self.reference) {
            return refused(format!(
                "its reference is {} and that of these data is {reference}: convert the data (stretch convert), so that both are in one unit",
                self.reference
            ));
        }
        Ok(())
    }

    /// Refuses data of another rate, unit or polarity.
    fn refuse(&self, channels: &Channels) -> Result<(), SleeveError> {
        self.refuse_signals(channels)?;
        let range = extent(
            channels
                .reference()
                .map(|x| self.target_range.normalise(self.target.from_reference(x))),
        );
        if range.min > 3.0 || range.max < -2.0 || range.max - range.min > 10.0 {
            return refused(format!(
                "the reference of these data lies far outside its range in the sessions: is {} in another unit?",
                self.reference
            ));
        }
        let share = (range.max - range.min) / (self.estimate.max - self.estimate.min);
        let steeper = (0..self.signals.len()).map(|k| {
            let (own, domain) = (extent(channels.signal(k)), self.domains[k][0]);
            let follows = correlation(channels.signal(k), channels.reference());
            (follows, share * (domain.max - domain.min) / (own.max - own.min))
        });
        if is_other_unit(steeper) {
            return refused(format!(
                "for the same change of the signals, the reference of these data changes by a different amount than in the sessions of the prior: is {} in \
                 another unit, such as radians instead of degrees? Convert it (stretch convert)",
                self.reference
            ));
        }
        self.refuse_polarity(channels)
    }

    /// Refuses signals of another rate or unit.
    pub(crate) fn refuse_signals(&self, channels: &Channels) -> Result<(), SleeveError> {
        let hz = channels.sample_rate.hz();
        if (hz / self.sample_rate_hz - 1.0).abs() > 0.05 {
            return refused(format!(
                "it has {} samples a second and the data {}: resample the data ({})",
                in_digits(self.sample_rate_hz, 6),
                in_digits(hz, 6),
                resampling(self.sample_rate_hz)
            ));
        }
        for (k, name) in self.signals.iter().enumerate() {
            let domain = self.domains[k][0];
            let reach = domain.max - domain.min;
            let far = |x: f64| x < domain.min - 2.0 * reach || x > domain.max + 2.0 * reach;
            let (all, outside) = channels
                .signal(k)
                .fold((0usize, 0usize), |(n, far_off), x| (n + 1, far_off + usize::from(far(x))));
            if 2 * outside > all {
                return refused(format!(
                    "{name} ran from {:.4} to {:.4} in its sessions, and most of these samples lie far outside: is the signal in another \
                     unit, reversed, or from another gauge?",
                    domain.min, domain.max
                ));
            }
        }
        self.misplaced(channels).map_or(Ok(()), refused)
    }

    /// Refuses data in which most channels that clearly follow the reference do so in the opposite direction.
    fn refuse_polarity(&self, channels: &Channels) -> Result<(), SleeveError> {
        let mean = &self.known[0].mean;
        let sign = self.target.reference_per_target().signum();
        let pair = |k: usize| {
            let prior = sign * term_correlation(&self.gram, mean, 1 + k * Bank::terms_a_channel());
            (correlation(channels.signal(k), channels.reference()), prior)
        };
        if let Some(opposite) = turned((0..self.signals.len()).map(pair)) {
            return refused(format!(
                "{opposite} of {} channels fall where they rose in its sessions: swap the wires of the bridge, or change the sign of the signal",
                self.signals.len()
            ));
        }
        Ok(())
    }

    /// Returns a note if the reference hardly moves.
    fn too_little(&self, channels: &Channels) -> Option<String> {
        let moved = extent(channels.reference());
        let all = self.unit_of_target();
        let share = (moved.max - moved.min) / all;
        (share < MOVEMENT).then(|| {
            format!(
                "the reference moved over {:.3} of the {all:.3} that the prior has seen: the result depends mostly on the prior; move over the whole range, at least once up and down",
                moved.max - moved.min
            )
        })
    }

    /// Returns a note that says how much of a path the prior knows.
    pub(crate) fn whom(&self, path: &[String], known: usize) -> Option<String> {
        if path.is_empty() || known == path.len() {
            return None;
        }
        let seen = paths_in_words(self.paths().filter(|p| p.len() == 1).map(<[String]>::to_vec));
        Some(match known {
            0 => format!(
                "the prior has no session of {}: the spread of all sessions is used (known: {seen})",
                path.join("/")
            ),
            known => {
                format!(
                    "the prior has sessions of {}, but none of {}",
                    path[..known].join("/"),
                    path.join("/")
                )
            }
        })
    }
}
