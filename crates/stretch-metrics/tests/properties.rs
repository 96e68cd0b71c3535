//! Property tests that must hold for any signals.

use approx::{assert_abs_diff_eq, relative_eq};
use proptest::prelude::*;
use stretch_core::Interval;
use stretch_metrics::{
    Agreement, Delta, Pair, PairedBlocks, PairedT, lag, student_t::ln_two_tailed,
};
use testkit::tolerance;

fn agreement(pairs: &[(f64, f64)]) -> Agreement<f64> {
    let mut all = Agreement::new();
    for &(truth, estimate) in pairs {
        all.push(Pair { truth, estimate });
    }
    all
}

/// Returns all metrics of an agreement in a fixed order.
fn figures(a: &Agreement<f64>) -> Vec<Option<f64>> {
    let e = a.errors();
    let mut all = vec![e.bias(), e.mae(), e.rmse(), e.std_dev(), e.max_abs()];
    for delta in [Delta::Estimate, Delta::Truth] {
        all.push(a.average_error_percent(delta));
        all.push(a.signed_error_percent(delta));
        all.push(a.rmse_percent(delta));
    }
    all.extend([a.r_squared(), a.correlation()]);
    all
}

fn same(a: &[Option<f64>], b: &[Option<f64>], within: f64) -> Result<(), TestCaseError> {
    for (i, pair) in a.iter().zip(b).enumerate() {
        match pair {
            (Some(a), Some(b)) => {
                // relative to max(1, value)
                let near = relative_eq!(a, b, epsilon = within, max_relative = within);
                prop_assert!(near, "figure {i}: {a} and {b}");
            }
            (a, b) => prop_assert_eq!(a, b),
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn merge_is_concatenation_in_any_order(
        a in stretch_strategies::pairs(0..60),
        b in stretch_strategies::pairs(0..60),
        c in stretch_strategies::pairs(0..60),
    ) {
        let whole = figures(&agreement(&[a.clone(), b.clone(), c.clone()].concat()));
        let [a, b, c] = [a, b, c].map(|pairs| agreement(&pairs));
        for order in [[&a, &b, &c], [&c, &a, &b], [&b, &c, &a]] {
            let mut merged = Agreement::new();
            order.iter().for_each(|part| merged.merge(part));
            same(&figures(&merged), &whole, tolerance::METRICS_MERGE)?;
        }
    }

    #[test]
    fn magnitudes_are_ordered(pairs in stretch_strategies::pairs(1..200)) {
        let all = agreement(&pairs);
        let e = all.errors();
        let [bias, mae, rmse, max] =
            [e.bias(), e.mae(), e.rmse(), e.max_abs()].map(|x| x.expect("not empty"));
        let slack = max * tolerance::F64_ROUNDING;
        prop_assert!(bias.abs() <= mae + slack && mae <= rmse + slack && rmse <= max + slack);
        let r = all.correlation();
        prop_assert!(r.is_none_or(|r| (-1.0..=1.0).contains(&r)));
        if let (Some(r), Some(r_squared)) = (r, all.r_squared()) {
            prop_assert!(r_squared <= r * r + tolerance::METRICS_MERGE, "no line does better");
        }
    }

    #[test]
    fn scale_and_shift(
        pairs in stretch_strategies::pairs(2..100),
        scale in 0.01..100.0,
        shift in -1e3..1e3,
    ) {
        let before = agreement(&pairs);
        let moved: Vec<_> =
            pairs.iter().map(|&(t, e)| (scale * t + shift, scale * e + shift)).collect();
        let after = agreement(&moved);
        let (before, after) = (figures(&before), figures(&after));
        // The first five have the unit of the signals, the others are dimensionless.
        let scaled: Vec<_> = before[..5].iter().map(|x| x.map(|x| scale * x)).collect();
        same(&after[..5], &scaled, tolerance::METRICS_SHIFT)?;
        // If range and SST are small compared with the rounding error of the shift, the results have no correct digits
        // to compare.
        let spread = pairs.iter().map(|p| p.0).fold(f64::MIN, f64::max)
            - pairs.iter().map(|p| p.0).fold(f64::MAX, f64::min);
        if spread > 1.0 {
            same(&after[5..], &before[5..], tolerance::METRICS_SHIFT)?;
        }
    }

    #[test]
    fn nothing_that_is_not_finite_comes_out(pairs in stretch_strategies::faulty_pairs(0..40)) {
        let all = agreement(&pairs);
        prop_assert_eq!(all.count() + all.skipped(), pairs.len() as u64);
        for figure in figures(&all).into_iter().flatten() {
            prop_assert!(figure.is_finite(), "{all:?}");
        }
        let (mut test, mut blocks) = (PairedT::new(), PairedBlocks::new(3)?);
        for &(a, b) in &pairs {
            prop_assert_eq!(test.push(a - b), blocks.push(a - b));
        }
        for result in [test.test(), blocks.test()].into_iter().flatten() {
            prop_assert!(result.t.is_finite() && result.ln_p <= 0.0, "{result:?}");
        }
        let (truth, estimate): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
        if let Ok(lag) = lag(&truth, &estimate, 4) {
            prop_assert!(lag.samples.abs() <= 4.5 && lag.correlation.abs() <= 1.0);
        }
    }

    #[test]
    fn a_lag_is_found_and_is_antisymmetric((expected, truth, estimate) in stretch_strategies::lagged(400)) {
        let found = lag(&truth, &estimate, 12)?;
        assert_abs_diff_eq!(found.samples, expected, epsilon = tolerance::METRICS_LAG_PARABOLA);
        prop_assert!(found.correlation >= found.correlation_at_zero && !found.at_limit);
        let back = lag(&estimate, &truth, 12)?;
        assert_abs_diff_eq!(back.samples, -found.samples, epsilon = tolerance::METRICS_SHIFT);
    }

    #[test]
    fn swapping_the_pairs_turns_the_test_round(pairs in stretch_strategies::pairs(3..80)) {
        let (mut one, mut other) = (PairedT::new(), PairedT::new());
        for &(a, b) in &pairs {
            one.push(a - b);
            other.push(b - a);
        }
        let (one, other) = (one.test()?, other.test()?);
        prop_assert_eq!((one.t, one.p, one.dof), (-other.t, other.p, other.dof));
        let turned = Interval { min: -other.interval_95.max, max: -other.interval_95.min };
        prop_assert_eq!(one.interval_95, turned);
        // The 95 % interval excludes 0 if and only if P is below 0.05.
        let outside = one.interval_95.min > 0.0 || one.interval_95.max < 0.0;
        prop_assert_eq!(outside, one.p < 0.05);
    }

    #[test]
    fn p_falls_with_t(dof in 0.5..1e6_f64, t in 0.0..50.0_f64, more in 1e-3..10.0_f64) {
        prop_assert!(ln_two_tailed(t + more, dof) < ln_two_tailed(t, dof));
    }
}
