//! The live form of a gauge with named defects: a Kalman filter that estimates the motion behind the signal.

use stretch_core::{
    Baseline, Branch, Calibration, Design, DesignError, DiagnosedMap, Model, Real, RestLevel,
    arithmetic::{lag, lag_share},
};

use crate::{
    Domain, Front, Reading, ReceptorError, ReceptorMemory,
    curve::Curve,
    defects::{Defects, DefectsMemory},
    fold::{greater, held, output, reference_dead_band},
    front::{Live, over_volts, usable},
};

/// Smallest length of a secant, as a share of the distance between knots.
pub const LEAST_RUN: f64 = 0.01;
/// Smallest slope of the drive over the target. With a smaller slope, the signal would not determine the target.
pub const LEAST_ANSWER: f64 = 0.05;
/// Weight s of a new sample in the smoothed signal, which keeps the share s/(2 - s) of the noise's variance.
pub const SMOOTH: f64 = 0.33;
const SHOWN: f64 = 0.2;
/// The sleeve counts as having reversed its motion when the smoothed signal has changed in the opposite direction by
/// this many of its standard deviations.
const TURN_DEVIATIONS: f64 = 6.0;
/// Greatest standard deviation of a target. The unit is the standard deviation of a target that is computed from one
/// noisy sample, at the mean slope of the curve.
const WIDEST: f64 = 4.0;
/// An estimate is at most this far outside the range of the fitted targets, as a share of that range.
const BEYOND: f64 = 0.003;

/// A receptor for [`Model::Diagnosed`].
///
/// For each sample:
/// 1. target and rate are predicted, with a rate that decays with the time constant `steady_s`; their covariance grows;
/// 2. two drives (inputs of the gauge's curve) are compared: that of the predicted target, and the one at which the
///    curve has the measured signal. The predicted target plus the difference is a second target, and its drive is
///    computed as well;
/// 3. the secant between the two targets is the slope of a Kalman step;
/// 4. the defects are advanced with the estimated target. If the sleeve slips on the muscle, the filter estimates the
///    position of the sleeve, and the muscle is taken to be ahead of the sleeve in the direction of the last certain
///    movement.
///
/// Therefore, while a play, a clipped end of the curve or a delay hides the target, the estimate follows the predicted
/// motion. [`Reading::sd`] is the standard deviation of the estimate. A skew (delay of the signal) is compensated by
/// prediction: the estimate is valid for the present time. There is an estimate from the first sample on. If the map
/// has a crosstalk, set the pressure with [`ReceptorMemory::set_pressure`] before a sample.
///
/// ```
/// use stretch_core::{Design, Stage, Volts};
/// use stretch_receptor::{DiagnosedReceptor, example_diagnosed};
/// let receptor = DiagnosedReceptor::<f32>::new(&example_diagnosed())?;
/// let mut memory = receptor.memory();
/// let readings = (0..200).map(|n| receptor.step(&mut memory, Volts(1.3 + 0.004 * n as f32)).unwrap());
/// let last = readings.last().unwrap();
/// assert!(last.length().0 < 165.0 && last.sd.unwrap() < 2.0);
/// # Ok::<(), stretch_receptor::ReceptorError>(())
/// ```
pub type DiagnosedReceptor<T> = Front<Diagnosed<T>>;

/// The model of a [`DiagnosedReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Diagnosed<T> {
    /// Factor of the signal: -1 if it falls as the target rises, otherwise 1.
    pub sign: T,
    /// The tracker of the baseline (the drifting signal at rest), if the calibration has one.
    pub rest: RestLevel<T>,
    /// The defects between target and curve.
    pub defects: Defects<T>,
    /// The curve from drive to signal.
    pub curve: Curve<T>,
    /// Seconds from a sample to the next.
    pub period_s: T,
    /// Factor by which the rate decays in a sample.
    pub kept: T,
    /// Square of `kept`.
    pub kept_twice: T,
    /// Variance that a sample adds to the rate.
    pub process_noise: T,
    /// Variance of the signal around the model.
    pub noise: T,
    /// Greatest variance of a target.
    pub widest: T,
    /// The least target.
    pub low: T,
    /// The greatest target.
    pub high: T,
    /// Time over which the estimate is extrapolated at its rate, in seconds. It is shorter than the delay that it
    /// compensates, because the modelled rate decays.
    pub ahead_s: T,
    /// Factor by which the filter's standard deviation is multiplied to get the reported one, in reference units.
    pub spread: T,
    /// Half-width of the sensor's slip.
    pub slip: T,
    /// The sleeve counts as having reversed its motion when the signal has changed in the opposite direction by more
    /// than this.
    pub turn_threshold: T,
    /// Variance of the muscle's position if the muscle may be anywhere within the slip of the sleeve.
    pub slip_variance: T,
    /// Share of the remaining difference by which, at each sample, the variance hidden by the slip approaches
    /// `slip_variance`.
    pub slip_variance_share: T,
    /// Reference units per target.
    pub gain: T,
    /// The reference at a target of zero.
    pub zero: T,
    /// Dead band: the largest magnitude of the target's rate at which the branch does not change.
    pub dead_band: T,
    /// The signal of a target that rests at its low end, with settled memory.
    pub at_rest: T,
}

