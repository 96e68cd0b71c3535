//! An offset of the signal does not change a calibration, in 64 bits and in 32. Also tests of calibrations of tables.

use stretch_calibrate::{
    ModelKind, Options, apply, calibrate, choose_model, fixed_record, parse_adc,
};
use stretch_core::{Calibration, Design, Model, Stage, Volts};
use stretch_data::{Channel, Trial};
use stretch_receptor::Receptor;

fn trial(name: &str, time_s: Vec<f64>, load_n: Vec<f64>, cell: Vec<f64>) -> Trial {
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("load_n", load_n), channel("cell", cell)];
    Trial { name: name.into(), time_s, channels }
}

/// Forty seconds of a load cell with the given offset and a range of 1, slightly non-linear and noisy.
fn cell(offset: f64) -> Trial {
    let time_s: Vec<f64> = (0..4000).map(|n| 0.01 * f64::from(n)).collect();
    let load = |t: f64| 0.5 + 0.32 * (0.9 * t).sin() + 0.15 * (2.3 * t + 1.0).sin();
    let mut noise = 1u32;
    let mut reading = |&t: &f64| {
        let u = load(t);
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 0.004 * (f64::from(noise) / f64::from(u32::MAX) - 0.5);
        offset + u + 0.15 * u * u - 0.1 * u * u * u + noise
    };
    let cell: Vec<f64> = time_s.iter().map(&mut reading).collect();
    let load_n = time_s.iter().map(|&t| 20.0 * load(t)).collect();
    trial("cell.csv", time_s, load_n, cell)
}

fn options(model: &str) -> Options {
    Options {
        signal: "cell".into(),
        reference: "load_n".into(),
        model: model.parse().unwrap(),
        ..Options::default()
    }
}

/// Root mean square error over a trial, and the estimates.
fn judged(trial: &Trial, estimates: impl Iterator<Item = Option<f64>>) -> (f64, Vec<f64>) {
    let truth = trial.require("load_n").unwrap();
    let estimates: Vec<f64> = estimates.map(|e| e.unwrap_or(f64::NAN)).collect();
    let errors = truth.iter().zip(&estimates).map(|(t, e)| (t - e).powi(2)).filter(|e| !e.is_nan());
    let errors: Vec<f64> = errors.collect();
    ((errors.iter().sum::<f64>() / errors.len() as f64).sqrt(), estimates)
}

fn in_64_bits(calibration: &Calibration, trial: &Trial) -> (f64, Vec<f64>) {
    let applied = apply(calibration, trial).unwrap();
    judged(trial, applied.readings.iter().map(|r| r.as_ref().ok().map(|r| r.estimate)))
}

fn in_32_bits(calibration: &Calibration, trial: &Trial) -> (f64, Vec<f64>) {
    let receptor = Receptor::<f32>::new(calibration).unwrap();
    let mut memory = receptor.memory();
    let signal = trial.require("cell").unwrap();
    let step = |v: &f64| receptor.step(&mut memory, Volts(*v as f32)).ok();
    judged(trial, signal.iter().map(step).map(|r| r.map(|r| f64::from(r.estimate))))
}

#[test]
fn an_offset_of_the_signal_changes_nothing() {
    for model in ["linear", "curve", "poly13", "poly15", "observer"] {
        let (here, options) = (cell(0.0), options(model));
        let about_zero = calibrate(std::slice::from_ref(&here), &options).unwrap();
        let (least, estimates) = in_64_bits(&about_zero.calibration, &here);
        for offset in [3.0, -30.0, 300.0, 4200.0] {
            let there = cell(offset);
            let calibrated = calibrate(std::slice::from_ref(&there), &options).unwrap();
            assert!(calibrated.fits.iter().all(|fit| fit.condition < 1e6), "{model} {offset}");
            let (rmse, found) = in_64_bits(&calibrated.calibration, &there);
            assert!((rmse / least - 1.0).abs() < 1e-3, "{model} {offset}: {least} {rmse}");
            let furthest = estimates.iter().zip(&found).map(|(a, b)| (a - b).abs());
            let furthest = furthest.filter(|d| !d.is_nan()).fold(0.0, f64::max);
            // The limit allows for the rounding of readings of about 4200, relative to a range of 1, in a rate over a
            // hundredth of a second.
            assert!(model == "observer" || furthest < 1e-6, "{model} {offset}: {furthest:e}");
            // An `f32` has 24 bits, of which 4200 takes 12.
            let (rmse, _) = in_32_bits(&calibrated.calibration, &there);
            assert!((rmse / least - 1.0).abs() < 0.02, "{model} {offset}: {least} {rmse} in f32");
        }
    }
}

/// A table of weights and readings in the given order.
fn table(readings: &[(f64, f64)]) -> Trial {
    let time_s = (0..readings.len()).map(|i| i as f64).collect();
    let (load_n, cell) = readings.iter().copied().unzip();
    trial("table.csv", time_s, load_n, cell)
}

