//! A Prandtl-Ishlinskii operator and its inverse undo each other.

use approx::assert_abs_diff_eq;
use proptest::prelude::*;
use stretch_core::{Hysteresis, Runner};
use testkit::tolerance as tol;

fn operator() -> impl Strategy<Value = Hysteresis> {
    let plays = proptest::collection::vec((0.01..0.3f64, -0.8..1.5f64), 0..=4);
    (0.3..3.0f64, plays).prop_filter_map("a falling branch", |(gain, plays)| {
        let (mut radius, mut radii, mut weights) = (0.0, Vec::new(), Vec::new());
        for (step, weight) in plays {
            radius += step;
            radii.push(radius);
            weights.push(weight);
        }
        let mut slope = gain;
        // slopes well above zero, so that the inverse is well conditioned
        let rises = weights.iter().all(|w| {
            slope += w;
            slope > 0.1
        });
        rises.then(|| Hysteresis::new(gain, &radii, &weights).expect("rising branches"))
    })
}

proptest! {
    #[test]
    fn inverse_after_operator_is_identity(
        forward in operator(),
        path in proptest::collection::vec(-1.0..1.0f64, 1..200),
    ) {
        let inverse = forward.inverse().unwrap();
        let (mut there, mut back) = (Runner::new(forward), Runner::new(inverse));
        for x in path {
            let y: f64 = there.step(x);
            let found: f64 = back.step(y);
            assert_abs_diff_eq!(found, x, epsilon = tol::HYSTERESIS_INVERSE);
        }
    }

    #[test]
    fn inverse_of_inverse_is_the_operator(forward in operator(), x in -1.0..1.0f64) {
        let twice = forward.inverse().unwrap().inverse().unwrap();
        let (a, b): (f64, f64) = (Runner::new(forward).step(x), Runner::new(twice).step(x));
        assert_abs_diff_eq!(a, b, epsilon = tol::HYSTERESIS_INVERSE);
    }
}

#[test]
fn what_cannot_be_inverted_is_refused() {
    assert!(Hysteresis::new(1.0, &[0.1], &[-1.0]).is_err());
    assert!(Hysteresis::new(1.0, &[0.2, 0.1], &[0.1, 0.1]).is_err());
    assert!(Hysteresis::new(0.0, &[], &[]).is_err());
}
