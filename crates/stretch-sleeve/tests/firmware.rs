//! The firmware's calibration of several gauges and its golden checksum are those that this code produces on this host.
//!
//! After an intended change of either, write both again with `STRETCH_WRITE_FIRMWARE=1 cargo test -p stretch-sleeve
//! --test it firmware`.

use std::{fs, path::PathBuf};

use stretch_core::{
    Design, HistoryShape, Interval, Label, Provenance, SampleRate, Schema, Stage, Values,
};
use stretch_sleeve::{
    ArrayCalibration, ArrayChannel, ArrayGains, ArrayReceptor, ArraySpec, array_bytes,
};

#[path = "../../../firmware/src/checksum.rs"]
#[allow(missing_docs, missing_debug_implementations, unreachable_pub)]
mod checksum;
use checksum::Checksum;

#[path = "../../../firmware/src/gauges.rs"]
#[allow(missing_docs, unreachable_pub)]
mod gauges;

fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../firmware").join(name)
}

fn writes() -> bool {
    std::env::var_os("STRETCH_WRITE_FIRMWARE").is_some()
}

/// Returns the trial of the firmware as converter codes. A missing sample is `u16::MAX`.
fn trial() -> Vec<u16> {
    let bytes = fs::read(file("data/trial.u16le")).unwrap();
    bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
}

/// Four gauges with two time constants each and products of two states.
fn several() -> ArrayCalibration<{ gauges::GAUGES }> {
    let count = gauges::GAUGES;
    let gain = |k: usize| f64::from(gauges::gain(k));
    let shape = HistoryShape { states: 3, degree: 2, memory_degree: 1 };
    let own: Vec<f64> = (1..shape.terms()).map(|t| 2.0 / t as f64).collect();
    let channel = |k: usize| {
        let follows: Vec<f64> = (0..count)
            .map(|j| if j == k { 0.0 } else { gain(k) / gain(j) / (count - 1) as f64 })
            .collect();
        ArrayChannel {
            signal: Label::new(&format!("gauge_{k}_v")).unwrap(),
            state_min: Values::new("state_min", &[1.1, -0.3, -0.3].map(|x| x * gain(k))).unwrap(),
            state_max: Values::new("state_max", &[2.1, 0.3, 0.3].map(|x| x * gain(k))).unwrap(),
            possible: Interval { min: 0.5 * gain(k), max: 3.0 * gain(k) },
            still_samples: 12,
            follows: Values::new("follows", &follows).unwrap(),
            largest_jump: 0.2 * gain(k),
        }
    };
    let gains = |uses: &dyn Fn(usize) -> bool| ArrayGains {
        constant: 45.0,
        terms: (0..count)
            .map(|k| if uses(k) { Values::new("terms", &own).unwrap() } else { Values::EMPTY })
            .collect(),
        sd: 2.0,
    };
    ArrayCalibration::new(ArraySpec {
        schema: Schema::CURRENT,
        reference: Label::new("angle_deg").unwrap(),
        sample_rate_hz: SampleRate::new(100.0).unwrap(),
        relaxations_s: Values::new("relaxations_s", &[0.05, 0.5]).unwrap(),
        degree: shape.degree,
        memory_degree: shape.memory_degree,
        estimate_domain: Interval { min: 0.0, max: 90.0 },
        channels: (0..count).map(channel).collect(),
        all: gains(&|_| true),
        without: (0..count).map(|lost| gains(&|k| k != lost)).collect(),
        alone: (0..count).map(|only| gains(&|k| k == only)).collect(),
        shifts: None,
        provenance: Provenance::new("", ["simulated"]),
    })
    .unwrap()
}

fn several_in_f32() -> String {
    let receptor = ArrayReceptor::<f32, { gauges::GAUGES }>::new(&several());
    let (mut memory, mut checksum) = (receptor.memory(), Checksum::default());
    for code in trial() {
        let volts = if code == u16::MAX { f32::NAN } else { f32::from(code) * (3.3 / 4095.0) };
        let reading = receptor.step(&mut memory, gauges::samples(volts));
        assert!(reading.is_ok_and(|r| r.lost == 0) || code == u16::MAX, "{reading:?}");
        checksum.answer(gauges::answer(reading));
    }
    format!("{:08x}", checksum.0)
}

#[test]
fn the_record_and_the_golden_checksum_are_these() {
    let record = array_bytes(&several()).unwrap();
    if writes() {
        fs::write(file("data/gauges.postcard"), &record).unwrap();
    }
    assert!(fs::read(file("data/gauges.postcard")).unwrap() == record, "gauges.postcard");
    let line = format!("model=gauges checksum={}", several_in_f32());
    let golden = fs::read_to_string(file("golden.txt")).unwrap();
    if writes() {
        let others: String = golden
            .lines()
            .filter(|line| !line.starts_with("model=gauges "))
            .map(|line| format!("{line}\n"))
            .collect();
        fs::write(file("golden.txt"), format!("{others}{line}\n")).unwrap();
    } else {
        assert!(golden.lines().any(|own| own == line), "golden.txt has no {line}");
    }
}
