//! The live form of a gauge's forward model: a small Kalman filter.

use stretch_core::{
    Baseline, Branch, Calibration, Design, MAX_OBSERVER_PLAYS, MAX_OBSERVER_RELAXATIONS, Model,
    Real, RestLevel,
    arithmetic::{lag, lag_share, play},
};

use crate::{
    Domain, Front, Reading, ReceptorError,
    curve::Curve,
    fold::{output, reference_dead_band, rounded},
    front::{Live, over_volts},
    gains::{Gains, SLOPES, STATES},
};

/// Smallest length of a secant, as a share of the distance between knots.
const LEAST_RUN: f64 = 0.01;

/// A receptor for [`Model::Observer`]: predicts the motion, compares the predicted with the measured signal, and
/// corrects the states.
///
/// There is an estimate from the first sample on, and the rate is a state, not a difference. A missing sample is
/// bridged by prediction as in every [`Front`]; during a longer gap the rate is zero.
///
/// A sample corrects every state by a gain times the innovation (signal minus predicted signal). The gain is the
/// stationary gain of a Kalman filter for the slope of the curve, from a table that is computed with the receptor. A
/// covariance recursion would cost twenty times as much and give larger errors, because a covariance adapts more slowly
/// than the slope changes. The slope is the greater of two: the tangent at the prediction, and the secant to the drive
/// at which the curve has the signal. A flat end of the curve therefore does not move the estimate far.
///
/// The tracker of the baseline compares the signal with the signal that a target at rest would give now, including the
/// effect of memory. Therefore it does not take an undershoot after a fast release for drift.
pub type ObserverReceptor<T> = Front<Observer<T>>;

/// The model of an [`ObserverReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer<T> {
    /// Factor of the signal: -1 if it falls as the target rises, otherwise 1.
    pub sign: T,
    /// The tracker of the baseline (the drifting signal at rest), if the calibration has one.
    pub rest: RestLevel<T>,
    /// The curve from drive to signal.
    pub curve: Curve<T>,
    /// Number of relaxations.
    pub relaxations: usize,
    /// Share of its distance to the target that each relaxation (first-order lag) covers in a sample.
    pub shares: [T; MAX_OBSERVER_RELAXATIONS],
    /// Weight of each relaxation in the drive.
    pub amplitudes: [T; MAX_OBSERVER_RELAXATIONS],
    /// Seconds by which the signal leads the target.
    pub lead_s: T,
    /// Number of plays.
    pub plays: usize,
    /// Half-widths of the plays (backlash operators).
    pub radii: [T; MAX_OBSERVER_PLAYS],
    /// Weight of each play in the drive.
    pub play_weights: [T; MAX_OBSERVER_PLAYS],
    /// A slope below `ends[k]` and not below `ends[k - 1]` has the gains `gains[k]`.
    pub ends: [T; SLOPES - 1],
    /// Gains as change of the state (target, rate, relaxations) per unit of signal.
    pub gains: [[T; STATES]; SLOPES],
    /// Seconds from a sample to the next.
    pub period_s: T,
    /// The least target.
    pub low: T,
    /// The greatest target.
    pub high: T,
    /// Reference units per target.
    pub gain: T,
    /// The reference at a target of zero.
    pub zero: T,
    /// Dead band: the largest magnitude of the target's rate at which the branch does not change.
    pub dead_band: T,
    /// The signal of a target that rests at its low end, with settled memory.
    pub at_rest: T,
}

/// The state of an [`ObserverReceptor`]'s model: the filter's states, the plays, the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverMemory<T> {
    /// Target, rate and relaxations, normalised. The target is NaN before the first sample.
    states: [T; STATES],
    plays: [T; MAX_OBSERVER_PLAYS],
    baseline: Baseline<T>,
}

