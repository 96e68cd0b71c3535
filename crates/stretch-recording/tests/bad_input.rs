//! Tests of every way in which a file can be invalid, with the error message.

use std::io::{self, Read};

use stretch_data::{DataError, Trial};
use stretch_recording::{ReadOptions, Recording, RecordingError, RowReader};

fn read(text: impl AsRef<[u8]>) -> Result<Trial, RecordingError> {
    let options = ReadOptions::new().require("bridge_v");
    Recording::from_reader(text.as_ref(), "t.csv", &options).map(|recording| recording.trial)
}

/// Checks the error for a file in which `bad` of `all` rows are bad.
#[track_caller]
fn refuses(text: impl AsRef<[u8]>, message: &str, bad: usize, all: usize) {
    let share = format!("{bad} of {all} rows cannot be read, and at most one in 5 may be left out");
    says(text, &format!("{message} ({share})"));
}

#[track_caller]
fn says(text: impl AsRef<[u8]>, message: &str) {
    let error = read(text).expect_err("it is wrong");
    assert_eq!(error.to_string(), message, "{error:?}");
}

#[test]
fn files_that_are_not_there_or_hold_nothing() {
    let error = Recording::read("no/such.csv", &ReadOptions::new()).expect_err("no file");
    assert_eq!(error.to_string(), "no/such.csv: cannot open it: No such file or directory");
    assert!(!error.is_row());
    let empty = "t.csv: the file is empty; it needs a header line with the names of its columns, \
                 then one row per sample";
    says("", empty);
    says("\u{feff}\r\n\n", empty);
    says(
        "time_s,bridge_v\n",
        "t.csv: there is a header line and no sample below it; record the trial again or leave \
         the file out",
    );
    says(
        "0,1.5\n0.1,1.6\n",
        "t.csv: 2 rows of 2 numbers from line 1 on, and no names above them; name the columns with \
         --columns, or put a header line above them, such as time_s,length_mm,bridge_v",
    );
    says(
        "(1.0) can0 123#2710\n(1.1) can0 123#2711\n",
        "t.csv: none of its first 2 lines is a row of numbers (the first is \"(1.0) can0 123#2710\"); \
         write one line per sample, with a separator between its numbers",
    );
}

#[test]
fn columns() {
    says(
        "time_s,brdige_v,s1\n0,1,2\n",
        "t.csv: there is no column bridge_v (did you mean brdige_v?); the columns are time_s, \
         brdige_v, s1",
    );
    says(
        "x,bridge_v\n0,1\n",
        "t.csv: there is no column time_s; the columns are x, bridge_v; say which column is the time \
         with --time COLUMN, or --time 100hz if there is none",
    );
    says(
        "time_s,bridge_v,bridge_v\n0,1,1\n",
        "t.csv: the header names column bridge_v twice; ask for bridge_v.0 or bridge_v.1, the first \
         and the second of them",
    );
}

#[test]
fn line_ends_of_another_age() {
    says(
        "time_s,bridge_v\r0,1\r0.1,2\r",
        "t.csv, row 1, column 2: the name \"bridge_v\u{fffd}0\" holds a control character; if the \
         lines end in CR alone, save the file with LF",
    );
}

#[test]
fn fields() {
    let not_a_number =
        "t.csv, row 3, column bridge_v: \"oops\" is not a number; correct it or remove that row";
    refuses("time_s,bridge_v\n0,1\n0.1,oops\n", not_a_number, 1, 2);
    // A known column must be numeric if no column is required.
    let known = "time_s,bridge_v,length_mm\n0,1,180mm\n";
    assert_eq!(read(known).expect("bridge_v").channels.len(), 1);
    let error = Recording::from_reader(known.as_bytes(), "t.csv", &ReadOptions::new());
    let error = error.expect_err("no length").to_string();
    assert!(
        error.starts_with("t.csv, row 2, column length_mm: \"180mm\" is not a number"),
        "{error}"
    );
    for value in ["NaN", "-inf", "1e999", "\"Infinity\""] {
        let shown = value.trim_matches('"');
        refuses(
            format!("bridge_v,time_s\n1,0\n{value},1\n"),
            &format!(
                "t.csv, row 3, column bridge_v: \"{shown}\" is not a finite number; correct it \
                 or remove that row"
            ),
            1,
            2,
        );
    }
    refuses(
        "time_s,bridge_v\n0,\n",
        "t.csv, row 2, column bridge_v: the field is empty; fill it in or remove that row",
        1,
        1,
    );
    // The notation of the numbers is ambiguous, however few rows there are.
    says(
        "time_s,bridge_v\n0,\"1,5\"\n",
        "t.csv, row 2, column bridge_v: \"1,5\" has a decimal comma; export the file again with \
         decimal points",
    );
    refuses(
        "time_s,bridge_v\n0,\"1\n",
        "t.csv, row 2, column bridge_v: the quotation marks do not pair up within the line; \
         remove or double them",
        1,
        1,
    );
    refuses(
        format!("time_s,bridge_v\n0,{}\n", "x".repeat(5000)),
        &format!(
            "t.csv, row 2, column bridge_v: \"{}...\" is not a number; correct it or remove that row",
            "x".repeat(40)
        ),
        1,
        1,
    );
}

#[test]
fn bytes_that_are_no_text() {
    let degrees =
        "t.csv, row 2, column bridge_v: \"1°\" is not a number; correct it or remove that row";
    refuses(b"time_s,bridge_v\n0,1\xb0\n", degrees, 1, 1);
    let utf16: Vec<u8> =
        "\u{feff}time_s,bridge_v\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let error = read(utf16).expect_err("UTF-16").to_string();
    assert!(error.contains("the text is UTF-16"), "{error}");
    // Error messages contain no control characters, because they are printed in a terminal.
    let error = read("time_s,bridge_v\n0,\u{1b}[2J\n").expect_err("no number").to_string();
    assert!(!error.contains('\u{1b}'), "{error:?}");
}

