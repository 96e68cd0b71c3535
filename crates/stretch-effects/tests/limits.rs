//! Limits of value, rate and acceleration, quantisation, dead zones, and friction.

use proptest::prelude::*;
use stretch_effects::{
    DeadBand, DeadZone, Friction, HoldBand, Knees, LoadFriction, Operator, Profile, Quantiser,
    SlewLimit, TorqueSpeed, soft_ceiling, soft_floor,
};

use crate::support::{
    DT_S, apart, cases, force, largest, motion, quickest, respond, signal, turns,
};

/// A few hundred roundings of values up to 10.
const ROUNDING: f64 = 1e-12;

/// Input in rising order, and output, of an operator without memory.
fn curve(operator: &dyn Operator, values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut x = values.to_vec();
    x.sort_by(f64::total_cmp);
    let y = respond(operator, &x);
    (x, y)
}

/// Whether a curve rises, and by no more than its input.
fn rises_at_most_as_much((x, y): &(Vec<f64>, Vec<f64>)) -> bool {
    let steps = x.windows(2).zip(y.windows(2));
    let is_between =
        |(x, y): (&[f64], &[f64])| (-ROUNDING..=x[1] - x[0] + ROUNDING).contains(&(y[1] - y[0]));
    steps.into_iter().all(is_between)
}

