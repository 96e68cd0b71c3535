//! Recordings written by other tools (`reference/recordings/make.py`) are read as the table from which they were made.

use std::path::PathBuf;

use stretch_data::Trial;
use stretch_recording::{Array, Clock, ReadOptions, Recording};

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../reference/recordings").join(name)
}

fn read(name: &str, options: &ReadOptions) -> Recording {
    Recording::read(path(name), options).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns the table that all of these files contain.
fn plain() -> Trial {
    Recording::read(path("plain.csv"), &ReadOptions::new()).expect("the table").trial
}

fn asked() -> ReadOptions {
    ReadOptions::new().require("length_mm").require("bridge_v")
}

/// Returns the largest difference from the table's channel.
#[track_caller]
fn off(trial: &Trial, channel: &str) -> f64 {
    let (own, table) = (trial.require(channel).expect("there"), plain());
    assert_eq!(own.len(), table.len());
    let pairs = own.iter().zip(table.require(channel).expect("there"));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[track_caller]
fn is_the_table(trial: &Trial) {
    let late = trial.time_s.iter().zip(plain().time_s).map(|(a, b)| (a - b).abs());
    // Stamps since 1970 are in nanoseconds.
    assert!(late.fold(0.0, f64::max) < 1e-9);
    assert_eq!(off(trial, "length_mm"), 0.0);
    // This channel was written in single precision.
    assert!(off(trial, "bridge_v") < 2e-7);
}

#[test]
fn the_own_form_is_read_to_the_bit_and_nothing_is_said() {
    let recording = read("plain.csv", &asked());
    assert_eq!(recording, Recording { trial: plain(), notes: Vec::new() });
}

#[test]
fn gzip() {
    is_the_table(&read("packed.csv.gz", &asked()).trial);
}

#[test]
fn numpy() {
    let named = asked().columns(["time_s", "length_mm", "bridge_v"]);
    is_the_table(&read("matrix.npy", &named).trial);
    is_the_table(&read("fields.npy", &asked()).trial);
    let Recording { trial, notes } = read("two_clocks.npz", &asked());
    is_the_table(&trial);
    assert!(notes[0].starts_with("left out: operator (numbers of type <U8"), "{notes:?}");
    let stamps = read("stamps.npz", &ReadOptions::new());
    assert_eq!(stamps.trial.channels[1].name, "both.1");
    assert_eq!(stamps.trial.channels[1].values, plain().require("bridge_v").expect("there"));
    assert!(stamps.trial.time_s.iter().zip(plain().time_s).all(|(a, b)| (a - b).abs() < 5e-7));
    let error = Recording::read(path("matrix.npy"), &ReadOptions::new()).expect_err("no names");
    assert!(error.to_string().contains("--columns"), "{error}");
    // A matrix in Fortran order: its columns follow one another in the file.
    let text = "{'descr': '|u1', 'fortran_order': True, 'shape': (4, 2), }";
    let text = format!("{text:<117}\n");
    let head = [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()];
    let bytes = [&head.concat()[..], &[0, 1, 2, 3, 7, 8, 9, 5]].concat();
    let read = |options| Recording::from_reader(&bytes[..], "f.npy", &options);
    let error = read(ReadOptions::new()).expect_err("no names").to_string();
    assert!(error.contains("shape [4, 2]"), "{error}");
    let trial = read(ReadOptions::new().columns(["time_s", "gauge"])).expect("names").trial;
    assert_eq!(trial.require("gauge").expect("there"), [7.0, 8.0, 9.0, 5.0]);
}

#[test]
#[cfg(feature = "parquet")]
fn parquet() {
    for packing in ["snappy", "zstd", "gzip", "lz4"] {
        let Recording { trial, notes } = read(&format!("{packing}.parquet"), &asked());
        is_the_table(&trial);
        assert_eq!(trial.channel("count").expect("whole numbers")[59], 59.0);
        assert_eq!(trial.channel("on").expect("true and false")[..2], [1.0, 0.0]);
        assert_eq!(
            notes,
            [
                "left out: word (no numbers)",
                "the time is column time",
                "columns left out because not all of their values are finite numbers: holes",
                "time counts from the first sample, 2024-05-01T12:00:00Z",
            ]
        );
    }
}

/// Declarations of Parquet integer columns, and the value of a number in which all bits are set.
#[cfg(feature = "parquet")]
const ONES: [(&str, f64); 7] = [
    ("INT32 c", -1.0),
    ("INT32 c (INTEGER(32,true))", -1.0),
    ("INT32 c (INTEGER(32,false))", 4_294_967_295.0),
    ("INT32 c (UINT_32)", 4_294_967_295.0),
    ("INT64 c", -1.0),
    ("INT64 c (INTEGER(64,false))", 18_446_744_073_709_551_615.0),
    ("INT64 c (UINT_64)", 18_446_744_073_709_551_615.0),
];

#[test]
#[cfg(feature = "parquet")]
fn whole_numbers_of_parquet_have_the_sign_that_the_file_declares() {
    use ::parquet::{
        column::writer::ColumnWriter, file::writer::SerializedFileWriter,
        schema::parser::parse_message_type,
    };
    const ROWS: i32 = 20;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.parquet");
    for (declared, wanted) in ONES {
        let schema = format!("message m {{ REQUIRED DOUBLE time_s; REQUIRED {declared}; }}");
        let schema = parse_message_type(&schema).expect("a schema").into();
        let file = std::fs::File::create(&path).expect("a file");
        let mut file = SerializedFileWriter::new(file, schema, Default::default()).expect("begun");
        let mut group = file.next_row_group().expect("a group");
        while let Some(mut column) = group.next_column().expect("a column") {
            let written = match column.untyped() {
                ColumnWriter::DoubleColumnWriter(own) => {
                    let time: Vec<f64> = (0..ROWS).map(|i| 0.01 * f64::from(i)).collect();
                    own.write_batch(&time, None, None)
                }
                ColumnWriter::Int32ColumnWriter(own) => {
                    own.write_batch(&[-1; ROWS as usize], None, None)
                }
                ColumnWriter::Int64ColumnWriter(own) => {
                    own.write_batch(&[-1; ROWS as usize], None, None)
                }
                _ => unreachable!("no such column is declared"),
            };
            written.expect("written");
            column.close().expect("closed");
        }
        group.close().expect("closed");
        file.close().expect("closed");
        let Recording { trial, .. } = Recording::read(&path, &ReadOptions::new()).expect("read");
        assert_eq!(trial.channel("c").expect("numbers"), [wanted; ROWS as usize], "{declared}");
    }
}

#[test]
fn a_grid_is_chosen_and_nothing_lies_beyond_the_samples() {
    let Recording { trial, notes } = read("plain.csv", &asked().grid_hz(40.0));
    assert_eq!((trial.len(), trial.time_s[23]), (24, 0.575));
    assert_eq!(
        notes,
        [
            "resampled to a grid of 40 Hz by linear interpolation: time_s (100.00 Hz); no low-pass filter is applied, so content above half the new rate aliases"
        ]
    );
    let table = plain();
    let bridge = table.require("bridge_v").expect("there");
    let between = 0.5 * (bridge[2] + bridge[3]);
    approx::assert_relative_eq!(
        trial.require("bridge_v").expect("asked for")[1],
        between,
        epsilon = 1e-12
    );
}

#[test]
#[cfg(feature = "parquet")]
fn an_episode_of_lerobot_goes_by_the_names_of_its_description() {
    let file = "lerobot/data/chunk-000/file-000.parquet";
    let Recording { trial, notes } = read(file, &ReadOptions::new());
    let table = plain();
    assert_eq!(trial.time_s, table.time_s);
    for name in ["length_mm", "bridge_v"] {
        let wanted = table.require(name).expect("there");
        assert_eq!(trial.channel(&format!("observation.state.{name}")), Some(wanted));
        let sent: Vec<f64> = wanted.iter().map(|x| x + 1.0).collect();
        assert_eq!(trial.channel(&format!("action.{name}")), Some(&sent[..]));
    }
    let said = notes.join("\n");
    assert!(said.contains("episodes 0 to 1, and 0 is read"), "{said}");
    assert!(said.contains("uneven.list.element (lists of different lengths)"), "{said}");

    let other = read(&format!("{file}#1"), &ReadOptions::new()).trial;
    let backwards: Vec<f64> =
        table.require("bridge_v").expect("there").iter().rev().copied().collect();
    assert_eq!(other.channel("observation.state.bridge_v"), Some(&backwards[..]));
    assert_eq!(other.time_s, table.time_s);
    let refused = Recording::read(path(&format!("{file}#7")), &ReadOptions::new());
    assert!(
        refused.unwrap_err().to_string().contains("there is no episode 7 in it; it holds 0 to 1")
    );
}

#[test]
fn a_table_has_no_episodes() {
    let refused = Recording::read(path("plain.csv#2"), &ReadOptions::new());
    assert!(refused.unwrap_err().to_string().contains("it holds no episodes"));
}

/// Returns a one-dimensional array with this name.
fn array(name: &str, values: impl IntoIterator<Item = f64>) -> Array {
    let values: Vec<f64> = values.into_iter().collect();
    Array { name: name.to_owned(), shape: vec![values.len()], values }
}

fn taken(arrays: Vec<Array>) -> (Recording, Vec<Clock>) {
    Recording::from_arrays("a", arrays, Vec::new(), &ReadOptions::new()).expect("arrays")
}

#[test]
fn slower_channels_are_brought_to_the_fastest_clock_and_not_beyond_their_own() {
    let fast = || (0..60).map(|k| 0.01 * f64::from(k));
    let slow = || (0..12).map(|k| 0.05 + 0.04 * f64::from(k));
    let (Recording { trial, notes }, clocks) = taken(vec![
        array("gauge.time_s", fast()),
        array("gauge.bridge_v", fast()),
        array("pressure.time_s", slow()),
        array("pressure.pressure_kpa", slow().map(|t| 200.0 + 100.0 * t)),
    ]);
    let lengths: Vec<_> = clocks.iter().map(|clock| clock.time_s.len()).collect();
    assert_eq!(lengths, [60, 12]);
    assert_eq!((trial.time_s[0], trial.len()), (0.05, 45));
    for (t, p) in trial.time_s.iter().zip(trial.require("pressure_kpa").expect("there")) {
        assert!((p - (200.0 + 100.0 * t)).abs() < 1e-9, "{p} at {t}");
    }
    assert!(
        notes.contains(
            &"resampled to the clock of gauge.time_s (100.00 Hz) by linear interpolation: pressure.time_s (25.00 Hz)".into()
        ),
        "{notes:?}"
    );
    assert!(
        notes.contains(
            &"0.050 s at the beginning and 0.100 s at the end are left out, because not every clock covers them".into()
        ),
        "{notes:?}"
    );
}

#[test]
fn a_date_and_times_beside_the_time_are_no_clocks() {
    let times = || (0..40).map(|k| 0.1 * f64::from(k));
    let (Recording { trial, notes }, _) = taken(vec![
        array("data.time", times()),
        array("data.length_mm", times().map(|t| 180.0 - t)),
        array("data.information.date", [2024.0, 2.0, 17.0]),
        array("data.information.timestamp", [15.0, 30.0, 59.0]),
    ]);
    assert_eq!((trial.len(), trial.channels.len()), (40, 1));
    assert!(notes[0].contains("data.information.date, data.information.timestamp"), "{notes:?}");

    let (Recording { trial, .. }, clocks) = taken(vec![
        array("imu.time_s", times()),
        array("imu.timestamp", times().map(|t| 7.0 + t)),
        array("imu.motor_t", times().map(|t| 20.0 + t)),
        array("time", times()),
        array("stamp", times().map(|t| 3.0 + t)),
    ]);
    let names: Vec<_> = trial.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!((clocks.len(), names), (2, vec!["imu.timestamp", "imu.motor_t", "stamp"]));
}

#[test]
fn what_is_read_in_python_is_refused_with_the_command() {
    let refused = |head: &[u8], file: &str| {
        let read = Recording::from_reader(head, file, &ReadOptions::new());
        read.expect_err("not read").to_string()
    };
    assert_eq!(
        refused(b"\x89MCAP0\r\n", "logs/run 1.mcap"),
        "logs/run 1.mcap: this is an MCAP file, which is not read here; convert it with `python -m stretch_gap convert \
         \"logs/run 1.mcap\" \"logs/run 1.npz\"` (pip install \"stretch-gap[ros]\")"
    );
    let behind_a_header = [&[b' '; 512][..], b"\x89HDF\r\n\x1a\n"].concat();
    let told = refused(&behind_a_header, "standard input");
    assert!(
        told.contains("MAT file of version 7.3") && told.contains("convert FILE FILE.npz"),
        "{told}"
    );
}

#[test]
#[cfg(not(feature = "parquet"))]
fn parquet_without_its_feature_is_refused_with_the_command() {
    let error = Recording::read(path("zstd.parquet"), &ReadOptions::new()).expect_err("not read");
    assert!(
        error.to_string().contains("zstd.npz` (pip install \"stretch-gap[parquet]\")"),
        "{error}"
    );
}
