//! Named defects act on a target as their equations state.

use approx::assert_abs_diff_eq;
use proptest::prelude::*;
use stretch_core::{DiagnosedMap, Fading, Model, arithmetic::lag_weights};
use stretch_receptor::{Defects, example_diagnosed};
use testkit::tolerance::RECURSIVE_OUTPUT;

const PERIOD_S: f64 = 0.01;

fn map() -> DiagnosedMap {
    let Model::Diagnosed(map) = example_diagnosed().spec().model else { unreachable!() };
    DiagnosedMap { slip: None, relaxation: None, ..map }
}

/// Outputs of a lag that has rested at the first input.
fn lagged(inputs: &[f64], tau_s: f64) -> Vec<f64> {
    let [a, b, c] = lag_weights(PERIOD_S, tau_s);
    let (mut z, mut before) = (inputs[0], inputs[0]);
    inputs
        .iter()
        .map(|&x| {
            z = a * z + b * before + c * x;
            before = x;
            z
        })
        .collect()
}

fn driven(map: &DiagnosedMap, targets: &[f64]) -> Vec<f64> {
    let defects = Defects::<f64>::new(map, PERIOD_S);
    let mut memory = defects.begin(targets[0], 0.0);
    targets.iter().map(|&y| defects.advance(&mut memory, y, 0.0)).collect()
}

fn targets() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-0.2..1.2f64, 2..60)
}

fn tau_s() -> impl Strategy<Value = f64> {
    0.001..20.0f64
}

proptest! {
    #[test]
    fn what_fades_is_a_share_of_the_way_from_three_lags(
        targets in targets(), taus_s in [tau_s(), tau_s(), tau_s()], share in -0.9..1.0f64,
    ) {
        let map = DiagnosedMap { relaxation: Some(Fading { share, taus_s }), ..map() };
        let lags = taus_s.map(|tau| lagged(&targets, tau));
        for (n, (u, y)) in driven(&map, &targets).into_iter().zip(&targets).enumerate() {
            let mean = lags.iter().map(|z| z[n]).sum::<f64>() / 3.0;
            assert_abs_diff_eq!(u, y + share * (y - mean), epsilon = RECURSIVE_OUTPUT);
        }
    }

    #[test]
    fn a_slow_amplifier_is_a_lag_behind_a_lag(
        targets in targets(), taus_s in [tau_s(), tau_s()],
    ) {
        let map = DiagnosedMap { lowpass_s: Some(taus_s), ..map() };
        let expected = lagged(&lagged(&targets, taus_s[0]), taus_s[1]);
        for (u, z) in driven(&map, &targets).into_iter().zip(expected) {
            assert_abs_diff_eq!(u, z, epsilon = RECURSIVE_OUTPUT);
        }
    }
}
