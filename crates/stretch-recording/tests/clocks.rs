//! Time stamps as loggers write them, and sparse tables. Each recording has 400 samples at 50 Hz unless a test states
//! otherwise.

use proptest::prelude::*;
use stretch_recording::{Array, ReadOptions, Recording, RecordingError, RowReader, TimeUnit};

const SAMPLES: usize = 400;
const RATE_HZ: f64 = 50.0;

/// Returns a table with a time column `name` and stamps at 50 Hz.
fn table(name: &str, stamp: impl Fn(usize, f64) -> String) -> String {
    let rows = (0..SAMPLES).map(|i| format!("{},{i}\n", stamp(i, i as f64 / RATE_HZ)));
    std::iter::once(format!("{name},bridge_v\n")).chain(rows).collect()
}

fn read_as(text: &str, options: &ReadOptions) -> Result<Recording, RecordingError> {
    Recording::from_reader(text.as_bytes(), "t.csv", options)
}

fn read(text: &str) -> Recording {
    read_as(text, &ReadOptions::new().require("bridge_v")).unwrap_or_else(|e| panic!("{e}"))
}

/// Checks that the recording is at 50 Hz from sample `first` on, within `within_s`, and that one of its notes contains
/// `says`.
#[track_caller]
fn is_at_50_hz(recording: &Recording, first: usize, within_s: f64, says: &str) {
    let Recording { trial, notes } = recording;
    assert_eq!(trial.len(), SAMPLES - first, "{notes:?}");
    assert_eq!(trial.require("bridge_v").unwrap()[0], first as f64);
    for (i, time_s) in trial.time_s.iter().enumerate() {
        let off_s = (time_s - trial.time_s[0] - i as f64 / RATE_HZ).abs();
        assert!(off_s <= within_s, "sample {i} is off by {off_s} s: {notes:?}");
    }
    assert!((trial.rate_hz().unwrap() / RATE_HZ - 1.0).abs() < 1e-3, "{:?}", trial.rate_hz());
    assert!(says.is_empty() || notes.iter().any(|note| note.contains(says)), "{notes:?}");
}

#[test]
fn units_come_from_the_name_and_the_values() {
    let cases: [(&str, f64, f64, &str); 17] = [
        ("Millis", 0.3, 1e3, "the time is column Millis"),
        ("TimeUS", 0.0, 1e6, ""),
        ("Time (Seconds)", 0.0, 1.0, ""),
        ("t_us", 12.0, 1e6, ""),
        ("Elapsed Time [ms]", 0.0, 1e3, ""),
        ("time_min", 0.0, 1.0 / 60.0, ""),
        ("Time (hours)", 0.0, 1.0 / 3600.0, ""),
        ("time", 45_339.5, 1.0 / 86_400.0, "in days"),
        ("Timestamp", 739_299.5, 1.0 / 86_400.0, "in days"),
        ("time_s", 2_460_357.5, 1.0 / 86_400.0, "in days"),
        ("timestamp", 1_714_564_800.0, 1.0, "2024-05-01T12:00:00Z"),
        ("timestamp", 1_714_564_800_000.0, 1e3, "in milliseconds"),
        ("timestamp", 1_714_564_800_000_000.0, 1e6, "in microseconds"),
        ("timestamp", 1_714_564_800_000_000_000.0, 1e9, "in nanoseconds"),
        ("time_s", 1_714_564_800_000.0, 1e3, "in milliseconds"),
        ("time", 0.0, 1e6, "in microseconds"),
        ("time", 7.0, 1e9, "in nanoseconds"),
    ];
    for (name, begin, per_second, says) in cases {
        // as many digits as a logger writes
        let decimals = if per_second < 1.0 { 10 } else { 3 };
        let stamp = |_, t: f64| match begin > 1e17 {
            true => (begin as i128 + (t * per_second).round() as i128).to_string(),
            false => format!("{:.decimals$}", begin + t * per_second),
        };
        is_at_50_hz(&read(&table(name, stamp)), 0, 1e-3, says);
    }
}

