//! Compares every factor and passage with its equation.

use super::{DT_S, inputs, signal, wave};
use crate::missing::term::{
    Factor::{self, *},
    Passage, RateForm, Term,
};
use approx::assert_abs_diff_eq;
use testkit::tolerance::LOCAL_VALUE;

/// Values of a single factor over one trial of a signal.
fn of(factor: Factor, x: &[f64]) -> Vec<f64> {
    let inputs = inputs(vec![signal("x", x.to_vec(), false)], &[x.len()]);
    Term::new(&[factor], Passage::Direct).values(&inputs, 1)
}

fn assert_like(found: &[f64], expected: impl Iterator<Item = f64>) {
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < LOCAL_VALUE, "sample {i}: {found} for {expected}");
    }
}

#[test]
fn curves_are_what_their_equations_say() {
    let x = wave(400);
    type Curve = (Factor, fn(f64) -> f64);
    let each: [Curve; 8] = [
        (Centred { signal: 0, at: 0.4, power: 3 }, |x| (x - 0.4) * (x - 0.4) * (x - 0.4)),
        (Power { signal: 0, power: 1.5 }, |x| x.powf(1.5)),
        (Power { signal: 0, power: 3.0 }, |x| x * x * x),
        (Above { signal: 0, at: 0.3, power: 2.0 }, |x| (x - 0.3).max(0.0).powi(2)),
        (Below { signal: 0, at: 0.3, power: 1.0 }, |x| (0.3 - x).max(0.0)),
        (Low { signal: 0, width: 0.1 }, |x| (-x / 0.1).exp()),
        (High { signal: 0, width: 0.1 }, |x| (-(1.0 - x) / 0.1).exp()),
        (Sine { signal: 0, turns: 2.0 }, |x| (std::f64::consts::TAU * 2.0 * x).sin()),
    ];
    for (factor, law) in each {
        assert_like(&of(factor, &x), x.iter().map(|x| law(*x)));
    }
}

/// A signal may go below its fitted range in a test trial. There, a fractional power would not be
/// real and an exponential could become huge. The factors therefore keep their value at the lower
/// end of the range.
#[test]
fn below_its_range_a_signal_counts_as_its_least() {
    let x = [-0.5, -0.01, 0.0, 0.2];
    for factor in [Power { signal: 0, power: 0.5 }, Low { signal: 0, width: 0.015 }] {
        let found = of(factor, &x);
        assert_eq!(found[0], found[2]);
        assert!(found.iter().all(|y| y.is_finite()));
    }
    assert_eq!(of(High { signal: 0, width: 0.1 }, &[1.5]), [1.0]);
}

#[test]
fn forms_of_the_rate_are_even_or_odd_as_friction_is() {
    use RateForm::{Linear, Magnitude, Rising, Sign, SignedRoot, SignedSquare, Square, Striction};
    let (x, back): (Vec<f64>, Vec<f64>) =
        (0..100).map(|i| (0.01 * f64::from(i), 1.0 - 0.01 * f64::from(i))).unzip();
    let at = |form, x: &[f64]| of(Rate { signal: 0, form }, x)[50];
    for odd in [Linear, SignedSquare, SignedRoot, Sign, Striction] {
        assert_abs_diff_eq!(at(odd, &x), -at(odd, &back), epsilon = LOCAL_VALUE);
    }
    for even in [Magnitude, Square] {
        assert_abs_diff_eq!(at(even, &x), at(even, &back), epsilon = LOCAL_VALUE);
    }
    // The rate v is 1 here, in ranges per second.
    for form in [Linear, Magnitude, Square, SignedSquare, SignedRoot, Rising] {
        assert_abs_diff_eq!(at(form, &x), 1.0, epsilon = LOCAL_VALUE);
    }
    assert_eq!(at(Rising, &back), 0.0);
    assert!((at(Sign, &x) - 1.0).abs() < 1e-8 && at(Striction, &x) < 0.04);
}

/// For a motion x in one direction from 0, x - play(x, w) equals x until the motion exceeds the
/// half-width w, and w afterwards.
#[test]
fn a_play_follows_its_width_behind() {
    let x: Vec<f64> = (0..200).map(|i| 0.005 * f64::from(i)).collect();
    let held = of(Play { signal: 0, width: 0.1 }, &x);
    assert_like(&held, x.iter().map(|x| x.min(0.1)));
}

