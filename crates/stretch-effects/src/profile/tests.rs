//! Tests of the S profile: its closed form of seven segments, and its limits under any command.

use alloc::vec::Vec;

use proptest::prelude::*;

use super::*;

const DT_S: f64 = 0.01;
/// Rounding of values up to 10 over a few hundred steps, divided by a sample time twice for an acceleration.
const ROUNDING: f64 = 1e-8;

fn followed(dt_s: f64, profile: Profile, round_s: f64, command: &[f64]) -> Vec<f64> {
    let grid = Grid::samples(dt_s).unwrap();
    let servo = SProfile::new(&grid, profile, round_s);
    let (mut cells, mut signal) = (vec![0.0; servo.cells()], command.to_vec());
    servo.begin(Start::Settled, command[0], &mut cells);
    servo.run(&Span::whole(&grid), &mut cells, &mut signal);
    signal
}

fn slopes(values: &[f64], dt_s: f64) -> Vec<f64> {
    values.windows(2).map(|p| (p[1] - p[0]) / dt_s).collect()
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Position at time t of the seven segments of constant jerk, from rest at 0 to rest at `way`.
fn seven_segments(way: f64, [jerk, acceleration, rate]: [f64; 3], t: f64) -> f64 {
    let rounds = acceleration / jerk;
    let (holds, cruises) =
        (rate / acceleration - rounds, way / rate - rate / acceleration - rounds);
    assert!(holds >= 0.0 && cruises >= 0.0, "both limits are reached");
    let segments = [
        (jerk, rounds),
        (0.0, holds),
        (-jerk, rounds),
        (0.0, cruises),
        (-jerk, rounds),
        (0.0, holds),
        (jerk, rounds),
    ];
    let ([mut y, mut v, mut a], mut left) = ([0.0; 3], t);
    for (j, takes) in segments {
        let h = takes.min(left);
        y += h * (v + h * (a / 2.0 + h * j / 6.0));
        v += h * (a + h * j / 2.0);
        a += h * j;
        left -= h;
    }
    y
}

proptest! {
    /// Every position of a move from rest to rest, and its duration, agree with the closed form. The trapezoid moves in
    /// steps of constant speed, which are ahead of the continuous motion by up to rate x step.
    #[test]
    fn a_move_has_seven_segments(acceleration in 10.0..60.0_f64, rate in 1.0..3.0_f64, part in 0.1..0.9_f64, more in 1.05..3.0_f64) {
        let round_s = part * rate / acceleration;
        let way = more * rate * (rate / acceleration + round_s);
        let (dt_s, takes_s) = (1e-4, way / rate + rate / acceleration + round_s);
        let mut command = vec![way; (takes_s / dt_s) as usize + 20];
        command[0] = 0.0;
        let found = followed(dt_s, Profile { acceleration, rate }, round_s, &command);
        let limits = [acceleration / round_s, acceleration, rate];
        for (i, y) in found.iter().enumerate() {
            let exact = seven_segments(way, limits, i as f64 * dt_s);
            prop_assert!((y - exact).abs() <= 2.0 * rate * dt_s, "{y} for {exact} at sample {i}");
        }
        let arrives = found.iter().position(|y| *y == way).expect("it arrives, to the last bit");
        prop_assert!((arrives as f64 * dt_s - takes_s).abs() <= 3.0 * dt_s, "{arrives} for {takes_s} s");
    }

    /// No limit is exceeded under any command, up to rounding in rate and acceleration.
    #[test]
    fn limits_hold_under_any_command(
        command in proptest::collection::vec(-5.0..5.0_f64, 2..40), acceleration in 5.0..80.0_f64, rate in 0.5..4.0_f64, samples in 1..30_u32
    ) {
        // The rounding time is a whole number of samples, so that differences of samples are means of those of the
        // profile.
        let round_s = f64::from(samples) * DT_S;
        let command: Vec<f64> = command.iter().flat_map(|x| [*x; 25]).collect();
        let profile = Profile { acceleration, rate };
        let trapezoid = followed(DT_S, profile, 0.0, &command);
        let smooth = followed(DT_S, profile, round_s, &command);
        let of = |y: &[f64]| {
            let v = slopes(y, DT_S);
            let a = slopes(&v, DT_S);
            [greatest(&v), greatest(&a), greatest(&slopes(&a, DT_S))]
        };
        let ([_, below, _], [v, a, j]) = (of(&trapezoid), of(&smooth));
        prop_assert!(v <= rate + ROUNDING && a <= below + ROUNDING, "{v}, {a} above {rate}, {below}");
        prop_assert!(below <= acceleration + ROUNDING, "{below} above {acceleration}");
        prop_assert!(j <= 2.0 * acceleration / round_s + 100.0 * ROUNDING, "{j} above {}", 2.0 * acceleration / round_s);
    }

    /// A rounding time of 0 gives the trapezoid to the last bit. A short rounding time moves a
    /// position by at most the distance that is covered at the highest rate in half of the rounding time.
    #[test]
    fn a_large_jerk_is_the_trapezoid(
        command in proptest::collection::vec(-5.0..5.0_f64, 2..12), acceleration in 5.0..80.0_f64, rate in 0.5..4.0_f64, round_s in 1e-6..1e-3_f64
    ) {
        let command: Vec<f64> = command.iter().flat_map(|x| [*x; 25]).collect();
        let (grid, profile) = (Grid::samples(DT_S).unwrap(), Profile { acceleration, rate });
        let mut trapezoid = command.clone();
        let mut cells = [0.0; 2];
        profile.begin(Start::Settled, command[0], &mut cells);
        profile.run(&Span::whole(&grid), &mut cells, &mut trapezoid);
        prop_assert_eq!(&followed(DT_S, profile, 0.0, &command), &trapezoid);
        for (y, plain) in followed(DT_S, profile, round_s, &command).iter().zip(&trapezoid) {
            prop_assert!((y - plain).abs() <= 0.5 * rate * round_s + ROUNDING);
        }
    }
}
