//! Lags, masses on springs, fading memories, means and delays: linear, with a gain of 1, and exact for lines between
//! nodes.

use proptest::prelude::*;
use stretch_effects::{
    FadingMemory, FlexibleJoint, Grid, Lowpass, MovingMean, Operator, Oscillator, Poles, Skew,
    SkewSpec, Swing, Times,
};

use crate::support::{DT_S, apart, cases, largest, respond, respond_on, samples, signal};

/// Linear operators, made for a grid.
#[derive(Debug, Clone, Copy)]
enum Linear {
    Lag(Poles),
    Mass { m: f64, damping: f64 },
    Joint { m: f64, damping: f64 },
    Fading { share: f64, times: Times },
    Mean { window_s: f64 },
    Late { skew_s: f64 },
}

impl Linear {
    fn on(self, grid: &Grid) -> Box<dyn Operator> {
        match self {
            Self::Lag(poles) => Box::new(Lowpass::new(poles, grid)),
            Self::Mass { m, damping } => {
                Box::new(Oscillator::new(Swing { m, damping, drag: 0.0, dry: 0.0 }, grid))
            }
            Self::Joint { m, damping } => Box::new(FlexibleJoint::new(m, damping, grid)),
            Self::Fading { share, times } => Box::new(FadingMemory::new(share, times, 1.0, grid)),
            Self::Mean { window_s } => Box::new(MovingMean::new(grid, window_s)),
            Self::Late { skew_s } => {
                Box::new(Skew::new(grid, SkewSpec { skew_s, ..SkewSpec::default() }))
            }
        }
    }

    fn respond(self, signal: &[f64]) -> Vec<f64> {
        respond(&*self.on(&samples()), signal)
    }

    /// Steady delay behind a ramp, s.
    fn trail_s(self) -> f64 {
        match self {
            Self::Lag(poles) => poles.tau_s,
            Self::Mass { m, damping } => 2.0 * damping * m,
            Self::Joint { .. } => 0.0,
            Self::Fading { share, times } => {
                let all = times.all();
                -share * all.iter().sum::<f64>() / all.len() as f64
            }
            Self::Mean { window_s } => 0.5 * window_s,
            Self::Late { skew_s } => skew_s,
        }
    }

    /// Time after which less than 1e-12 of an earlier state remains, s.
    fn settled_s(self) -> f64 {
        match self {
            Self::Lag(poles) => 60.0 * poles.tau_s,
            Self::Mass { m, damping } | Self::Joint { m, damping } => 60.0 * m / damping,
            Self::Fading { times, .. } => 60.0 * times.tau_s * times.spread,
            Self::Mean { window_s } => window_s,
            Self::Late { skew_s } => skew_s.abs(),
        }
    }
}

fn masses() -> impl Strategy<Value = (f64, f64)> {
    (0.005..0.05_f64, 0.1..0.95_f64)
}

fn times() -> impl Strategy<Value = Times> {
    (0.005..0.1_f64, prop_oneof![Just(1.0), 1.0..4.0_f64])
        .prop_map(|(tau_s, spread)| Times { tau_s, spread })
}

/// Operators that are exact for lines between nodes.
fn exact() -> impl Strategy<Value = Linear> {
    prop_oneof![
        (0.005..0.1_f64, prop_oneof![Just(0.0), 0.501..1.0_f64])
            .prop_map(|(tau_s, second)| Linear::Lag(Poles { tau_s, second })),
        masses().prop_map(|(m, damping)| Linear::Mass { m, damping }),
        masses().prop_map(|(m, damping)| Linear::Joint { m, damping }),
        (-0.5..0.6_f64, times()).prop_map(|(share, times)| Linear::Fading { share, times }),
        (0.0..0.1_f64).prop_map(|window_s| Linear::Mean { window_s }),
    ]
}

/// All operators. Those that are not exact approximate the signal between nodes by a line or a cubic.
fn linear() -> impl Strategy<Value = Linear> {
    prop_oneof![
        exact(),
        (0.005..0.1_f64, 0.01..0.5_f64)
            .prop_map(|(tau_s, second)| Linear::Lag(Poles { tau_s, second })),
        (-0.1..0.1_f64).prop_map(|skew_s| Linear::Late { skew_s }),
    ]
}