/// A lag follows a ramp of slope r at a distance of r tau, once the initial transient has decayed.
#[test]
fn a_lag_of_a_ramp_is_its_slope_times_its_time() {
    let x: Vec<f64> = (0..2000).map(|i| 0.0005 * f64::from(i)).collect();
    let behind = of(Lag { signal: 0, tau_s: 0.5 }, &x);
    // The result may differ by the rise of the ramp in half a sample time, because the lag may
    // interpolate or hold the ramp between samples.
    let expected = 0.05 * 0.5;
    assert!((behind[1999] - expected).abs() <= 0.05 * 0.5 * DT_S + LOCAL_VALUE, "{}", behind[1999]);
    assert_eq!(behind[0], 0.0);
}

#[test]
fn a_delay_is_exact_on_a_ramp_and_holds_the_first_value() {
    let x: Vec<f64> = (0..300).map(|i| 0.003 * f64::from(i)).collect();
    for samples in [0.0_f64, 2.0, 12.5, 30.0] {
        let late = of(Late { signal: 0, delay_s: samples * DT_S }, &x);
        let expected = x.iter().map(|x| (x - 0.003 * samples).max(0.0) - x);
        assert_like(&late, expected);
    }
}

#[test]
fn peaks_and_turns_remember_what_they_should() {
    let x = wave(630); // up and down, twice
    let peak = of(Peak { signal: 0 }, &x);
    assert!(peak[..150].iter().all(|p| *p == 0.0), "it rises");
    assert_abs_diff_eq!(peak[314], 1.0, epsilon = 1e-3); // back at the bottom, as far as samples meet it
    let turned = of(Turned { signal: 0, width: 0.1 }, &x);
    assert!(turned.iter().all(|t| t.abs() <= 1.0));
    // The signal moved by 1 since the last turn: the value is the sign times 1 - exp(-10).
    assert!(turned[150] > 0.999 && turned[310] < -0.999, "{} {}", turned[150], turned[310]);
}

#[test]
fn travel_counts_both_ways_and_no_noise() {
    let x = wave(629); // two ways up, two down: 4 ranges
    let far = of(Travel { signal: 0, power: 1.0 }, &x);
    // The play that removes noise, a hundredth of the range wide, loses distance at each of the
    // three turns and at the end.
    assert!((far[628] - 4.0).abs() < 0.1, "{}", far[628]);
    assert!(far.windows(2).all(|pair| pair[0] <= pair[1]));
    let rest: Vec<f64> = (0..500).map(|i| 0.5 + 0.004 * f64::from(i % 3 - 1)).collect();
    assert_eq!(of(Travel { signal: 0, power: 1.0 }, &rest)[499], 0.0);
    assert_eq!(of(TravelFade { signal: 0, width: 2.0 }, &rest)[499], 1.0);
}

#[test]
fn clocks_begin_with_the_trial_or_with_the_session() {
    let inputs = inputs(vec![signal("x", wave(400), false)], &[200, 200]);
    let of = |factor| Term::new(&[factor], Passage::Direct).values(&inputs, 2);
    let time = of(Time { power: 1.0 });
    assert_eq!((time[0], time[200]), (0.0, 0.0));
    assert_abs_diff_eq!(time[100], 0.5, epsilon = LOCAL_VALUE);
    let session = of(Session { power: 1.0 });
    assert_abs_diff_eq!(session[200], 0.5, epsilon = LOCAL_VALUE); // 60 of 120 s
    let fade = of(TimeFade { tau_s: 1.0 });
    assert_eq!((fade[0], fade[200]), (1.0, 1.0));
    assert_abs_diff_eq!(fade[100], (-1.0_f64).exp(), epsilon = LOCAL_VALUE);
}

/// Memories are cleared between trials: equal trials have equal values, whatever precedes them.
#[test]
fn memories_begin_anew_with_every_trial() {
    let x = [wave(300), wave(300)].concat();
    let inputs = inputs(vec![signal("x", x.clone(), false), signal("u", x, true)], &[300, 300]);
    let factors = [
        Play { signal: 0, width: 0.1 },
        Lag { signal: 0, tau_s: 0.5 },
        Late { signal: 0, delay_s: 0.3 },
        Peak { signal: 0 },
        Turned { signal: 0, width: 0.1 },
        Travel { signal: 0, power: 1.0 },
    ];
    let passages = [Passage::Direct, Passage::Lag { tau_s: 0.4 }, Passage::Leak { tau_s: 0.3 }];
    for factor in factors {
        for passage in passages {
            let all = Term::new(&[factor], passage).values(&inputs, 2);
            assert_eq!(all[..300], all[300..], "{factor:?} {passage:?}");
            // The values do not change if fewer trials are computed.
            assert_eq!(Term::new(&[factor], passage).values(&inputs, 1), all[..300]);
        }
    }
}