proptest! {
    #![proptest_config(cases(128))]

    #[test]
    fn saturation_keeps_its_bounds(x in signal(), low in -2.0..0.0_f64, high in 0.0..2.0_f64, width in 1e-4..0.2_f64) {
        let knees = Knees { low: Some(low), high: Some(high), width };
        let found = curve(&knees, &x);
        prop_assert!(rises_at_most_as_much(&found));
        for (x, y) in found.0.iter().zip(&found.1) {
            prop_assert!((..=high + ROUNDING).contains(y));
            // The upper knee lowers the output of the lower knee.
            prop_assert!(*y >= low - width * 2.0_f64.ln() - ROUNDING);
            if *x > low + 40.0 * width && *x < high - 40.0 * width {
                prop_assert_eq!(x, y, "far from both ends it is the value itself");
            }
        }
        let without = respond(&Knees { low: None, high: None, width }, &x);
        prop_assert_eq!(without, x);
    }

    #[test]
    fn a_soft_floor_is_above_value_and_bound(x in -5.0..5.0_f64, low in -2.0..2.0_f64, w in 1e-4..1.0_f64) {
        let (hard, soft) = (x.max(low), soft_floor(x, low, w));
        prop_assert!(soft >= hard - ROUNDING && soft <= hard + w * 2.0_f64.ln() + ROUNDING);
        prop_assert_eq!(soft_ceiling(-x, -low, w), -soft);
    }

    #[test]
    fn a_dead_zone_is_odd_and_weakens(x in signal(), w in 0.0..1.5_f64, softness in 0.0..1.0_f64) {
        let zone = DeadZone { w, softness };
        prop_assert!(rises_at_most_as_much(&curve(&zone, &x)));
        let y = respond(&zone, &x);
        let mirrored = respond(&zone, &x.iter().map(|x| -x).collect::<Vec<_>>());
        prop_assert!(y.iter().zip(&mirrored).all(|(y, m)| *y == -m));
        prop_assert!(x.iter().zip(&y).all(|(x, y)| y.abs() <= x.abs() + ROUNDING && x * y >= 0.0));
        // A soft edge differs from a hard one by at most its width times ln 2. Below a hard edge the output is zero.
        let hard = respond(&DeadZone { w, softness: 0.0 }, &x);
        prop_assert!(apart(&y, &hard) <= softness * w * 2.0_f64.ln() + ROUNDING);
        prop_assert!(x.iter().zip(&hard).all(|(x, y)| x.abs() > w || *y == 0.0));
    }

    #[test]
    fn a_band_holds_what_is_near(x in signal(), w in 0.0..1.5_f64, short in 0.0..1.0_f64) {
        let y = respond(&HoldBand { w, short }, &x);
        prop_assert!(apart(&x, &y) <= w + ROUNDING);
        for (x, y) in x[1..].iter().zip(y.windows(2)) {
            match (x - y[0]).abs() > w {
                true => prop_assert!(((x - y[1]).abs() - short * w).abs() <= ROUNDING),
                false => prop_assert_eq!(y[0], y[1]),
            }
        }
    }

    #[test]
    fn a_valve_opens_from_shut_to_open(
        commands in prop::collection::vec(0.0..=1.0_f64, 2..60), u_db in 0.0..0.6_f64, softness in 0.0..2.0_f64, gate in 0.0..2.0_f64
    ) {
        let valve = DeadBand { u_db, softness, gate: 0.0, least: 0.02 };
        let (u, open) = curve(&valve, &[commands.as_slice(), &[0.0, 1.0]].concat());
        prop_assert!(open.is_sorted() && open[0] == 0.0);
        prop_assert!((open[open.len() - 1] - 1.0).abs() <= ROUNDING, "fully open at full command");
        prop_assert!(u.iter().zip(&open).all(|(u, open)| *open <= u + ROUNDING), "never further than commanded");
        let hard = respond(&DeadBand { softness: 0.0, ..valve }, &u);
        prop_assert!(u.iter().zip(&hard).all(|(u, open)| *u > u_db || *open == 0.0 || u_db == 0.0));
        // A gate closes the valve further.
        let gated = respond(&DeadBand { gate, ..valve }, &u);
        prop_assert!(gated.iter().zip(&open).all(|(gated, open)| (0.0..=open.max(1e-12) + ROUNDING).contains(gated)));
    }

    #[test]
    fn a_slew_limit_keeps_its_rate_and_arrives(x in signal(), rate in 1.0..500.0_f64) {
        let limit = SlewLimit { rate };
        let y = respond(&limit, &x);
        prop_assert!(quickest(&y) <= rate * DT_S * (1.0 + 1e-9));
        prop_assert!(largest(&y) <= largest(&x));
        // The output moves towards the input, and never beyond.
        prop_assert!(x[1..].iter().zip(y.windows(2)).all(|(x, y)| (x - y[1]) * (x - y[0]) >= 0.0));
        // A slower signal passes unchanged to the last bit. A constant command is reached in the time that the rate
        // allows.
        let slow: Vec<f64> = x.iter().map(|x| x * rate * DT_S / 6.0).collect();
        prop_assert_eq!(respond(&limit, &slow), slow);
        let steps = (1.0 / (rate * DT_S)).ceil() as usize;
        let mut step = vec![1.0; steps + 2];
        step[0] = 0.0;
        let reached = respond(&limit, &step);
        prop_assert!(reached[steps + 1] == 1.0 && (steps < 2 || reached[steps - 1] < 1.0));
    }

    /// A trapezoid moves straight to a constant command. Its speed changes in steps of a h, so it may overshoot by one
    /// such step.
    #[test]
    fn a_profile_stops_at_its_command(acceleration in 5.0..80.0_f64, rate in 0.5..4.0_f64, to in -3.0..3.0_f64) {
        let seconds = to.abs() / rate + rate / acceleration + 2.0 * (to.abs() / acceleration).sqrt();
        let mut command = vec![to; (seconds / DT_S) as usize + 10];
        command[0] = 0.0;
        let y = respond(&Profile { acceleration, rate }, &command);
        prop_assert_eq!(y[y.len() - 1], to);
        let step = acceleration * DT_S * DT_S;
        let back = y.windows(2).map(|pair| (pair[0] - pair[1]) * to.signum()).fold(0.0, f64::max);
        prop_assert!(back <= step && largest(&y) <= to.abs() + step, "{back}");
    }

    #[test]
    fn a_quantiser_rounds_once(x in signal(), step in 0.01..1.0_f64) {
        let found = curve(&Quantiser { step }, &x);
        prop_assert!(found.1.is_sorted());
        prop_assert!(apart(&found.0, &found.1) <= 0.5 * step + ROUNDING);
        let whole = |y: &f64| (y / step - (y / step).round()).abs() <= 1e-9;
        prop_assert!(found.1.iter().all(whole));
        prop_assert_eq!(&respond(&Quantiser { step }, &found.1), &found.1);
    }

    #[test]
    fn a_motor_is_weaker_the_faster_it_drives(torque in signal(), v in 0.0..5.0_f64, stall in 0.5..3.0_f64, slope in 0.0..1.0_f64) {
        let motor = TorqueSpeed { stall, slope };
        let at = |v: f64| {
            let mut y = torque.clone();
            let grid = crate::support::samples();
            let strain = vec![v; y.len()];
            motor.run(&stretch_effects::Span { strain: &strain, ..stretch_effects::Span::whole(&grid) }, &mut [], &mut y);
            y
        };
        let (still, driving, backwards) = (at(0.0), at(v), at(-v));
        prop_assert!(torque.iter().zip(&still).all(|(x, y)| *y == x.clamp(-stall, stall)));
        for ((still, driving), backwards) in still.iter().zip(&driving).zip(&backwards) {
            match *still > 0.0 {
                // The braking torque is the same as at rest.
                true => prop_assert!(driving <= still && backwards == still && *driving >= 0.0),
                false => prop_assert!(backwards >= still && driving == still && *backwards <= 0.0),
            }
        }
        prop_assert!(largest(&driving) <= stall);
    }

    /// Friction takes energy from every motion, and is zero at rest.
    #[test]
    fn friction_opposes(
        speeds in signal(), coulomb in 0.0..5.0_f64, viscous in 0.0..5.0_f64, more in 0.0..5.0_f64, slow in 0.01..1.0_f64,
        width in prop_oneof![Just(0.0), 1e-3..0.5_f64], lopsided in -0.5..0.5_f64, load in signal()
    ) {
        let rail = Friction { coulomb, viscous, more, slow, width, lopsided };
        let found = force(&rail, &speeds, &[]);
        prop_assert!(speeds.iter().zip(&found).all(|(v, f)| v * f >= 0.0));
        let most = |v: &f64| (coulomb + more) * (1.0 + lopsided.abs()) + viscous * v.abs() + ROUNDING;
        prop_assert!(speeds.iter().zip(&found).all(|(v, f)| f.abs() <= most(v)));
        prop_assert_eq!(rail.force(0.0), 0.0);
        // At high speed, only the parts that depend on the direction and on the speed remain.
        for side in [-1.0, 1.0] {
            let wanted = side * (coulomb * (1.0 + side * lopsided) + 20.0 * viscous);
            prop_assert!((rail.force(side * 20.0) - wanted).abs() <= 1e-9, "{wanted}");
        }
        let even = Friction { lopsided: 0.0, ..rail };
        prop_assert!(speeds.iter().all(|v| even.force(*v) == -even.force(-v)));
        // The force is proportional to the load's absolute value.
        let n = speeds.len().min(load.len());
        let bearing = LoadFriction { mu: coulomb, width: width.max(1e-3) };
        let (speeds, load) = (&speeds[..n], &load[..n]);
        let found = force(&bearing, speeds, load);
        prop_assert!(speeds.iter().zip(&found).all(|(v, f)| v * f >= 0.0));
        let doubled: Vec<f64> = load.iter().map(|x| -2.0 * x).collect();
        let twice: Vec<f64> = found.iter().map(|f| 2.0 * f).collect();
        prop_assert!(apart(&force(&bearing, speeds, &doubled), &twice) <= ROUNDING);
    }

    /// No limit moves the output outside the range of the input's motion.
    #[test]
    fn limits_stay_within_the_motion(turns in turns(), rate in 0.5..20.0_f64, acceleration in 5.0..80.0_f64) {
        let path = motion(&turns, 20);
        let [low, high] = [f64::min, f64::max].map(|f| path.iter().copied().fold(path[0], f));
        let y = respond(&SlewLimit { rate }, &path);
        prop_assert!(y.iter().all(|y| (low..=high).contains(y)));
        // A profile has to brake, so it may pass a turning point by its braking distance.
        let y = respond(&Profile { acceleration, rate }, &path);
        let brakes = 0.5 * rate * rate / acceleration + rate * DT_S;
        prop_assert!(y.iter().all(|y| (low - brakes..=high + brakes).contains(y)));
    }
}

/// A conductance below the least one is produced by pulses, whose mean is the correct share.
#[test]
fn a_gate_lets_its_share_pass() {
    let (least, count) = (0.02, 4000);
    for u in [0.001, 0.002, 0.004] {
        let valve = DeadBand { u_db: 0.01, softness: 1.5, gate: 0.9, least };
        let open = DeadBand { gate: 0.0, ..valve };
        let pulses = respond(&valve, &vec![u; count]).iter().filter(|y| **y > 0.0).count();
        let passed = 1.0 - (-u / (0.01 * 0.9)).exp();
        let due = (least + (1.0 - least) * respond(&open, &[u])[0]) * passed / least;
        assert!((pulses as f64 - due * count as f64).abs() <= 1.0, "{u}: {pulses} of {due}");
    }
}
