//! Writes the corpus that fuzzing begins with: `fuzz/run.sh seeds`.
//!
//! It is linked as the targets are, and ends before the first input.
//!
//! A few inputs a target, each of a kilobyte or two. Recordings begin with those of `stretch-recording/tests/corpus`.
#![no_main]

use std::{error::Error, fs, path::Path};

use stretch_calibrate::{
    Memory, ModelKind, Options, calibrate, calibration_to_json, fixed_record, parse_adc,
};
use stretch_core::{Calibration, RateEstimator};
use stretch_data::{Channel, Trial};
use stretch_problem::worker::WorkerFrame;
use stretch_receptor::{
    code::{FixedCalibration, FixedObserver},
    example_calibration, example_diagnosed, example_observer,
};

type Done = Result<(), Box<dyn Error>>;

fn put(target: &str, name: &str, bytes: &[u8]) -> Done {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    fs::create_dir_all(&folder)?;
    Ok(fs::write(folder.join(name), bytes)?)
}

/// A value in postcard.
fn flat(value: &impl serde::Serialize) -> Result<Vec<u8>, postcard::Error> {
    let mut buffer = [0; 4096];
    postcard::to_slice(value, &mut buffer).map(|bytes| bytes.to_vec())
}

/// A muscle that goes up and down, and a gauge that follows it late.
fn ramps() -> Trial {
    let time_s: Vec<f64> = (0..600).map(|n| 0.01 * f64::from(n)).collect();
    let at = |t: f64| 165.0 + 14.0 * (1.3 * t).cos() + 0.3 * (31.0 * t).sin();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![
        channel("length_mm", time_s.iter().map(|&t| at(t)).collect()),
        channel("bridge_v", time_s.iter().map(|&t| 1.24 + 0.03 * (180.0 - at(t - 0.03))).collect()),
    ];
    Trial { name: "ramps".into(), time_s, channels }
}

/// Records of every kind of model.
fn records() -> Result<Vec<(&'static str, Calibration)>, Box<dyn Error>> {
    let mut all = vec![
        ("poly13", example_calibration()),
        ("observer", example_observer()),
        ("diagnosed", example_diagnosed()),
    ];
    let remembering = |kind, rest| ModelKind::Remembering { kind, rest };
    for (name, model) in [
        ("line", ModelKind::Linear),
        ("poly55", "poly55".parse()?),
        ("history_rest", remembering(Memory::History, true)),
    ] {
        let options = Options { model, ..Options::default() };
        all.push((name, calibrate(&[ramps()], &options)?.calibration));
    }
    Ok(all)
}

