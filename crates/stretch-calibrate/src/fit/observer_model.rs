//! The forward model of a gauge: `signal = curve(drive)`, `drive = target + dynamics`.

use stretch_core::{
    Design, Interval, Model, Polarity, Provenance, Range, RestLevel, RestTracker, SampleRate,
    Stage, Volts,
    arithmetic::{lag, lag_share, play},
};
use stretch_filter::{SgFilter, SgShape};
use stretch_receptor::{Reading, Receptor};

use crate::{
    CalibrateError,
    prepare::{Prepared, Tally, noise},
};

use super::{
    curve::Place,
    history::{SETTLE, States},
};

const RADII: [f64; 3] = [0.03, 0.1, 0.3];
/// Smallest slope of the drive with respect to the target while outputs of plays (hysteresis elements) are constant, as
/// a share of the slope without plays.
const LEAST_ANSWER: f64 = 0.1;
/// Window of the quadratic filter that smooths the reference, in samples.
const SMOOTH: usize = 7;

/// Choices of a fit. If a fit is given such choices, it uses them and chooses nothing itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ObserverChoice {
    pub(crate) taus: [Option<f64>; 2],
    pub(crate) plays: bool,
    pub(crate) agility: f64,
    pub(crate) rest: Option<RestTracker>,
}

impl ObserverChoice {
    pub(crate) fn taus(&self) -> impl Iterator<Item = f64> {
        self.taus.into_iter().flatten()
    }

    pub(crate) fn radii(&self) -> &'static [f64] {
        if self.plays { &RADII } else { &[] }
    }

    /// Returns the number of dynamic parameters: lead, amplitudes and play weights.
    pub(crate) fn dynamics(&self) -> usize {
        1 + self.taus().count() + self.radii().len()
    }
}

/// A piece of a trial: the signal above its baseline, the smoothed target and its rate.
pub(crate) struct Piece {
    pub(crate) signal: Vec<f64>,
    pub(crate) smooth: Vec<f64>,
    /// Pressures; empty if no pressure is needed.
    pub(crate) pressure: Vec<f64>,
    rate: Vec<f64>,
}

/// A sample: the signal, and the inputs of the model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<'a> {
    pub(crate) target: f64,
    /// Derivatives of the drive with respect to each dynamic parameter.
    pub(crate) features: &'a [f64],
    pub(crate) signal: f64,
}

impl Sample<'_> {
    /// Returns the sum that the dynamics add to the target.
    pub(crate) fn added(&self, dynamics: &[f64]) -> f64 {
        self.features.iter().zip(dynamics).map(|(a, b)| a * b).sum()
    }

    pub(crate) fn drive(&self, dynamics: &[f64]) -> f64 {
        self.target + self.added(dynamics)
    }
}

/// Returns all evenly sampled pieces. Pieces that are too short to be smoothed are left out.
pub(crate) fn pieces(
    prepared: &Prepared,
    rest: Option<RestTracker>,
) -> Result<Vec<Piece>, CalibrateError> {
    let rate = prepared.sample_rate;
    let centred = SgShape::centred_rate(SMOOTH, 2);
    let smoother = SgFilter::<f64>::new(SgShape { order: 0, ..centred }, rate)?;
    let differentiator = SgFilter::<f64>::new(centred, rate)?;
    let sign = prepared.polarity.sign();
    let mut pieces = Vec::new();
    for series in &prepared.series {
        if series.signal.len() <= SMOOTH + SETTLE {
            continue;
        }
        let above = rested(&series.signal, rest, prepared.polarity, prepared.signal_range, rate);
        let target: Vec<f64> =
            series.target.iter().map(|&t| prepared.target_range.normalise(t)).collect();
        let mut smooth = vec![0.0; target.len()];
        let mut slope = smooth.clone();
        smoother.over_log(&target, &mut smooth)?;
        differentiator.over_log(&target, &mut slope)?;
        let signal = above.iter().map(|v| sign * v).collect();
        let pressure = series.pressure.clone();
        pieces.push(Piece { signal, smooth, pressure, rate: slope });
    }
    Ok(pieces)
}

impl Piece {
    /// Returns the derivatives of the drive with respect to each dynamic parameter, for each sample.
    pub(crate) fn features(&self, choice: ObserverChoice, period_s: f64) -> States {
        let first = self.smooth[0];
        let mut slow: Vec<(f64, f64)> =
            choice.taus().map(|tau| (first, lag_share(period_s, tau))).collect();
        let mut played = vec![first; choice.radii().len()];
        let width = choice.dynamics();
        let mut values = Vec::with_capacity(width * self.smooth.len());
        for (&y, &rate) in self.smooth.iter().zip(&self.rate) {
            values.push(rate);
            for (l, share) in &mut slow {
                *l = lag(*l, y, *share);
                values.push(y - *l);
            }
            for (p, &w) in played.iter_mut().zip(choice.radii()) {
                *p = play(*p, y, w);
                values.push(y - *p);
            }
        }
        States { values, width }
    }

    /// Iterates over the samples after the low-passes have settled, with their `features`.
    pub(crate) fn samples<'a>(
        &'a self,
        features: &'a States,
    ) -> impl Iterator<Item = Sample<'a>> + Clone {
        let all = self.smooth.iter().zip(features.iter()).zip(&self.signal).skip(SETTLE);
        all.map(|((&target, features), &signal)| Sample { target, features, signal })
    }
}

