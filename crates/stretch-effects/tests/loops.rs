//! Plays, hysteresis and friction by position: rate-independent loops.

use proptest::prelude::*;
use stretch_effects::{
    Backlash, BoucWen, Dahl, HoldBand, Loops, Operator, PrandtlIshlinskii, Span, Start,
};

use crate::support::{apart, cases, force, motion, respond, run, samples, turns};

/// A few hundred roundings of values up to 10, divided by a `back` of 0.01.
const ROUNDING: f64 = 1e-10;

fn play() -> impl Strategy<Value = Backlash> {
    (0.0..1.5_f64, prop_oneof![Just(0.0), 0.0..0.95_f64])
        .prop_map(|(w, spread)| Backlash::soft(w, spread))
}

fn hysteresis() -> impl Strategy<Value = PrandtlIshlinskii> {
    (0.0..1.0_f64, 0.05..1.5_f64, 0.15..0.95_f64)
        .prop_map(|(h, s, spread)| PrandtlIshlinskii::new(Loops { h, s, spread }))
}

fn bouc_wen() -> impl Strategy<Value = BoucWen> {
    (0.01..0.5_f64, 0.05..1.5_f64).prop_map(|(c, s)| BoucWen { c, s })
}

/// A contact without play.
fn contact() -> impl Strategy<Value = Dahl> {
    (0.1..5.0_f64, 0.05..1.5_f64, prop_oneof![Just(0.0), Just(1.0), 0.01..1.0_f64])
        .prop_map(|(f, s, back)| Dahl { f, s, back, w: 0.0, load_size: None })
}

/// Lag of the output along a motion, or the force of a contact.
fn held(operator: &dyn Operator, is_force: bool, path: &[f64]) -> Vec<f64> {
    if is_force {
        return force(operator, path, &[]);
    }
    path.iter().zip(respond(operator, path)).map(|(x, y)| x - y).collect()
}

/// Every loop, with whether its output is a force.
fn loops() -> impl Strategy<Value = (Box<dyn Operator>, bool)> {
    prop_oneof![
        play().prop_map(|o| (Box::new(o) as Box<dyn Operator>, false)),
        hysteresis().prop_map(|o| (Box::new(o) as Box<dyn Operator>, false)),
        bouc_wen().prop_map(|o| (Box::new(o) as Box<dyn Operator>, false)),
        contact().prop_map(|o| (Box::new(o) as Box<dyn Operator>, true)),
    ]
}

