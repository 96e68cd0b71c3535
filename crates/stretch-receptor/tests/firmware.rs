//! The firmware's data files and golden checksums equal those that this code makes on this host.
//!
//! After a change that is meant to alter them, write them anew with
//! `STRETCH_WRITE_FIRMWARE=1 cargo test -p stretch-receptor --test it firmware`.

use std::{fmt::Write, fs, path::PathBuf};

use stretch_core::{
    Calibration, CalibrationSpec, Design, DiagnosedMap, FitSummary, Hertz, HistoryMap,
    HistoryShape, Interval, LinearMap, Model, ObserverMap, RateEstimator, RestTracker, SampleRate,
    Stage, Values, Volts,
};
use stretch_filter::{Differentiator, IntegerSgRate, LowPassSpec, NamedRate, RateFilter, SgRate};
use stretch_receptor::{
    DiagnosedReceptor, HistoryReceptor, ObserverReceptor, Reading, StretchReceptor, Withheld,
    code::{Adc, AdcCode, AdcSpec, CodeReading, FixedCalibration, FixedObserver, FixedReceptor},
    example_calibration, example_diagnosed, example_observer,
};

#[path = "../../../firmware/src/checksum.rs"]
#[allow(missing_docs, missing_debug_implementations, unreachable_pub)]
mod checksum;
use checksum::Checksum;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../firmware")
}

/// Checks that a file has these bytes, or writes it.
fn same(name: &str, bytes: &[u8]) {
    let path = folder().join(name);
    if std::env::var_os("STRETCH_WRITE_FIRMWARE").is_some() {
        fs::write(&path, bytes).unwrap();
    }
    let found = fs::read(&path).unwrap_or_default();
    assert!(found == bytes, "{name} is not what this host makes; see the head of this test");
}

fn due() -> Adc {
    Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap()
}

/// Twenty seconds of the nominal rig's arbitrary trial at 100 Hz through a noisy
/// 12-bit converter, with gaps of one, three and five samples.
fn trial() -> Vec<u16> {
    // a row every 0.05 s
    let rows = testkit::vectors::columns("rig/arbitrary.csv").remove("nominal.bridge_v").unwrap();
    let mut seed = 0x2545_f491_4f6c_dd1du64;
    let mut uniform = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 40) as f64 / f64::from(1 << 24) - 0.5
    };
    let sample = |n: usize| {
        let at = n as f64 / 5.0;
        let (row, share) = (at.floor() as usize, at.fract());
        let next = rows[(row + 1).min(rows.len() - 1)];
        // four uniform numbers: nearly normal, a standard deviation of 2 mV
        let noise: f64 = (0..4).map(|_| uniform()).sum::<f64>() * 0.002 * 3f64.sqrt();
        let volts = rows[row.min(rows.len() - 1)] * (1.0 - share) + next * share + noise;
        due().code(volts).0 as u16
    };
    let mut codes: Vec<u16> = (0..2000).map(sample).collect();
    for gap in [400..401, 800..803, 1200..1205] {
        codes[gap].fill(u16::MAX);
    }
    codes
}

pub(crate) fn linear() -> Calibration {
    let mut spec = example_calibration().into_spec();
    spec.model = Model::Linear(LinearMap {
        slope: 0.97,
        intercept: 0.02,
        signal_domain: Interval { min: 1.1, max: 2.06 },
        fit: FitSummary { samples: 9000, r_squared: 0.968, rmse: 0.05 },
    });
    Calibration::new(spec).unwrap()
}

fn record<T: serde::Serialize>(name: &str, value: &T) {
    let mut buffer = [0; 4096];
    let bytes = stretch_core::record::store(value, &mut buffer).unwrap();
    same(&format!("data/{name}.postcard"), bytes);
}

fn codes(calibration: &Calibration) -> String {
    let calibration = FixedCalibration::<11, 2>::new(calibration, &due()).unwrap();
    let receptor = FixedReceptor::new(calibration);
    let (mut memory, mut checksum) = (receptor.memory(), Checksum::default());
    for code in trial() {
        let code = if code == u16::MAX { AdcCode::MISSING } else { AdcCode(code.into()) };
        checksum.answer(receptor.step(&mut memory, code));
    }
    format!("{:08x}", checksum.0)
}

