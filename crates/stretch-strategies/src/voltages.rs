//! Voltage streams with the faults of measurements.

use proptest::{collection, prelude::*};

/// One sample of a faulty stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// The sample as it is.
    None,
    /// Not a number, or an infinity: a lost sample.
    Lost(f64),
    /// A spike of any finite size in place of the sample.
    Spike(f64),
    /// The previous value again, as from a stuck converter.
    Stuck,
}

/// A fault for one sample; nine in ten are [`Fault::None`].
pub fn fault() -> impl Strategy<Value = Fault> {
    prop_oneof![
        18 => Just(Fault::None),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)]
            .prop_map(Fault::Lost),
        1 => prop_oneof![
            2 => (-1e3..1e3).prop_map(Fault::Spike),
            1 => proptest::num::f64::NORMAL.prop_map(Fault::Spike),
            1 => Just(Fault::Stuck),
        ],
    ]
}

/// A random walk of the bridge voltage in 1..2.5 V, without faults: `length` samples.
pub fn clean_voltages(length: usize) -> impl Strategy<Value = Vec<f64>> {
    (1.0..2.5f64, collection::vec(-0.05..0.05f64, length)).prop_map(
        |(start, steps): (f64, Vec<f64>)| {
            let mut volts: f64 = start;
            let wander = |step: f64| {
                volts = (volts + step).clamp(1.0, 2.5);
                volts
            };
            steps.into_iter().map(wander).collect()
        },
    )
}

/// A [`clean_voltages`] with faults: lost samples, spikes of any size, stuck values.
pub fn faulty_voltages(length: usize) -> impl Strategy<Value = Vec<f64>> {
    (clean_voltages(length), collection::vec(fault(), length)).prop_map(|(clean, faults)| {
        let mut before = clean.first().copied().unwrap_or(1.0);
        let spoil = |(volts, fault): (f64, Fault)| {
            let sample = match fault {
                Fault::None => volts,
                Fault::Lost(nothing) => nothing,
                Fault::Spike(value) => value,
                Fault::Stuck => before,
            };
            before = volts;
            sample
        };
        clean.into_iter().zip(faults).map(spoil).collect()
    })
}
