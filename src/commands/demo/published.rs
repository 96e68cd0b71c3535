//! Reader for published recordings of a knee in a knitted sleeve, in the authors' file format.

use std::{
    io::{BufRead, BufReader, Read},
    path::Path,
};

use anyhow::Context;
use stretch_data::{Channel, Trial, files::open_input};
use stretch_recording::{ReadOptions, Recording};

/// Repository of the files.
pub(super) const REPOSITORY: &str = "github.com/e-Body-Lab/graphene-based-knitted-sensing-sleeve";
/// Commit of the repository for which this reader was written.
pub(super) const COMMIT: &str = "47369abac95fd43a10ada4156dd22cae91ee7f70";

/// The columns that are used: the angle, and the five sensors.
const COLUMNS: [&str; 6] = ["angle_deg", "s1", "s2", "s3", "s4", "s5"];
/// Columns of accelerometer and gyroscope, which follow.
const INERTIAL: [&str; 6] = ["a1", "a2", "a3", "w1", "w2", "w3"];
/// Limit for the length of the first line, bytes, because a binary file may contain no line end.
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
    let mut first = String::new();
    let file = open_input(path).with_context(told)?.take(LONGEST);
    BufReader::new(file).read_line(&mut first).with_context(told)?;
    let first = first.trim_start_matches('\u{feff}').split(',').next().unwrap_or_default();
    if first.trim().parse::<f64>().is_err() {
        return Ok(None);
    }
    let options = ReadOptions::new().columns(COLUMNS.into_iter().chain(INERTIAL));
    let options = COLUMNS.into_iter().fold(options, |options, name| options.require(name));
    let all = Recording::read(path, &options.sample_rate_hz(RATE_HZ))?.trial;
    let channels = COLUMNS.map(|name| all.channel(name).unwrap_or_default());
    let begins = |row: usize| channels[1..].iter().all(|values| values[row] == 0.0);
    let rows: Vec<usize> = (0..all.len()).collect();
    let session = |(i, rows): (usize, &[usize])| Trial {
        name: format!("{}, session {}", all.name, i + 1),
        time_s: all.time_s[..rows.len()].to_vec(),
        channels: COLUMNS
            .into_iter()
            .zip(channels)
            .map(|(name, values)| Channel {
                name: name.to_owned(),
                values: values[rows[0]..][..rows.len()].to_vec(),
            })
            .collect(),
    };
    Ok(Some(rows.chunk_by(|_, next| !begins(*next)).enumerate().map(session).collect()))
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
                    7,0,0,0,0,0,9,9,9,9,9,9\r\n8,1,2,3,4,5,9,9,9,9,9,9\r\n9,5,4,3,2,1,9,9,9,9,9,9\r\n";
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
        let rest = ",9,9,9,9,9,9\n";
        let bad = wrong(&format!("1,0,0,0,0,0{rest}1,0,0,x,0,0{rest}"));
        assert!(bad.contains("row 2, column s3: \"x\" is not a number"), "{bad}");
        let short = wrong("1,0,0,0,0\n");
        assert!(short.contains("row 1: the row has 5 numbers"), "{short}");
    }
}
