//! What the targets share: bytes as streams, trials and recordings, and what must hold of all that is made of them.

use stretch_core::{Calibration, Real, Runner, Volts};
use stretch_data::{Channel, Trial};
use stretch_receptor::{
    Receptor,
    code::{Adc, AdcCode, AdcSpec, FixedCalibration, FixedObserver, FixedReceptor},
};
use stretch_recording::{ReadOptions, Recording};

/// Samples that loggers and broken sensors bring.
const ODD: [f64; 16] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    1e-300,
    1e-45,
    1e18,
    -1e18,
    9.9e17,
    1e30,
    -1e30,
    1e308,
    -999.0,
    65535.0,
    3.3,
];

/// Samples in units of a range, 0 its least and 1 its greatest value; or what no range has.
#[derive(Debug, Clone, Copy)]
pub enum Sample {
    /// A share of the range.
    Share(f64),
    /// A value as it is.
    Value(f64),
}

impl Sample {
    /// The value, where the range is from `min` on `span` wide.
    pub fn of(self, min: f64, span: f64) -> f64 {
        match self {
            Self::Share(share) => min + share * span,
            Self::Value(value) => value,
        }
    }
}

/// Bytes as samples: mostly one byte each, a share of the range; some repeat, some are odd, some are eight bytes as they are.
pub fn samples(bytes: &[u8]) -> impl Iterator<Item = Sample> {
    let (mut at, mut last) = (0, Sample::Share(0.5));
    std::iter::from_fn(move || {
        let byte = *bytes.get(at)?;
        at += 1;
        last = match byte {
            0..220 => Sample::Share(f64::from(byte) / 180.0 - 0.1),
            220..230 => last,
            230..246 => Sample::Value(ODD[usize::from(byte - 230)]),
            _ => {
                let mut raw = [0; 8];
                let some = &bytes[at..bytes.len().min(at + 8)];
                raw[..some.len()].copy_from_slice(some);
                at += some.len();
                Sample::Value(f64::from_le_bytes(raw))
            }
        };
        Some(last)
    })
}

/// Every reading of a stream is finite, its share of warm-up ones apart.
pub fn steps<T: Real>(calibration: &Calibration, stream: &[u8]) {
    let Ok(receptor) = Receptor::<T>::new(calibration) else { return };
    let mut receptor = Runner::new(receptor);
    let range = calibration.spec().signal_range;
    for sample in samples(stream) {
        let volts = sample.of(range.min(), range.span());
        if let Ok(reading) = receptor.step(Volts(T::from_f64(volts))) {
            assert!(reading.estimate.is_finite() && reading.rate.is_finite(), "{reading:?}");
            assert!(reading.sd.is_none_or(T::is_finite), "{reading:?}");
        }
    }
}

/// A converter: its bits, and the span that it sees, from a byte.
pub fn adc(calibration: &Calibration, byte: u8) -> Option<Adc> {
    let range = calibration.spec().signal_range;
    let bits = [8, 10, 12, 14, 15, 16][usize::from(byte) % 6];
    let (zero_v, full_scale_v) = match byte / 6 % 3 {
        0 => (0.0, 3.3),
        1 => (range.min(), range.max()),
        _ => (range.min() - 0.3 * range.span(), range.max() + 0.1 * range.span()),
    };
    Adc::new(AdcSpec { bits, zero_v, full_scale_v }).ok()
}

/// Bytes as codes, also such as no converter gives.
pub fn codes(bytes: &[u8], largest: i32) -> impl Iterator<Item = AdcCode> {
    samples(bytes).map(move |sample| AdcCode(sample.of(0.0, f64::from(largest)) as i32))
}

/// A calibration over codes, where it can be converted, steps whatever comes.
pub fn code_steps<const WINDOW: usize, const DEGREE: usize>(
    made: Result<FixedCalibration<WINDOW, DEGREE>, impl Sized>,
    stream: &[u8],
) {
    let Ok(calibration) = made else { return };
    let largest = (1 << calibration.adc_bits()) - 1;
    let mut receptor = Runner::new(FixedReceptor::new(calibration));
    for code in codes(stream, largest) {
        let _ = receptor.step(code);
    }
}

/// The same of an observer in integers.
pub fn observer_steps(observer: FixedObserver, stream: &[u8]) {
    let largest = (1 << observer.adc_bits()) - 1;
    let mut receptor = Runner::new(observer);
    for code in codes(stream, largest) {
        let _ = receptor.step(code);
    }
}

/// A recording that was read can be written: `head` is what tells its format, put before bytes that lack it.
pub fn recording(head: &[u8], bytes: &[u8]) {
    let head = if bytes.starts_with(head) { &[] } else { head };
    let bytes = [head, bytes].concat();
    for options in [ReadOptions::new(), ReadOptions::new().sample_rate_hz(100.0)] {
        if let Ok(recording) = Recording::from_reader(&bytes[..], "fuzz", &options) {
            assert!(recording.trial.check().is_ok());
        }
    }
}

/// A log with the columns asked for, at 100 Hz, from bytes: each column takes every n-th sample of the stream, time too.
///
/// The columns are `(name, least, greatest)` of what is usual for them.
pub fn trial(bytes: &[u8], columns: &[(&str, f64, f64)], most: usize) -> Trial {
    let all: Vec<Sample> = samples(bytes).collect();
    let width = columns.len() + 1;
    let rows = all.chunks_exact(width).take(most);
    let mut now = 0.0;
    let time_s = rows
        .clone()
        .map(|row| {
            // mostly the next period; holes, jitter and steps back are a byte away
            now += match row[0] {
                Sample::Share(share) if share < 0.9 => 0.01,
                Sample::Share(share) => 0.01 + share - 0.9,
                Sample::Value(value) => value,
            };
            now
        })
        .collect();
    let channel = |(i, (name, min, max)): (usize, &(&str, f64, f64))| Channel {
        name: (*name).to_owned(),
        values: rows.clone().map(|row| row[i + 1].of(*min, max - min)).collect(),
    };
    Trial {
        name: "fuzz".to_owned(),
        time_s,
        channels: columns.iter().enumerate().map(channel).collect(),
    }
}
