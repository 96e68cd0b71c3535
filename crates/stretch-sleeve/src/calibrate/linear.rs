//! A model that is linear in its coefficients, and the calibrations made from it.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use stretch_calibrate::CalibrateError;
use stretch_core::{
    Calibration, CalibrationSpec, FitSummary, HistoryMap, Interval, Label, Model, Normalisation,
    Polarity, Provenance, Range, RangeSpec, RateEstimator, RateSource, SampleRate, Schema, Target,
    Values,
};

use crate::{
    ArrayCalibration, ArrayGains, ArrayShifts, ArraySpec, GaugeCalibration, MAX_CHANNELS,
    SleeveCalibration, SleeveError,
};

use super::{
    array::{Still, watched},
    bank::{BANK, Bank},
    channels::Channels,
    turns::{find_turns, with_limit_of},
};

/// Ridge penalty of the regression of a lost channel on the remaining ones, as a share of a term's power.
const RIDGE: f64 = 1e-6;

/// Coefficients of the terms of a [`Bank`], for the normalised target, and statistics of the fitted data.
#[derive(Clone)]
pub(crate) struct Linear {
    pub(crate) signals: Vec<String>,
    pub(crate) reference: String,
    pub(crate) sample_rate_hz: f64,
    pub(crate) target: Target,
    pub(crate) target_range: Range,
    pub(crate) estimate: Interval,
    pub(crate) domains: Vec<Vec<Interval>>,
    pub(crate) weights: Vec<f64>,
    /// `X'X` divided by the number of samples, where each row of `X` contains the terms of a sample.
    pub(crate) gram: DMatrix<f64>,
    /// Expected mean squared error of the normalised target.
    pub(crate) variance: f64,
    pub(crate) samples: u64,
    pub(crate) still: Still,
    /// Largest changes of the zero in the sessions of a prior.
    pub(crate) zero_moves: Vec<f64>,
}

impl Linear {
    /// Creates the calibration. For a single gauge it includes the turning points of movements, if the data show them.
    /// `channels` are the fitted data, if there are any. `shifts` are the usual differences between channels, if known.
    pub(crate) fn record(
        &self,
        channels: Option<&Channels>,
        shifts: Option<ArrayShifts<MAX_CHANNELS>>,
        provenance: Provenance,
    ) -> Result<SleeveCalibration, SleeveError> {
        match self.signals.len() {
            1 => {
                let stretches = channels.iter().flat_map(|own| &own.stretches);
                let signals: Vec<&[f64]> = stretches.map(|own| own.signals[0].as_slice()).collect();
                let one = self.one(provenance)?;
                let turns = find_turns(&one, &signals);
                let turns = turns.map(|turns| with_limit_of(turns, &self.zero_moves));
                Ok(SleeveCalibration::One(Box::new(GaugeCalibration::new(one, turns)?)))
            }
            _ => Ok(SleeveCalibration::Many(Box::new(self.many(channels, shifts, provenance)?))),
        }
    }