/// A forward model of the signal multiplied by the sign of its polarity.
pub(crate) struct Forward {
    pub(crate) choice: ObserverChoice,
    pub(crate) curve: Vec<f64>,
    pub(crate) drive: Interval,
    /// Lead, amplitudes, play weights.
    pub(crate) dynamics: Vec<f64>,
    pub(crate) noise: f64,
}

impl Forward {
    /// Returns whether the drive rises with the target in every state of the plays. Otherwise the model cannot be
    /// inverted. After a reversal, the outputs of all plays are constant at first, and that of the widest play for the
    /// longest time.
    pub(crate) fn answers(&self) -> bool {
        let plays = self.choice.radii().len();
        let (instant, weights) = self.dynamics[1..].split_at(self.dynamics.len() - 1 - plays);
        let least: f64 = 1.0 + instant.iter().sum::<f64>();
        let mut slope = least;
        let engaged = weights.iter().rev().all(|weight| {
            slope += weight;
            slope > LEAST_ANSWER * least
        });
        least > 0.0 && engaged
    }

    /// Returns the position of a sample's drive on the curve.
    pub(crate) fn place(&self, sample: &Sample) -> Place {
        Place::new(sample.drive(&self.dynamics), self.drive)
    }
}

/// Time constant with which the live baseline of a forward model follows a signal below the resting level, s. It can be
/// short because a forward model computes the resting level without noise.
pub(crate) const LIVE_CATCH_UP_S: f64 = 0.02;
/// Time constant with which a baseline follows a signal below the resting level in a fit, s.
const CATCH_UP_S: f64 = 0.5;
/// Leaks (rates at which the baseline rises by itself) that are tried, as shares of the signal's range per second.
const LEAKS: [f64; 4] = [0.0, 0.0003, 0.001, 0.003];
/// Margin below the resting level for the noise of a signal at rest, in standard deviations.
const MARGIN: f64 = 1.0;
/// A trial that begins in the lowest part of the range, of this share, is assumed to begin at rest.
const LOWEST_QUARTER: f64 = 0.25;
/// Number of samples at a trial's start whose median is its starting value.
const FIRST: usize = 50;

/// Returns candidate baselines. The resting level is the start of the first trial that begins in the lowest quarter of
/// the range, minus a margin for noise. Resting signals below this level are drift. If the baseline is not tracked, the
/// only candidate is `None`.
pub(crate) fn candidates(prepared: &Prepared, rest: bool) -> Vec<Option<RestTracker>> {
    if !rest {
        return vec![None];
    }
    let sign = prepared.polarity.sign();
    let starts: Vec<f64> = prepared
        .series
        .iter()
        .map(|series| {
            let first = &series.signal[..series.signal.len().min(FIRST)];
            let mut signed: Vec<f64> = first.iter().map(|v| sign * v).collect();
            signed.sort_by(f64::total_cmp);
            signed[signed.len() / 2]
        })
        .collect();
    let records = prepared.series.iter().map(|s| s.signal.as_slice());
    let lowest = (prepared.series.iter().flat_map(|s| s.signal.iter()).map(|v| sign * v))
        .fold(f64::INFINITY, f64::min);
    let resting = lowest + LOWEST_QUARTER * prepared.signal_range.span();
    let first = starts.iter().copied().find(|&start| start < resting).unwrap_or(lowest);
    let level = sign * (first - MARGIN * noise(records));
    let span = prepared.signal_range.span();
    let tracker = |share| Some(RestTracker { level, catch_up_s: CATCH_UP_S, leak: share * span });
    LEAKS.map(tracker).into()
}

/// Subtracts the baseline from a log, as in the receptor.
pub(crate) fn rested(
    signal: &[f64],
    rest: Option<RestTracker>,
    polarity: Polarity,
    range: Range,
    sample_rate: SampleRate,
) -> Vec<f64> {
    let level = RestLevel::new(rest, polarity, range, sample_rate);
    let (sign, mut baseline) = (polarity.sign(), level.memory());
    signal.iter().map(|v| sign * level.step(&mut baseline, sign * v, 0.0)).collect()
}

/// Runs the live receptor over the trials with a model and returns its error statistics without the first samples of
/// each piece. Calls `see` with the error of each reading, in the normalised target.
pub(crate) fn judge_live(
    prepared: &Prepared,
    model: Model,
    mut see: impl FnMut(f64, &Reading),
) -> Result<Tally, CalibrateError> {
    let calibration = prepared.calibration(model, Provenance::new("", []))?;
    let receptor = Receptor::<f64>::new(&calibration)?;
    let mut tally = Tally::default();
    for series in &prepared.series {
        let mut memory = receptor.memory();
        for (i, (&v, &target)) in series.signal.iter().zip(&series.target).enumerate() {
            if let Some(&p) = series.pressure.get(i) {
                memory.set_pressure(p);
            }
            let Ok(reading) = receptor.step(&mut memory, Volts(v)) else { continue };
            if i < SETTLE {
                continue;
            }
            let truth = prepared.target_range.normalise(target);
            let estimate = prepared.target.from_reference(reading.estimate);
            let error = truth - prepared.target_range.normalise(estimate);
            tally.take(truth, error);
            see(error, &reading);
        }
    }
    Ok(tally)
}
