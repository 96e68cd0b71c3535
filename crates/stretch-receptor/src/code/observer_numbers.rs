//! The integers of an observer, converted from a calibration or checked after deserialisation.

use stretch_core::{
    Calibration, DesignError, MAX_OBSERVER_PLAYS, MAX_OBSERVER_RELAXATIONS, Model, RestTracker,
    arithmetic::lag_share, fixed,
};

use super::adc::{Adc, AdcCode};
use crate::{
    fold::{output, reference_dead_band},
    gains::{Gains, SLOPES, STATES},
};

/// The most knots of a curve in fixed point.
pub(super) const KNOTS: usize = 32;
/// Number of fractional bits of targets, drives, and rates per sample.
pub(super) const TARGET_BITS: u32 = 26;
/// Number of fractional bits of the weights in the drive.
pub(super) const WEIGHT_BITS: u32 = 20;
/// Number of fractional bits of a position between knots.
pub(super) const PLACE_BITS: u32 = 16;
/// Number of fractional bits of shares.
pub(super) const SHARE_BITS: u32 = 31;
/// Bits by which a 16-bit sample is shifted up.
pub(super) const SIGNAL_BITS: u32 = 12;
/// Largest magnitudes. If no number exceeds them, no sum in a step exceeds 32 bits and no product exceeds 63 bits.
const MOST_SIGNAL: i32 = 1 << 28;
const MOST_TARGET: i32 = 4 << TARGET_BITS;
const MOST_WEIGHT: i32 = 16 << WEIGHT_BITS;
const MOST_LEAD: i32 = 1000 << WEIGHT_BITS;

/// The integers that a [`FixedObserver`](super::FixedObserver) computes with. Signals are in `2^-12` of a 16-bit step,
/// negated if the signal falls as the target rises. Targets, drives and rates per sample have 26 fractional bits,
/// weights 20, positions between knots 16, and shares 31.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ObserverNumbers {
    /// Schema version. This field is first, so that a newer schema is refused before the rest is read.
    pub schema: u32,
    /// Bits of the converter.
    pub adc_bits: u8,
    /// Whether the signal falls as the target rises.
    pub falling: bool,
    /// Number of knots of the curve.
    pub knots: u8,
    /// Signals at the knots, rising.
    pub curve: [i32; KNOTS],
    /// The drive of the first knot.
    pub drive_low: i32,
    /// Knots per unit of drive, times `2^(32 + PLACE_BITS - TARGET_BITS)`.
    pub per_step: i32,
    /// Share of its distance to the target that each relaxation (first-order lag) covers in a sample.
    pub shares: [i32; MAX_OBSERVER_RELAXATIONS],
    /// Weight of each relaxation in the drive.
    pub amplitudes: [i32; MAX_OBSERVER_RELAXATIONS],
    /// Samples by which the signal leads the target.
    pub lead: i32,
    /// Half-widths of the plays (backlash operators).
    pub radii: [i32; MAX_OBSERVER_PLAYS],
    /// Weight of each play in the drive.
    pub play_weights: [i32; MAX_OBSERVER_PLAYS],
    /// Number of relaxations.
    pub relaxations: u8,
    /// Number of plays.
    pub plays: u8,
    /// Slopes of the curve, in signal per knot, that separate the rows of `gains`.
    pub ends: [i32; SLOPES - 1],
    /// Kalman gains as change of the state per unit of signal, times `2^gain_bits`; one row per slope.
    pub gains: [[i32; STATES]; SLOPES],
    /// Number of fractional bits of `gains`.
    pub gain_bits: u8,
    /// The least target.
    pub low: i32,
    /// The greatest target.
    pub high: i32,
    /// Dead band: the largest magnitude of the rate at which the branch does not change.
    pub dead_band: i32,
    /// Thousandths of the reference's unit at a target of 0, plus a half for rounding, times `2^(TARGET_BITS +
    /// output_bits)`.
    pub zero: i64,
    /// Thousandths of the reference's unit per unit of target, times `2^output_bits`.
    pub gain: i32,
    /// Number of fractional bits of `gain`; `zero` has `TARGET_BITS` more.
    pub output_bits: u8,
    /// The tracker of the baseline, which runs only if `pull` is above zero.
    pub rest: RestNumbers,
}

/// The numbers of the tracker of the baseline, which is the drift of the resting signal.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RestNumbers {
    /// The resting signal.
    pub level: i32,
    /// Share of a negative mean excess (signal above baseline and resting level) by which the baseline falls in a
    /// sample.
    pub pull: i32,
    /// Rise of the baseline in a sample whose mean excess is not negative.
    pub leak: i32,
    /// Weight of a new sample in the running mean of the excess.
    pub average: i32,
    /// Limit on the magnitude of an excess that enters the mean.
    pub most: i32,
    /// Largest magnitude of the baseline.
    pub furthest: i32,
}