#[test]
fn units_that_are_open_are_asked_for() {
    for (name, per_second) in [("time", 1e3), ("t", 1e3), ("time_s", 1e3), ("time", 1e5)] {
        let text = table(name, |_, t| format!("{:.1}", t * per_second));
        let text = if name == "time_s" { text.replace(".0,", ",") } else { text };
        let error = read_as(&text, &ReadOptions::new()).expect_err("two meanings").to_string();
        assert!(error.contains(&format!("--time {name}:s")), "{error}");
    }
    // An option that gives the unit overrides the values.
    let text = table("time", |_, t| format!("{:.1}", t * 1e3));
    let options = ReadOptions::new().time("time").time_unit(TimeUnit::Milliseconds);
    is_at_50_hz(&read_as(&text, &options).unwrap(), 0, 1e-9, "");
    let slow = ReadOptions::new().time("time").time_unit(TimeUnit::Seconds);
    let trial = read_as(&text, &slow).unwrap().trial;
    assert!((trial.rate_hz().unwrap() - 0.05).abs() < 1e-9);
}

#[test]
fn clocks_roll_over() {
    let wrapped = |modulus: f64, begin: f64, per_second: f64| {
        move |_: usize, t: f64| format!("{}", ((begin + t * per_second).round()) % modulus)
    };
    let two = |bits| 2_f64.powi(bits);
    for (name, modulus, begin, per_second) in [
        ("time_us", two(32), 4_291_967_296.0, 1e6),
        ("time_ms", two(32), two(32) - 3000.0, 1e3),
        ("time_ms", two(16), 62_000.0, 1e3),
        ("time_us", two(16), 0.0, 1e6),
        ("time_us", two(24), two(24) - 1e6, 1e6),
    ] {
        let text = table(name, wrapped(modulus, begin, per_second));
        is_at_50_hz(&read(&text), 0, 1e-6, "rolls over");
    }
    let of_day = |begin_s: f64| {
        move |_: usize, t: f64| {
            let ms = ((begin_s + t) * 1e3).round() as u64 % 86_400_000;
            let (s, ms) = (ms / 1000, ms % 1000);
            format!("{:02}:{:02}:{:02}.{ms:03}", s / 3600, s / 60 % 60, s % 60)
        }
    };
    is_at_50_hz(&read(&table("time", of_day(86_397.0))), 0, 1e-6, "86400 s are added");
    let seconds = |_: usize, t: f64| format!("{:.3}", (86_395.0 + t) % 86_400.0);
    is_at_50_hz(&read(&table("time_s", seconds)), 0, 1e-6, "row 252: 86400 s are added");
    // a signed counter
    let signed = |_: usize, t: f64| ((2_147_480_000.0 + t * 1e3) as i64 as i32).to_string();
    let signed = |i: usize, t: f64| {
        let count = (2_147_480_000.0 + t * 1e3).round() as u32 as i32;
        if count > 0 { signed(i, t) } else { count.to_string() }
    };
    is_at_50_hz(&read(&table("time_ms", signed)), 0, 1e-2, "rolls over");
}

#[test]
fn samples_may_be_lost_where_a_clock_rolls_over() {
    for (name, modulus, per_second) in [
        ("time_us", 2_f64.powi(32), 1e6),
        ("time_ms", 2_f64.powi(32), 1e3),
        ("time_ms", 2_f64.powi(16), 1e3),
        ("time_s", 86_400.0, 1.0),
    ] {
        // Half a second is lost at the roll-over.
        let after = |i: usize, t: f64| if i < 200 { t } else { t + 0.5 };
        let begin = modulus - 4.2 * per_second;
        let stamp = |i, t| format!("{:.2}", (begin + after(i, t) * per_second) % modulus);
        let Recording { trial, notes, .. } = read(&table(name, stamp));
        assert!(
            notes.iter().any(|note| note.contains("rolls over in row 202")),
            "{name}: {notes:?}"
        );
        let is_step = |(i, t): (usize, &[f64])| {
            let expected = if i == 199 { 0.52 } else { 0.02 };
            (t[1] - t[0] - expected).abs() < 1e-6
        };
        assert!(trial.time_s.windows(2).enumerate().all(is_step), "{name}");
    }
    // A step back that is not a roll-over is refused.
    let text = table("time_s", |i, t| format!("{:.2}", if i < 200 { 100.0 + t } else { t - 4.0 }));
    assert!(read_as(&text, &ReadOptions::new()).unwrap_err().to_string().contains("split"));
}

