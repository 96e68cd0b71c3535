//! The live form of a gauge's forward model: a small Kalman filter.

use stretch_core::{
    Baseline, Branch, Calibration, Design, DesignError, MAX_KNOTS, MAX_OBSERVER_PLAYS,
    MAX_OBSERVER_RELAXATIONS, Model, Real, RestLevel, Volts, lag, lag_share, play,
};

use crate::{
    Domain, Front, Reading,
    fold::{output, reference_dead_band, rounded},
    front::{Live, usable},
    gains::{Gains, SLOPES, STATES},
};

/// A secant is taken over at least this share of the way between knots.
const LEAST_RUN: f64 = 0.01;

/// A receptor for [`Model::Observer`]: predicts the motion, compares the signal
/// it would give with the one that came, and corrects.
///
/// It answers from the first sample on, and its rate is a state, not a
/// difference. A missing sample is predicted over as every [`Front`] does; a long
/// gap forgets all but branch and baseline.
///
/// A sample corrects every state by a gain times what the signal has over its
/// prediction. The gain is the one that a Kalman filter settles at for the slope
/// of the curve, from a table made when the receptor is: carrying the covariance
/// along costs twenty times as much and errs more (the slope changes faster than
/// a covariance can follow, and a filter that is wrong trusts itself). The slope
/// is the greater of the tangent at the prediction and of the secant to the drive
/// that the signal alone suggests, so that a flat end of the curve cannot throw
/// the estimate.
///
/// The baseline, where it is followed, is compared with the signal that rest would
/// give now, memory included: an undershoot after a fast release is not drift.
pub type ObserverReceptor<T> = Front<Observer<T>>;

/// The model of an [`ObserverReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer<T> {
    /// Multiplies the signal: -1 where it falls as the target rises.
    pub sign: T,
    /// The baseline, where one is followed.
    pub rest: RestLevel<T>,
    /// Knots of the curve.
    pub knots: usize,
    /// Signed signals at the knots, rising.
    pub curve: [T; MAX_KNOTS],
    /// The drive of the first knot.
    pub drive_low: T,
    /// From knot to knot.
    pub drive_step: T,
    /// Its reciprocal.
    pub per_step: T,
    /// How many there are.
    pub relaxations: usize,
    /// The share of the way that each goes in a sample.
    pub shares: [T; MAX_OBSERVER_RELAXATIONS],
    /// What each adds to the drive.
    pub amplitudes: [T; MAX_OBSERVER_RELAXATIONS],
    /// Seconds by which the signal leads.
    pub lead_s: T,
    /// How many there are.
    pub plays: usize,
    /// Their half-widths.
    pub radii: [T; MAX_OBSERVER_PLAYS],
    /// What each adds to the drive.
    pub play_weights: [T; MAX_OBSERVER_PLAYS],
    /// Below `ends[k]`, and not below the one before, a slope has the gains `gains[k]`.
    pub ends: [T; SLOPES - 1],
    /// State (target, rate, relaxations) per signal.
    pub gains: [[T; STATES]; SLOPES],
    /// Seconds from a sample to the next.
    pub period_s: T,
    /// The least target.
    pub low: T,
    /// The greatest.
    pub high: T,
    /// Reference units per target.
    pub gain: T,
    /// The reference at a target of zero.
    pub zero: T,
    /// The largest rate of the target that keeps the branch.
    pub dead_band: T,
    /// The signal where the target rests, memory settled.
    pub at_rest: T,
}

/// What an [`ObserverReceptor`]'s model remembers: its states, the plays, the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverMemory<T> {
    /// Target, rate, relaxations: normalised. The target is NaN before the first sample.
    states: [T; STATES],
    plays: [T; MAX_OBSERVER_PLAYS],
    baseline: Baseline<T>,
}