fn volts<R: Stage<f32, Out = Option<f32>> + NamedRate>(
    calibration: &Calibration,
    rate: R,
) -> String {
    volts_of(StretchReceptor::with_rate(calibration, rate).unwrap())
}

fn volts_of<S>(receptor: S) -> String
where
    S: Stage<Volts<f32>, Out = Result<Reading<f32>, Withheld>>,
{
    let (mut memory, mut checksum) = (receptor.memory(), Checksum::default());
    for code in trial() {
        let volts = if code == u16::MAX { f32::NAN } else { f32::from(code) * (3.3 / 4095.0) };
        let answer = receptor.step(&mut memory, Volts(volts)).map(|reading| CodeReading {
            estimate: reading.estimate,
            branch: reading.branch,
            domain: reading.domain,
        });
        checksum.answer(answer);
    }
    format!("{:08x}", checksum.0)
}

/// Returns the calibration with the name of another estimator. The program then computes with that estimator, although
/// the calibration was fitted with a different one.
fn named(calibration: &Calibration, rate_estimator: RateEstimator) -> Calibration {
    let spec = CalibrationSpec { rate_estimator, ..calibration.clone().into_spec() };
    Calibration::new(spec).unwrap()
}

fn with(model: Model) -> Calibration {
    Calibration::new(CalibrationSpec { model, ..example_calibration().into_spec() }).unwrap()
}

const REST: RestTracker = RestTracker { level: 1.105, catch_up_s: 0.5, leak: 0.001 };

/// A map of the largest shape that `stretch calibrate` may choose. The cost of a step depends on the shape, and hardly
/// on the values of the coefficients.
fn history(rest: Option<RestTracker>) -> Calibration {
    let (relaxations_s, radii, degree) = ([0.1, 0.4], [0.15], 5);
    let states = 1 + relaxations_s.len() + radii.len();
    let terms = HistoryShape { states, degree, memory_degree: degree }.terms();
    let mut coefficients: Vec<f64> =
        (0..terms).map(|k| 0.02 * f64::from((k % 7) as u8) - 0.06).collect();
    (coefficients[0], coefficients[1]) = (0.5, 0.5);
    let (mut min, mut max) = (vec![-0.3; states], vec![0.3; states]);
    (min[0], max[0]) = (-0.1, 0.9);
    with(Model::History(HistoryMap {
        rest,
        relaxations_s: Values::new("relaxations_s", &relaxations_s).unwrap(),
        radii: Values::new("radii", &radii).unwrap(),
        degree,
        memory_degree: degree,
        state_min: Values::new("state_min", &min).unwrap(),
        state_max: Values::new("state_max", &max).unwrap(),
        coefficients: Values::new("coefficients", &coefficients).unwrap(),
        estimate_domain: Interval { min: 0.0, max: 1.0 },
        fit: FitSummary { samples: 9000, r_squared: 0.99, rmse: 0.01 },
    }))
}

/// Name of the model, name of its file, and its calibration.
fn histories() -> [(&'static str, &'static str, Calibration); 2] {
    let (plain, followed) = (history(None), history(Some(REST)));
    [("history", "history", plain), ("history+rest", "history-rest", followed)]
}

fn observers() -> [(&'static str, &'static str, Calibration); 2] {
    let followed = example_observer();
    let Model::Observer(map) = followed.spec().model else { unreachable!() };
    let spec = CalibrationSpec {
        model: Model::Observer(ObserverMap { rest: None, ..map }),
        ..followed.clone().into_spec()
    };
    let plain = Calibration::new(spec).unwrap();
    [("observer", "observer", plain), ("observer+rest", "observer-rest", followed)]
}

fn diagnosed() -> [(&'static str, &'static str, Calibration); 2] {
    let plain = example_diagnosed();
    let Model::Diagnosed(map) = plain.spec().model else { unreachable!() };
    let rest = Some(RestTracker { level: 1.243, catch_up_s: 0.02, leak: 0.0 });
    let spec = CalibrationSpec {
        model: Model::Diagnosed(DiagnosedMap { rest, ..map }),
        ..plain.clone().into_spec()
    };
    let followed = Calibration::new(spec).unwrap();
    [("diagnosed", "diagnosed", plain), ("diagnosed+rest", "diagnosed-rest", followed)]
}

