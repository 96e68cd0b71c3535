//! The live form of a gauge's forward model: a small Kalman filter.

use stretch_core::{
    Branch, Calibration, Design, DesignError, MAX_KNOTS, MAX_OBSERVER_PLAYS,
    MAX_OBSERVER_RELAXATIONS, Model, Real, Stage, Volts,
};
use stretch_filter::LARGEST_SAMPLE;

use crate::{
    Domain, MAX_BRIDGED, Reading, Withheld,
    fold::{output, reference_dead_band, share_of},
    history::play,
    rest_level::RestLevel,
};

/// Target, its rate, and the relaxations.
const STATES: usize = 2 + MAX_OBSERVER_RELAXATIONS;
/// What is unknown of target and relaxations before the first sample, squared.
const FIRST_SPREAD: f64 = 0.1;
/// What is unknown of the rate before the first sample, squared, in 1/s^2.
const FIRST_RATE_SPREAD: f64 = 1.0;
/// The target's variance is never held for more than its whole range squared.
const MOST_SPREAD: f64 = 1.0;

/// A secant is taken over at least this share of the way between knots.
const LEAST_RUN: f64 = 0.01;

/// A receptor for [`Model::Observer`]: predicts the motion, compares the signal
/// it would give with the one that came, and corrects.
///
/// It answers from the first sample on, and its rate is a state, not a
/// difference. A missing sample is predicted over, at most [`MAX_BRIDGED`] in a
/// row; one more forgets all but branch and baseline.
///
/// With `P` the states' covariance, `h` the gradient of the drive and `g` the
/// slope of the curve, a sample corrects by
/// `k = P h g/(g^2 h'P h + noise^2)` times what the signal has over its
/// prediction. The slope is the greater of the tangent at the prediction and of
/// the secant to the drive that the signal alone suggests, so that a flat end
/// of the curve cannot throw the estimate.
///
/// Cost: about `4 n^2 + 6 n` products a sample for `n = 2 + relaxations` states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverReceptor<T> {
    sign: T,
    rest: RestLevel<T>,
    knots: usize,
    /// Signed signals at the knots, rising.
    curve: [T; MAX_KNOTS],
    drive_low: T,
    drive_step: T,
    per_step: T,
    relaxations: usize,
    shares: [T; MAX_OBSERVER_RELAXATIONS],
    amplitudes: [T; MAX_OBSERVER_RELAXATIONS],
    lead_s: T,
    plays: usize,
    radii: [T; MAX_OBSERVER_PLAYS],
    play_weights: [T; MAX_OBSERVER_PLAYS],
    noise_square: T,
    agility_a_sample: T,
    period_s: T,
    low: T,
    high: T,
    gain: T,
    zero: T,
    dead_band: T,
}

/// What an [`ObserverReceptor`] remembers: its states, their covariance, the plays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverMemory<T> {
    /// Target, rate, relaxations: normalised. The target is NaN before the first sample.
    states: [T; STATES],
    spread: [[T; STATES]; STATES],
    plays: [T; MAX_OBSERVER_PLAYS],
    baseline: T,
    branch: Branch,
    missing: u8,
}

impl<T: Real> ObserverReceptor<T> {
    /// A receptor for `calibration`.
    ///
    /// # Errors
    /// [`DesignError`] when the calibration is of another model.
    pub fn new(calibration: &Calibration) -> Result<Self, DesignError> {
        let Model::Observer(map) = &calibration.model else {
            return Err(DesignError::OutOfRange { field: "model", value: f64::NAN });
        };
        map.validate()?;
        let sign = calibration.polarity.sign();
        let period_s = calibration.sample_rate_hz.period_s();
        let (gain, zero) = output(calibration);
        let knots = map.curve.len();
        let drive = map.drive_domain;
        let step = (drive.max - drive.min) / (knots - 1) as f64;
        // a curve against the polarity would be inverted the wrong way round
        let rises = sign * (map.curve[knots - 1] - map.curve[0]);
        DesignError::check("rise of observer.curve", rises, rises > 0.0)?;
        let noise_square = map.noise * map.noise;
        Ok(Self {
            sign: T::from_f64(sign),
            rest: RestLevel::new(map.rest, calibration),
            knots,
            curve: filled(map.curve.iter().map(|v| sign * v)),
            drive_low: T::from_f64(drive.min),
            drive_step: T::from_f64(step),
            per_step: T::from_f64(step.recip()),
            relaxations: map.relaxations_s.len(),
            shares: filled(map.relaxations_s.iter().map(|&tau| share_of(period_s, tau))),
            amplitudes: filled(map.amplitudes.iter().copied()),
            lead_s: T::from_f64(map.lead_s),
            plays: map.radii.len(),
            radii: filled(map.radii.iter().copied()),
            play_weights: filled(map.play_weights.iter().copied()),
            noise_square: T::from_f64(noise_square),
            agility_a_sample: T::from_f64(map.agility * period_s),
            period_s: T::from_f64(period_s),
            low: T::from_f64(map.estimate_domain.min),
            high: T::from_f64(map.estimate_domain.max),
            gain: T::from_f64(gain),
            zero: T::from_f64(zero),
            dead_band: T::from_f64((reference_dead_band(calibration) / gain).abs()),
        })
    }

