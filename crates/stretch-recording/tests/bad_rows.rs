//! Rows that cannot be read are left out and counted, in files and in live streams. Too many of them are refused.

use proptest::prelude::*;
use stretch_data::Trial;
use stretch_recording::{ReadOptions, Recording, RowReader};

fn asked() -> ReadOptions {
    ReadOptions::new().require("length_mm").require("bridge_v")
}

/// Rows of a good recording below its header.
fn good_rows(count: usize) -> Vec<String> {
    let row = |i: usize| {
        let t = 0.02 * i as f64;
        format!("{t:.2},{:.4},{:.5}", 100.0 + 20.0 * t.sin(), 1.0 + 0.3 * t.sin())
    };
    (0..count).map(row).collect()
}

const HEADER: &str = "time_s,length_mm,bridge_v";

/// Reads a file of a header and rows. Returns the times in hundredths of a second, and the notes.
fn read(lines: &[String], options: &ReadOptions) -> Result<(Vec<u32>, Vec<String>), String> {
    let text = lines.join("\n");
    let read = Recording::from_reader(text.as_bytes(), "t.csv", options);
    let Recording { trial, notes } = read.map_err(|error| error.to_string())?;
    assert!(trial.channels.iter().all(|c| c.values.iter().all(|x| x.is_finite())), "{notes:?}");
    Ok((trial.time_s.iter().map(|t| (100.0 * t).round() as u32).collect(), notes))
}

/// Returns the times from a live stream, in hundredths of a second.
fn live(lines: &[String], options: &ReadOptions) -> Vec<u32> {
    let text = lines.join("\n");
    let mut rows = RowReader::new(text.as_bytes(), "live", options).expect("a header");
    let mut times = Vec::new();
    while let Some(row) = rows.next_row() {
        match row {
            Ok(row) => times.push((100.0 * row.time_s).round() as u32),
            Err(error) => assert!(error.is_row(), "{error}"),
        }
    }
    times
}

/// Ways to damage a table at one line, with the number of rows that are then lost.
const HARMS: [(&str, usize); 11] = [
    ("cut", 1),
    ("glued", 2),
    ("header", 0),
    ("nan", 1),
    ("blank", 1),
    ("all blank", 1),
    ("text", 1),
    ("words", 0),
    ("noise", 1),
    ("quote", 1),
    ("extra", 1),
];

fn harm(lines: &mut Vec<String>, at: usize, way: &str) {
    let cells: Vec<String> = lines[at].split(',').map(str::to_owned).collect();
    match way {
        "cut" => lines[at] = format!("{},{}", cells[0], &cells[1][..2]),
        "glued" => {
            let next = lines.remove(at + 1);
            lines[at] = format!("{},{}{next}", cells[0], cells[1]);
        }
        "header" => lines.insert(at, HEADER.to_owned()),
        "nan" => lines[at] = format!("{},NaN,{}", cells[0], cells[2]),
        "blank" => lines[at] = format!("{},,{}", cells[0], cells[2]),
        "all blank" => lines[at] = ",,".to_owned(),
        "text" => lines[at] = format!("{},ERR,{}", cells[0], cells[2]),
        "words" => lines.insert(at, "End of test".to_owned()),
        "noise" => lines[at] = "\u{fffd}\u{1}x7".to_owned(),
        "quote" => lines[at] = format!("{},\"{}", cells[0], lines[at]),
        "extra" => lines[at] = format!("{},1,2", lines[at]),
        other => panic!("{other}"),
    }
}