fn fixed_observer(calibration: &Calibration) -> String {
    let receptor = FixedObserver::new(calibration, &due()).unwrap();
    let (mut memory, mut checksum) = (receptor.memory(), Checksum::default());
    for code in trial() {
        let code = if code == u16::MAX { AdcCode::MISSING } else { AdcCode(code.into()) };
        checksum.answer(receptor.step(&mut memory, code));
    }
    format!("{:08x}", checksum.0)
}

#[test]
fn the_trial_and_the_records_are_these() {
    let bytes: Vec<u8> = trial().into_iter().flat_map(u16::to_le_bytes).collect();
    same("data/trial.u16le", &bytes);
    for (name, calibration) in [("poly13", example_calibration()), ("linear", linear())] {
        record(name, &calibration);
        let fixed = FixedCalibration::<11, 2>::new(&calibration, &due()).unwrap();
        record(&format!("{name}-fixed"), &fixed);
    }
    for (_, name, calibration) in histories() {
        record(name, &calibration);
    }
    for (_, name, calibration) in observers() {
        record(name, &calibration);
        let fixed = FixedObserver::new(&calibration, &due()).unwrap();
        record(&format!("{name}-fixed"), &fixed);
    }
    for (_, name, calibration) in diagnosed() {
        record(name, &calibration);
    }
}

#[test]
fn the_golden_checksums_are_these() {
    let (poly13, linear) = (example_calibration(), linear());
    let hz = SampleRate::new(100.0).unwrap();
    let low_pass = LowPassSpec { cutoff: Hertz(5.0), sample_rate: hz };
    let tracker = RateEstimator::Tracker { tracking_index: 0.1 };
    let sg = SgRate::<f32, 11, 2>::new(hz).unwrap();
    let differentiated = named(&poly13, RateEstimator::Differentiator { cutoff_hz: 5.0 });
    let golden = [
        ("poly13-fixed", codes(&poly13)),
        ("linear-fixed", codes(&linear)),
        ("poly13-f32-volts", volts(&poly13, sg)),
        ("linear-f32-volts", volts(&linear, sg)),
        ("poly13-f32-volts-integer", volts(&poly13, IntegerSgRate::<11, 2>::new(hz, 3.3).unwrap())),
        (
            "poly13-f32-differentiator",
            volts(&differentiated, Differentiator::new(low_pass).unwrap()),
        ),
        (
            "poly13-f32-tracker",
            volts(&named(&poly13, tracker), RateFilter::<f32>::new(tracker, hz).unwrap()),
        ),
    ];
    let mut text = String::from("# made by the test `firmware` of stretch-receptor on a host\n");
    let mut golden: Vec<(String, String)> =
        golden.into_iter().map(|(model, checksum)| (model.to_owned(), checksum)).collect();
    for (model, _, calibration) in histories() {
        golden.push((
            model.to_owned(),
            volts_of(HistoryReceptor::with_rate(&calibration, sg).unwrap()),
        ));
    }
    for (model, _, calibration) in observers() {
        let receptor = ObserverReceptor::<f32>::new(&calibration).unwrap();
        golden.push((model.to_owned(), volts_of(receptor)));
        golden.push((format!("{model}-fixed"), fixed_observer(&calibration)));
    }
    for (model, _, calibration) in diagnosed() {
        let receptor = DiagnosedReceptor::<f32>::new(&calibration).unwrap();
        golden.push((model.to_owned(), volts_of(receptor)));
    }
    for (model, checksum) in golden {
        writeln!(text, "model={model} checksum={checksum}").unwrap();
    }
    // the line of the model `gauges` comes from the corresponding test of stretch-sleeve
    let found = fs::read_to_string(folder().join("golden.txt")).unwrap();
    found.lines().filter(|line| line.starts_with("model=gauges ")).for_each(|line| {
        writeln!(text, "{line}").unwrap();
    });
    same("golden.txt", text.as_bytes());
}
