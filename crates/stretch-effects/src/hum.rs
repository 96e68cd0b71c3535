//! Mains hum on recorded samples.

use alloc::{boxed::Box, vec};
use core::f64::consts::{FRAC_PI_4, TAU};

use crate::{
    effect::{Acts, Effect, Live},
    kind::{Kind, Line, Measured, Side},
    operator::{Operator, Span},
    parameter::{EffectParameter, Role},
    place::Place,
    sketch::{Quantity, Sketch},
};

/// A sine added to samples: y = x + a sin(2 pi f t + phase), with the session time t.
///
/// ```
/// use stretch_effects::{Grid, Hum, Operator, Span};
/// let hum = Hum { a: 0.1, f_hz: 60.0, phase: 1.0 };
/// let mut volts = [0.0; 100];
/// hum.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut volts);
/// let wanted = |i: f64| 0.1 * (std::f64::consts::TAU * 60.0 * 0.01 * i + 1.0).sin();
/// assert!((volts[0] - wanted(0.0)).abs() < 1e-12 && (volts[99] - wanted(99.0)).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hum {
    /// Amplitude, in the unit of the signal.
    pub a: f64,
    /// Frequency, Hz.
    pub f_hz: f64,
    /// Phase at the session's start, rad.
    pub phase: f64,
}

impl Operator for Hum {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        // The signal consists of samples, not nodes. The wave is rotated by one angle per sample, and is computed
        // exactly every 256 samples.
        let turn = TAU * self.f_hz * span.grid.dt_s();
        let (sin_turn, cos_turn) = (libm::sin(turn), libm::cos(turn));
        for (block, samples) in signal.chunks_mut(256).enumerate() {
            let sample = span.first_node / span.grid.pieces() + 256 * block;
            let t = span.start_s + sample as f64 * span.grid.dt_s();
            // Whole turns are subtracted so that the angle stays small.
            let turns = self.f_hz * t;
            let angle = TAU * (turns - libm::floor(turns)) + self.phase;
            let (mut sin, mut cos) = (libm::sin(angle), libm::cos(angle));
            for v in samples {
                *v += self.a * sin;
                (sin, cos) = (sin * cos_turn + cos * sin_turn, cos * cos_turn - sin * sin_turn);
            }
        }
    }
}

/// Mains hum; its phase is estimated from the recording.
pub static HUM: Kind = Kind {
    name: "hum",
    title: "mains hum",
    words: "it picks up the mains",
    equation: "y = x + a sin(2 pi f t + phase), the phase found in the recording second by second",
    usual: &[Side::Output],
    parameters: |e, unit| {
        vec![EffectParameter::sized("a", unit, 0.0..=0.1 * e.span()), MAINS, PHASE]
    },
    starts: Some(|e| {
        let one = |f: f64| [0.002, 0.02].map(|k| vec![k * e.span(), f]);
        [one(50.0), one(60.0)].concat()
    }),
    operator: |v, _, _| {
        let phase = v.get(2).copied().unwrap_or(FRAC_PI_4);
        Box::new(Hum { a: v[0], f_hz: v[1], phase })
    },
    sketch: Some(|v, _, signals| {
        let phase = v.get(2).copied().unwrap_or(FRAC_PI_4);
        let body = "let turns = F * t
            let y = x + A * sin(6.283185307179586 * (turns - floor(turns)) + PHASE)";
        Sketch::of(signals.x.clone(), body).beside(Quantity::SESSION_TIME).with_all(&[
            ("A", v[0], &*signals.x.unit),
            ("F", v[1], "Hz"),
            ("PHASE", phase, "rad"),
        ])
    }),
    find: Some(find),
    line: Some(|values| Line { hertz: values[1], amplitude: values[0] }),
    // Sampled at the rate fs, a hum of frequency f appears at |f - k fs| for the nearest integer k. From fs = 1.5 f on
    // this is at least f/2 = 25 Hz, where no muscle moves. At a lower rate the hum may appear at any frequency, down to
    // a slow wave that resembles motion or drift.
    shown_from_hz: Some(|values| 1.5 * values[1]),
    ..Kind::PLAIN
};

/// Frequency of the mains.
const MAINS: EffectParameter =
    EffectParameter::shape("f", "Hz", 50.0, 60.0, 50.0).linear().with_role(Role::Choice);
