//! Tests against values from SciPy, NumPy and mpmath (`reference/metrics/make.py`).

use approx::relative_eq;
use stretch_metrics::{
    Agreement, Delta, Pair, PairedBlocks, PairedT, TTest, fisher_f, lag,
    student_t::{critical, ln_two_tailed, two_tailed},
};
use testkit::{tolerance, vectors::columns};

#[track_caller]
fn close(what: &str, value: f64, expected: f64, relative: f64) {
    let near = relative_eq!(value, expected, epsilon = 0.0, max_relative = relative);
    assert!(near, "{what}: {value} for {expected}");
}

#[test]
fn errors_agreement_and_lag() {
    let signals = columns("metrics/signals.csv");
    let figures = columns("metrics/figures.csv");
    let truth = &signals["truth"];
    for (row, name) in ["first", "second"].into_iter().enumerate() {
        let estimate = &signals[name];
        let mut agreement = Agreement::new();
        for (&t, &e) in truth.iter().zip(estimate) {
            assert!(agreement.push(Pair { truth: t, estimate: e }));
        }
        let errors = agreement.errors();
        let lag = lag(truth, estimate, 20).expect("enough samples");
        for (figure, value) in [
            ("bias", errors.bias()),
            ("mae", errors.mae()),
            ("rmse", errors.rmse()),
            ("std_dev", errors.std_dev()),
            ("max_abs", errors.max_abs()),
            ("average_estimate", agreement.average_error_percent(Delta::Estimate)),
            ("average_truth", agreement.average_error_percent(Delta::Truth)),
            ("signed_estimate", agreement.signed_error_percent(Delta::Estimate)),
            ("signed_truth", agreement.signed_error_percent(Delta::Truth)),
            ("r_squared", agreement.r_squared()),
            ("correlation", agreement.correlation()),
            ("lag_correlation", Some(lag.correlation)),
        ] {
            let value = value.expect("there are samples");
            close(figure, value, figures[figure][row], tolerance::METRICS_SUMS);
        }
        close("lag", lag.samples, figures["lag"][row], tolerance::METRICS_LAG);
    }
}

#[test]
fn paired_tests_on_samples_and_blocks() {
    let signals = columns("metrics/signals.csv");
    let expected = columns("metrics/paired.csv");
    let (mut samples, mut blocks) = (PairedT::new(), PairedBlocks::new(50).expect("not empty"));
    for ((t, a), b) in signals["truth"].iter().zip(&signals["first"]).zip(&signals["second"]) {
        let (a, b) = ((a - t).abs(), (b - t).abs());
        samples.push(a - b);
        blocks.push(a - b);
    }
    let tests: [TTest; 2] = [samples.test().expect("spread"), blocks.test().expect("spread")];
    for (row, test) in tests.iter().enumerate() {
        close("t", test.t, expected["t"][row], tolerance::METRICS_SUMS);
        close("mean", test.mean_difference, expected["mean"][row], tolerance::METRICS_SUMS);
        close("low", test.interval_95.min, expected["low"][row], tolerance::METRICS_SUMS);
        close("high", test.interval_95.max, expected["high"][row], tolerance::METRICS_SUMS);
        // At P = 1e-240 a relative error of t is magnified by a factor of about t^2.
        close("p", test.p, expected["p"][row], tolerance::METRICS_TINY_P);
        assert_eq!(test.dof as f64, expected["dof"][row]);
    }
}

#[test]
fn student_t_of_any_size() {
    let table = columns("metrics/student_t.csv");
    let mut tiny = 0;
    for (row, &ln_p) in table["ln_p"].iter().enumerate() {
        let (t, dof, p) = (table["t"][row], table["dof"][row], table["p"][row]);
        let what = format!("t {t}, dof {dof}");
        let (found, within) = (ln_two_tailed(t, dof), tolerance::METRICS_LN_P);
        // relative to max(1, |ln P|)
        let near = relative_eq!(found, ln_p, epsilon = within, max_relative = within);
        assert!(near, "{what}: ln P {found} for {ln_p}");
        assert_eq!(ln_two_tailed(-t, dof), ln_two_tailed(t, dof), "{what}: two-tailed");
        if p > 1e-300 {
            close(&what, two_tailed(t, dof), p, tolerance::METRICS_P);
        } else {
            tiny += 1;
            assert!(two_tailed(t, dof) <= 1e-300, "{what}");
        }
    }
    assert!(tiny > 10, "the table reaches below the least f64");
}

#[test]
fn critical_values() {
    let table = columns("metrics/critical.csv");
    for (row, &t) in table["t"].iter().enumerate() {
        let (p, dof) = (table["p"][row], table["dof"][row]);
        close(&format!("p {p}, dof {dof}"), critical(p, dof), t, tolerance::METRICS_CRITICAL);
    }
    assert_eq!(critical(0.0, 5.0), f64::INFINITY);
    assert!(critical(f64::NAN, 5.0).is_nan() && critical(0.5, 0.0).is_nan());
}

#[test]
fn quantiles_agree_with_sixty_digits() {
    let table = columns("fit/quantiles.csv");
    for (row, expected) in table["t"].iter().enumerate() {
        let [level, terms, dof] = ["level", "terms", "dof"].map(|name| table[name][row]);
        let near =
            |a: f64, b| relative_eq!(a, b, epsilon = 0.0, max_relative = tolerance::FIT_QUANTILE);
        let t = critical(1.0 - level, dof);
        assert!(near(t, *expected), "t at {level} of {dof}: {t:?}");
        let f = fisher_f::critical(1.0 - level, terms as u16, dof as u64);
        assert!(near(f, table["f"][row]), "F at {level} of {terms}, {dof}: {f:?}");
    }
}

/// The tail is defined if t is infinite, also if the degrees of freedom are infinite at the same
/// time.
#[test]
fn an_infinite_t_has_a_tail_of_zero_for_any_degrees_of_freedom() {
    for dof in [1.0, 1e6, f64::INFINITY] {
        assert_eq!(two_tailed(f64::INFINITY, dof), 0.0, "{dof}");
        assert_eq!(ln_two_tailed(f64::INFINITY, dof), f64::NEG_INFINITY, "{dof}");
    }
}

#[test]
fn critical_values_of_extreme_levels_and_counts_stay_finite() {
    for level in [1e-300, 1e-9, 0.5, 1.0 - 1e-15] {
        for dof in [1, 2, 999, 1000, u64::MAX] {
            let t = critical(1.0 - level, dof as f64);
            assert!(t.is_finite(), "t at {level:e} of {dof}");
            let f = fisher_f::critical(1.0 - level, 21, dof);
            assert!(f.is_finite() && f >= 0.0, "F at {level:e} of {dof}: {f}");
        }
    }
}
