//! Trials, rig files, data sets, and faulty tables.

use std::ops::Range;

use proptest::{
    collection::{btree_map, vec},
    option,
    prelude::*,
};

use stretch_data::{
    Channel, DataSet, EffectEntry, Parameter, RigFile, Split, Trial, TrialEntry, TrialKind,
};

/// Any finite number of any magnitude.
pub fn number() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite())
}

/// A trial that a file can hold: any names, any finite numbers, increasing time.
///
/// ```
/// use proptest::prelude::*;
///
/// proptest!(|(trial in stretch_strategies::any_trial())| {
///     prop_assert!(trial.check().is_ok());
/// });
/// ```
pub fn any_trial() -> impl Strategy<Value = Trial> {
    (1..20_usize, vec("[ -~µ°]{1,12}", 0..5)).prop_flat_map(|(rows, mut names)| {
        names.retain(|name| !name.trim().is_empty() && name != "time_s");
        names.sort();
        names.dedup();
        let columns = vec(vec(number(), rows), names.len());
        (vec(number(), rows), columns).prop_map(move |(mut time_s, columns)| {
            time_s.sort_by(f64::total_cmp);
            time_s.dedup_by(|a, b| a == b);
            let rows = time_s.len();
            let channel = |(name, values): (&String, Vec<f64>)| Channel {
                name: name.clone(),
                values: values[..rows].to_vec(),
            };
            let channels = names.iter().zip(columns).map(channel).collect();
            Trial { name: "any.csv".to_owned(), time_s, channels }
        })
    })
}

/// A trial as a rig records it at 100 Hz: `length_mm` moves between 150 and 180, and `bridge_v`
/// rises as the length decreases, with noise of up to 2 mV.
pub fn rig_trial(rows: Range<usize>) -> impl Strategy<Value = Trial> {
    (rows, 0.005..0.05, 0.0..6.0).prop_flat_map(|(rows, rate, phase): (usize, f64, f64)| {
        vec(-0.002..0.002, rows).prop_map(move |noise: Vec<f64>| {
            let length = |i: usize| 165.0 + 15.0 * (rate * i as f64 + phase).sin();
            let volts = |(i, noise): (usize, f64)| 1.24 + 0.05 * (180.0 - length(i)) + noise;
            let channel = |name: &str, values| Channel { name: name.to_owned(), values };
            Trial {
                name: "rig.csv".to_owned(),
                time_s: (0..rows).map(|i| i as f64 / 100.0).collect(),
                channels: vec![
                    channel("length_mm", (0..rows).map(length).collect()),
                    channel("bridge_v", noise.into_iter().enumerate().map(volts).collect()),
                ],
            }
        })
    })
}

/// A parameter with any finite value and any tolerances of at least 0.
pub fn parameter() -> impl Strategy<Value = Parameter> {
    let tolerance = || option::of(number().prop_map(f64::abs));
    (number(), tolerance(), tolerance()).prop_map(|(value, tolerance, tolerance_abs)| Parameter {
        value,
        tolerance,
        tolerance_abs,
    })
}

/// A rig file with any names, including quotation marks and dots.
pub fn rig_file() -> impl Strategy<Value = RigFile> {
    let name = || {
        let free = |name: &String| !["kind", "effect", "name"].contains(&name.as_str());
        "[a-zA-Z_. \"é]{1,8}".prop_filter("a key of the format", free)
    };
    let stages = btree_map(name(), btree_map(name(), parameter(), 0..4), 0..4);
    let effect = (any::<String>(), btree_map(name(), number(), 0..3))
        .prop_map(|(name, parameters)| EffectEntry { name, parameters });
    (option::of(any::<String>()), vec(effect, 0..3), stages)
        .prop_map(|(kind, effects, stages)| RigFile { kind, effects, stages })
}

/// A data set of one to five trials.
pub fn data_set() -> impl Strategy<Value = DataSet> {
    let entry = (0..TrialKind::ALL.len(), option::of(0.0..=1.0), number(), any::<bool>());
    (any::<String>(), 1e-3..1e6, any::<bool>(), vec(entry, 1..6)).prop_map(
        |(name, rate_hz, rig, entries)| {
            let trial = |(i, (kind, opening, start_s, test))| TrialEntry {
                file: format!("trials/{i}.csv"),
                kind: TrialKind::ALL[kind],
                opening,
                start_s,
                split: if test { Split::Test } else { Split::Fit },
                digest: (i % 2 == 1).then(|| format!("crc32c {i:08x}")),
            };
            let trials = entries.into_iter().enumerate().map(trial).collect();
            DataSet { name, rate_hz, rig: rig.then(|| "rig.toml".to_owned()), trials }
        },
    )
}

/// Bytes of a CSV file with arbitrary faults, or arbitrary bytes.
pub fn faulty_csv() -> impl Strategy<Value = Vec<u8>> {
    let rows = || vec("[-+0-9eE.,;\"\\t naif\\r]{0,20}", 0..12).prop_map(|rows| rows.join("\n"));
    prop_oneof![
        rows().prop_map(|rows| format!("time_s,bridge_v\n{rows}").into_bytes()),
        rows().prop_map(String::into_bytes),
        (rig_trial(1..20), any::<prop::sample::Index>(), any::<u8>()).prop_map(
            |(trial, at, byte)| {
                let mut text = Vec::new();
                trial.write_to(&mut text).expect("memory takes everything");
                let at = at.index(text.len());
                text[at] = byte;
                text
            }
        ),
        vec(any::<u8>(), 0..300),
    ]
}