/// The state of a [`DiagnosedReceptor`]'s model: target and rate with their covariance, the defects, the baseline, the
/// pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiagnosedMemory<T> {
    /// NaN before the first sample.
    target: T,
    rate: T,
    /// Variance of the target, covariance, variance of the rate.
    covariance: [T; 3],
    defects: DefectsMemory<T>,
    baseline: Baseline<T>,
    pressure: T,
    /// Variance of the target because the muscle's position in the slip is unknown.
    hidden: T,
    /// Distance of the muscle ahead of its sleeve.
    slipped: T,
    /// Furthest point of the sleeve in the direction of its last movement, in signal.
    reached: T,
    /// The smoothed signal that the sleeve would give without memory. Reversals are detected in this signal and not in
    /// the filter's target, because a filter with a rate overshoots when the motion stops.
    shown: T,
}

impl<T: Real> DiagnosedReceptor<T> {
    /// A receptor for `calibration`.
    ///
    /// # Errors
    /// [`ReceptorError`] when the calibration is of another model.
    pub fn new(calibration: &Calibration) -> Result<Self, ReceptorError> {
        let Model::Diagnosed(map) = &calibration.spec().model else {
            return Err(calibration.spec().model.instead_of("diagnosed").into());
        };
        Ok(Self { model: Diagnosed::new(map, calibration)? })
    }
}

impl<T: Real> ReceptorMemory<DiagnosedMemory<T>> {
    /// Sets the pressure of the samples to come, in the unit of the map's crosstalk.
    pub fn set_pressure(&mut self, pressure: T) {
        self.model.set_pressure(pressure);
    }
}

impl<T: Real> DiagnosedMemory<T> {
    pub(crate) fn set_pressure(&mut self, pressure: T) {
        if let Some(pressure) = usable(pressure) {
            self.pressure = pressure;
        }
    }
}

impl<T: Real> Diagnosed<T> {
    fn new(map: &DiagnosedMap, calibration: &Calibration) -> Result<Self, DesignError> {
        let (polarity, sample_rate) =
            (calibration.spec().polarity, calibration.spec().sample_rate_hz);
        let (sign, period_s) = (polarity.sign(), sample_rate.period_s());
        let (gain, zero) = output(calibration);
        let knots = map.curve.len();
        // a curve that falls, after multiplication by the sign of the polarity, would be inverted in the wrong
        // direction
        let rises = sign * (map.curve[knots - 1] - map.curve[0]);
        DesignError::check("rise of diagnosed.curve", rises, rises > 0.0)?;
        let widest = WIDEST * map.noise * (map.drive_domain.max - map.drive_domain.min) / rises;
        let values = map.curve.iter().map(|v| sign * v);
        // a slow amplifier delays a ramp by the sum of its time constants
        let slow: f64 = map.lowpass_s.into_iter().flatten().sum();
        let (skew, steady) = (map.skew_s + slow, map.steady_s);
        // distance that the target moves in this time per unit of rate, with the rate decaying; for a negative skew the
        // rate is taken as constant
        let ahead = if skew > 0.0 { -steady * libm::expm1(-skew / steady) } else { skew };
        let edge = BEYOND * (map.estimate_domain.max - map.estimate_domain.min);
        // the filter estimates the position of the sleeve; the reversals of the sleeve determine the position of the
        // muscle in it
        let slip = map.slip.map_or(0.0, |p| p.radii.iter().sum::<f64>() / 3.0);
        let defects = Defects::new(&DiagnosedMap { slip: None, lowpass_s: None, ..*map }, period_s);
        let model = Self {
            sign: T::from_f64(sign),
            rest: RestLevel::new(map.rest, polarity, calibration.spec().signal_range, sample_rate),
            defects,
            curve: Curve::new(values, map.drive_domain),
            period_s: T::from_f64(period_s),
            kept: T::from_f64(libm::exp(-period_s / steady)),
            kept_twice: T::from_f64(libm::exp(-2.0 * period_s / steady)),
            process_noise: T::from_f64(map.agility * period_s),
            noise: T::from_f64(map.noise * map.noise),
            widest: T::from_f64(widest * widest),
            low: T::from_f64(map.estimate_domain.min - edge),
            high: T::from_f64(map.estimate_domain.max + edge),
            ahead_s: T::from_f64(ahead),
            spread: T::from_f64(map.spread * gain.abs()),
            slip: T::from_f64(slip),
            turn_threshold: T::from_f64(TURN_DEVIATIONS * libm::sqrt(SHOWN) * map.noise),
            slip_variance: T::from_f64(slip * slip / 3.0),
            slip_variance_share: T::from_f64(lag_share(period_s, steady)),
            gain: T::from_f64(gain),
            zero: T::from_f64(zero),
            dead_band: T::from_f64((reference_dead_band(calibration) / gain).abs()),
            at_rest: T::zero(),
        };
        let mut still = model.defects.begin(model.low, T::zero());
        let at_rest = model.curve.forward(model.defects.advance(&mut still, model.low, T::zero()));
        Ok(Self { at_rest: at_rest.0, ..model })
    }

