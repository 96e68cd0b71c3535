//! Recordings that other tools wrote (`reference/recordings/make.py`) come back as the table that they were made from.

use std::path::PathBuf;

use stretch_data::Trial;
use stretch_recording::{ReadOptions, Recording};

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../reference/recordings").join(name)
}

fn read(name: &str, options: &ReadOptions) -> Recording {
    Recording::read(path(name), options).unwrap_or_else(|e| panic!("{e}"))
}

/// The table that all of them hold.
fn plain() -> Trial {
    Recording::read(path("plain.csv"), &ReadOptions::new()).expect("the table").trial
}

fn asked() -> ReadOptions {
    ReadOptions::new().require("length_mm").require("bridge_v")
}

/// Largest distance to the table's channel.
#[cfg(any(
    feature = "gzip",
    feature = "npz",
    feature = "mat",
    feature = "hdf5",
    feature = "mcap",
    feature = "parquet"
))]
#[track_caller]
fn off(trial: &Trial, channel: &str) -> f64 {
    let (own, table) = (trial.require(channel).expect("there"), plain());
    assert_eq!(own.len(), table.len());
    let pairs = own.iter().zip(table.require(channel).expect("there"));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[cfg(any(
    feature = "gzip",
    feature = "npz",
    feature = "mat",
    feature = "hdf5",
    feature = "mcap",
    feature = "parquet"
))]
#[track_caller]
fn is_the_table(trial: &Trial) {
    let late = trial.time_s.iter().zip(plain().time_s).map(|(a, b)| (a - b).abs());
    // Stamps of an epoch come in nanoseconds.
    assert!(late.fold(0.0, f64::max) < 1e-9);
    assert_eq!(off(trial, "length_mm"), 0.0);
    // A channel that was written in single precision.
    assert!(off(trial, "bridge_v") < 2e-7);
}

#[test]
fn the_own_form_is_read_to_the_bit_and_nothing_is_said() {
    let recording = read("plain.csv", &asked());
    assert_eq!(recording, Recording { trial: plain(), notes: Vec::new() });
}

#[test]
#[cfg(feature = "gzip")]
fn gzip() {
    is_the_table(&read("packed.csv.gz", &asked()).trial);
}

#[test]
#[cfg(feature = "npz")]
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
}

#[test]
#[cfg(feature = "mat")]
fn matlab() {
    is_the_table(&read("plain.mat", &asked()).trial);
    let Recording { trial, .. } = read("structure.mat", &ReadOptions::new().require("bridge_v"));
    assert_eq!(off(&trial, "bridge_v"), 0.0);
    // Written in single precision.
    assert!(off(&trial, "length_mm") < 1e-5);
}

#[test]
#[cfg(feature = "hdf5")]
fn hdf5_and_matlab_7_3() {
    is_the_table(&read("groups.h5", &asked()).trial);
    is_the_table(&read("seven_three.mat", &asked()).trial);
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
                "left out, not all of their values are finite numbers: holes",
                "time counts from the first sample, 2024-05-01T12:00:00Z",
            ]
        );
    }
}

#[test]
#[cfg(feature = "mcap")]
fn messages_in_json() {
    is_the_table(&read("json.mcap", &asked()).trial);
    let Recording { trial, notes } = read("json.mcap", &asked().require("pressure_kpa"));
    // The slower topic begins later and ends earlier: nothing is made up beyond it.
    assert_eq!((trial.time_s[0], trial.len()), (0.05, 45));
    for (t, p) in trial.time_s.iter().zip(trial.require("pressure_kpa").expect("asked for")) {
        // A straight line rounded to hundredths lies between two such.
        assert!((p - (200.0 + 100.0 * t)).abs() < 0.0051, "{p} at {t}");
    }
    assert!(
        notes.contains(
            &"brought to the clock of /gauge (100.00 Hz) by straight lines: /pressure (25.00 Hz)"
                .into()
        ),
        "{notes:?}"
    );
    assert!(
        notes.contains(
            &"0.050 s at the beginning and 0.100 s at the end are left out: not every clock runs there".into()
        ),
        "{notes:?}"
    );
}

#[test]
#[cfg(feature = "mcap")]
fn messages_of_ros() {
    let options = ReadOptions::new().require("elbow").require("gauge.code");
    let Recording { trial, notes } = read("ros2.mcap", &options);
    // Both have stamps of their own, half a period apart; the recorder's were late and uneven.
    assert!(
        notes[0].starts_with("time is what the messages' own stamps say: /gauge, /joint_states"),
        "{notes:?}"
    );
    assert_eq!(trial.len(), 59);
    let table = plain();
    let length = table.require("length_mm").expect("there");
    let (elbow, code) = (
        trial.require("elbow").expect("asked for"),
        trial.require("gauge.code").expect("asked for"),
    );
    for i in 0..59 {
        assert_eq!(code[i], -(i as f64));
        // In the middle between two positions, by a straight line; stamps are whole nanoseconds.
        assert!((elbow[i] - 0.5 * (length[i] + length[i + 1])).abs() < 1e-6, "{i}");
    }
    assert_eq!(trial.channel("gauge.axes.2").map(|v| v[7]), Some(7.0));
    assert_eq!(trial.channel("gauge.ok").map(|v| v[0]), Some(1.0));
    assert!(trial.channels.iter().all(|c| !c.name.contains("image")));
}

#[test]
fn a_grid_is_chosen_and_nothing_lies_beyond_the_samples() {
    let Recording { trial, notes } = read("plain.csv", &asked().grid_hz(40.0));
    assert_eq!((trial.len(), trial.time_s[23]), (24, 0.575));
    assert_eq!(
        notes,
        [
            "brought to a grid of 40 Hz by straight lines: the recording (100.00 Hz); nothing is filtered, so that what is faster folds down"
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
    assert!(said.contains("uneven.list.element (lists of several lengths)"), "{said}");

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

#[test]
#[cfg(feature = "mcap")]
fn protobuf_in_mcap() {
    let Recording { trial, notes } = read("protobuf.mcap", &ReadOptions::new());
    let (table, samples) = (plain(), 60);
    let late = trial.time_s.iter().zip(&table.time_s).map(|(a, b)| (a - b).abs());
    assert!(late.fold(0.0, f64::max) < 1e-9, "own stamps, not when it was logged");
    assert_eq!(trial.channel("length_mm"), Some(table.require("length_mm").expect("there")));
    let bridge_v = trial.require("bridge_v").expect("a message within");
    let wanted = table.require("bridge_v").expect("there");
    assert!(bridge_v.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 2e-7), "single precision");
    assert_eq!(trial.require("rig.gauge.count").expect("zigzag")[samples - 1], -59.0);
    assert_eq!(trial.require("rig.position.wrist").expect("by its name")[samples - 1], -59.0);
    // what protobuf leaves out is 0
    assert_eq!(trial.require("rig.is_moving").expect("true and false")[..2], [0.0, 1.0]);
    assert!(notes.iter().any(|note| note.contains("own stamps")), "{notes:?}");
}
