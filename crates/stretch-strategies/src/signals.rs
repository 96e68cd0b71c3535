//! Signals whose derivative is known, times, and faulty streams.

use proptest::{collection, prelude::*};

/// A signal whose value and rate are known at every time.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Signal {
    /// c\[0\] + c\[1\] t + c\[2\] t^2 + ...
    Polynomial(Vec<f64>),
    /// An offset and a sum of sines.
    Sines {
        /// The mean.
        offset: f64,
        /// The parts.
        parts: Vec<Sine>,
    },
}

/// amplitude sin(2 pi frequency t + phase)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sine {
    /// Amplitude, in the signal's unit.
    pub amplitude: f64,
    /// Frequency, in hertz.
    pub frequency_hz: f64,
    /// Phase, in radians.
    pub phase: f64,
}

impl Signal {
    /// The value at `time_s`.
    pub fn value(&self, time_s: f64) -> f64 {
        match self {
            Self::Polynomial(c) => c.iter().rev().fold(0.0, |sum, c| sum * time_s + c),
            Self::Sines { offset, parts } => {
                let sine = |s: &Sine| s.amplitude * libm::sin(s.angle(time_s));
                offset + parts.iter().map(sine).sum::<f64>()
            }
        }
    }

    /// The derivative at `time_s`, in the signal's unit per second.
    pub fn rate(&self, time_s: f64) -> f64 {
        match self {
            Self::Polynomial(c) => {
                let terms = c.iter().enumerate().skip(1).rev();
                terms.fold(0.0, |sum, (k, c)| sum * time_s + k as f64 * c)
            }
            Self::Sines { parts, .. } => {
                let cosine =
                    |s: &Sine| s.amplitude * s.angular_frequency() * libm::cos(s.angle(time_s));
                parts.iter().map(cosine).sum()
            }
        }
    }

    /// The values at `count` times from zero, `period_s` apart.
    pub fn samples(&self, count: usize, period_s: f64) -> Vec<f64> {
        (0..count).map(|n| self.value(n as f64 * period_s)).collect()
    }

    /// The derivatives at `count` times from zero, `period_s` apart.
    pub fn rates(&self, count: usize, period_s: f64) -> Vec<f64> {
        (0..count).map(|n| self.rate(n as f64 * period_s)).collect()
    }
}

impl Sine {
    fn angular_frequency(&self) -> f64 {
        2.0 * core::f64::consts::PI * self.frequency_hz
    }

    fn angle(&self, time_s: f64) -> f64 {
        self.angular_frequency() * time_s + self.phase
    }
}

/// Polynomials of at most `degree` with coefficients in -10..10.
///
/// ```
/// use proptest::prelude::*;
/// use stretch_core::{Runner, SampleRate};
/// use stretch_filter::SgRate;
///
/// proptest!(|(signal in stretch_strategies::polynomial(2))| {
///     let hz = SampleRate::new(100.0).unwrap();
///     let mut rate = Runner::new(SgRate::<f64, 11, 2>::new(hz).unwrap());
///     for n in 0..30 {
///         let t = n as f64 * 0.01;
///         if let Some(estimate) = rate.step(signal.value(t)) {
///             approx::assert_abs_diff_eq!(estimate, signal.rate(t), epsilon = 1e-9);
///         }
///     }
/// });
/// ```
pub fn polynomial(degree: usize) -> impl Strategy<Value = Signal> {
    collection::vec(-10.0..10.0, degree + 1).prop_map(Signal::Polynomial)
}

/// One to four sines below `highest_hz`, amplitudes up to 1, about an offset in -1..1.
pub fn sines(highest_hz: f64) -> impl Strategy<Value = Signal> {
    let sine = (0.01..1.0, 0.01..1.0, 0.0..core::f64::consts::TAU).prop_map(
        move |(amplitude, part, phase)| Sine { amplitude, frequency_hz: part * highest_hz, phase },
    );
    (-1.0..1.0, collection::vec(sine, 1..=4))
        .prop_map(|(offset, parts)| Signal::Sines { offset, parts })
}

/// Streams of up to `longest` samples with faults as from a converter or a link: mostly values in
/// -10..10, but also NaN, infinities, huge and tiny numbers.
pub fn faulty_stream(longest: usize) -> impl Strategy<Value = Vec<f64>> {
    let sample = prop_oneof![
        8 => -10.0..10.0,
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)],
        1 => any::<f64>(),
    ];
    collection::vec(sample, 0..=longest)
}

/// Increasing times from zero, with intervals between 0.5 and 1.5 times `period_s`.
pub fn uneven_times(count: usize, period_s: f64) -> impl Strategy<Value = Vec<f64>> {
    collection::vec(0.5..1.5, count).prop_map(move |steps| {
        let mut time_s = 0.0;
        steps
            .into_iter()
            .map(|step| {
                let now = time_s;
                time_s += step * period_s;
                now
            })
            .collect()
    })
}