#[test]
fn every_harm_at_every_place_costs_its_rows_alone() {
    for (way, lost) in HARMS {
        for at in [1, 2, 3, 31, 59] {
            let mut lines = good_rows(60);
            lines.insert(0, HEADER.to_owned());
            harm(&mut lines, at, way);
            let expected: Vec<u32> = (0..60)
                .filter(|i| !(at - 1..at - 1 + lost).contains(i))
                .map(|i| 2 * i as u32)
                .collect();
            let (times, notes) =
                read(&lines, &asked()).unwrap_or_else(|e| panic!("{way} {at}: {e}"));
            assert_eq!(times, expected, "{way} at {at}: {notes:?}");
            // Lines above the first row do not belong to the table.
            let is_top =
                at == 1 && matches!(way, "words" | "header" | "noise" | "all blank" | "quote");
            let named = format!("row {}", at + 1);
            let said = notes
                .iter()
                .any(|note| note.starts_with("a row is left out") && note.contains(&named));
            assert!(said || is_top, "{way} at {at}: {notes:?}");
            assert_eq!(live(&lines, &asked()), expected, "{way} at {at}, live");
            if !is_top {
                let strict = read(&lines, &asked().strict(true)).expect_err("strict");
                assert!(strict.contains(&named) && strict.contains("--strict"), "{strict}");
            }
        }
    }
}

#[test]
fn what_is_around_a_table_is_no_row_of_it() {
    // The power failed while the last line was written.
    let mut lines = good_rows(60);
    lines.insert(0, HEADER.to_owned());
    lines.push("1.2".to_owned());
    assert_eq!(read(&lines, &asked()).expect("59 rows").0.len(), 60);
    // the log begins in the middle of a line
    lines.pop();
    lines.insert(0, "3,1.02".to_owned());
    let (times, notes) = read(&lines, &asked()).expect("60 rows");
    assert_eq!((times.len(), live(&lines, &asked()).len()), (60, 60));
    assert_eq!(notes, ["the first line is not part of the table and is skipped"]);
    // Summaries follow the numbers.
    lines.remove(0);
    lines.extend(["", "End of test", "Maximum,105.3", "Mean;1.02"].map(str::to_owned));
    let (times, notes) = read(&lines, &asked()).expect("60 rows");
    assert_eq!(times.len(), 60);
    assert_eq!(
        notes,
        ["3 rows are left out (63, 64, 65): row 63: the header has 3 fields and this row has 1"]
    );
}

#[test]
fn a_share_of_bad_rows_is_left_out_and_a_larger_one_refused() {
    for (every, is_read) in [(10, true), (5, true), (4, false), (2, false)] {
        let mut lines = good_rows(100);
        lines
            .iter_mut()
            .skip(3)
            .step_by(every)
            .for_each(|line| *line = line.replacen(',', ",x", 1));
        lines.insert(0, HEADER.to_owned());
        let read = read(&lines, &asked());
        match read {
            Ok((times, notes)) => {
                assert!(is_read && times.len() == 100 - 100 / every, "{every}: {notes:?}");
                assert!(
                    notes[0].starts_with(&format!("{} rows are left out (5, ", 100 / every)),
                    "{notes:?}"
                );
            }
            Err(error) => {
                assert!(
                    !is_read && error.starts_with("t.csv, row 5, column length_mm: \"x"),
                    "{error}"
                );
                assert!(error.contains("of 100 rows cannot be read"), "{error}");
            }
        }
    }
}

/// If no columns are required, a row without a number in a column is bad if nearly all other rows have one. Otherwise
/// the column counts as text.
#[test]
fn a_column_that_nobody_asks_for_keeps_its_numbers() {
    let lines: Vec<String> = std::iter::once("time_s,force,state,rare".to_owned())
        .chain((0..60).map(|i| {
            let force = if i == 20 { "oops".to_owned() } else { i.to_string() };
            let rare = if i % 3 == 0 { "1" } else { "" };
            format!("{:.2},{force},on,{rare}", 0.02 * f64::from(i))
        }))
        .collect();
    let text = lines.join("\n");
    let Recording { trial, notes } =
        Recording::from_reader(text.as_bytes(), "t.csv", &ReadOptions::new()).expect("read");
    assert_eq!((trial.len(), trial.channels.len()), (59, 1));
    assert_eq!(trial.require("force").expect("there")[20], 21.0);
    assert_eq!(
        notes,
        [
            "a row is left out: row 22, column force: \"oops\" is not a number",
            "columns left out because not all of their fields are numbers: state, rare",
        ]
    );
}