#[test]
fn seconds_and_nanoseconds_in_two_columns_are_one_stamp() {
    for (seconds, nanoseconds) in [
        ("sec", "nanosec"),
        ("secs", "nsecs"),
        ("header.stamp.secs", "header.stamp.nsecs"),
        ("/joint_states/header/stamp/sec", "/joint_states/header/stamp/nanosec"),
    ] {
        // The jitter of 2 ms shows that the stamps are read and not spread evenly.
        let time_s = |i: usize| i as f64 / RATE_HZ + if i % 2 == 1 { 0.002 } else { 0.0 };
        let row = |i: usize| {
            let (ns, begin) = ((time_s(i) * 1e9).round() as u64, 1_700_000_000);
            format!("{},{},{i}\n", begin + ns / 1_000_000_000, ns % 1_000_000_000)
        };
        let rows: String = (0..SAMPLES).map(row).collect();
        let Recording { trial, notes } = read(&format!("{seconds},{nanoseconds},bridge_v\n{rows}"));
        assert!(notes.iter().any(|n| n.contains("2023-11-14T22:13:20Z")), "{notes:?}");
        let is_right = |(i, t): (usize, &f64)| (t - time_s(i)).abs() < 1e-9;
        assert!(trial.time_s.iter().enumerate().all(is_right), "{seconds}: {notes:?}");
        assert!(trial.channels.iter().all(|c| c.name == "bridge_v"), "{seconds}");
    }
}

#[test]
fn minutes_and_seconds_alone_are_a_stamp() {
    let stamp = |_: usize, t: f64| {
        format!("{:02}:{:06.3}", if t < 4.0 { 59 } else { 0 }, (56.0 + t) % 60.0)
    };
    is_at_50_hz(&read(&table("time", stamp)), 0, 1e-6, "3600 s are added");
}

#[test]
fn a_terminal_puts_the_time_in_brackets() {
    let day = |date: &str| {
        let row = |i: usize| format!("[{date}12:00:{:06.3}] {i}|{}\n", i as f64 / RATE_HZ, 2 * i);
        (0..SAMPLES).map(row).collect::<String>()
    };
    for (date, separator) in [("2024-05-01 ", ","), ("", ","), ("2024-05-01T", "\t"), ("", ";")] {
        let text = day(date).replace('|', separator);
        let options =
            ReadOptions::new().require("bridge_v").columns(["time", "bridge_v", "length_mm"]);
        is_at_50_hz(&read_as(&text, &options).unwrap(), 0, 1e-6, "");
    }
}

#[test]
fn repeated_and_coarse_stamps_are_spread() {
    let ticks = |tick_s: f64| {
        move |_: usize, t: f64| format!("{:.5}", (t / tick_s + 1e-9).floor() * tick_s)
    };
    for tick_s in [0.031_25, 0.015_625, 0.015_6, 0.1, 1.0] {
        let text = table("time_s", ticks(tick_s));
        is_at_50_hz(&read(&text), 0, 1e-3, "spread evenly");
    }
    let once = |i: usize, t: f64| format!("{:.3}", if i == 100 { t - 0.02 } else { t });
    is_at_50_hz(
        &read(&table("time_s", once)),
        0,
        1e-9,
        "row 102 has the time stamp of the row before",
    );
    let seconds = |_: usize, t: f64| format!("2024-02-17 23:59:{:02.0}", (50.0 + t + 1e-9).floor());
    is_at_50_hz(&read(&table("time", seconds)), 0, 1e-6, "50 per second");
    // The recording begins within a second.
    let late = |_: usize, t: f64| format!("{}", (1_714_564_800.4 + t + 1e-9).floor());
    is_at_50_hz(&read(&table("timestamp", late)), 0, 1e-6, "50 per second");
    // The stamps stayed the same while samples continued.
    let stuck = |i: usize, t: f64| format!("{:.2}", if (100..130).contains(&i) { 2.0 } else { t });
    is_at_50_hz(&read(&table("time_s", stuck)), 0, 1e-9, "29 rows have the time stamp");
    // Lost samples are not mistaken for ticks, even at regular intervals.
    for every in [9, 37] {
        let text = table("time_s", |_, t| format!("{t:.2}"));
        let lines = text.split_inclusive('\n').enumerate();
        let text: String = lines.filter(|(i, _)| i % every != 5).map(|(_, line)| line).collect();
        let trial = read(&text).trial;
        assert!(trial.time_s.iter().all(|t| (t * RATE_HZ - (t * RATE_HZ).round()).abs() < 1e-9));
    }
}

