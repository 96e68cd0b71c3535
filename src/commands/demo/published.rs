//! Reader for published recordings of a knee in a knitted sleeve, in the authors' file format.

use std::{
    io::{BufRead, BufReader, Read},
    path::Path,
};

use anyhow::{Context, bail, ensure};
use stretch_data::{Channel, Trial, files::open_input};

/// Repository of the files.
pub(super) const REPOSITORY: &str = "github.com/e-Body-Lab/graphene-based-knitted-sensing-sleeve";
/// Commit of the repository for which this reader was written.
pub(super) const COMMIT: &str = "47369abac95fd43a10ada4156dd22cae91ee7f70";

/// The columns that are read. Columns of accelerometer and gyroscope follow.
const COLUMNS: [&str; 6] = ["angle_deg", "s1", "s2", "s3", "s4", "s5"];
/// Limit for the length of a line, bytes; real lines are shorter.
const LONGEST: u64 = 64 << 10;
/// The authors' sample rate.
const RATE_HZ: f64 = 100.0;

/// Reads the sessions of a published file. Returns `None` if its first line does not start with a
/// number.
///
/// The file has no header and no time column. A row holds the knee angle in degrees, five relative
/// changes of resistance (change over resistance at rest), and six columns of an inertial sensor.
/// There are 100 rows per second. Sessions follow each other. The resistance at rest is that of a
/// session's first row, so all five changes are exactly zero there. The file is split at such rows.
///
/// # Errors
/// Files that cannot be read, and fields that are not numbers.
pub(super) fn sessions(path: &Path) -> anyhow::Result<Option<Vec<Trial>>> {
    let told = || format!("{}: cannot read it as text", path.display());
    let mut file = BufReader::new(open_input(path).with_context(told)?);
    let mut sessions: Vec<Vec<[f64; COLUMNS.len()]>> = Vec::new();
    let mut line = String::new();
    for number in 1.. {
        line.clear();
        // The limit is needed because a binary file may contain no line end.
        let length = (&mut file).take(LONGEST).read_line(&mut line).with_context(told)?;
        let text = line.trim_start_matches('\u{feff}').trim();
        if number == 1
            && text.split(',').next().is_none_or(|first| first.trim().parse::<f64>().is_err())
        {
            return Ok(None);
        }
        if length == 0 {
            break;
        }
        let place = || format!("{}, row {number}", path.display());
        ensure!((length as u64) < LONGEST, "{}: the line is longer than {LONGEST} bytes", place());
        if text.is_empty() {
            continue;
        }
        let row = row(text).with_context(place)?;
        match sessions.last_mut() {
            Some(session) if row[1..].iter().any(|x| *x != 0.0) => session.push(row),
            _ => sessions.push(vec![row]),
        }
    }
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let named = |(i, rows): (usize, &Vec<_>)| trial(format!("{file}, session {}", i + 1), rows);
    Ok(Some(sessions.iter().enumerate().map(named).collect()))
}

fn row(line: &str) -> anyhow::Result<[f64; COLUMNS.len()]> {
    let mut row = [0.0; COLUMNS.len()];
    let mut fields = line.split(',').map(str::trim);
    for (value, name) in row.iter_mut().zip(COLUMNS) {
        let Some(field) = fields.next() else { bail!("there is no field for {name}") };
        *value = match field.parse() {
            Ok(number) if f64::is_finite(number) => number,
            _ => bail!("{name} is {field:?}, not a number"),
        };
    }
    Ok(row)
}

fn trial(name: String, rows: &[[f64; COLUMNS.len()]]) -> Trial {
    let channel = |(i, name): (usize, &str)| Channel {
        name: name.to_owned(),
        values: rows.iter().map(|row| row[i]).collect(),
    };
    Trial {
        name,
        time_s: (0..rows.len()).map(|n| n as f64 / RATE_HZ).collect(),
        channels: COLUMNS.into_iter().enumerate().map(channel).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn read(text: &str) -> anyhow::Result<Option<Vec<Trial>>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("made_up.csv");
        fs::write(&path, text).unwrap();
        sessions(&path)
    }

    #[test]
    fn sessions_begin_where_all_sensors_are_zero() {
        let text = "\u{feff}1.5,0,0,0,0,0,9,9,9,9,9,9\r\n2.5,0,.1,0,0,-2E-1,9,9,9,9,9,9,\r\n\
                    7,0,0,0,0,0,9,9,9,9,9,9\r\n8,1,2,3,4,5\r\n9,5,4,3,2,1\r\n";
        let trials = read(text).unwrap().expect("numbers in the first line");
        let lengths: Vec<usize> = trials.iter().map(Trial::len).collect();
        assert_eq!(lengths, [2, 3]);
        assert_eq!(trials[0].channel("angle_deg"), Some(&[1.5, 2.5][..]));
        assert_eq!(trials[0].channel("s5"), Some(&[0.0, -0.2][..]));
        assert_eq!((trials[1].time_s[2], trials[1].channels.len()), (0.02, 6));
        assert_eq!(trials[1].name, "made_up.csv, session 2");
    }

    #[test]
    fn other_files_are_told_by_their_header_and_bad_fields_by_their_place() {
        assert_eq!(read("time_s,angle_deg,s1\n0,1,2\n").unwrap(), None);
        let wrong = |text: &str| format!("{:#}", read(text).unwrap_err());
        assert!(wrong("1,0,0,0,0,0\n1,0,0,x,0,0\n").ends_with("row 2: s3 is \"x\", not a number"));
        assert!(wrong("1,0,0,0,0\n").contains("row 1: there is no field for s5"));
    }
}