    /// Returns the coefficients of a calibration whose states have the domains of this model; `None` for any other
    /// calibration.
    pub(crate) fn weights_of(&self, record: &SleeveCalibration) -> Option<Vec<f64>> {
        let is_near = |a: &[f64], b: &[f64]| {
            a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + b.abs()))
        };
        match record {
            SleeveCalibration::One(own) => {
                let own = own.calibration();
                let same = self.one(own.spec().provenance.clone()).ok()?;
                let (Model::History(a), Model::History(b)) =
                    (&own.spec().model, &same.spec().model)
                else {
                    return None;
                };
                let is_same = own.spec().signal_range == same.spec().signal_range
                    && own.spec().target_range == same.spec().target_range
                    && is_near(&a.relaxations_s, &b.relaxations_s)
                    && is_near(&a.state_min, &b.state_min)
                    && is_near(&a.state_max, &b.state_max);
                is_same.then(|| a.coefficients.to_vec())
            }
            SleeveCalibration::Many(own) => {
                let mut ends = own.spec().channels.iter().zip(&self.domains);
                let is_same = own.spec().channels.len() == self.domains.len()
                    && ends.all(|(channel, domain)| {
                        let list =
                            |f: fn(&Interval) -> f64| domain.iter().map(f).collect::<Vec<_>>();
                        is_near(&channel.state_min, &list(|d| d.min))
                            && is_near(&channel.state_max, &list(|d| d.max))
                    });
                let (zero, gain) = self.zero_and_gain();
                is_same.then(|| {
                    let terms = own.spec().all.terms.iter().flat_map(|own| own.iter());
                    let constant = (own.spec().all.constant - zero) / gain;
                    [constant].into_iter().chain(terms.map(|term| term / gain)).collect()
                })
            }
        }
    }

    /// Returns `zero` and `gain` of `reference = zero + gain * normalised target`.
    pub(crate) fn zero_and_gain(&self) -> (f64, f64) {
        let gain = self.target.reference_per_normalised(self.target_range);
        (self.target.to_reference(self.target_range.offset()), gain)
    }

    /// Returns the range of a channel's terms among all terms.
    pub(crate) fn terms_of(&self, channel: usize) -> std::ops::Range<usize> {
        let own = Bank::terms_a_channel();
        1 + channel * own..1 + (channel + 1) * own
    }

    /// Returns the variance of the estimate over the samples in `gram`.
    fn power(&self, weights: &DVector<f64>) -> f64 {
        let moments = &self.gram * weights;
        let mean = moments[0] / self.gram[(0, 0)];
        (weights.dot(&moments) / self.gram[(0, 0)] - mean * mean).max(f64::MIN_POSITIVE)
    }

    fn one(&self, provenance: Provenance) -> Result<Calibration, SleeveError> {
        let domain = self.domains[0][0];
        let Interval { min, max } = domain;
        let spec = RangeSpec { mode: Normalisation::MinMax, zero: 0.0, min, max };
        let signal_range = Range::new(spec)?;
        let span = max - min;
        // The signal is normalised before its states are computed. States are linear in the signal, so their domains
        // scale with it.
        let end = |f: fn(&Interval) -> f64| {
            let mut ends: Vec<f64> = self.domains[0].iter().map(|d| f(d) / span).collect();
            ends[0] = (f(&domain) - min) / span;
            ends
        };
        let weights = DVector::from_column_slice(&self.weights);
        let power = self.power(&weights);
        let rising = term_correlation(&self.gram, &weights, 1) >= 0.0;
        let map = HistoryMap {
            rest: None,
            relaxations_s: Values::new("relaxations_s", BANK.relaxations_s)?,
            radii: Values::EMPTY,
            degree: BANK.degree,
            memory_degree: BANK.memory_degree,
            state_min: Values::new("state_min", &end(|d| d.min))?,
            state_max: Values::new("state_max", &end(|d| d.max))?,
            coefficients: Values::new("coefficients", &self.weights)?,
            estimate_domain: self.estimate,
            fit: FitSummary {
                samples: self.samples,
                r_squared: 1.0 - self.variance / (power + self.variance),
                rmse: self.variance.sqrt(),
            },
        };
        Ok(Calibration::new(CalibrationSpec {
            schema: Schema::CURRENT,
            signal: Label::new(&self.signals[0])?,
            reference: Label::new(&self.reference)?,
            sample_rate_hz: SampleRate::new(self.sample_rate_hz)?,
            target: self.target,
            polarity: if rising { Polarity::Rising } else { Polarity::Falling },
            signal_range,
            target_range: self.target_range,
            rate_estimator: RateEstimator::SAVGOL_11_2,
            rate_source: RateSource::Voltage,
            dead_band: 0.0,
            model: Model::History(map),
            provenance,
        })?)
    }

    fn many(
        &self,
        channels: Option<&Channels>,
        shifts: Option<ArrayShifts<MAX_CHANNELS>>,
        provenance: Provenance,
    ) -> Result<ArrayCalibration<MAX_CHANNELS>, SleeveError> {
        let count = self.signals.len();
        let ends = [self.estimate.min, self.estimate.max];
        let ends = ends.map(|t| self.target.to_reference(self.target_range.denormalise(t)));
        let everything: Vec<usize> = (0..count).collect();
        let lost = |k: usize| everything.iter().copied().filter(|&c| c != k).collect::<Vec<_>>();
        Ok(ArrayCalibration::new(ArraySpec {
            schema: Schema::CURRENT,
            reference: Label::new(&self.reference)?,
            sample_rate_hz: SampleRate::new(self.sample_rate_hz)?,
            relaxations_s: Values::new("relaxations_s", BANK.relaxations_s)?,
            degree: BANK.degree,
            memory_degree: BANK.memory_degree,
            estimate_domain: Interval { min: ends[0].min(ends[1]), max: ends[0].max(ends[1]) },
            channels: (0..count).map(|k| watched(self, channels, k)).collect::<Result<_, _>>()?,
            all: self.gains(&everything)?,
            without: (0..count).map(|k| self.gains(&lost(k))).collect::<Result<_, _>>()?,
            alone: (0..count).map(|k| self.gains(&[k])).collect::<Result<_, _>>()?,
            shifts,
            provenance,
        })?)
    }

    /// Returns the coefficients of the remaining channels, and the additional mean squared error due to the lost ones.
    ///
    /// The lost terms `l` are replaced by their regression on the remaining terms `r`, with `G = X'X/n`. The
    /// coefficients become `w_r + G_rr^-1 G_rl w_l`, and the mean squared error increases by `w_l' (G_ll - G_lr G_rr^-1
    /// G_rl) w_l`.
    pub(crate) fn remaining(&self, keep: &[usize]) -> Option<(DVector<f64>, f64)> {
        let terms = self.weights.len();
        let stays =
            |term: usize| term == 0 || keep.iter().any(|&k| self.terms_of(k).contains(&term));
        let (r, l): (Vec<usize>, Vec<usize>) = (0..terms).partition(|&term| stays(term));
        let mut weights = DVector::zeros(terms);
        r.iter().for_each(|&term| weights[term] = self.weights[term]);
        if l.is_empty() {
            return Some((weights, 0.0));
        }
        let part = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| self.gram[(rows[i], columns[j])])
        };
        let mut inner = part(&r, &r);
        for i in 1..r.len() {
            inner[(i, i)] *= 1.0 + RIDGE;
        }
        let cross = part(&r, &l);
        let lost = DVector::from_iterator(l.len(), l.iter().map(|&term| self.weights[term]));
        let said = &cross * &lost;
        let moved = cholesky(&inner)?.solve(&said);
        r.iter().zip(moved.iter()).for_each(|(&term, m)| weights[term] += m);
        let missed = lost.dot(&(part(&l, &l) * &lost)) - said.dot(&moved);
        Some((weights, missed.max(0.0) / self.gram[(0, 0)]))
    }

    /// Returns the gains of some channels, in the reference's unit.
    fn gains(&self, keep: &[usize]) -> Result<ArrayGains<MAX_CHANNELS>, SleeveError> {
        let undetermined = || CalibrateError::Undetermined { model: "array".into() };
        let (weights, missed) = self.remaining(keep).ok_or_else(undetermined)?;
        let (zero, gain) = self.zero_and_gain();
        let of = |k: usize| -> Result<_, SleeveError> {
            if !keep.contains(&k) {
                return Ok(Values::EMPTY);
            }
            let own: Vec<f64> = self.terms_of(k).map(|term| gain * weights[term]).collect();
            Ok(Values::new("terms", &own)?)
        };
        Ok(ArrayGains {
            constant: zero + gain * weights[0],
            terms: (0..self.signals.len()).map(of).collect::<Result<_, _>>()?,
            sd: gain.abs() * (self.variance + missed).sqrt(),
        })
    }
}

/// Returns the inverse of a symmetric positive definite matrix, such as a covariance, a precision or `X'X/n`.
pub(crate) fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    cholesky(matrix).map(|factor| symmetric(factor.inverse()))
}

pub(crate) fn cholesky(matrix: &DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    Cholesky::new(symmetric(matrix.clone()))
}

pub(crate) fn symmetric(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let transposed = matrix.transpose();
    (matrix + transposed) * 0.5
}

/// Returns the correlation of a term with the model's estimate, over the samples in `gram`.
pub(crate) fn term_correlation(gram: &DMatrix<f64>, w: &DVector<f64>, term: usize) -> f64 {
    let moments = gram * w;
    let mean = moments[0] / gram[(0, 0)];
    let covariance = moments[term] / gram[(0, 0)] - mean * gram[(0, term)] / gram[(0, 0)];
    let power = w.dot(&moments) / gram[(0, 0)] - mean * mean;
    let own = gram[(term, term)] / gram[(0, 0)] - (gram[(0, term)] / gram[(0, 0)]).powi(2);
    if power > 0.0 && own > 0.0 { covariance / (power * own).sqrt() } else { 0.0 }
}
