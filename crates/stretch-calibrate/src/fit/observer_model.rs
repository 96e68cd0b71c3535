//! A gauge's forward model: `signal = curve(drive)`, `drive = target + dynamics`.

use stretch_core::{
    Interval, RestTracker,
    arithmetic::{lag, lag_share, play},
};
use stretch_filter::{SgFilter, SgShape};

use crate::{CalibrateError, prepare::Prepared};

use super::{curve::Place, rest::rested};

const RADII: [f64; 3] = [0.03, 0.1, 0.3];
/// Least slope of the drive over the target while plays are engaged.
const LEAST_ANSWER: f64 = 0.1;
/// Window of the reference's smoothing, in samples; quadratic.
const SMOOTH: usize = 7;
/// Samples at the start of a piece while low-passes forget where they began.
pub(crate) const SETTLE: usize = 10;

/// The choices of a fit. A fit that is given earlier choices makes no further ones.
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

    /// Number of dynamic parameters: lead, amplitudes and weights of the plays.
    pub(crate) fn dynamics(&self) -> usize {
        1 + self.taus().count() + self.radii().len()
    }
}

/// A piece of a trial: signal above its baseline, the target smoothed, its rate.
pub(crate) struct Piece {
    pub(crate) signal: Vec<f64>,
    pub(crate) smooth: Vec<f64>,
    /// Pressures; empty where no pressure is needed.
    pub(crate) pressure: Vec<f64>,
    rate: Vec<f64>,
}

/// A sample: the signal, and the inputs of the model.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample<'a> {
    pub(crate) target: f64,
    /// Contribution to the drive of a unit of each dynamic parameter.
    pub(crate) features: &'a [f64],
    pub(crate) signal: f64,
}

impl Sample<'_> {
    /// The sum that the dynamics add to the target.
    pub(crate) fn added(&self, dynamics: &[f64]) -> f64 {
        self.features.iter().zip(dynamics).map(|(a, b)| a * b).sum()
    }

    pub(crate) fn drive(&self, dynamics: &[f64]) -> f64 {
        self.target + self.added(dynamics)
    }
}

/// All pieces, even in time; pieces too short to smooth are left out.
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
    /// Contribution to the drive of a unit of each dynamic parameter, for each sample.
    pub(crate) fn features(&self, choice: ObserverChoice, period_s: f64) -> Vec<Vec<f64>> {
        let first = self.smooth[0];
        let mut slow: Vec<(f64, f64)> =
            choice.taus().map(|tau| (first, lag_share(period_s, tau))).collect();
        let mut played = vec![first; choice.radii().len()];
        let step = |(&y, &rate): (&f64, &f64)| {
            let mut row = vec![rate];
            for (l, share) in &mut slow {
                *l = lag(*l, y, *share);
                row.push(y - *l);
            }
            for (p, &w) in played.iter_mut().zip(choice.radii()) {
                *p = play(*p, y, w);
                row.push(y - *p);
            }
            row
        };
        self.smooth.iter().zip(&self.rate).map(step).collect()
    }

    /// The samples after the low-passes have settled, with their `features`.
    pub(crate) fn samples<'a>(
        &'a self,
        features: &'a [Vec<f64>],
    ) -> impl Iterator<Item = Sample<'a>> {
        let all = self.smooth.iter().zip(features).zip(&self.signal).skip(SETTLE);
        all.map(|((&target, features), &signal)| Sample { target, features, signal })
    }
}

/// A forward model in signed signal.
pub(crate) struct Forward {
    pub(crate) choice: ObserverChoice,
    pub(crate) curve: Vec<f64>,
    pub(crate) drive: Interval,
    /// Lead, amplitudes, weights of the plays.
    pub(crate) dynamics: Vec<f64>,
    pub(crate) noise: f64,
}

impl Forward {
    /// Whether the drive rises with the target whichever plays are engaged: a
    /// drive that falls cannot be inverted. Plays engage from the widest on.
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

    /// The place of a sample's drive on the curve.
    pub(crate) fn place(&self, sample: &Sample) -> Place {
        Place::new(sample.drive(&self.dynamics), self.drive)
    }
}