    /// Starts from the target that would give this signal at rest, and from the settled state of the defects at this
    /// target.
    fn begin(&self, memory: &mut DiagnosedMemory<T>, signal: T) {
        let (to, _) = self.curve.inverse(signal);
        let mut target = held(to, self.low, self.high);
        // plays add a constant to the drive; the iteration is needed for nonlinear defects
        for _ in 0..3 {
            let defects = self.defects.begin(target, memory.pressure);
            let poised = self.defects.poise(&defects, memory.pressure);
            let off = to - self.defects.drive(&defects, &poised, target);
            target = held(target + off, self.low, self.high);
        }
        memory.target = target;
        memory.rate = T::zero();
        memory.slipped = self.slip * self.defects.initial_hysteresis_at(target);
        (memory.shown, _) = self.curve.forward(target);
        memory.reached = memory.shown;
        let travelled = memory.defects;
        memory.defects = self.defects.begin(target, memory.pressure).as_worked(&travelled);
        let span = self.high - self.low;
        let tenth = T::from_f64(0.1) * span;
        memory.covariance = [tenth * tenth, T::zero(), span * span];
    }

    /// Predicts target, rate and covariance one sample ahead.
    #[inline(always)]
    fn predict(&self, memory: &mut DiagnosedMemory<T>) {
        let (dt, kept) = (self.period_s, self.kept);
        memory.target = memory.target + dt * memory.rate;
        memory.rate = kept * memory.rate;
        let [yy, yr, rr] = memory.covariance;
        let across = yr + dt * rr;
        let grown = yy + dt * (yr + across);
        // the variance is limited: where the signal hardly depends on the target, noise would otherwise move the target
        // from one end of the flat part to the other
        let (grown, across) = if grown > self.widest {
            let share = self.widest / grown;
            (share * grown, share * (kept * across))
        } else {
            (grown, kept * across)
        };
        memory.covariance = [grown, across, self.kept_twice * rr + self.process_noise];
        self.hold(memory);
    }

    /// Limits the target to its range. At an end, a rate that points outwards becomes zero.
    #[inline(always)]
    fn hold(&self, memory: &mut DiagnosedMemory<T>) {
        if memory.target < self.low {
            memory.target = self.low;
            memory.rate = greater(memory.rate, T::zero());
        }
        if memory.target > self.high {
            memory.target = self.high;
            memory.rate = if memory.rate < T::zero() { memory.rate } else { T::zero() };
        }
    }

    /// Returns by how much the memory of the gauge would shift the signal if the target were at rest now.
    #[inline(always)]
    fn rest_shift(&self, memory: &DiagnosedMemory<T>) -> T {
        if memory.target.is_nan() {
            return T::zero();
        }
        let poised = self.defects.poise(&memory.defects, memory.pressure);
        let drive = self.defects.drive(&memory.defects, &poised, self.low);
        self.curve.forward(drive).0 - self.at_rest
    }