impl<T: Real> ObserverReceptor<T> {
    /// A receptor for `calibration`.
    ///
    /// # Errors
    /// [`ReceptorError`] when the calibration is of another model.
    pub fn new(calibration: &Calibration) -> Result<Self, ReceptorError> {
        let Model::Observer(map) = &calibration.spec().model else {
            return Err(calibration.spec().model.instead_of("observer").into());
        };
        let (polarity, sample_rate) =
            (calibration.spec().polarity, calibration.spec().sample_rate_hz);
        let (sign, period_s) = (polarity.sign(), sample_rate.period_s());
        let (gain, zero) = output(calibration);
        let gains = Gains::new(map, sign, period_s)?;
        let model = Observer {
            sign: T::from_f64(sign),
            rest: RestLevel::new(map.rest, polarity, calibration.spec().signal_range, sample_rate),
            curve: Curve::new(map.curve.iter().map(|v| sign * v), map.drive_domain),
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
    /// Returns the drive at which the curve has the value `signal`, and the signal clamped to the ends of the curve.
    #[inline(always)]
    fn inverse(&self, signal: T) -> (T, T) {
        let (first, last) = self.curve.ends();
        let held = signal.max(first).min(last);
        (self.curve.inverse(held).0, held)
    }

    /// Returns the signal at a drive, the slope at that drive, and the drive clamped to the fitted curve.
    #[inline(always)]
    fn forward(&self, drive: T) -> (T, T, T) {
        let Curve { knots, values, low, step, per_step } = &self.curve;
        let most = T::from_f64((knots - 1) as f64);
        let place = ((drive - *low) * *per_step).max(T::zero()).min(most);
        let below = place.to_usize().unwrap_or(0).min(knots - 2);
        let rise = values[below + 1] - values[below];
        let share = place - T::from_f64(below as f64);
        (values[below] + share * rise, rise * *per_step, *low + place * *step)
    }

    fn begin(&self, memory: &mut ObserverMemory<T>, signal: T) {
        let (drive, _) = self.inverse(signal);
        let target = drive.max(self.low).min(self.high);
        memory.states = [target; STATES];
        memory.states[1] = T::zero();
        memory.plays = [target; MAX_OBSERVER_PLAYS];
    }

    /// Predicts the states one sample ahead.
    #[inline(always)]
    fn predict(&self, memory: &mut ObserverMemory<T>) {
        let x = &mut memory.states;
        x[0] = (x[0] + self.period_s * x[1]).max(self.low).min(self.high);
        for i in 0..self.relaxations {
            x[2 + i] = lag(x[2 + i], x[0], self.shares[i]);
        }
    }

    /// The drive of a target that is at `y` now.
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

    /// Returns by how much the memory of the gauge would shift the signal if the target were at rest now.
    #[inline(always)]
    fn rest_shift(&self, memory: &ObserverMemory<T>) -> T {
        if memory.states[0].is_nan() {
            return T::zero();
        }
        self.forward(self.drive_at(memory, self.low)).0 - self.at_rest
    }

    /// Corrects the states with a signed signal above its baseline. Returns whether the signal lay on the curve.
    #[inline(always)]
    fn correct(&self, memory: &mut ObserverMemory<T>, signal: T) -> bool {
        let drive = self.drive_at(memory, memory.states[0]) + self.lead_s * memory.states[1];
        let (predicted, tangent, from) = self.forward(drive);
        let (to, held) = self.inverse(signal);
        let run = to - from;
        // over a very small distance, the secant would be dominated by rounding
        let far = run.abs() > T::from_f64(LEAST_RUN) * self.curve.step;
        let secant = if far { (held - predicted) / run } else { tangent };
        let slope = tangent.max(secant);

        // the signal is limited to one span of the curve beyond its ends, because of spikes
        let (first, last) = self.curve.ends();
        let span = last - first;
        let surprise = signal.max(first - span).min(last + span) - predicted;
        let gains = &self.gains[self.nearest(slope)];
        for i in 0..2 + self.relaxations {
            memory.states[i] = memory.states[i] + gains[i] * surprise;
        }
        self.hold(memory);
        held == signal
    }

    /// Returns the index of the gains for a slope, by bisection.
    #[inline(always)]
    fn nearest(&self, slope: T) -> usize {
        let (mut from, mut to) = (0, SLOPES - 1);
        while from < to {
            let middle = (from + to) / 2;
            if slope < self.ends[middle] { to = middle } else { from = middle + 1 }
        }
        from
    }

    /// Limits the target to its range. At an end, a rate that points outwards becomes zero. Then moves the plays.
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
    over_volts!(T);

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

    /// Bridges a missing sample with the predicted motion.
    fn bridge(&self, memory: &mut ObserverMemory<T>, _: u8) -> bool {
        let begun = !memory.states[0].is_nan();
        if begun {
            self.predict(memory);
            self.hold(memory);
        }
        begun
    }

    fn pause(&self, memory: &mut ObserverMemory<T>) {
        memory.states[1] = T::zero();
        self.bridge(memory, 0);
    }

    fn restart(&self, memory: &mut ObserverMemory<T>) {
        *memory = ObserverMemory { baseline: memory.baseline, ..self.memory() };
    }
}
