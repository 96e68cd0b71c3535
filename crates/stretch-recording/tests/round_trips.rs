//! Written recordings are read back bit by bit, and no input causes a panic.

use proptest::prelude::*;
use stretch_data::Trial;
use stretch_recording::{ReadOptions, Recording, RowReader};

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// Changes a trial to one that a user may have recorded: 100 samples a second, and names that are not numbers.
fn as_recorded(mut trial: Trial) -> Trial {
    trial.time_s = (0..trial.len()).map(|i| i as f64 / 100.0).collect();
    for (i, channel) in trial.channels.iter_mut().enumerate() {
        channel.name = format!("c{i} {}", channel.name.trim());
    }
    trial
}

proptest! {
    #[test]
    fn trials(trial in prop_oneof![stretch_strategies::any_trial(), stretch_strategies::rig_trial(1..50)]) {
        let trial = as_recorded(trial);
        let mut text = Vec::new();
        trial.write_to(&mut text)?;
        let options = trial.channels.iter().fold(ReadOptions::new(), |o, c| o.require(&c.name));
        let back = Recording::from_reader(&text[..], "t.csv", &options)?.trial;
        prop_assert_eq!(bits(&back.time_s), bits(&trial.time_s));
        prop_assert_eq!(back.channels.len(), trial.channels.len());
        for (a, b) in back.channels.iter().zip(&trial.channels) {
            prop_assert_eq!(&a.name, &b.name);
            prop_assert_eq!(bits(&a.values), bits(&b.values));
        }
        // Read the same rows one at a time.
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
    fn columns_in_any_order_and_dialect(
        trial in stretch_strategies::rig_trial(1..30),
        turned in any::<bool>(),
        dialect in prop::sample::select(vec![(",", "\n", ""), (";", "\r\n", "\u{feff}"), ("\t", "\n\n", "")]),
    ) {
        let mut other = trial.clone();
        if turned {
            other.channels.reverse();
        }
        let mut text = Vec::new();
        other.write_to(&mut text)?;
        let (delimiter, end, head) = dialect;
        let text = String::from_utf8(text)?.replace(',', delimiter).replace('\n', end);
        let text = format!("{head}{text}");
        let back = Recording::from_reader(text.as_bytes(), "rig.csv", &ReadOptions::new())?.trial;
        for channel in &trial.channels {
            prop_assert_eq!(back.require(&channel.name)?, &channel.values[..]);
        }
    }

    #[test]
    fn soup_never_panics_and_what_is_read_is_sound(soup in stretch_strategies::faulty_csv()) {
        let options = ReadOptions::new().max_line_bytes(64);
        if let Ok(Recording { trial, .. }) = Recording::from_reader(&soup[..], "soup", &options) {
            trial.check()?;
        }
        if let Ok(mut rows) = RowReader::new(&soup[..], "soup", &options.require("bridge_v")) {
            let mut count = 0;
            while let Some(row) = rows.next_row() {
                count += 1;
                let sound = row.map_or(true, |r| r.time_s.is_finite() && r.values[0].is_finite());
                prop_assert!(sound);
            }
            prop_assert!(count <= soup.len(), "it ends");
        }
    }
}

/// Columns may have numbers as names. The header of the project's format is not a row of numbers even then.
#[test]
fn a_trial_whose_columns_are_called_by_numbers_is_read_as_it_was_written() {
    let text = "time_s,180,1.24\n0,178,1.3\n0.01,179,1.4\n";
    let read = Recording::from_reader(text.as_bytes(), "log.csv", &ReadOptions::new());
    assert_eq!(read.expect("a trial").trial.require("180").expect("a column"), [178.0, 179.0]);
}