#[test]
fn stale_rows_are_left_out() {
    for stale in [1, 3] {
        let text =
            table("Time (s)", |i, t| format!("{:.3}", if i < stale { 2.445 + t } else { t }));
        let says = if stale == 1 { "row 2 is left out" } else { "3 rows are left out" };
        is_at_50_hz(&read(&text), stale, 1e-9, says);
    }
    let unset =
        table("time_s", |i, t| format!("{:.3}", if i < 2 { t } else { 1_714_564_800.0 + t }));
    is_at_50_hz(&read(&unset), 2, 1e-6, "2 rows are left out");
    let again = table("time_s", |i, t| format!("{:.3}", if i < 200 { t } else { t - 4.0 }));
    let error = read_as(&again, &ReadOptions::new()).expect_err("two recordings").to_string();
    assert!(error.contains("row 202, column time_s: time goes back from 3.98 to 0"), "{error}");
    assert!(error.contains("split the recording") && error.contains("--time RATEhz"), "{error}");
    let strict = ReadOptions::new().strict(true);
    let one = table("time_s", |i, t| format!("{:.3}", if i == 0 { 2.445 } else { t }));
    assert!(read_as(&one, &strict).expect_err("strict").to_string().contains("--strict"));
    let still = table("time_s", |_, _| "5".to_owned());
    let error = read_as(&still, &ReadOptions::new()).expect_err("no clock").to_string();
    assert!(error.contains("time does not advance at 5"), "{error}");
}

#[test]
fn a_rate_replaces_a_column_of_time() {
    let text = table("time_s", |_, t| format!("{:.3}", t / 2.0));
    let options = ReadOptions::new().require("bridge_v").sample_rate_hz(RATE_HZ);
    let says = "column time_s is not read: the time is computed from a rate of 50 Hz";
    is_at_50_hz(&read_as(&text, &options).unwrap(), 0, 1e-12, says);
    let still = table("time_s", |_, _| "oops".to_owned());
    is_at_50_hz(&read_as(&still, &options).unwrap(), 0, 1e-12, says);
    let mut rows = RowReader::new(text.as_bytes(), "live", &options).unwrap();
    assert_eq!(rows.next_row().unwrap().unwrap().time_s, 0.0);
    assert_eq!(rows.next_row().unwrap().unwrap().time_s, 0.02);
}

/// Number of stamps in which a stream looks for the ticks of its clock.
const LOOKED_AT: usize = 64;

/// Returns the times of a stream and its notes.
fn live(text: &str) -> (Vec<f64>, Vec<String>) {
    live_as(text, ReadOptions::new())
}

fn live_as(text: &str, options: ReadOptions) -> (Vec<f64>, Vec<String>) {
    let options = options.require("bridge_v");
    let mut rows = RowReader::new(text.as_bytes(), "live", &options).unwrap();
    let (mut times, mut notes) = (Vec::new(), Vec::new());
    while let Some(row) = rows.next_row() {
        times.extend(row.map(|row| row.time_s).ok());
        notes.extend(rows.take_notes());
    }
    (times, notes)
}