/// Rounding of a few hundred steps of a recursion whose oscillations last some twenty steps.
const ROUNDING: f64 = 1e-10;

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn outputs_add_up(operator in linear(), pairs in prop::collection::vec((-3.0..3.0_f64, -3.0..3.0_f64), 2..60), k in -2.0..2.0_f64) {
        let (one, other): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        let sum: Vec<f64> = one.iter().zip(&other).map(|(a, b)| a + k * b).collect();
        let [of_one, of_other] = [&one, &other].map(|x| operator.respond(x));
        let added: Vec<f64> = of_one.iter().zip(&of_other).map(|(a, b)| a + k * b).collect();
        prop_assert!(apart(&operator.respond(&sum), &added) <= ROUNDING);
    }

    /// A constant signal passes unchanged, and the output reaches a signal that comes to rest.
    #[test]
    fn the_gain_at_rest_is_one(operator in linear(), level in -3.0..3.0_f64, before in signal()) {
        let still = vec![level; 50];
        prop_assert!(apart(&operator.respond(&still), &still) <= ROUNDING);
        let rest = (operator.settled_s() / DT_S) as usize + 10;
        let comes_to_rest = [before, vec![level; rest]].concat();
        let y = operator.respond(&comes_to_rest);
        prop_assert!((y[y.len() - 1] - level).abs() <= ROUNDING);
    }

    /// The delay behind a ramp does not depend on the slope.
    #[test]
    fn a_ramp_is_trailed(operator in linear(), slope in -9.0..9.0_f64) {
        let count = (operator.settled_s() / DT_S) as usize + 30;
        let ramp: Vec<f64> = (0..count).map(|i| slope * DT_S * i as f64).collect();
        // An operator that reads the signal early has no values after the end.
        let at = count - 15;
        let wanted = ramp[at] - slope * operator.trail_s();
        let found = operator.respond(&ramp)[at];
        prop_assert!((found - wanted).abs() <= ROUNDING * (1.0 + largest(&ramp)), "{found} for {wanted}");
    }

    /// A delayed input gives the same output with the same delay (time invariance).
    #[test]
    fn no_moment_is_special(operator in linear(), signal in signal(), later in 1..40_usize) {
        let waits = [vec![signal[0]; later], signal.clone()].concat();
        let (now, then) = (operator.respond(&signal), operator.respond(&waits));
        // Next to the ends of a recording, linear interpolation replaces the cubic.
        let from = if matches!(operator, Linear::Late { .. }) { 13.min(now.len()) } else { 0 };
        let to = if matches!(operator, Linear::Late { .. }) { now.len().saturating_sub(13).max(from) } else { now.len() };
        prop_assert!(apart(&now[from..to], &then[later + from..later + to]) <= ROUNDING);
    }

    /// For lines between nodes, the step length does not matter.
    #[test]
    fn steps_do_not_matter_for_lines(operator in exact(), signal in signal(), step_s in 0.001..0.01_f64, delay_s in 0.0..0.01_f64) {
        let fine = Grid::new(DT_S, step_s, delay_s).unwrap();
        let line = |node: usize| {
            let (i, t) = (node / fine.pieces(), fine.time_s(node));
            let next = signal.get(i + 1).unwrap_or(&signal[i]);
            signal[i] + (next - signal[i]) * (t / DT_S - i as f64)
        };
        let nodes: Vec<f64> = (0..fine.nodes(signal.len())).map(line).collect();
        let cut = respond_on(&fine, &*operator.on(&fine), &nodes);
        let at_samples: Vec<f64> = cut.iter().step_by(fine.pieces()).copied().collect();
        prop_assert!(apart(&at_samples, &operator.respond(&signal)) <= 1e3 * ROUNDING);
    }

    /// The output of real poles and of means remains in the range of the input.
    #[test]
    fn lags_do_not_overshoot(tau_s in 0.001..0.3_f64, second in 0.0..0.5_f64, window_s in 0.0..0.3_f64, signal in signal()) {
        let [low, high] = [f64::min, f64::max].map(|f| signal.iter().copied().fold(signal[0], f));
        for operator in [Linear::Lag(Poles { tau_s, second }), Linear::Mean { window_s }] {
            let y = operator.respond(&signal);
            prop_assert!(y.iter().all(|y| (low - ROUNDING..=high + ROUNDING).contains(y)), "{operator:?}");
        }
    }

    /// A mass that a ramp sets in motion follows the closed form, also behind a joint.
    #[test]
    fn a_mass_follows_the_closed_form((m, damping) in masses(), slope in -5.0..5.0_f64) {
        let ramp: Vec<f64> = (0..80).map(|i| slope * DT_S * f64::from(i)).collect();
        let omega = (1.0 - damping * damping).sqrt() / m;
        let swing = |t: f64, at: f64, speed: f64| {
            let rate = (speed + damping / m * at) / omega;
            (-damping * t / m).exp() * (at * (omega * t).cos() + rate * (omega * t).sin())
        };
        let trail = 2.0 * damping * m;
        let mass = Linear::Mass { m, damping }.respond(&ramp);
        let joint = Linear::Joint { m, damping }.respond(&ramp);
        for i in 0..ramp.len() {
            let t = DT_S * i as f64;
            let of_mass = slope * (t - trail + swing(t, trail, -1.0));
            let of_joint = slope * (t + swing(t, 0.0, -1.0));
            prop_assert!((mass[i] - of_mass).abs() <= ROUNDING, "{} for {of_mass}", mass[i]);
            prop_assert!((joint[i] - of_joint).abs() <= ROUNDING, "{} for {of_joint}", joint[i]);
        }
    }

    /// Drag and dry friction damp an oscillation. The final error is at most the dry friction.
    #[test]
    fn drag_and_friction_damp((m, damping) in masses(), drag in 0.0..2.0_f64, dry in 0.0..0.2_f64) {
        let grid = samples();
        let mut step = vec![1.0; 3000];
        step[0] = 0.0;
        let respond_to = |drag: f64, dry: f64| respond(&Oscillator::new(Swing { m, damping, drag, dry }, &grid), &step);
        let top = |y: &[f64]| y.iter().copied().fold(0.0, f64::max);
        let (free, damped) = (respond_to(0.0, 0.0), respond_to(drag, dry));
        prop_assert!(top(&damped) <= top(&free) + 1e-3, "{} above {}", top(&damped), top(&free));
        prop_assert!((damped[2999] - 1.0).abs() <= dry + 1e-6, "{}", damped[2999]);
    }

    /// A step appears behind a fading memory as 1 + share and fades to 1, and never leaves this range.
    #[test]
    fn a_memory_fades(share in -0.5..0.6_f64, times in times()) {
        let step: Vec<f64> = (0..2000).map(|i| f64::from(u8::from(i > 0))).collect();
        let y = Linear::Fading { share, times }.respond(&step);
        let beyond: Vec<f64> = y[1..].iter().map(|y| (y - 1.0) / share).collect();
        prop_assert!(beyond.windows(2).all(|pair| pair[1] <= pair[0] + 1e-9));
        prop_assert!(beyond.iter().all(|part| (-1e-9..=1.0 + 1e-9).contains(part)), "{beyond:?}");
    }

    /// A cubic is reproduced exactly at any time between any nodes, also if two clocks have different rates.
    #[test]
    fn a_cubic_is_read_exactly(
        c in prop::array::uniform4(-1.0..1.0_f64), skew_s in -0.2..0.2_f64, rate in -1e-3..1e-3_f64, step_s in 0.002..0.01_f64
    ) {
        let grid = Grid::new(DT_S, step_s, 0.0).unwrap();
        let cubic = |t: f64| c[0] + t * (c[1] + t * (c[2] + t * c[3]));
        let nodes: Vec<f64> = (0..grid.nodes(120)).map(|node| cubic(grid.time_s(node))).collect();
        let mut shown = vec![0.0; 120];
        Skew::new(&grid, SkewSpec { skew_s, rate, empty: 0.0 }).sample(&nodes, &mut shown);
        for (i, y) in shown.iter().enumerate().take(95).skip(25) {
            let t = DT_S * i as f64;
            let wanted = cubic(t - skew_s - rate * t);
            prop_assert!((y - wanted).abs() <= ROUNDING, "{y} for {wanted} at {i}");
        }
    }

    /// Outside its ends a recording keeps its end values; `empty` scales the value before the start.
    #[test]
    fn ends_are_held(signal in signal(), skew_s in 1.0..50.0_f64, empty in 0.0..=1.0_f64) {
        let last = signal[signal.len() - 1];
        let read = |skew_s: f64, empty: f64| {
            respond(&Skew::new(&samples(), SkewSpec { skew_s, rate: 0.0, empty }), &signal)
        };
        prop_assert!(read(skew_s, empty).iter().all(|y| *y == (1.0 - empty) * signal[0]));
        prop_assert!(read(-skew_s, empty).iter().all(|y| *y == last));
    }
}

/// Real and complex poles meet at equal poles.
#[test]
fn poles_change_continuously() {
    let step = [vec![0.0; 3], vec![1.0; 60]].concat();
    let of = |second| Linear::Lag(Poles { tau_s: 0.05, second }).respond(&step);
    // Two real poles pass on the output of the first as linear between samples.
    assert!(apart(&of(0.5), &of(0.500_001)) < 0.02);
    // A Butterworth filter overshoots by exp(-pi) = 4.3 %.
    let top = of(0.5_f64.sqrt()).into_iter().fold(0.0, f64::max);
    assert!((top - 1.0 - (-std::f64::consts::PI).exp()).abs() < 2e-3, "{top}");
}
