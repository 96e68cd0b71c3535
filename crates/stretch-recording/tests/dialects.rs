//! A table that is written in any dialect is read back unchanged, as a whole or row by row.

use proptest::prelude::*;
use stretch_data::{Trial, push_number};
use stretch_recording::{ReadOptions, Recording, RowReader};

/// A way to write a table.
#[derive(Debug, Clone)]
struct Dialect {
    separator: &'static str,
    has_commas: bool,
    is_quoted: bool,
    line_end: &'static str,
    has_mark: bool,
    comments: &'static str,
    units: Units,
    is_trailed: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Units {
    InNames,
    Brackets,
    Row,
}

fn dialect() -> impl Strategy<Value = Dialect> {
    let separators = prop::sample::select(vec![",", ";", "\t", " ", "  ", " ; ", ", ", "|", " | "]);
    let line_ends = prop::sample::select(vec!["\n", "\r\n", "\n\n"]);
    let comments = prop::sample::select(vec!["", "# rig 2, Monday\n", "% a\n\n% b; c\n", "// x\n"]);
    let units = prop::sample::select(vec![Units::InNames, Units::Brackets, Units::Row]);
    (separators, any::<[bool; 4]>(), line_ends, comments, units).prop_map(
        |(separator, [comma, is_quoted, has_mark, trailed], line_end, comments, units)| Dialect {
            separator,
            has_commas: comma && !separator.contains(','),
            is_quoted,
            line_end,
            has_mark,
            comments,
            units,
            is_trailed: trailed && !separator.trim().is_empty(),
        },
    )
}

impl Dialect {
    fn names(&self, bare: &[(&str, &str)]) -> Vec<String> {
        let name = |(name, unit): &(&str, &str)| match self.units {
            Units::InNames => format!("{name}_{unit}"),
            // Names that are not quoted cannot contain the blanks that separate columns.
            Units::Brackets if self.is_quoted => format!("\"{name} ({unit})\""),
            Units::Brackets => format!("{name}[{unit}]"),
            Units::Row if self.is_quoted => format!("\"{name}\""),
            Units::Row => (*name).to_owned(),
        };
        bare.iter().map(name).collect()
    }

    fn number(&self, value: f64) -> String {
        let mut text = Vec::new();
        push_number(&mut text, value);
        let text = String::from_utf8(text).expect("digits");
        if self.has_commas { text.replace('.', ",") } else { text }
    }

    /// Writes `length_mm` and `bridge_v` over the time.
    fn write(&self, trial: &Trial) -> String {
        let mut text = String::new();
        if self.has_mark {
            text.push('\u{feff}');
        }
        text.push_str(self.comments);
        let mut line = |cells: Vec<String>| {
            text.push_str(&cells.join(self.separator));
            text.push_str(if self.is_trailed { self.separator.trim() } else { "" });
            text.push_str(self.line_end);
        };
        line(self.names(&[("time", "s"), ("length", "mm"), ("bridge", "V")]));
        if self.units == Units::Row {
            line(["s", "mm", "V"].map(str::to_owned).into());
        }
        for (i, &time_s) in trial.time_s.iter().enumerate() {
            let values = trial.channels.iter().map(|c| c.values[i]);
            line([time_s].into_iter().chain(values).map(|x| self.number(x)).collect());
        }
        text
    }
}

proptest! {
    #[test]
    fn a_table_in_any_dialect(trial in stretch_strategies::rig_trial(2..40), dialect in dialect()) {
        let text = dialect.write(&trial);
        // A name with its unit in capitals is required as it is written.
        let capital = dialect.units == Units::InNames;
        let bridge = if capital { "bridge_V" } else { "bridge_v" };
        let options = ReadOptions::new().require("length_mm").require(bridge);
        let read = Recording::from_reader(text.as_bytes(), "t.csv", &options);
        let read = read.map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?.trial;
        prop_assert_eq!(&read.time_s, &trial.time_s);
        prop_assert_eq!(read.require("length_mm")?, trial.require("length_mm")?);
        prop_assert_eq!(read.require(bridge)?, trial.require("bridge_v")?);

        // Read the table as a live stream, row by row.
        let mut rows = RowReader::new(text.as_bytes(), "t.csv", &options)?;
        for (i, time_s) in trial.time_s.iter().enumerate() {
            let row = rows.next_row().expect("as many rows")?;
            prop_assert_eq!(row.time_s, *time_s);
            prop_assert_eq!(row.values, [trial.channels[0].values[i], trial.channels[1].values[i]]);
        }
        prop_assert!(rows.next_row().is_none());
    }

    #[test]
    fn without_a_header(trial in stretch_strategies::rig_trial(2..40), dialect in dialect(), cut in 0..12_usize) {
        let header = Dialect { comments: "", units: Units::InNames, is_trailed: false, has_mark: false, ..dialect };
        let text = header.write(&trial);
        let (_, rows) = text.split_once('\n').expect("a header");
        // A serial port can be opened in the middle of a line.
        let cut = cut.min(rows.find('\n').expect("a row"));
        let options = ReadOptions::new().columns(["time_s", "length_mm", "bridge_v"]).require("bridge_v");
        let whole = Recording::from_reader(rows.as_bytes(), "port", &options)?;
        prop_assert_eq!(&whole.trial.channels, &trial.channels);
        let rest = &rows.as_bytes()[cut..];
        let mut live = RowReader::new(rest, "port", &options)?;
        let mut values = Vec::new();
        while let Some(row) = live.next_row() {
            // The rest of the first line may look like a complete line with another time.
            if let Ok(row) = row {
                values.push(row.values[0]);
            }
        }
        prop_assert!(values.ends_with(&trial.channels[1].values[2..]), "{:?}\n{}", values, rows);
    }

    #[test]
    fn soup_never_panics_and_what_is_read_can_be_written(text in stretch_strategies::faulty_csv()) {
        let named = ReadOptions::new().columns(["time_s", "v"]);
        for options in [ReadOptions::new(), ReadOptions::new().grid_hz(10.0), named] {
            match Recording::from_reader(&text[..], "soup", &options) {
                Ok(Recording { trial, .. }) => prop_assert!(trial.check().is_ok()),
                Err(error) => prop_assert!(error.to_string().starts_with("soup"), "{}", error),
            }
            if let Ok(mut rows) = RowReader::new(&text[..], "soup", &options) {
                while let Some(row) = rows.next_row() {
                    prop_assert!(row.map_or(true, |row| row.time_s.is_finite()));
                }
            }
        }
    }

    #[test]
    fn own_form_is_read_without_a_word(trial in stretch_strategies::rig_trial(1..60)) {
        let mut text = Vec::new();
        trial.write_to(&mut text)?;
        let read = Recording::from_reader(&text[..], "rig.csv", &ReadOptions::new())?;
        prop_assert_eq!(read, Recording { trial, notes: Vec::new() });
    }
}