#[test]
fn rows_and_time() {
    refuses(
        "time_s,bridge_v\n0,1\n0.1\n0.2,1\n",
        "t.csv, row 3: the header has 2 fields and this row has 1; complete or remove that row",
        1,
        3,
    );
    says(
        "time_s,bridge_v\n0,1,7,8\n",
        "t.csv: 1 row of 4 numbers from line 2 on, and no names for them in the line above \
         (\"time_s,bridge_v\"; if its commas are decimal commas, separate the columns with \
         semicolons); name the columns with --columns, or put a header line above them, such \
         as time_s,length_mm,bridge_v",
    );
    says(
        "time_s,bridge_v\n0.5,1\n0.25,1\n",
        "t.csv, row 3, column time_s: time goes back from 0.5 to 0.25; to replace the time \
         column by a rate, give --time RATEhz",
    );
    says(
        "time_s,bridge_v\n0.5,1\n0.5,1\n",
        "t.csv, row 3, column time_s: time does not advance at 0.5; to replace the time column by \
         a rate, give --time RATEhz",
    );
}

/// A stream that returns `head` and then, without a line end, `left` further bytes.
struct Endless {
    left: u64,
    head: &'static [u8],
}

impl Read for Endless {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if !self.head.is_empty() {
            return self.head.read(out);
        }
        let count = (out.len() as u64).min(self.left);
        self.left -= count;
        out[..count as usize].fill(b'7');
        Ok(count as usize)
    }
}

#[test]
fn a_line_of_a_gigabyte_is_refused_after_a_piece_of_it() {
    for head in [&b""[..], b"time_s,bridge_v\n0,1\n"] {
        let mut stream = Endless { left: 1 << 30, head };
        let error = Recording::from_reader(&mut stream, "t.csv", &ReadOptions::new());
        let error = error.expect_err("too long");
        let row = if head.is_empty() { 1 } else { 3 };
        assert_eq!(
            error.to_string(),
            format!(
                "t.csv, row {row}: the line is longer than 65536 bytes; write a table with \
                 one line per sample"
            )
        );
        assert!(stream.left > (1 << 30) - (1 << 20), "it read {} bytes", (1 << 30) - stream.left);
    }
}

#[test]
fn what_other_programs_write_is_understood() {
    for text in [
        "\u{feff}time_s,bridge_v\r\n0,1.5\r\n1,2.5\r\n",
        "bridge_v;time_s\n1.5;0\n2.5;1",
        "\"time_s\"\t\"bridge_v\"\n0\t1.5\n\n1\t2.5\n\n",
        " time_s , bridge_v \n 0 , +1.5 \n 1 , \"2.5\" \n",
        "time_s,note,bridge_v,\n0,\"a, \"\"b\"\"\",1.5,\n1,x,25e-1,\n",
        "time_s,bridge_v,s1,s2\n0,1.5,1,NaN\n1,2.5,,7\n",
    ] {
        let trial = read(text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
        assert_eq!(trial.time_s, [0.0, 1.0], "{text:?}");
        assert_eq!(trial.channel("bridge_v"), Some(&[1.5, 2.5][..]), "{text:?}");
        assert_eq!(trial.channels.len(), 1, "{text:?}: the others hold something else");
    }
}

#[test]
fn a_stream_survives_its_rows() {
    let long = "9".repeat(100_000);
    let text = format!(
        "time_s,note,bridge_v\n0,a,1\n1,b,two\n2,c\n3,d,4\n{long}\n\n3,e,5\n1,f,6\n2,\",\",7"
    );
    let options = ReadOptions::new().require("bridge_v");
    let mut rows = RowReader::new(text.as_bytes(), "live", &options).expect("a header");
    assert_eq!(rows.columns().collect::<Vec<_>>(), ["time_s", "note", "bridge_v"]);
    let mut seen = Vec::new();
    while let Some(row) = rows.next_row() {
        seen.push(match row {
            Ok(row) => format!("{} {} {}", row.row, row.time_s, row.values[0]),
            Err(error) => {
                assert!(error.is_row());
                let is_time =
                    matches!(error, RecordingError::Data(DataError::TimeNotRising { .. }));
                format!("{} {}", if is_time { "time:" } else { "row:" }, error)
                    .chars()
                    .take(22)
                    .collect()
            }
        });
    }
    assert_eq!(
        seen,
        [
            "2 0 1",
            "row: live, row 3, colu",
            "row: live, row 4: the ",
            "5 3 4",
            "row: live, row 6: the ",
            "8 3.6 5",
            "time: live, row 9, col",
            "10 2 7",
        ]
    );
}

#[test]
fn a_stream_answers_each_line_before_it_asks_for_more() {
    /// A reader that fails if it is read beyond its lines.
    struct Lines(Vec<&'static [u8]>);
    impl Read for Lines {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            if self.0.is_empty() {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            let line = self.0.remove(0);
            out[..line.len()].copy_from_slice(line);
            Ok(line.len())
        }
    }
    let stream = Lines(vec![b"time_s,v\n", b"0,1\n", b"1,", b"2\n"]);
    let options = ReadOptions::new().require("v");
    let mut rows = RowReader::new(stream, "live", &options).expect("a header");
    assert_eq!(rows.next_row().expect("a row").expect("good").values, [1.0]);
    assert_eq!(rows.next_row().expect("a row").expect("good").values, [2.0]);
    let error = rows.next_row().expect("an error").expect_err("the stream broke");
    assert!(!error.is_row());
    assert!(rows.next_row().is_none());
}