/// The schema version of the serialised observers that this release writes, and the newest that it reads.
pub(super) const SCHEMA: u32 = stretch_core::CALIBRATION_SCHEMA;

impl ObserverNumbers {
    pub(super) fn new(calibration: &Calibration, adc: &Adc) -> Result<Self, DesignError> {
        let Model::Observer(map) = &calibration.spec().model else {
            return Err(calibration.spec().model.instead_of("observer"));
        };
        let sign = calibration.spec().polarity.sign();
        let period_s = calibration.spec().sample_rate_hz.period_s();
        let spec = adc.spec();
        let step_v = adc.volts_per_code() / f64::from(adc.align()?);
        let per_volt = f64::from(1 << SIGNAL_BITS) / step_v;
        let span = |volts: f64| round("fixed.signal", volts * per_volt);
        let at = |volts: f64| round("fixed.signal", sign * (volts - spec.zero_v) * per_volt);
        let knots = map.curve.len();
        if knots > KNOTS {
            return Err(DesignError::TooLarge { field: "fixed.curve", asked: knots, most: KNOTS });
        }
        let mut curve = [0; KNOTS];
        for (place, &volts) in curve.iter_mut().zip(map.curve.iter()) {
            *place = at(volts)?;
        }
        let drive = map.drive_domain;
        let step = (drive.max - drive.min) / (knots - 1) as f64;
        let gains = Gains::new(map, sign, period_s)?;
        // change of the state per unit of integer signal, with the rate per sample instead of per second
        let of = gains.of.map(|mut of| {
            of[1] *= period_s;
            of.map(|gain| gain / per_volt * f64::from(1 << TARGET_BITS))
        });
        let largest = of.iter().flatten().fold(f64::MIN_POSITIVE, |most, k| most.max(k.abs()));
        let gain_bits = bits_for(largest).min(40);
        let mut rounded = [[0; STATES]; SLOPES];
        for (row, gains) in rounded.iter_mut().zip(&of) {
            for (place, &gain) in row.iter_mut().zip(gains) {
                *place = fixed::from_f64("fixed.gains", gain, gain_bits)?;
            }
        }
        let mut ends = [0; SLOPES - 1];
        for (place, &end) in ends.iter_mut().zip(&gains.ends) {
            *place = span(end * step)?;
        }
        let (gain, zero) = output(calibration);
        let (gain, zero) = (1000.0 * gain, 1000.0 * zero);
        let output_bits = bits_for(gain.abs()).min(20);
        let target = |x: f64| fixed::from_f64("fixed.target", x, TARGET_BITS);
        let share = |x: f64| fixed::from_f64("fixed.share", x.min(1.0 - 1e-9), SHARE_BITS);
        let weight = |x: f64| fixed::from_f64("fixed.weight", x, WEIGHT_BITS);
        let place_bits = 32 + PLACE_BITS - TARGET_BITS;
        let rest = match map.rest {
            None => RestNumbers { level: 0, pull: 0, leak: 0, average: 0, most: 0, furthest: 0 },
            Some(rest) => RestNumbers {
                level: at(rest.level)?,
                pull: share(period_s / rest.catch_up_s)?,
                leak: span(rest.leak * period_s)?,
                average: share(lag_share(period_s, RestTracker::AVERAGE_S))?,
                most: span(RestTracker::MOST_EXCESS * calibration.spec().signal_range.span())?,
                furthest: span(RestTracker::FURTHEST * calibration.spec().signal_range.span())?,
            },
        };
        let half = 0.5;
        Self {
            schema: SCHEMA,
            adc_bits: spec.bits,
            falling: sign < 0.0,
            knots: knots as u8,
            curve,
            drive_low: target(drive.min)?,
            per_step: fixed::from_f64("fixed.drive", step.recip(), place_bits)?,
            shares: each(&map.relaxations_s, |tau| share(lag_share(period_s, tau)))?,
            amplitudes: each(&map.amplitudes, weight)?,
            lead: weight(map.lead_s / period_s)?,
            radii: each(&map.radii, target)?,
            play_weights: each(&map.play_weights, weight)?,
            relaxations: map.relaxations_s.len() as u8,
            plays: map.radii.len() as u8,
            ends,
            gains: rounded,
            gain_bits: gain_bits as u8,
            low: target(map.estimate_domain.min)?,
            high: target(map.estimate_domain.max)?,
            dead_band: target(
                (reference_dead_band(calibration) / (gain / 1000.0)).abs() * period_s,
            )?,
            // the cast and the sum saturate, and `check` refuses numbers that do not fit
            zero: (libm::ldexp(zero, (TARGET_BITS + output_bits) as i32) as i64)
                .saturating_add(libm::ldexp(half, (TARGET_BITS + output_bits) as i32) as i64),
            gain: fixed::from_f64("fixed.gain", gain, output_bits)?,
            output_bits: output_bits as u8,
            rest,
        }
        .check()
    }

