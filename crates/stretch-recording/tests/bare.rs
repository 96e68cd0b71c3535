//! Tests of readings without a time and without a name, one number per line.

use stretch_recording::{ReadOptions, Recording, RowReader};

fn asked() -> ReadOptions {
    ReadOptions::new().require("raw").untimed_hz(10.0)
}

#[test]
fn bare_readings_are_read_with_or_without_a_name_above_them() {
    for text in
        ["raw\n84213\n94120\n104080\n", "84213\n94120\n104080\n", "84213\r\n94120\r\n104080"]
    {
        let Recording { trial, notes } =
            Recording::from_reader(text.as_bytes(), "bare.csv", &asked()).unwrap();
        assert_eq!(trial.time_s, [0.0, 0.1, 0.2], "{text:?}");
        assert_eq!(trial.channel("raw"), Some(&[84213.0, 94120.0, 104080.0][..]));
        assert!(notes.iter().any(|note| note.contains("there is no time")), "{notes:?}");
        let mut rows = RowReader::new(text.as_bytes(), "stdin", &asked()).unwrap();
        assert!(rows.take_notes().iter().any(|note| note.contains("there is no time")));
        let mut live = Vec::new();
        while let Some(row) = rows.next_row() {
            let row = row.unwrap();
            live.push((row.time_s, row.values[0]));
        }
        assert_eq!(live, [(0.0, 84213.0), (0.1, 94120.0), (0.2, 104080.0)], "{text:?}");
    }
}

#[test]
fn a_row_that_is_no_number_takes_its_time() {
    let mut rows = RowReader::new(&b"1\noops\n3\n"[..], "stdin", &asked()).unwrap();
    assert_eq!(rows.next_row().unwrap().unwrap().time_s, 0.0);
    assert!(rows.next_row().unwrap().unwrap_err().is_row());
    assert_eq!(rows.next_row().unwrap().unwrap().time_s, 0.2);
}

#[test]
fn a_table_with_a_time_keeps_it() {
    let text = "time_s,raw\n5,1\n5.5,2\n6,3\n";
    let Recording { trial, notes } =
        Recording::from_reader(text.as_bytes(), "a.csv", &asked()).unwrap();
    assert_eq!((trial.time_s, notes), (vec![5.0, 5.5, 6.0], Vec::new()));
}