proptest! {
    #![proptest_config(cases(96))]

    /// The output depends on the path only, not on the speed.
    #[test]
    fn loops_have_no_rate((operator, is_force) in loops(), turns in turns(), slow in 2..20_usize) {
        let quick = held(&*operator, is_force, &motion(&turns, 1));
        let slow_path = held(&*operator, is_force, &motion(&turns, slow));
        let at_turns: Vec<f64> = slow_path.iter().step_by(slow).copied().collect();
        prop_assert!(apart(&quick, &at_turns) <= ROUNDING, "{quick:?} {at_turns:?}");
    }

    /// From rest no motion gains energy. The held part moves with the motion, so its last value bounds the work of a
    /// step.
    #[test]
    fn loops_are_passive((operator, is_force) in loops(), turns in turns()) {
        let path = motion(&turns, 7);
        let held = held(&*operator, is_force, &path);
        let mut work = 0.0;
        for (step, held) in path.windows(2).zip(&held[1..]) {
            work += held * (step[1] - step[0]);
            prop_assert!(work >= -ROUNDING, "{work}");
        }
    }

    /// The held part is bounded, and a long move reaches the bound.
    #[test]
    fn a_long_way_fills_a_loop((operator, is_force) in loops(), turns in turns(), side in prop_oneof![Just(-1.0), Just(1.0)]) {
        let far = [turns.as_slice(), &[side * 80.0, side * 120.0]].concat();
        let all = held(&*operator, is_force, &motion(&far, 5));
        let full = all[all.len() - 1];
        prop_assert!(side * full >= 0.0);
        prop_assert!(all.iter().all(|held| held.abs() <= full.abs() + ROUNDING), "{full} of {all:?}");
    }

    /// A given hysteresis state equals the one that the described motion leaves.
    #[test]
    fn a_given_state_is_that_of_a_motion((operator, is_force) in loops(), turns in turns(), side in prop_oneof![Just(-1.0), Just(1.0)]) {
        let path = motion(&turns, 3);
        let grid = samples();
        let after = |cells: &mut [f64], start: Start| {
            let zeros = vec![0.0; path.len()];
            let (strain, signal) = if is_force { (&path[..], &zeros[..]) } else { (&[][..], &path[..]) };
            run(&*operator, cells, start, Span { strain, ..Span::whole(&grid) }, signal, path.len())
        };
        let given = after(&mut vec![0.0; operator.cells()], Start::Hysteresis(side));
        // The motion starts far away and moves straight to the first value.
        let mut cells = vec![0.0; operator.cells()];
        operator.begin(Start::Settled, turns[0] - side * 100.0, &mut cells);
        let moved = after(&mut cells, Start::Carried { rest_s: 0.0 });
        prop_assert!(apart(&given, &moved) <= ROUNDING, "{given:?} {moved:?}");
    }

    /// A trial that continues the preceding one gives the same output as a single motion.
    #[test]
    fn trials_that_carry_on_are_one_motion((operator, is_force) in loops(), first in turns(), second in turns()) {
        let whole = held(&*operator, is_force, &[first.as_slice(), &second].concat());
        let grid = samples();
        let mut cells = vec![0.0; operator.cells()];
        let mut parts = Vec::new();
        for (path, start) in [(&first, Start::Settled), (&second, Start::Carried { rest_s: 5.0 })] {
            let zeros = vec![0.0; path.len()];
            let (strain, signal) = if is_force { (&path[..], &zeros[..]) } else { (&[][..], &path[..]) };
            let out = run(&*operator, &mut cells, start, Span { strain, ..Span::whole(&grid) }, signal, 3);
            parts.extend(path.iter().zip(out).map(|(x, y)| if is_force { y } else { x - y }));
        }
        prop_assert!(apart(&whole, &parts) <= ROUNDING);
    }

    /// A closed excursion within a larger one leaves no trace in plays (wiping out).
    #[test]
    fn a_closed_excursion_leaves_no_trace(play in play(), hysteresis in hysteresis(), before in turns(), inner in 0.0..1.0_f64, after in turns()) {
        let (from, to) = (before[before.len() - 2], before[before.len() - 1]);
        let back = to + inner * (from - to);
        let excursion = [before.as_slice(), &[back, to], &after].concat();
        let plain = [before.as_slice(), &after].concat();
        for operator in [&play as &dyn Operator, &hysteresis] {
            let (with, without) = (respond(operator, &excursion), respond(operator, &plain));
            let n = before.len();
            prop_assert!(apart(&with[n + 2..], &without[n..]) <= ROUNDING);
            prop_assert!((with[n + 1] - with[n - 1]).abs() <= ROUNDING, "back to the same state");
        }
    }

    /// Loops of plays between the same ends have the same form for any history (congruency).
    #[test]
    fn loops_between_the_same_ends_are_congruent(hysteresis in hysteresis(), one in turns(), other in turns(), low in -2.0..0.0_f64, high in 0.0..2.0_f64) {
        let round = |before: &[f64]| {
            let path = [before, &[low, high], &motion(&[high, low, high], 9)].concat();
            let out = respond(&hysteresis, &path);
            let start = out[before.len() + 2];
            out[before.len() + 2..].iter().map(|y| y - start).collect::<Vec<f64>>()
        };
        prop_assert!(apart(&round(&one), &round(&other)) <= ROUNDING);
    }

    /// A wide sweep erases the memory of smooth loops, and the loops then close.
    #[test]
    fn smooth_loops_close_after_a_wide_sweep(bouc_wen in bouc_wen(), contact in contact(), one in turns(), other in turns()) {
        let wide = |s: f64| 40.0 * s;
        for (operator, is_force, s) in [(&bouc_wen as &dyn Operator, false, bouc_wen.s), (&contact, true, contact.s)] {
            let end = |before: &[f64]| {
                let sweep = [wide(s), -wide(s), wide(s)].map(|far| far + 3.0 * far.signum());
                let path = [before, &sweep, &[0.5, -0.5, 0.5]].concat();
                let all = held(operator, is_force, &path);
                all[before.len() + 2..].to_vec()
            };
            prop_assert!(apart(&end(&one), &end(&other)) <= 1e-9);
        }
    }

    /// From rest, a move over the distance d moves the state of every play by d, but at most by its half-width. The
    /// output is held back by the mean of these states.
    #[test]
    fn plays_fill_up_to_their_widths(h in 0.0..1.0_f64, s in 0.05..1.5_f64, spread in 0.15..0.95_f64, d in -2.0..2.0_f64) {
        let mean = |widths: [f64; 3]| widths.iter().map(|w| d.abs().min(*w)).sum::<f64>() / 3.0 * d.signum();
        let hysteresis = PrandtlIshlinskii::new(Loops { h, s, spread });
        let behind = held(&hysteresis, false, &[0.0, d]);
        prop_assert!((behind[1] - h * mean([s, s * spread, s * spread * spread])).abs() <= ROUNDING);
        let behind = held(&Backlash::soft(s, spread), false, &[0.0, d]);
        prop_assert!((behind[1] - mean([s, s * (1.0 - spread), s * (1.0 + spread)])).abs() <= ROUNDING);
    }

    /// A play stays within its half-width, moves only if it is pushed, and moves no further than its input.
    #[test]
    fn a_play_is_pushed(w in 0.0..1.5_f64, turns in turns()) {
        let path = motion(&turns, 5);
        let out = respond(&Backlash::hard(w), &path);
        for (x, y) in path.windows(2).zip(out.windows(2)) {
            let behind = x[1] - y[1];
            prop_assert!(behind.abs() <= w + ROUNDING);
            let moved = y[1] - y[0];
            prop_assert!(moved == 0.0 || (behind.abs() >= w - ROUNDING && behind * moved >= 0.0), "{behind} {moved}");
            prop_assert!(moved.abs() <= (x[1] - x[0]).abs() + ROUNDING);
        }
    }

    /// The outputs of two inputs differ by no more than the inputs.
    #[test]
    fn a_play_is_a_contraction(play in play(), pairs in prop::collection::vec((-3.0..3.0_f64, -0.2..0.2_f64), 2..40)) {
        let one: Vec<f64> = pairs.iter().map(|(x, _)| *x).collect();
        let other: Vec<f64> = pairs.iter().map(|(x, off)| x + off).collect();
        let off_by = apart(&respond(&play, &one), &respond(&play, &other));
        prop_assert!(off_by <= apart(&one, &other) + ROUNDING);
    }

    /// A dead band of the firmware that stops a whole band before its target equals a play.
    #[test]
    fn a_band_that_stops_short_is_a_play(w in 0.0..1.5_f64, turns in turns()) {
        let path = motion(&turns, 4);
        let band = respond(&HoldBand { w, short: 1.0 }, &path);
        prop_assert!(apart(&band, &respond(&Backlash::hard(w), &path)) <= ROUNDING);
    }

    /// Behind a play the force of a contact follows the output of the play. A load scales the force.
    #[test]
    fn a_contact_rubs_behind_its_play(contact in contact(), w in 0.0..0.5_f64, turns in turns(), load in -3.0..3.0_f64) {
        let path = motion(&turns, 4);
        let behind = force(&Dahl { w, ..contact }, &path, &[]);
        let let_through = respond(&Backlash::hard(w), &path);
        prop_assert!(apart(&behind, &force(&contact, &let_through, &[])) <= ROUNDING);
        let loaded = force(&Dahl { load_size: Some(2.0), ..contact }, &path, &vec![load; path.len()]);
        let scaled: Vec<f64> = force(&contact, &path, &[]).iter().map(|f| f * load.abs() / 2.0).collect();
        prop_assert!(apart(&loaded, &scaled) <= ROUNDING);
    }

    /// Half of the force builds up from rest over a distance of s ln 2, for any steepness after a reversal.
    #[test]
    fn a_contact_builds_up_over_its_presliding_length(contact in contact()) {
        let way = contact.s * 2.0_f64.ln();
        let found = force(&contact, &[0.0, way], &[]);
        prop_assert!((found[1] - 0.5 * contact.f).abs() <= ROUNDING);
    }
}

/// A full opposing force vanishes over s ln 2 in Dahl's model, and over s in the model of Bouc and Wen.
#[test]
fn a_contact_turns_as_steeply_as_it_says() {
    for (back, way) in [(1.0, 2.0_f64.ln()), (0.0, 1.0)] {
        let contact = Dahl { f: 1.0, s: 0.5, back, w: 0.0, load_size: None };
        let found = force(&contact, &[0.0, 50.0, 50.0 - 0.5 * way], &[]);
        assert!(found[2].abs() < ROUNDING, "{back}: {found:?}");
    }
}
