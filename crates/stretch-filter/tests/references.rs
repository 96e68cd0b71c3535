//! Tests against values from exact arithmetic and from SciPy (`reference/filter/generate.py`).

use approx::abs_diff_eq;
use std::collections::HashMap;
use stretch_core::{Design, Hertz, Runner, SampleRate, Stage};
use stretch_filter::{
    Differentiator, LowPass, LowPassSpec, SgFilter, SgRate, SgShape, Tracker, TrackerSpec,
};
use testkit::{tolerance, vectors};

type Columns = HashMap<String, Vec<f64>>;

fn hundred() -> SampleRate {
    SampleRate::new(100.0).unwrap()
}

/// Returns the row numbers in which the named columns have these values.
fn rows(table: &Columns, key: &[(&str, f64)]) -> Vec<usize> {
    let count = table.values().next().unwrap().len();
    (0..count).filter(|&i| key.iter().all(|(name, v)| table[*name][i] == *v)).collect()
}

fn pick(table: &Columns, column: &str, rows: &[usize]) -> Vec<f64> {
    assert!(!rows.is_empty(), "no such rows");
    rows.iter().map(|&i| table[column][i]).collect()
}

#[track_caller]
fn assert_close(ours: &[f64], theirs: &[f64], relative: f64) {
    assert_eq!(ours.len(), theirs.len());
    let largest = theirs.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!(
            abs_diff_eq!(a, b, epsilon = relative * largest),
            "{i}: {a} against {b} (largest {largest})"
        );
    }
}

#[test]
fn taps_equal_exact_arithmetic() {
    let table = vectors::columns("filter/savgol_taps.csv");
    let starts = rows(&table, &[("lag", 0.0)]);
    assert_eq!(starts.len(), 13);
    for start in starts {
        let field = |name: &str| table[name][start] as usize;
        let (window, degree) = (field("window"), field("degree"));
        let shape = SgShape { window, degree, order: field("order"), delay: field("delay") };
        let ours = SgFilter::<f64, 64>::new(shape, hundred()).unwrap();
        let range = start..start + window;
        assert_close(ours.taps(), &table["exact"][range.clone()], tolerance::TAPS);
        // SciPy's taps lose accuracy with the condition number of its Vandermonde system.
        let lost = f64::EPSILON * table["condition"][start];
        assert_close(&table["scipy"][range], ours.taps(), tolerance::TAPS + lost);
    }
}

#[test]
fn the_typed_shape_has_the_taps_of_the_run_time_shape() {
    let typed = SgRate::<f64, 11, 3, 2>::new(hundred()).unwrap();
    let shape = SgShape { window: 11, degree: 3, order: 1, delay: 2 };
    let named = SgFilter::<f64, 64>::new(shape, hundred()).unwrap();
    assert_eq!(typed.taps(), named.taps());
}

#[test]
fn a_log_with_its_ends_equals_scipy() {
    let x = &vectors::columns("filter/signal.csv")["x"];
    let table = vectors::columns("filter/savgol_log.csv");
    for (window, degree, order) in [(11, 2, 1), (11, 2, 0), (25, 4, 1), (7, 3, 2)] {
        let key = [("window", window), ("degree", degree), ("order", order)];
        let key = key.map(|(name, v)| (name, v as f64));
        let shape = SgShape { window, degree, order, delay: window / 2 };
        let filter = SgFilter::<f64, 64>::new(shape, hundred()).unwrap();
        let mut y = vec![0.0; x.len()];
        filter.over_log(x, &mut y).unwrap();
        assert_close(&y, &pick(&table, "y", &rows(&table, &key)), tolerance::SOLVED_TAPS);
    }
}

fn live<const W: usize, const D: usize, const DELAY: usize>() {
    let x = &vectors::columns("filter/signal.csv")["x"];
    let table = vectors::columns("filter/savgol_live.csv");
    let key = [("window", W), ("degree", D), ("delay", DELAY)].map(|(n, v)| (n, v as f64));
    let mut rate = Runner::new(SgRate::<f64, W, D, DELAY>::new(hundred()).unwrap());
    let y: Vec<f64> = x.iter().filter_map(|&x| rate.step(x)).collect();
    assert_close(&y, &pick(&table, "y", &rows(&table, &key)), tolerance::SOLVED_TAPS);
}