    /// Corrects the states with a signed signal above its baseline. Returns whether the signal lay on the curve.
    #[inline(always)]
    fn correct(&self, memory: &mut DiagnosedMemory<T>, signal: T) -> bool {
        let poised = self.defects.poise(&memory.defects, memory.pressure);
        let here = memory.target;
        let drive = self.defects.drive(&memory.defects, &poised, here);
        let (predicted, tangent) = self.curve.forward(drive);
        // the signal is limited to one span of the curve beyond its ends, because of spikes
        let (first, last) = self.curve.ends();
        let span = last - first;
        let bounded = held(signal, first - span, last + span);
        let (to, on_curve) = self.curve.inverse(bounded);
        let (run, surprise) = (to - drive, bounded - predicted);
        let least = T::from_f64(LEAST_RUN) * self.curve.step;
        let far = run.abs() > least;
        let toward = if run < T::zero() { -T::one() } else { T::one() };

        // the slope of the drive, as a secant to the target that would explain the signal
        let probe = if far { run } else { toward * least };
        let moved = self.defects.drive(&memory.defects, &poised, here + probe) - drive;
        let answer = greater(moved / probe, T::from_f64(LEAST_ANSWER));
        // the slope of the curve is the greater of secant and tangent; the tangent alone would move the estimate far at
        // a flat end of the curve
        let secant = if far { surprise / run } else { tangent };
        let slope = answer * greater(secant, tangent);
        let [yy, yr, rr] = memory.covariance;
        let (by_y, by_r) = (slope * yy, slope * yr);
        let share = (slope * by_y + self.noise).recip();
        let (gain_y, gain_r) = (by_y * share, by_r * share);
        memory.target = here + gain_y * surprise;
        memory.rate = memory.rate + gain_r * surprise;
        memory.covariance = [yy - gain_y * by_y, yr - gain_y * by_r, rr - gain_r * by_r];
        self.hold(memory);
        if self.slip > T::zero() {
            // `shown` is the signal that a gauge without memory would have
            let (bare, _) = self.curve.forward(here);
            let shown = bare + surprise;
            memory.shown = lag(memory.shown, shown, T::from_f64(SMOOTH));
            self.turn(memory);
        }
        self.defects.follow(&mut memory.defects, &poised, memory.target);
        on_curve
    }

    /// Estimates the position of the muscle in its sleeve: the muscle is ahead of the sleeve in the direction of the
    /// sleeve's last movement. While the sleeve does not move, the muscle may be anywhere inside.
    #[inline(always)]
    fn turn(&self, memory: &mut DiagnosedMemory<T>) {
        let toward = if memory.slipped < T::zero() { -T::one() } else { T::one() };
        let back = toward * (memory.reached - memory.shown);
        if back <= T::zero() {
            memory.reached = memory.shown;
            memory.slipped = toward * self.slip;
            memory.hidden = T::zero();
        } else if back > self.turn_threshold {
            memory.reached = memory.shown;
            memory.slipped = -toward * self.slip;
            memory.hidden = T::zero();
        } else {
            memory.reached = lag(memory.reached, memory.shown, self.slip_variance_share);
            memory.hidden = lag(memory.hidden, self.slip_variance, self.slip_variance_share);
        }
    }
}

impl<T: Real> Design for Diagnosed<T> {
    type Memory = DiagnosedMemory<T>;

    fn memory(&self) -> DiagnosedMemory<T> {
        let zero = T::zero();
        DiagnosedMemory {
            target: T::nan(),
            rate: zero,
            covariance: [zero; 3],
            defects: self.defects.begin(self.low, zero),
            baseline: self.rest.memory(),
            pressure: zero,
            hidden: zero,
            slipped: zero,
            reached: zero,
            shown: zero,
        }
    }
}

impl<T: Real> Live for Diagnosed<T> {
    over_volts!(T);

    #[inline(always)]
    fn read(
        &self,
        memory: &mut DiagnosedMemory<T>,
        branch: &mut Branch,
        signal: T,
    ) -> Option<Reading<T>> {
        let shift = if self.rest.follows() { self.rest_shift(memory) } else { T::zero() };
        let signal = self.rest.step(&mut memory.baseline, self.sign * signal, shift);
        if memory.target.is_nan() {
            self.begin(memory, signal);
        } else {
            self.predict(memory);
        }
        let on_curve = self.correct(memory, signal);
        let (rate, ahead) = (memory.rate, self.ahead_s);
        *branch = branch.next(rate, self.dead_band);
        let target = held(memory.target + memory.slipped + ahead * rate, self.low, self.high);
        let [yy, yr, rr] = memory.covariance;
        let variance = memory.hidden + yy + ahead * (yr + yr + ahead * rr);
        Some(Reading {
            estimate: self.zero + self.gain * target,
            rate: self.gain * rate,
            branch: *branch,
            domain: Domain::from_flags(!on_curve, false),
            sd: Some(self.spread * Real::sqrt(greater(variance, T::zero()))),
        })
    }

    /// Bridges a missing sample with the predicted motion.
    fn bridge(&self, memory: &mut DiagnosedMemory<T>, _: u8) -> bool {
        let begun = !memory.target.is_nan();
        if begun {
            self.predict(memory);
            self.defects.advance(&mut memory.defects, memory.target, memory.pressure);
        }
        begun
    }

    /// Increases the variance of target and rate. The next sample then has more weight than the prediction.
    fn pause(&self, memory: &mut DiagnosedMemory<T>) {
        self.bridge(memory, 0);
    }

    fn restart(&self, memory: &mut DiagnosedMemory<T>) {
        *memory = DiagnosedMemory { pressure: memory.pressure, ..self.memory() };
    }
}