/// Returns the degree of the curve that a table gives.
fn degree_of(readings: &[(f64, f64)], right: f64) -> u8 {
    let (table, options) = (table(readings), Options { is_table: true, ..options("curve") });
    let calibrated = calibrate(std::slice::from_ref(&table), &options).unwrap();
    let (rmse, estimates) = in_64_bits(&calibrated.calibration, &table);
    assert!(estimates.iter().all(|e| e.is_finite()), "from the first row on");
    assert!(rmse < right, "{rmse}");
    match &calibrated.calibration.spec().model {
        Model::Linear(_) => 1,
        Model::Surfaces { inflation, deflation } => {
            assert_eq!(inflation, deflation);
            inflation.surface.degree().volts()
        }
        other => panic!("{}", other.name()),
    }
}

/// Counts above the empty scale, in any order.
const COUNTS: [f64; 8] =
    [49_600.0, 0.0, 198_300.0, 9_900.0, 99_200.0, 19_800.0, 148_700.0, 5_000.0];

/// Weights that were noted with errors of up to 0.04, and their readings.
fn weights(bent: f64, draw: u32) -> Vec<(f64, f64)> {
    let mut noise = draw;
    let mut error = || {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.08 * (f64::from(noise) / f64::from(u32::MAX) - 0.5)
    };
    COUNTS.iter().map(|&x| (x / 99.19 + bent * x * x + error(), 84_213.0 + x)).collect()
}

#[test]
fn a_table_gives_a_line_or_a_curve_of_the_right_degree() {
    const DRAWS: u32 = 60;
    for (bent, degree) in [(0.0, 1), (2.5e-9, 2)] {
        let found: Vec<u8> = (0..DRAWS)
            .map(|k| degree_of(&weights(bent, k.wrapping_mul(2_654_435_769)), 0.1))
            .collect();
        assert!(found.iter().all(|&found| found >= degree), "{degree}: {found:?}");
        // By chance, the criterion of one standard error accepts a higher degree for one table in six: for 10 of 60,
        // with a standard deviation of 2.9. Two standard deviations more are allowed.
        let higher = found.iter().filter(|&&found| found > degree).count();
        assert!(higher <= 16, "{degree}: {found:?}");
    }
    let flex = |bend: f64| (bend, 412.0 + 2.4 * bend + 0.014 * bend * bend);
    assert!(degree_of(&Vec::from_iter((0..19).map(|k| flex(5.0 * f64::from(k)))), 0.2) >= 2);
}

#[test]
fn the_choice_for_a_table_is_between_a_line_and_a_curve() {
    let options = Options { is_table: true, ..options("curve") };
    let choice = choose_model(&[table(&weights(2.5e-9, 1))], &options).unwrap();
    let judged: Vec<&str> = choice.rows.iter().map(|row| row.model.as_str()).collect();
    assert_eq!(judged.len(), 2, "{judged:?}");
    assert_eq!(choice.model, ModelKind::Curve, "{}", choice.why);
    assert_eq!(choice.notes, Vec::<String>::new());
}

#[test]
fn a_line_answers_at_once_at_any_rate_and_on_one_row() {
    let readings: Vec<(f64, f64)> =
        (0..6).map(|k| (f64::from(k), 8.0 + 2.0 * f64::from(k))).collect();
    let options = Options { is_table: true, ..options("linear") };
    let calibration = calibrate(&[table(&readings)], &options).unwrap().calibration;
    for rows in [1, 2, 10, 12] {
        let stream: Vec<(f64, f64)> = (0..rows).map(|k| (0.0, 8.0 + f64::from(k))).collect();
        let mut stream = table(&stream);
        stream.time_s.iter_mut().for_each(|t| *t *= 0.1);
        let applied = apply(&calibration, &stream).unwrap();
        for (k, reading) in applied.readings.iter().enumerate() {
            let reading = reading.as_ref().unwrap();
            let held = (0.5 * k as f64).min(5.0);
            approx::assert_abs_diff_eq!(reading.estimate, held, epsilon = 1e-9);
            // From the tenth sample on the rate is known: the load rises by half a newton in each sample of 0.1 s.
            let is_known = (k >= 10).then(|| (reading.rate - 5.0).abs() < 1e-6);
            assert_eq!(is_known.unwrap_or(true), k >= 10 || reading.rate.is_nan(), "{reading:?}");
        }
        assert_eq!(applied.faults.missing + applied.faults.jittered, 0);
    }
}

#[test]
fn a_converter_of_24_bits_has_no_form_in_integers() {
    let calibration = calibrate(&[cell(4200.0)], &options("poly13")).unwrap().calibration;
    let wide = fixed_record(&calibration, &parse_adc("24,4199,4202").unwrap()).unwrap_err();
    assert!(wide.to_string().contains("24 bits") && wide.to_string().contains("float"), "{wide}");
    assert!(fixed_record(&calibration, &parse_adc("16,4199,4202").unwrap()).is_ok());
    assert!(parse_adc("25,0,1").unwrap_err().to_string().contains("1 to 24 bits"));
}