#[test]
fn a_stream_has_the_same_clock() {
    let micros =
        |_: usize, t: f64| format!("{}", (4_291_967_296.0 + t * 1e6).round() % 2_f64.powi(32));
    let (times, notes) = live(&table("time_us", micros));
    assert_eq!(times.len(), SAMPLES);
    assert!(times.windows(2).all(|t| (t[1] - t[0] - 0.02).abs() < 1e-6));
    assert!(notes.iter().any(|note| note.contains("rolls over in row 152")), "{notes:?}");
    let (times, notes) =
        live(&table("time_s", |_, t| format!("{:.5}", (t / 0.03125).floor() * 0.03125)));
    assert_eq!(times.len(), SAMPLES - 1, "before the first tick nothing is known of the clock");
    assert!(times.windows(2).all(|t| t[1] > t[0]));
    assert!(
        times.iter().enumerate().skip(50).all(|(i, t)| (t - 0.02 * (i + 1) as f64).abs() < 0.032)
    );
    assert!(notes.iter().any(|note| note.contains("stamps repeat")), "{notes:?}");
    // If an expected rate is known, such as that of a calibration, it places the samples before the first tick.
    let whole = table("time_s", |_, t| format!("{:.0}", t.floor()));
    for (usual_hz, near_s) in [(RATE_HZ, 1e-9), (1.1 * RATE_HZ, 0.1), (0.5 * RATE_HZ, 1.1)] {
        let (times, _) = live_as(&whole, ReadOptions::new().untimed_hz(usual_hz));
        assert_eq!(times.len(), SAMPLES);
        assert!(times.windows(2).all(|t| t[1] > t[0]), "{usual_hz} Hz: {times:?}");
        let first = times.iter().take(50).enumerate();
        assert!(first.clone().all(|(i, t)| (t - 0.02 * i as f64).abs() < near_s), "{times:?}");
    }
    let (times, _) =
        live(&table("timestamp", |_, t| format!("{:.0}", 1_714_564_800_000.0 + t * 1e3)));
    assert!((times[1] - times[0] - 0.02).abs() < 1e-6);
}

/// A function that returns the stamp for a time in seconds.
type Stamp = fn(f64) -> f64;

#[test]
fn the_first_step_of_a_stream_shows_its_unit() {
    for (unit, per_second, from) in [
        ("milliseconds", 1e3, 5.0),
        ("microseconds", 1e6, 777.0),
        ("nanoseconds", 1e9, 1e3),
        ("minutes", 1.0 / 60.0, 3.0),
        ("days", 1.0 / 86_400.0, 45_000.25),
        ("days", 1.0 / 86_400.0, 739_000.5),
        ("", 1.0, 30_000.0),
    ] {
        let text = table("t", |_, t| format!("{:.12}", from + t * per_second));
        let (times, notes) = live_as(&text, ReadOptions::new().untimed_hz(RATE_HZ));
        assert_eq!(times.len(), SAMPLES, "{unit}");
        assert!(times.windows(2).all(|t| (t[1] - t[0] - 0.02).abs() < 1e-4), "{unit}");
        let by_steps = format!("the time is taken to be in {unit}, because of its steps");
        assert_eq!(notes.contains(&by_steps), !unit.is_empty(), "{unit}: {notes:?}");
    }
}

/// Tests a clock with ticks of 15.6 ms. At 50 samples a second, none of its stamps repeats.
#[test]
fn a_stream_with_coarse_stamps_has_the_usual_rate() {
    let usual = || ReadOptions::new().untimed_hz(RATE_HZ);
    for tick_s in [0.015_6, 0.015_625, 0.016] {
        let ticks = |t: f64| (t / tick_s + 1e-9).floor() * tick_s;
        let (times, notes) = live_as(&table("time_s", |_, t| format!("{:.6}", ticks(t))), usual());
        let [note] = &notes[..] else { panic!("{notes:?}") };
        assert!(note.contains("ticks of") && note.contains("50 per second"), "{note}");
        for (i, time_s) in times.iter().enumerate() {
            let late_s = i as f64 / RATE_HZ - time_s;
            assert!((-tick_s..=tick_s).contains(&late_s), "{tick_s}, sample {i}: {late_s}");
        }
        for pair in times[LOOKED_AT..].windows(2) {
            assert!((pair[1] - pair[0] - 1.0 / RATE_HZ).abs() < 1e-6, "{tick_s}: {pair:?}");
        }
        // A lost sample remains a gap.
        let lost =
            table("time_s", |i, t| format!("{:.6}", ticks(if i < 200 { t } else { t + 0.02 })));
        let (times, _) = live_as(&lost, usual());
        assert!((times[399] - 8.0).abs() < tick_s, "{tick_s}: {}", times[399]);
    }
    // Jitter is not mistaken for ticks, and a clock of another rate is not adjusted to the expected one.
    let early = |i: usize, t: f64| format!("{:.4}", t + 0.001 * ((i * 7 % 5) as f64 - 2.0) + 1.0);
    let (times, notes) = live_as(&table("time_s", early), usual());
    assert_eq!((times[1], notes.len()), (1.02, 0), "{notes:?}");
    let other =
        table("time_s", |i, _| format!("{:.6}", (i as f64 * 0.024 / 0.0156).floor() * 0.0156));
    let (times, notes) = live_as(&other, usual());
    assert!(notes.is_empty() && (times[399] - 9.576).abs() < 0.0157, "{notes:?} {}", times[399]);
}