/// Up and down, held, odd values, samples as they are.
fn stream() -> Vec<u8> {
    let mut bytes: Vec<u8> = (18..198).step_by(3).chain((18..198).rev().step_by(5)).collect();
    bytes.extend([225; 12]);
    bytes.extend(230..246);
    bytes.extend([60, 70, 80, 90, 100, 110, 120, 255, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    bytes
}

/// Rows of so many columns behind a time that goes on.
fn rows(columns: usize, count: usize) -> Vec<u8> {
    (0..count)
        .flat_map(|row| {
            let at = move |phase: f64| (100.0 + 75.0 * (0.11 * row as f64 + phase).sin()) as u8;
            std::iter::once(100).chain((0..columns).map(move |c| at(0.2 + 3.0 * c as f64)))
        })
        .collect()
}

libfuzzer_sys::fuzz_target!(
    init: only_write(),
    |_bytes: &[u8]| {}
);

fn only_write() {
    let done = write();
    done.as_ref().inspect_err(|error| println!("{error}")).ok();
    std::process::exit(i32::from(done.is_err()));
}

fn write() -> Done {
    let adc = parse_adc("12,0,3.3")?;
    for (name, record) in records()? {
        let bytes = flat(&record)?;
        let with_stream = [bytes.clone(), stream()].concat();
        put("receptor_stream", name, &with_stream)?;
        put("receptor_codes", name, &[vec![3 + 4 * 2], with_stream].concat())?;
        put("log_of_record", name, &[bytes.clone(), rows(3, 80)].concat())?;
        put("export_record", name, &[vec![2], bytes.clone()].concat())?;
        put("calibration_record", name, &bytes)?;
        // the release before wrote schema 1, without a seal
        put("calibration_record", &format!("{name}.schema_1"), &[&[1], &bytes[1..]].concat())?;
        put(
            "calibration_record",
            &format!("{name}.json"),
            calibration_to_json(&record)?.as_bytes(),
        )?;
        if let Ok(fixed) = fixed_record(&record, &adc) {
            put("calibration_record", &format!("{name}.fixed"), &fixed.bytes)?;
        }
    }
    let (poly, observer) = (example_calibration(), example_observer());
    for (which, bytes) in [
        flat(&FixedCalibration::<11, 2>::new(&poly, &adc)?)?,
        flat(&FixedObserver::new(&observer, &adc)?)?,
    ]
    .into_iter()
    .enumerate()
    {
        let bytes = [vec![which as u8], bytes, stream()].concat();
        put("receptor_codes", &format!("flash_{which}"), &bytes)?;
    }
    for which in 0..3 {
        put("receptor_example", &which.to_string(), &[vec![which], stream()].concat())?;
    }
    for (name, estimator) in [
        ("savgol", RateEstimator::SAVGOL_11_2),
        ("difference", RateEstimator::Differentiator { cutoff_hz: 8.0 }),
        ("tracker", RateEstimator::Tracker { tracking_index: 0.1 }),
    ] {
        let bytes = flat(&(estimator, 100.0))?;
        put("rate_filter", name, &[bytes, stream()].concat())?;
    }
    for model in [0, 1, 2, 252, 255] {
        for how in [0, 1, 8, 64 + 16] {
            let bytes = [vec![model, how], rows(2, if model < 3 { 200 } else { 120 })].concat();
            put("calibrate_log", &format!("{model}_{how}"), &bytes)?;
        }
    }
    for (which, columns) in [(0, 2), (1, 4), (3, 5)] {
        let bytes = [vec![which | 8 << 2], rows(columns, 150)].concat();
        put("diagnose_log", &which.to_string(), &bytes)?;
    }
    texts()
}

fn texts() -> Done {
    let csv =
        "time_s,length_mm,bridge_v\n0,180,1.24\n0.01,179.5,1.25\n0.02,179,1.27\n0.03,178,1.30\n";
    put("trial_csv", "plain", csv.as_bytes())?;
    put("recording_text", "plain", csv.as_bytes())?;
    put("recording_text", "units", b"Zeit (ms);Weg (mm);U [V]\n0;180,0;1,24\n10;179,5;1,25\n")?;
    put(
        "recording_text",
        "stamps",
        b"# a logger's\n2024-05-01T10:00:00.000Z\t1.5\n2024-05-01T10:00:00.010Z\t1.6\n",
    )?;
    let rig = stretch_sim::default_rig_text();
    put("rig_file", "stock", rig.as_bytes())?;
    put(
        "rig_file",
        "effect",
        format!("{rig}\n[effects]\ngauge_hysteresis = {{ h = 0.2, s = 0.012 }}\n").as_bytes(),
    )?;
    let set = "name = 'two'\nrate_hz = 100\nrig = 'rig.toml'\n[[trial]]\nfile = 'a.csv'\nkind = 'other'\nsplit = 'fit'\n\
         [[trial]]\nfile = 'b.csv'\nkind = 'other'\nsplit = 'test'\nstart_s = 30\n";
    put("data_set_toml", "two", set.as_bytes())?;
    put("data_set_folder", "two", [set, csv, csv, &rig].join("\0").as_bytes())?;
    let problem = "simulator = [\"python3\", \"servo.py\"]\nwrap = [\"input.delay\", \"output.backlash\"]\n\
         [[stage]]\nname = \"servo\"\noutput = \"angle_deg\"\ninputs = [\"command_V\"]\n\
         [[parameter]]\nname = \"gain\"\nvalue = 10\ntolerance = \"10 %\"\n[[trial]]\nfile = \"monday.csv\"\n";
    put("problem_toml", "servo", problem.as_bytes())?;
    let header =
        serde_json::json!({ "kind": "outputs", "models": [{ "samples": 2 }, { "error": "no" }] });
    let frame = WorkerFrame::bytes(&header, &[1.0, 2.0]);
    put("worker_frames", "two", &[frame.clone(), frame].concat())?;
    for (name, text) in [
        ("model", "history+rest"),
        ("poly", "poly35"),
        ("rate", "savgol:11,2,5"),
        ("difference", "difference:8"),
        ("adc", "12,0,3.3"),
    ] {
        put("spellings", name, text.as_bytes())?;
    }
    put("link_frames", "four", &link()?)
}

/// Frames as a board sends them, one of them twice and one lost.
fn link() -> Result<Vec<u8>, Box<dyn Error>> {
    let mut out = Vec::new();
    for counter in [0u32, 1, 1, 3, 4] {
        let frame = stretch_link::Frame {
            counter,
            time_ms: 10 * counter,
            code: 2000,
            answer: stretch_link::Answer::Warming,
        };
        let mut line = [0; stretch_link::Frame::LONGEST];
        out.extend_from_slice(frame.encode(&mut line));
    }
    Ok(out)
}