impl<T: Real> ObserverReceptor<T> {
    /// A receptor for `calibration`.
    ///
    /// # Errors
    /// [`DesignError`] when the calibration is of another model.
    pub fn new(calibration: &Calibration) -> Result<Self, DesignError> {
        let Model::Observer(map) = &calibration.model else {
            return Err(calibration.model.instead_of("observer"));
        };
        map.validate()?;
        let (polarity, sample_rate) = (calibration.polarity, calibration.sample_rate_hz);
        let (sign, period_s) = (polarity.sign(), sample_rate.period_s());
        let (gain, zero) = output(calibration);
        let knots = map.curve.len();
        let drive = map.drive_domain;
        let step = (drive.max - drive.min) / (knots - 1) as f64;
        // a curve against the polarity would be inverted the wrong way round
        let rises = sign * (map.curve[knots - 1] - map.curve[0]);
        DesignError::check("rise of observer.curve", rises, rises > 0.0)?;
        let slopes = map.curve.windows(2).map(|pair| sign * (pair[1] - pair[0]) / step);
        let (flattest, steepest) =
            slopes.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), s| (a.min(s), b.max(s)));
        let gains = Gains::new(map, period_s, flattest, steepest)?;
        let model = Observer {
            sign: T::from_f64(sign),
            rest: RestLevel::new(map.rest, polarity, calibration.signal_range, sample_rate),
            knots,
            curve: rounded(map.curve.iter().map(|v| sign * v)),
            drive_low: T::from_f64(drive.min),
            drive_step: T::from_f64(step),
            per_step: T::from_f64(step.recip()),
            relaxations: map.relaxations_s.len(),
            shares: rounded(map.relaxations_s.iter().map(|&tau| lag_share(period_s, tau))),
            amplitudes: rounded(map.amplitudes.iter().copied()),
            lead_s: T::from_f64(map.lead_s),
            plays: map.radii.len(),
            radii: rounded(map.radii.iter().copied()),
            play_weights: rounded(map.play_weights.iter().copied()),
            ends: gains.ends.map(T::from_f64),
            gains: gains.of.map(|of| of.map(T::from_f64)),
            period_s: T::from_f64(period_s),
            low: T::from_f64(map.estimate_domain.min),
            high: T::from_f64(map.estimate_domain.max),
            gain: T::from_f64(gain),
            zero: T::from_f64(zero),
            dead_band: T::from_f64((reference_dead_band(calibration) / gain).abs()),
            at_rest: T::zero(),
        };
        Ok(Self { model: Observer { at_rest: model.forward(model.low).0, ..model } })
    }
}

impl<T: Real> Observer<T> {
    /// The drive that a signal suggests by itself, the nearest end beyond the curve.
    #[inline(always)]
    fn inverse(&self, signal: T) -> (T, T) {
        let (first, last) = (self.curve[0], self.curve[self.knots - 1]);
        let held = signal.max(first).min(last);
        // the last knot at or below, by halving
        let (mut below, mut above) = (0, self.knots - 1);
        while above - below > 1 {
            let middle = (below + above) / 2;
            if self.curve[middle] <= held { below = middle } else { above = middle }
        }
        let rise = self.curve[below + 1] - self.curve[below];
        let place = T::from_f64(below as f64) + (held - self.curve[below]) / rise;
        (self.drive_low + place * self.drive_step, held)
    }

    /// The signal at a drive and the slope there; the curve ends where it was fitted.
    #[inline(always)]
    fn forward(&self, drive: T) -> (T, T, T) {
        let most = T::from_f64((self.knots - 1) as f64);
        let place = ((drive - self.drive_low) * self.per_step).max(T::zero()).min(most);
        let below = place.to_usize().unwrap_or(0).min(self.knots - 2);
        let rise = self.curve[below + 1] - self.curve[below];
        let share = place - T::from_f64(below as f64);
        let held = self.drive_low + place * self.drive_step;
        (self.curve[below] + share * rise, rise * self.per_step, held)
    }

    fn begin(&self, memory: &mut ObserverMemory<T>, signal: T) {
        let (drive, _) = self.inverse(signal);
        let target = drive.max(self.low).min(self.high);
        memory.states = [target; STATES];
        memory.states[1] = T::zero();
        memory.plays = [target; MAX_OBSERVER_PLAYS];
    }

    /// Moves the states on by a sample.
    #[inline(always)]
    fn predict(&self, memory: &mut ObserverMemory<T>) {
        let x = &mut memory.states;
        x[0] = (x[0] + self.period_s * x[1]).max(self.low).min(self.high);
        for i in 0..self.relaxations {
            x[2 + i] = lag(x[2 + i], x[0], self.shares[i]);
        }
    }

    /// The drive of a target that stands at `y` now.
    #[inline(always)]
    fn drive_at(&self, memory: &ObserverMemory<T>, y: T) -> T {
        let mut drive = y;
        for i in 0..self.relaxations {
            drive = drive + self.amplitudes[i] * (y - memory.states[2 + i]);
        }
        for j in 0..self.plays {
            let played = play(memory.plays[j], y, self.radii[j]);
            drive = drive + self.play_weights[j] * (y - played);
        }
        drive
    }