#[test]
fn arrays_have_the_same_clock() {
    let array = |name: &str, value: Stamp| Array {
        name: name.to_owned(),
        shape: vec![SAMPLES],
        values: (0..SAMPLES).map(|i| value(i as f64 / RATE_HZ)).collect(),
    };
    let bridge = array("bridge_v", |t| t * RATE_HZ);
    let clocks: [(&str, Stamp, &str); 5] = [
        ("time_us", |t| (4_291_967_296.0 + t * 1e6).round() % 2_f64.powi(32), "rolls over"),
        ("time_s", |t| (t / 0.03125 + 1e-9).floor() * 0.03125, "spread evenly"),
        ("time", |t| 45_339.5 + t / 86_400.0, "in days"),
        ("t", |t| 1_714_564_800_000.0 + t * 1e3, "in milliseconds"),
        ("Millis", |t| 0.3 + t * 1e3, ""),
    ];
    for (name, value, says) in clocks {
        let arrays = vec![array(name, value), bridge.clone()];
        let (recording, clocks) =
            Recording::from_arrays("a.npz", arrays, Vec::new(), &ReadOptions::new()).unwrap();
        is_at_50_hz(&recording, 0, 1e-3, says);
        assert_eq!(clocks[0].time_s.len(), SAMPLES);
    }
}

#[test]
fn columns_of_a_sparse_table_have_the_clocks_of_their_own_rows() {
    let rows = (0..300).map(|i| {
        let t = f64::from(i) / RATE_HZ;
        format!("{t:.4},{},\n{:.4},,{}\n", 100.0 + t, t + 0.003, 1.0 + t)
    });
    let text: String =
        std::iter::once("__time,/joint/position,/cmd/data\n".to_owned()).chain(rows).collect();
    let asked = ReadOptions::new().require("/joint/position").require("/cmd/data");
    let on_grid = asked.clone().grid_hz(RATE_HZ);
    let grid = read_as(&text, &on_grid).unwrap();
    assert_eq!(grid.trial.len(), 299, "{:?}", grid.notes);
    for options in [asked, ReadOptions::new()] {
        let Recording { trial, notes } = read_as(&text, &options).unwrap();
        assert!(
            notes.iter().any(|note| note.contains("time stamps of their filled rows")),
            "{notes:?}"
        );
        let (joint, bridge) =
            (trial.require("/joint/position").unwrap(), trial.require("/cmd/data").unwrap());
        for ((t, joint), bridge) in trial.time_s.iter().zip(joint).zip(bridge) {
            assert!((joint - 100.0 - t).abs() < 1e-9, "at {t}");
            // The bridge is written three milliseconds late with its own stamp.
            assert!((bridge - 1.0 - (t - 0.003)).abs() < 1e-9, "at {t}");
        }
    }
    // Other programs write these words in place of a blank.
    for missing in ["nan", "NA", "N/A", "null", "None"] {
        let filled = text.replace(",\n", &format!(",{missing}\n"));
        let filled = filled.replace(",,", &format!(",{missing},"));
        assert_ne!(filled, text);
        assert_eq!(read_as(&filled, &on_grid).unwrap().trial, grid.trial, "{missing}");
    }
    // Only one topic is required.
    let one = read_as(&text, &ReadOptions::new().require("/cmd/data")).unwrap();
    assert_eq!(one.trial.len(), 300);
    assert!((one.trial.rate_hz().unwrap() - RATE_HZ).abs() < 1e-6);
    // One column is sampled more slowly than the other.
    let slow = table("time_s,length_mm", |i, t| {
        if i % 5 == 0 { format!("{t:.2},{}", 100.0 + t) } else { format!("{t:.2},") }
    });
    let options = ReadOptions::new().require("bridge_v").require("length_mm");
    let trial = read_as(&slow, &options).unwrap().trial;
    assert_eq!(trial.len(), 396);
    let length = trial.require("length_mm").unwrap();
    assert!(length.iter().zip(&trial.time_s).all(|(x, t)| (x - 100.0 - t).abs() < 1e-9));
    // A sensor that fails has no separate clock.
    let lost = table("time_s,length_mm", |i, t| {
        if i < 250 { format!("{t:.2},{}", 100.0 + t) } else { format!("{t:.2},") }
    });
    let error = read_as(&lost, &options).expect_err("too many blanks").to_string();
    assert!(error.contains("row 252, column length_mm") && error.contains("150 of 400"), "{error}");
    // A column of blanks has no separate clock.
    let blank = table("time_s,length_mm", |_, t| format!("{t:.2},"));
    assert!(read_as(&blank, &options).is_err());
}