/// Phase of the hum. If the sample rate is twice the mains frequency, a hum of the amplitude A appears in the samples
/// with the amplitude A |sin(phase)|. The phase pi/4, used until the phase is found, gives the root mean square of this
/// amplitude over all phases.
const PHASE: EffectParameter = EffectParameter::shape("phase", "rad", -TAU, TAU, 0.0)
    .linear()
    .with_role(Role::Found { stand_in: FRAC_PI_4 });

fn find(values: &[f64], record: &Measured<'_>, simulated: &mut [f64]) {
    let line = WanderingLine { a: values[0] * record.unit, f_hz: values[1] };
    if line.a != 0.0 {
        line.follow(record.samples, record.noise, record.dt_s, simulated);
    }
}

/// Mains hum that couples into the bridge.
pub(crate) static MAINS_HUM: Effect = Effect {
    name: "mains_hum",
    title: "the gauge's mains hum",
    words: "mains hum is picked up",
    equation: "v -> v + a sin(2 pi f t + phase), not skewed",
    parameters: &[EffectParameter::strength("a", "V", 0.0, 0.1, 0.02), MAINS, PHASE],
    acts: Acts::at(&HUM, Place::Record),
    starts: Some(|_| {
        [50.0, 60.0].iter().flat_map(|f| [0.002, 0.02].map(|a| vec![a, *f])).collect()
    }),
    live: Some(Live::BY_CURVE),
    ..Effect::PLAIN
};

/// Window in which the phase is assumed constant, s.
const WINDOW_S: f64 = 1.0;

/// A hum of known amplitude and frequency whose phase cannot be predicted.
///
/// ```
/// use stretch_effects::WanderingLine;
/// let wave = |i: usize| 0.1 * (std::f64::consts::TAU * 50.0 * 0.004 * i as f64 + 0.7).sin();
/// let measured: Vec<f64> = (0..500).map(wave).collect();
/// let mut simulated = vec![0.0; 500];
/// WanderingLine { a: 0.1, f_hz: 50.0 }.follow(&measured, 0.01, 0.004, &mut simulated);
/// assert!(measured.iter().zip(&simulated).all(|(m, s)| (m - s).abs() < 2e-3));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WanderingLine {
    /// Amplitude, in the unit of the samples.
    pub a: f64,
    /// Frequency, Hz.
    pub f_hz: f64,
}

impl WanderingLine {
    /// Adds the hum to simulated samples that may be used for fitting. In each window of a second, amplitude and phase
    /// are estimated from the residual at the line's frequency; the amplitude is limited to 1.5 a, and noise shrinks
    /// the estimate. Each sample is predicted from the other samples of its window. `noise` is one standard deviation
    /// of the measured samples; there must be at least as many measured as simulated samples.
    pub fn follow(&self, measured: &[f64], noise: f64, dt_s: f64, simulated: &mut [f64]) {
        let (a, f) = (self.a, self.f_hz);
        let window = ((WINDOW_S / dt_s) as usize).max(8);
        for (block, values) in simulated.chunks_mut(window).enumerate() {
            let first = block * window;
            let measured = &measured[first..first + values.len()];
            let wave = |i: usize| {
                let turns = f * dt_s * (first + i) as f64;
                let angle = TAU * (turns - libm::floor(turns));
                (libm::cos(angle), libm::sin(angle))
            };
            let (mut cc, mut cs, mut ss, mut rc, mut rs) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (i, (m, v)) in measured.iter().zip(values.iter()).enumerate() {
                let (c, s) = wave(i);
                let r = m - v;
                cc += c * c;
                cs += c * s;
                ss += s * s;
                rc += r * c;
                rs += r * s;
            }
            // The prior of both quadratures is normal with variance a^2/2.
            let ridge = noise * noise / (0.5 * a * a + 1e-18);
            let (cc, ss) = (cc + ridge, ss + ridge);
            let determinant = cc * ss - cs * cs;
            let (mut p, mut q) =
                ((rc * ss - rs * cs) / determinant, (rs * cc - rc * cs) / determinant);
            let size = libm::sqrt(p * p + q * q);
            if size > 1.5 * a {
                (p, q) = (p * 1.5 * a / size, q * 1.5 * a / size);
            }
            for (i, (m, v)) in measured.iter().zip(values.iter_mut()).enumerate() {
                let (c, s) = wave(i);
                let hum = p * c + q * s;
                // Leave-one-out prediction: the sample is predicted without itself, so that the fit does not explain
                // its noise.
                let leverage = (ss * c * c - 2.0 * cs * c * s + cc * s * s) / determinant;
                *v = m - (m - (*v + hum)) / (1.0 - leverage.min(0.5));
            }
        }
    }
}