    /// Refuses numbers with which a step could overflow.
    pub(super) fn check(self) -> Result<Self, DesignError> {
        if !(1..=SCHEMA).contains(&self.schema) {
            return Err(DesignError::Schema { found: self.schema, newest: SCHEMA });
        }
        let within = |field, x: i32, most: i32| {
            DesignError::check(field, x.into(), x.unsigned_abs() <= most as u32).map(|_| ())
        };
        let holds = |field, value: f64, holds| DesignError::check(field, value, holds).map(|_| ());
        let knots = usize::from(self.knots);
        holds("adc.bits", self.adc_bits.into(), (1..=16).contains(&self.adc_bits))?;
        holds("fixed.knots", knots as f64, (2..=KNOTS).contains(&knots))?;
        for &knot in &self.curve[..knots] {
            within("fixed.curve", knot, 4 * MOST_SIGNAL / 2)?;
        }
        for pair in self.curve[..knots].windows(2) {
            let rise = f64::from(pair[1]) - f64::from(pair[0]);
            holds("rise of fixed.curve", rise, rise > 0.0 && rise <= f64::from(MOST_SIGNAL))?;
        }
        let span = f64::from(self.curve[knots - 1]) - f64::from(self.curve[0]);
        holds("span of fixed.curve", span, span <= f64::from(MOST_SIGNAL))?;
        within("fixed.drive_low", self.drive_low, MOST_TARGET)?;
        holds("fixed.per_step", self.per_step.into(), self.per_step > 0)?;
        for share in self.shares.into_iter().chain([self.rest.pull, self.rest.average]) {
            holds("fixed.share", share.into(), share >= 0)?;
        }
        for weight in self.amplitudes.into_iter().chain(self.play_weights) {
            within("fixed.weight", weight, MOST_WEIGHT)?;
        }
        within("fixed.lead", self.lead, MOST_LEAD)?;
        for target in self.radii.into_iter().chain([self.low, self.high]) {
            within("fixed.target", target, MOST_TARGET)?;
        }
        holds("fixed.low", self.low.into(), self.low < self.high)?;
        holds("fixed.dead_band", self.dead_band.into(), self.dead_band >= 0)?;
        let counts = usize::from(self.relaxations) <= MAX_OBSERVER_RELAXATIONS
            && usize::from(self.plays) <= MAX_OBSERVER_PLAYS;
        holds("fixed.relaxations", self.relaxations.into(), counts)?;
        holds("fixed.gain_bits", self.gain_bits.into(), self.gain_bits <= 40)?;
        holds("fixed.output_bits", self.output_bits.into(), self.output_bits <= 20)?;
        holds("fixed.zero", self.zero as f64, self.zero.unsigned_abs() <= 1 << 60)?;
        for &end in &self.ends {
            holds("fixed.ends", end.into(), (0..=MOST_SIGNAL).contains(&end))?;
        }
        let RestNumbers { level, leak, most, furthest, .. } = self.rest;
        within("fixed.level", level, 4 * MOST_SIGNAL / 2)?;
        for size in [leak, most, furthest] {
            holds("fixed.rest", size.into(), (0..=MOST_SIGNAL).contains(&size))?;
        }
        Ok(Self { schema: SCHEMA, ..self })
    }

    /// Returns the number of codes, which is the smallest number that is not a code.
    pub(super) fn codes(&self) -> u32 {
        1 << self.adc_bits
    }

    /// Converts a code to a signal, negated if the signal falls as the target rises.
    #[inline(always)]
    pub(super) fn signal(&self, code: AdcCode) -> i32 {
        let aligned = code.0 << (16 - u32::from(self.adc_bits) + SIGNAL_BITS);
        if self.falling { -aligned } else { aligned }
    }
}

fn round(field: &'static str, x: f64) -> Result<i32, DesignError> {
    fixed::from_f64(field, x, 0)
}

fn each<const N: usize>(
    values: &[f64],
    convert: impl Fn(f64) -> Result<i32, DesignError>,
) -> Result<[i32; N], DesignError> {
    let mut out = [0; N];
    for (place, &value) in out.iter_mut().zip(values) {
        *place = convert(value)?;
    }
    Ok(out)
}

/// Returns the number of fractional bits with which `largest` fits 31 bits.
fn bits_for(largest: f64) -> u32 {
    let (mut bits, mut scaled) = (0, largest);
    while bits < 60 && 2.0 * scaled < f64::from(i32::MAX) {
        scaled *= 2.0;
        bits += 1;
    }
    bits
}