    /// By how much memory moves the signal of a target at rest now.
    #[inline(always)]
    fn rest_shift(&self, memory: &ObserverMemory<T>) -> T {
        if memory.states[0].is_nan() {
            return T::zero();
        }
        self.forward(self.drive_at(memory, self.low)).0 - self.at_rest
    }

    /// Takes in a signed signal above its baseline; whether it lay on the curve.
    #[inline(always)]
    fn correct(&self, memory: &mut ObserverMemory<T>, signal: T) -> bool {
        let drive = self.drive_at(memory, memory.states[0]) + self.lead_s * memory.states[1];
        let (predicted, tangent, from) = self.forward(drive);
        let (to, held) = self.inverse(signal);
        let run = to - from;
        // over a hair's breadth rounding alone would decide the secant
        let far = run.abs() > T::from_f64(LEAST_RUN) * self.drive_step;
        let secant = if far { (held - predicted) / run } else { tangent };
        let slope = tangent.max(secant);

        // a spike counts as a signal one whole curve away, no more
        let (first, last) = (self.curve[0], self.curve[self.knots - 1]);
        let span = last - first;
        let surprise = signal.max(first - span).min(last + span) - predicted;
        let gains = &self.gains[self.nearest(slope)];
        for i in 0..2 + self.relaxations {
            memory.states[i] = memory.states[i] + gains[i] * surprise;
        }
        self.hold(memory);
        held == signal
    }

    /// The place of the gains for a slope, by halving.
    #[inline(always)]
    fn nearest(&self, slope: T) -> usize {
        let (mut from, mut to) = (0, SLOPES - 1);
        while from < to {
            let middle = (from + to) / 2;
            if slope < self.ends[middle] { to = middle } else { from = middle + 1 }
        }
        from
    }

    /// Keeps target and rate where they can be.
    #[inline(always)]
    fn hold(&self, memory: &mut ObserverMemory<T>) {
        if memory.states[0] < self.low {
            memory.states[0] = self.low;
            memory.states[1] = memory.states[1].max(T::zero());
        }
        if memory.states[0] > self.high {
            memory.states[0] = self.high;
            memory.states[1] = memory.states[1].min(T::zero());
        }
        for j in 0..self.plays {
            memory.plays[j] = play(memory.plays[j], memory.states[0], self.radii[j]);
        }
    }
}

impl<T: Real> Design for Observer<T> {
    type Memory = ObserverMemory<T>;

    fn memory(&self) -> ObserverMemory<T> {
        ObserverMemory {
            states: [T::nan(); STATES],
            plays: [T::zero(); MAX_OBSERVER_PLAYS],
            baseline: self.rest.memory(),
        }
    }
}

impl<T: Real> Live for Observer<T> {
    type Sample = Volts<T>;
    type Signal = T;
    type Side = Branch;
    type Reading = Reading<T>;

    #[inline(always)]
    fn signal(&self, sample: Volts<T>) -> Option<T> {
        usable(sample.0)
    }

    #[inline(always)]
    fn read(
        &self,
        memory: &mut ObserverMemory<T>,
        branch: &mut Branch,
        signal: T,
    ) -> Option<Reading<T>> {
        let shift = if self.rest.follows() { self.rest_shift(memory) } else { T::zero() };
        let signal = self.rest.step(&mut memory.baseline, self.sign * signal, shift);
        if memory.states[0].is_nan() {
            self.begin(memory, signal);
        } else {
            self.predict(memory);
        }
        let on_curve = self.correct(memory, signal);
        let [target, rate, ..] = memory.states;
        *branch = branch.next(rate, self.dead_band);
        Some(Reading {
            estimate: self.zero + self.gain * target,
            rate: self.gain * rate,
            branch: *branch,
            domain: Domain::from_flags(!on_curve, false),
            sd: None,
        })
    }

    /// By the motion that it predicts.
    fn bridge(&self, memory: &mut ObserverMemory<T>, _: u8) -> bool {
        let begun = !memory.states[0].is_nan();
        if begun {
            self.predict(memory);
            self.hold(memory);
        }
        begun
    }

    fn forget(&self, memory: &mut ObserverMemory<T>) {
        *memory = ObserverMemory { baseline: memory.baseline, ..self.memory() };
    }
}
