//! What is written reads back to the bit, and nothing that is read panics.

use proptest::{collection::vec, prelude::*};
use stretch_data::{
    Channel, DataSet, EffectEntry, Parameter, ReadOptions, RigFile, RowReader, Split, Trial,
    TrialEntry, TrialKind,
};

/// Any finite bit pattern.
fn number() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite())
}

fn trial() -> impl Strategy<Value = Trial> {
    (1..20_usize, vec("[ -~µ°]{1,12}", 0..5)).prop_flat_map(|(rows, mut names)| {
        names.retain(|name| !name.trim().is_empty() && name != "time_s");
        names.sort();
        names.dedup();
        let columns = vec(vec(number(), rows), names.len());
        (vec(number(), rows), columns).prop_map(move |(mut time_s, columns)| {
            time_s.sort_by(f64::total_cmp);
            time_s.dedup_by(|a, b| a == b);
            let rows = time_s.len();
            let channels = names
                .iter()
                .zip(columns)
                .map(|(name, values)| Channel {
                    name: name.clone(),
                    values: values[..rows].to_vec(),
                })
                .collect();
            Trial { name: "t.csv".to_owned(), time_s, channels }
        })
    })
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

fn parameter() -> impl Strategy<Value = Parameter> {
    let tolerance = || proptest::option::of(number().prop_map(f64::abs));
    (number(), tolerance(), tolerance()).prop_map(|(value, tolerance, tolerance_abs)| Parameter {
        value,
        tolerance,
        tolerance_abs,
    })
}

fn rig() -> impl Strategy<Value = RigFile> {
    let name = || {
        "[a-zA-Z_. \"é]{1,8}"
            .prop_filter("taken", |name| name != "kind" && name != "effect" && name != "name")
    };
    let stages = proptest::collection::btree_map(
        name(),
        proptest::collection::btree_map(name(), parameter(), 0..4),
        0..4,
    );
    let effect = (any::<String>(), proptest::collection::btree_map(name(), number(), 0..3))
        .prop_map(|(name, parameters)| EffectEntry { name, parameters });
    (proptest::option::of(any::<String>()), vec(effect, 0..3), stages)
        .prop_map(|(kind, effects, stages)| RigFile { kind, effects, stages })
}

proptest! {
    #[test]
    fn trials(trial in trial()) {
        let mut text = Vec::new();
        trial.write_to(&mut text)?;
        let back = Trial::from_reader(&text[..], "t.csv", &ReadOptions::new())?;
        prop_assert_eq!(bits(&back.time_s), bits(&trial.time_s));
        prop_assert_eq!(back.channels.len(), trial.channels.len());
        for (a, b) in back.channels.iter().zip(&trial.channels) {
            prop_assert_eq!(&a.name, &b.name);
            prop_assert_eq!(bits(&a.values), bits(&b.values));
        }
        // The same rows, one at a time.
        let options = trial.channels.iter().fold(ReadOptions::new(), |o, c| o.require(&c.name));
        let mut rows = RowReader::new(&text[..], "t.csv", &options)?;
        for (i, time_s) in trial.time_s.iter().enumerate() {
            let row = rows.next_row().expect("as many rows")?;
            prop_assert_eq!(row.time_s.to_bits(), time_s.to_bits());
            let values: Vec<f64> = trial.channels.iter().map(|c| c.values[i]).collect();
            prop_assert_eq!(bits(row.values), bits(&values));
        }
        prop_assert!(rows.next_row().is_none());
    }

    #[test]
    fn rigs(rig in rig()) {
        prop_assert_eq!(RigFile::parse("rig.toml", &rig.to_toml())?, rig);
    }

    #[test]
    fn data_sets(name in any::<String>(), rate_hz in 1e-3..1e6, start_s in number(), opening in proptest::option::of(0.0..=1.0), kind in 0..5_usize) {
        let entry = TrialEntry {
            file: "a/b.csv".to_owned(),
            kind: TrialKind::ALL[kind],
            opening,
            start_s,
            split: Split::Test,
        };
        let set = DataSet { name, rate_hz, rig: Some("rig.toml".to_owned()), trials: vec![entry] };
        prop_assert_eq!(DataSet::parse("dataset.toml", &set.to_toml())?, set);
    }

    #[test]
    fn byte_soup(soup in vec(any::<u8>(), 0..300)) {
        read_everything(&soup);
    }

    #[test]
    fn csv_soup(rows in vec("[-+0-9eE.,;\"\\t naif\\r]{0,20}", 0..12)) {
        read_everything(format!("time_s,bridge_v\n{}", rows.join("\n")).as_bytes());
        read_everything(rows.join("\n").as_bytes());
    }
}

/// Reads bytes as everything that there is; what comes out is sound.
fn read_everything(soup: &[u8]) {
    let options = ReadOptions::new().max_line_bytes(64);
    if let Ok(trial) = Trial::from_reader(soup, "soup", &options) {
        trial.check().expect("what was read can be written");
    }
    if let Ok(mut rows) = RowReader::new(soup, "soup", &options.require("bridge_v")) {
        let mut count = 0;
        while let Some(row) = rows.next_row() {
            count += 1;
            assert!(
                row.is_err() || row.is_ok_and(|r| r.time_s.is_finite() && r.values[0].is_finite())
            );
        }
        assert!(count <= soup.len(), "it ends");
    }
    let text = String::from_utf8_lossy(soup);
    let _ = DataSet::parse("soup", &text);
    let _ = RigFile::parse("soup", &text);
}