proptest! {
    #[test]
    fn spreading_keeps_the_order_and_every_stamp_within_its_tick(
        rate_hz in 20.0..400.0_f64, tick_s in prop::sample::select(vec![0.01, 0.015625, 0.03125, 0.1, 1.0]),
        begin_s in 0.0..10.0_f64, samples in 100..800_usize,
    ) {
        let stamp = |i: usize| ((begin_s + i as f64 / rate_hz) / tick_s).floor() * tick_s;
        let rows = (0..samples).map(|i| format!("{},{i}\n", stamp(i)));
        let text: String = std::iter::once("time_s,bridge_v\n".to_owned()).chain(rows).collect();
        let Ok(Recording { trial, notes }) = read_as(&text, &ReadOptions::new()) else {
            // Only a recording of less than a few ticks may be refused, because its clock may not be usable.
            prop_assert!(stamp(samples - 1) - stamp(0) < 2.5 * tick_s);
            return Ok(());
        };
        prop_assert!(trial.time_s.windows(2).all(|t| t[1] > t[0]));
        if trial.len() == samples {
            let off = |(i, t): (usize, &f64)| (t - begin_s - i as f64 / rate_hz).abs();
            let worst = trial.time_s.iter().enumerate().map(off).fold(0.0, f64::max);
            prop_assert!(worst <= 2.0 * tick_s, "{} s: {:?}", worst, notes);
        }
    }

    #[test]
    fn a_counter_may_roll_over_anywhere(at in 1..400_usize, bits in prop::sample::select(vec![24, 32])) {
        let modulus = 2_f64.powi(bits);
        let begin = modulus - at as f64 * 20_000.0;
        let text = table("time_us", |_, t| format!("{}", (begin + t * 1e6).round() % modulus));
        let trial = read(&text).trial;
        prop_assert_eq!(trial.len(), SAMPLES);
        prop_assert!(trial.time_s.windows(2).all(|t| (t[1] - t[0] - 0.02).abs() < 1e-6));
    }
}

/// A file that holds two recordings names the row in which its time goes back, although rows before it are left out.
#[test]
fn time_that_begins_again_is_named_where_it_does() {
    let first = (0..300).map(|n| 0.01 * f64::from(n));
    let stamps = first.chain((0..1000).map(|n| 2.5 + 0.01 * f64::from(n)));
    let rows: String = stamps.map(|time_s| format!("{time_s:.2},1\n")).collect();
    let notes = read(&format!("time_s,bridge_v\n{rows}")).notes;
    let named =
        "row 302: time goes back from 2.99 to 2.5; 49 rows are left out, the first of them row 253";
    assert!(notes.iter().any(|note| note.starts_with(named)), "{notes:?}");
}