    /// The drive that a signal suggests by itself, the nearest end beyond the curve.
    #[inline(always)]
    fn drive(&self, signal: T) -> (T, T) {
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
    fn signal(&self, drive: T) -> (T, T, T) {
        let most = T::from_f64((self.knots - 1) as f64);
        let place = ((drive - self.drive_low) * self.per_step).max(T::zero()).min(most);
        let below = place.to_usize().unwrap_or(0).min(self.knots - 2);
        let rise = self.curve[below + 1] - self.curve[below];
        let share = place - T::from_f64(below as f64);
        let held = self.drive_low + place * self.drive_step;
        (self.curve[below] + share * rise, rise * self.per_step, held)
    }

    fn begin(&self, memory: &mut ObserverMemory<T>, signal: T) {
        let (drive, _) = self.drive(signal);
        let target = drive.max(self.low).min(self.high);
        memory.states = [target; STATES];
        memory.states[1] = T::zero();
        memory.plays = [target; MAX_OBSERVER_PLAYS];
        memory.spread = [[T::zero(); STATES]; STATES];
        for i in 0..2 + self.relaxations {
            memory.spread[i][i] = T::from_f64(FIRST_SPREAD);
        }
        memory.spread[1][1] = T::from_f64(FIRST_RATE_SPREAD);
    }

    /// Moves states and covariance on by a sample: `P = F P F' + Q`, the rows
    /// and columns that change only.
    #[inline(always)]
    fn predict(&self, memory: &mut ObserverMemory<T>) {
        let n = 2 + self.relaxations;
        let (x, p) = (&mut memory.states, &mut memory.spread);
        x[0] = (x[0] + self.period_s * x[1]).max(self.low).min(self.high);
        for j in 0..n {
            p[0][j] = p[0][j] + self.period_s * p[1][j];
        }
        for row in p.iter_mut().take(n) {
            row[0] = row[0] + self.period_s * row[1];
        }
        for i in 0..self.relaxations {
            let share = self.shares[i];
            x[2 + i] = x[2 + i] + share * (x[0] - x[2 + i]);
            for j in 0..n {
                p[2 + i][j] = p[2 + i][j] + share * (p[0][j] - p[2 + i][j]);
            }
            for row in p.iter_mut().take(n) {
                row[2 + i] = row[2 + i] + share * (row[0] - row[2 + i]);
            }
        }
        p[1][1] = p[1][1] + self.agility_a_sample;
    }

    /// Takes in a signed signal above its baseline; whether it lay on the curve.
    #[inline(always)]
    fn correct(&self, memory: &mut ObserverMemory<T>, signal: T) -> bool {
        let n = 2 + self.relaxations;
        let y = memory.states[0];
        let mut gradient = [T::zero(); STATES];
        gradient[0] = T::one();
        gradient[1] = self.lead_s;
        let mut drive = y + self.lead_s * memory.states[1];
        for i in 0..self.relaxations {
            drive = drive + self.amplitudes[i] * (y - memory.states[2 + i]);
            gradient[0] = gradient[0] + self.amplitudes[i];
            gradient[2 + i] = -self.amplitudes[i];
        }
        for j in 0..self.plays {
            let played = play(memory.plays[j], y, self.radii[j]);
            drive = drive + self.play_weights[j] * (y - played);
            if played == memory.plays[j] {
                gradient[0] = gradient[0] + self.play_weights[j];
            }
        }
        let (predicted, tangent, from) = self.signal(drive);
        let (to, held) = self.drive(signal);
        let run = to - from;
        // over a hair's breadth rounding alone would decide the secant
        let far = run.abs() > T::from_f64(LEAST_RUN) * self.drive_step;
        let secant = if far { (held - predicted) / run } else { tangent };
        let slope = tangent.max(secant);

        let mut reach = [T::zero(); STATES];
        let mut spread = T::zero();
        for i in 0..n {
            for j in 0..n {
                reach[i] = reach[i] + memory.spread[i][j] * gradient[j];
            }
            reach[i] = reach[i] * slope;
            spread = spread + reach[i] * gradient[i];
        }
        let weight = (spread * slope + self.noise_square).recip();
        // a spike counts as a signal one whole curve away, no more
        let (first, last) = (self.curve[0], self.curve[self.knots - 1]);
        let span = last - first;
        let surprise = signal.max(first - span).min(last + span) - predicted;
        for i in 0..n {
            let pull = reach[i] * weight;
            memory.states[i] = memory.states[i] + pull * surprise;
            for j in 0..=i {
                let p = memory.spread[i][j] - pull * reach[j];
                memory.spread[i][j] = p;
                memory.spread[j][i] = p;
            }
            // rounding may not make a variance vanish or turn
            memory.spread[i][i] = memory.spread[i][i].max(T::epsilon());
        }
        self.hold(memory, n);
        held == signal
    }

    /// Keeps target, rate and covariance where they can be.
    #[inline(always)]
    fn hold(&self, memory: &mut ObserverMemory<T>, n: usize) {
        let most = T::from_f64(MOST_SPREAD);
        if memory.spread[0][0] > most {
            let shrink = most / memory.spread[0][0];
            for row in memory.spread.iter_mut().take(n) {
                for p in row.iter_mut().take(n) {
                    *p = *p * shrink;
                }
            }
        }
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

    #[cold]
    fn missed(&self, memory: &mut ObserverMemory<T>) {
        memory.missing = memory.missing.saturating_add(1);
        if memory.missing <= MAX_BRIDGED && !memory.states[0].is_nan() {
            self.predict(memory);
            self.hold(memory, 2 + self.relaxations);
        } else {
            let (branch, baseline) = (memory.branch, memory.baseline);
            *memory = ObserverMemory { branch, baseline, missing: MAX_BRIDGED, ..self.memory() };
        }
    }
}

impl<T: Real> Design for ObserverReceptor<T> {
    type Memory = ObserverMemory<T>;

    fn memory(&self) -> ObserverMemory<T> {
        ObserverMemory {
            states: [T::nan(); STATES],
            spread: [[T::zero(); STATES]; STATES],
            plays: [T::zero(); MAX_OBSERVER_PLAYS],
            baseline: T::zero(),
            branch: Branch::Inflation,
            missing: 0,
        }
    }
}

impl<T: Real> Stage<Volts<T>> for ObserverReceptor<T> {
    type Out = Result<Reading<T>, Withheld>;

    #[inline(always)]
    fn step(&self, memory: &mut ObserverMemory<T>, sample: Volts<T>) -> Self::Out {
        let usable = sample.0.abs() <= T::from_f64(LARGEST_SAMPLE);
        if !usable {
            self.missed(memory);
            return Err(Withheld::Missing);
        }
        memory.missing = 0;
        let signal = self.rest.step(&mut memory.baseline, self.sign * sample.0);
        if memory.states[0].is_nan() {
            self.begin(memory, signal);
        } else {
            self.predict(memory);
        }
        let on_curve = self.correct(memory, signal);
        let [target, rate, ..] = memory.states;
        memory.branch = memory.branch.next(rate, self.dead_band);
        Ok(Reading {
            estimate: self.zero + self.gain * target,
            rate: self.gain * rate,
            branch: memory.branch,
            domain: Domain::from_flags(!on_curve, false),
        })
    }
}

fn filled<T: Real, const N: usize>(values: impl Iterator<Item = f64>) -> [T; N] {
    let mut out = [T::zero(); N];
    for (place, value) in out.iter_mut().zip(values) {
        *place = T::from_f64(value);
    }
    out
}