#[test]
fn live_rates_equal_scipy() {
    live::<11, 2, 0>();
    live::<11, 2, 5>();
    live::<31, 3, 0>();
}

/// Returns the complex response at `frequency_hz`, computed from the sections' coefficients.
fn response<const N: usize>(filter: &LowPass<f64, N>, frequency_hz: f64) -> (f64, f64) {
    let w = std::f64::consts::TAU * frequency_hz / filter.spec().sample_rate.hz();
    let at = |c0: f64, c1: f64, c2: f64| {
        (c0 + c1 * w.cos() + c2 * (2.0 * w).cos(), -c1 * w.sin() - c2 * (2.0 * w).sin())
    };
    filter.sections().iter().fold((1.0, 0.0), |(re, im), section| {
        let c = section.spec();
        let ((nr, ni), (dr, di)) = (at(c.b0, c.b1, c.b2), at(1.0, c.a1, c.a2));
        let norm = dr * dr + di * di;
        let (hr, hi) = ((nr * dr + ni * di) / norm, (ni * dr - nr * di) / norm);
        (re * hr - im * hi, re * hi + im * hr)
    })
}

fn butterworth<const N: usize>() {
    let x = &vectors::columns("filter/signal.csv")["x"];
    let responses = vectors::columns("filter/butter_response.csv");
    let outputs = vectors::columns("filter/butter_output.csv");
    let gains = vectors::columns("filter/butter_gain.csv");
    for cutoff_hz in [0.5, 5.0, 20.0, 45.0] {
        let key = [("order", N as f64), ("cutoff_hz", cutoff_hz)];
        let spec = LowPassSpec { cutoff: Hertz(cutoff_hz), sample_rate: hundred() };
        let filter = spec.design::<f64, N>().unwrap();

        for i in rows(&responses, &key) {
            let (re, im) = response(&filter, responses["frequency_hz"][i]);
            let off = (re - responses["re"][i]).hypot(im - responses["im"][i]);
            assert!(off <= tolerance::RECURSIVE_OUTPUT, "order {N} at {cutoff_hz} Hz: {off}");
        }

        let mut memory = filter.settled_at(0.0); // SciPy starts from rest
        let y: Vec<f64> = x.iter().map(|&x| filter.step(&mut memory, x)).collect();
        let theirs = pick(&outputs, "y", &rows(&outputs, &key));
        assert_close(&y, &theirs, tolerance::RECURSIVE_OUTPUT);

        let gain = |column| pick(&gains, column, &rows(&gains, &key))[0];
        let noise_gain = gain("noise_gain");
        assert_close(&[filter.noise_gain()], &[noise_gain], tolerance::QUADRATURE);
        let delay_s = gain("delay_s");
        assert_close(&[filter.delay_s()], &[delay_s], tolerance::DELAY_FROM_PHASE);
        if N == 2 {
            let differentiator = Differentiator::<f64>::new(spec).unwrap();
            let noise_gain = gain("difference_noise_gain");
            assert_close(&[differentiator.noise_gain()], &[noise_gain], tolerance::QUADRATURE);
            // The closed form of one section agrees with the quadrature.
            let section = filter.sections()[0];
            assert_close(&[section.noise_gain()], &[filter.noise_gain()], tolerance::QUADRATURE);
        }
    }
}

#[test]
fn butterworth_equals_scipy() {
    butterworth::<1>();
    butterworth::<2>();
    butterworth::<3>();
    butterworth::<4>();
    butterworth::<5>();
    butterworth::<6>();
    butterworth::<7>();
    butterworth::<8>();
}

#[test]
fn tracker_gains_solve_the_riccati_equation() {
    let table = vectors::columns("filter/tracker_gains.csv");
    let one = SampleRate::new(1.0).unwrap();
    for (i, &tracking_index) in table["tracking_index"].iter().enumerate() {
        let tracker =
            Tracker::<f64>::new(TrackerSpec { tracking_index, sample_rate: one }).unwrap();
        let (alpha, beta) = (tracker.alpha(), tracker.beta());
        let ours = [alpha, beta, tracker.value_noise_gain(), tracker.noise_gain()];
        let names = ["alpha", "beta", "value_noise_gain", "rate_noise_gain"];
        for (ours, name) in ours.iter().zip(names) {
            assert_close(&[*ours], &[table[name][i]], tolerance::SOLVED_TAPS);
        }
        assert_eq!(tracker.memory().remaining(), tracker.warm_up());
    }
}
