//! Effects that depend on time, on travel or on other channels: drifts, warming, softening, clocks, hum, crosstalk.

use std::f64::consts::TAU;

use proptest::prelude::*;
use stretch_effects::{
    ClockDrift, Crosstalk, Drift, Grid, Hum, Measured, Offset, Operator, Softening, Span, Start,
    Times, Warming, kind_named,
};

use crate::support::{
    DT_S, apart, cases, largest, motion, respond, respond_on, run, samples, signal, turns,
};

const ROUNDING: f64 = 1e-12;

/// Output for a constant input of 1, in a trial that begins at a session time.
fn gain(operator: &dyn Operator, start_s: f64, count: usize) -> Vec<f64> {
    let (grid, mut cells) = (samples(), vec![0.0; operator.cells()]);
    let span = Span { start_s, ..Span::whole(&grid) };
    run(operator, &mut cells, Start::Settled, span, &vec![1.0; count], count)
}

proptest! {
    #![proptest_config(cases(64))]

    /// A drift is linear at first, settles at d/settle, and depends on session time alone.
    #[test]
    fn a_drift_settles(d in -1e-3..1e-3_f64, settle in 1e-3..0.1_f64, start_s in 0.0..500.0_f64) {
        let drift = Drift { per_s: d, settle_per_s: settle };
        let after = |t: f64| gain(&drift, t, 1)[0] - 1.0;
        prop_assert!((after(1e6 / settle) - d / settle).abs() <= ROUNDING * (1.0 + (d / settle).abs()));
        prop_assert!(after(start_s).abs() <= (d * start_s).abs() + ROUNDING, "never more than the straight line");
        let nearly = Drift { settle_per_s: 1e-9, ..drift };
        prop_assert!((gain(&nearly, start_s, 1)[0] - gain(&Drift::straight(d), start_s, 1)[0]).abs() <= 1e-6);
        // The second half of a trial gives the same output as the same samples in the whole trial.
        let whole = gain(&drift, start_s, 40);
        let rest = gain(&drift, start_s + 20.0 * DT_S, 20);
        prop_assert!(apart(&whole[20..], &rest) <= ROUNDING);
        let zero = Offset { at_start: d, per_s: settle };
        prop_assert!((gain(&zero, start_s, 1)[0] - 1.0 - d - settle * start_s).abs() <= ROUNDING * (1.0 + start_s));
    }

    /// Warming begins anew in every trial, is monotone, and ends at 1 + h for any grid steps.
    #[test]
    fn warming_goes_one_way(h in -0.3..0.3_f64, tau_s in 0.02..2.0_f64, spread in prop_oneof![Just(1.0), 1.0..8.0_f64], start_s in 0.0..500.0_f64) {
        let times = Times { tau_s, spread };
        let heats = Warming::new(h, times, &samples());
        let (grid, mut cells, ones) = (samples(), vec![0.0; heats.cells()], vec![1.0; 300]);
        let mut trial = |start: Start, start_s: f64| {
            let span = Span { start_s, ..Span::whole(&grid) };
            run(&heats, &mut cells, start, span, &ones, 300)
        };
        let found = trial(Start::Settled, start_s);
        prop_assert_eq!(&found, &trial(Start::Carried { rest_s: 1.0 }, 0.0), "warming starts with the trial, not with the session");
        prop_assert_eq!(found[0], 1.0);
        prop_assert!(found.windows(2).all(|pair| (pair[1] - pair[0]) * h >= -ROUNDING));
        prop_assert!(found.iter().all(|y| ((y - 1.0) / h) <= 1.0 + 1e-9));
        let fine = Grid::new(DT_S, 0.003, 0.0).unwrap();
        let cut = respond_on(&fine, &Warming::new(h, times, &fine), &vec![1.0; fine.nodes(300)]);
        let at_samples: Vec<f64> = cut.iter().step_by(fine.pieces()).copied().collect();
        prop_assert!(apart(&at_samples, &found) <= ROUNDING);
        let left = times.all().iter().map(|tau| (-2.99 / tau).exp()).sum::<f64>() / times.all().len() as f64;
        prop_assert!((found[299] - 1.0 - h * (1.0 - left)).abs() <= 1e-9);
    }

    /// Softening depends on the distance, not on the time. It takes between 0 and m of the part above its zero, and
    /// continues between trials.
    #[test]
    fn softening_counts_the_way(turns in turns(), m in 0.0..0.5_f64, n in 0.5..50.0_f64, tail in prop_oneof![Just(0.0), 0.05..2.5_f64], slow in 2..10_usize) {
        let gauge = Softening { m, n, tail, zero: 0.5, reversal: 1e-6 };
        let (grid, mut cells) = (samples(), [0.0; 3]);
        let mut factor = |path: &[f64], start: Start| -> Vec<f64> {
            let span = Span { strain: path, ..Span::whole(&grid) };
            let out = run(&gauge, &mut cells, start, span, &vec![2.5; path.len()], 5);
            out.iter().map(|y| (y - 0.5) / 2.0).collect()
        };
        let quick = factor(&turns, Start::Settled);
        let again = factor(&turns, Start::Carried { rest_s: 9.0 });
        let slow_path = factor(&motion(&turns, slow), Start::Settled);
        prop_assert!(quick[0] == 1.0 && again[0] <= quick[quick.len() - 1] + ROUNDING);
        prop_assert!(quick.iter().chain(&again).all(|f| (1.0 - m - ROUNDING..=1.0).contains(f)));
        prop_assert!(quick.windows(2).all(|pair| pair[1] <= pair[0]));
        prop_assert!((slow_path[slow_path.len() - 1] - quick[quick.len() - 1]).abs() <= 1e-9);
        // After the distance n: 1 - m (1 - (1 + tail)^(-1/tail)).
        let left = if tail == 0.0 { (-1.0_f64).exp() } else { (1.0 + tail).powf(-1.0 / tail) };
        let once = factor(&[0.0, n], Start::Settled);
        prop_assert!((once[1] - 1.0 + m * (1.0 - left)).abs() <= ROUNDING);
    }

    /// Noise that is smaller than a reversal causes no softening.
    #[test]
    fn noise_does_not_soften(noise in prop::collection::vec(-1.0..1.0_f64, 2..80)) {
        let gauge = Softening { m: 0.3, n: 1.0, tail: 0.0, zero: 0.0, reversal: 1e-2 };
        let path: Vec<f64> = noise.iter().map(|x| 0.004 * x).collect();
        let (grid, mut cells) = (samples(), [0.0; 3]);
        let out = run(&gauge, &mut cells, Start::Settled, Span { strain: &path, ..Span::whole(&grid) }, &vec![1.0; path.len()], 80);
        prop_assert!(out.iter().all(|y| *y == 1.0));
    }

    /// A clock of another rate reads a line of session time with a growing delay, which continues from trial to trial.
    #[test]
    fn a_clock_drifts_through_the_session(skew_s in -0.05..0.05_f64, rate in -1e-4..1e-4_f64, start_s in 0.0..500.0_f64) {
        let grid = samples();
        let clock = ClockDrift::new(skew_s, rate, &grid);
        let mut line: Vec<f64> = (0..60).map(|i| start_s + DT_S * f64::from(i)).collect();
        clock.run(&Span { start_s, ..Span::whole(&grid) }, &mut [], &mut line);
        for (i, shown) in line.iter().enumerate().take(45).skip(15) {
            let t = start_s + DT_S * i as f64;
            prop_assert!((shown - (t - skew_s - rate * t)).abs() <= 1e-9);
        }
    }

    /// A hum adds a wave of session time with constant amplitude to any signal.
    #[test]
    fn a_hum_is_a_wave_of_session_time(x in signal(), a in 0.0..1.0_f64, f_hz in 1.0..70.0_f64, phase in -3.0..3.0_f64, start_s in 0.0..500.0_f64) {
        let (grid, hum) = (samples(), Hum { a, f_hz, phase });
        let mut y = x.clone();
        hum.run(&Span { start_s, ..Span::whole(&grid) }, &mut [], &mut y);
        for (i, (x, y)) in x.iter().zip(&y).enumerate() {
            let turns = f_hz * (start_s + DT_S * i as f64);
            let wave = a * (TAU * turns.fract() + phase).sin();
            // Rounding of an angle of up to 500 s times 70 Hz.
            prop_assert!((y - x - wave).abs() <= 1e-9, "{} for {wave}", y - x);
        }
    }

    /// The phase of a hum is found in each second of the recording if the noise is small enough.
    #[test]
    fn the_phase_of_a_hum_is_found(phase in -3.0..3.0_f64, turn in -1.0..1.0_f64, a in 0.05..0.2_f64) {
        let find = kind_named("hum").unwrap().find.unwrap();
        let dt_s = 0.004;
        let wave = |i: usize| a * (TAU * 50.0 * dt_s * i as f64 + phase + turn * (i / 250) as f64).sin();
        let measured: Vec<f64> = (0..750).map(wave).collect();
        let record = |noise: f64| Measured { samples: &measured, noise, unit: 1.0, dt_s };
        let mut found = vec![0.0; 750];
        find(&[a, 50.0], &record(0.01 * a), &mut found);
        prop_assert!(apart(&found, &measured) <= 0.05 * a, "{}", apart(&found, &measured));
        // A large noise hides the hum, and with an amplitude of zero nothing is added.
        let mut hidden = vec![0.0; 750];
        find(&[a, 50.0], &record(1e3 * a), &mut hidden);
        prop_assert!(largest(&hidden) <= 0.01 * a);
        let mut none = vec![0.0; 750];
        find(&[0.0, 50.0], &record(0.01 * a), &mut none);
        prop_assert!(largest(&none) == 0.0);
    }

    /// Crosstalk adds a function of the other channel to any signal.
    #[test]
    fn crosstalk_adds_another_channel(x in signal(), c in -1.0..1.0_f64, bend in -1.0..1.0_f64, other in -5.0..5.0_f64) {
        let (grid, talk) = (samples(), Crosstalk { c, bend, middle: 1.0, span: 4.0 });
        let strain = vec![other; x.len()];
        let mut y = x.clone();
        talk.run(&Span { strain: &strain, ..Span::whole(&grid) }, &mut [], &mut y);
        let z = (other - 1.0) / 4.0;
        prop_assert!(x.iter().zip(&y).all(|(x, y)| (y - x - c * (z + bend * z * z)).abs() <= ROUNDING));
        prop_assert_eq!(respond(&Crosstalk { c: 0.0, ..talk }, &x), x);
    }
}