/// pandas writes the index as a first column without a name. A blank column between others gets no note.
#[test]
fn a_column_of_numbers_without_a_name_is_left_out_with_a_note() {
    for (lead, told) in
        [(true, &["columns left out because they have no name: column 1"][..]), (false, &[])]
    {
        let rows = (0..60).map(|i| {
            let index = if lead { i.to_string() } else { String::new() };
            format!("{index},{:.2},,{i}", 0.02 * f64::from(i))
        });
        let text: Vec<String> = std::iter::once(",time_s,,force".to_owned()).chain(rows).collect();
        let text = text.join("\n");
        let Recording { trial, notes } =
            Recording::from_reader(text.as_bytes(), "t.csv", &ReadOptions::new()).expect("read");
        assert_eq!((trial.len(), trial.channels.len()), (60, 1));
        assert_eq!(notes, told);
    }
}

/// If columns are required, a hole (a field without a number) in any other column does not lose a row, neither in a
/// file nor in a stream.
#[test]
fn a_hole_beside_what_is_asked_for_costs_no_row() {
    let mut lines = good_rows(30);
    lines.insert(0, HEADER.to_owned());
    harm(&mut lines, 12, "blank");
    let options = ReadOptions::new().require("bridge_v");
    let (times, notes) = read(&lines, &options).expect("30 rows");
    assert_eq!((times.len(), live(&lines, &options).len()), (30, 30));
    assert_eq!(notes, ["columns left out because not all of their fields are numbers: length_mm"]);
    assert_eq!(read(&lines, &ReadOptions::new()).expect("29 rows").0.len(), 29);
    let (times, notes) = read(&lines, &options.all_columns()).expect("29 rows");
    assert_eq!((times.len(), notes.len()), (29, 1));
    assert!(notes[0].starts_with("a row is left out: row 13, column length_mm"), "{notes:?}");
}

/// If samples are counted, a lost row counts as a sample.
#[test]
fn a_lost_sample_takes_time() {
    let mut lines = vec!["bridge_v,x".to_owned()];
    lines.extend((0..40).map(|i| format!("{i},1")));
    lines[11] = "oops,1".to_owned();
    lines.insert(21, "bridge_v;x".to_owned());
    let options = ReadOptions::new().require("bridge_v").sample_rate_hz(50.0);
    let (times, _) = read(&lines, &options).expect("39 rows");
    assert_eq!((times.len(), times[9], times[10], times[38]), (39, 18, 22, 78));
}

proptest! {
    #[test]
    fn a_recording_with_one_damaged_row_reads_as_its_other_rows(
        trial in stretch_strategies::rig_trial(20..60),
        at in any::<prop::sample::Index>(),
        way in prop::sample::select(HARMS.map(|(way, _)| way).to_vec()),
    ) {
        let mut text = Vec::new();
        trial.write_to(&mut text)?;
        let mut lines: Vec<String> = String::from_utf8(text)?.lines().map(str::to_owned).collect();
        let at = 1 + at.index(trial.len() - 1);
        let lost = HARMS.iter().find(|(name, _)| *name == way).expect("known").1;
        harm(&mut lines, at, way);
        let read = Recording::from_reader(lines.join("\n").as_bytes(), "t.csv", &asked());
        let read = read.map_err(|e| TestCaseError::fail(format!("{way} at {at}: {e}")))?;
        let mut rest: Trial = trial;
        rest.name = "t.csv".to_owned();
        let columns = rest.channels.iter_mut().map(|c| &mut c.values);
        columns.chain([&mut rest.time_s]).for_each(|values| { values.drain(at - 1..at - 1 + lost); });
        prop_assert_eq!(read.trial, rest);
        prop_assert_eq!(read.notes.len(), 1);
    }
}