/// Terms are causal: a change of later samples does not change earlier values.
#[test]
fn no_term_looks_ahead() {
    let (x, mut other) = (wave(400), wave(400));
    other[201..].iter_mut().for_each(|x| *x = 0.3);
    let values = |x: &[f64], term: &Term| {
        let mut inputs = inputs(vec![signal("x", x.to_vec(), false)], &[400]);
        inputs.signals[0].v = vec![1.0; 400]; // rates are differences to both sides
        term.values(&inputs, 1)
    };
    let inputs = inputs(vec![signal("x", x.clone(), false)], &[400]);
    let roles = super::roles(&[400], 0);
    for term in crate::missing::library::library(&inputs, &roles, false) {
        assert_eq!(values(&x, &term)[..=200], values(&other, &term)[..=200], "{term:?}");
    }
}

#[test]
fn a_product_is_that_of_its_factors_and_nothing_is_one() {
    let x = wave(200);
    let inputs = inputs(vec![signal("x", x, false)], &[200]);
    let one = Term::new(&[], Passage::Direct).values(&inputs, 1);
    assert_eq!(one, vec![1.0; 200]);
    let of = |factors: &[Factor]| Term::new(factors, Passage::Direct).values(&inputs, 1);
    let (a, b) = (Power { signal: 0, power: 1.0 }, Cosine { signal: 0, turns: 1.0 });
    let product = of(&[a]).into_iter().zip(of(&[b])).map(|(a, b)| a * b);
    assert_like(&of(&[a, b]), product);
}

/// For the constant product 1, the lag starts from 0 and is 1 - exp(-t/tau).
#[test]
fn a_lag_starts_at_rest() {
    let inputs = inputs(vec![signal("x", wave(300), false)], &[300]);
    let one = Term::new(&[], Passage::Lag { tau_s: 0.3 }).values(&inputs, 1);
    for (i, z) in one.iter().enumerate().skip(1) {
        // The test allows the lag to start at the first sample, or one sample earlier or later.
        let at = |i: f64| 1.0 - (-i * DT_S / 0.3).exp();
        assert!((at(i as f64 - 1.0) - 1e-9..=at(i as f64 + 1.0) + 1e-9).contains(z), "{i}: {z}");
    }
}

/// The leak is z' = g/tau - u z/tau with the opening u. With u = 0, z integrates g. With u > 0 and
/// a constant g, z tends to g/u with the time constant tau/u.
#[test]
fn a_leak_integrates_while_shut_and_forgets_while_open() {
    let with = |opening: f64| {
        let signals =
            vec![signal("x", vec![1.0; 600], false), signal("u", vec![opening; 600], true)];
        let inputs = inputs(signals, &[600]);
        Term::new(&[Power { signal: 0, power: 1.0 }], Passage::Leak { tau_s: 0.5 })
            .values(&inputs, 1)
    };
    let shut = with(0.0);
    assert_like(&shut, (1..=600).map(|i| f64::from(i) * DT_S / 0.5));
    let open = with(2.0);
    assert_like(&open, (1..=600).map(|i| 0.5 * (1.0 - (-f64::from(i) * DT_S * 2.0 / 0.5).exp())));
    // A negative opening counts as shut.
    assert_eq!(with(-1.0), shut);
}

#[test]
fn shapes_are_read_and_written_in_order() {
    let term = Term::new(
        &[
            Play { signal: 0, width: 0.1 },
            Power { signal: 0, power: 2.0 },
            Lag { signal: 0, tau_s: 3.0 },
        ],
        Passage::Leak { tau_s: 0.7 },
    );
    assert_eq!(term.shapes(), [0.1, 3.0, 0.7]);
    assert_eq!(term.with_shape(1, 4.0).shapes(), [0.1, 4.0, 0.7]);
    assert_eq!(term.with_shape(9, 4.0), term);
    let written = serde_json::to_string(&term).expect("written");
    assert_eq!(serde_json::from_str::<Term>(&written).expect("read"), term);
}
