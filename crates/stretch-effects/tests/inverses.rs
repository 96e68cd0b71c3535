//! Tests of inverses: a bent scale, a play, and several operators in series.

use proptest::prelude::*;
use stretch_effects::{Backlash, Bow, BowedGain, Offset, Operator, Row, Span, bow};

use crate::support::{apart, cases, largest, quickest, respond, samples, signal};

fn undone(operator: &dyn Operator, signal: &[f64]) -> Vec<f64> {
    let mut out = signal.to_vec();
    operator.undo(&mut out);
    out
}

/// A motion of two tones, which reverses many times at different places.
fn two_tones(slow: f64, quick: f64, share: f64) -> Vec<f64> {
    let at = |i: usize| {
        let t = 0.001 * i as f64;
        3.0 * (1.0 - share) * (slow * t).sin() + 3.0 * share * (quick * t).sin()
    };
    (0..12_000).map(at).collect()
}

proptest! {
    #![proptest_config(cases(24))]

    /// Without a skew a bent scale is undone exactly. With a skew, each of eight substitutions shrinks the error by the
    /// slope.
    #[test]
    fn a_bent_scale_is_undone(z in prop::collection::vec(0.0..=1.0_f64, 2..40), c in -0.1..0.1_f64, skew in prop_oneof![Just(0.0), -1.0..1.0_f64], zero in -3.0..3.0_f64, span in 0.5..5.0_f64) {
        let scale = Bow { c: c * span, skew, zero, span };
        let x: Vec<f64> = z.iter().map(|z| zero + span * z).collect();
        let off_by = apart(&undone(&scale, &respond(&scale, &x)), &x);
        let slope = 4.0 * c.abs() * (1.0 + skew.abs());
        let left = if skew == 0.0 { 0.0 } else { 2.0 * (c * span).abs() * slope.powi(8) };
        prop_assert!(off_by <= left + 1e-9, "{off_by} above {left}");
    }

    /// A bow is zero at both ends and c in the middle. Reversing the skew mirrors the curve.
    #[test]
    fn a_bow_is_what_it_says(c in -1.0..1.0_f64, x in 0.0..=1.0_f64, skew in -1.0..1.0_f64) {
        prop_assert!((bow(c, 0.5, skew) - c).abs() <= 1e-15);
        prop_assert!(bow(c, 0.0, skew) == 0.0 && bow(c, 1.0, skew) == 0.0);
        prop_assert!((bow(c, x, skew) - bow(c, 1.0 - x, -skew)).abs() <= 1e-14);
        // Within its ends, a bow never exceeds twice its height.
        prop_assert!(bow(c, x, skew).abs() <= 2.0 * c.abs());
        // The curve of a gain equals that of a scale of size 1.
        let (grid, mut y) = (samples(), [2.0]);
        BowedGain { c, skew, scale: 4.0 }.run(&Span { strain: &[4.0 * x], ..Span::whole(&grid) }, &mut [], &mut y);
        prop_assert!((y[0] - 2.0 * (1.0 + bow(c, x, skew))).abs() <= 1e-14);
    }

    /// The input that is found reproduces the recorded output within a band that is proportional to the half-width.
    #[test]
    fn a_play_is_undone(w in 0.05..0.6_f64, slow in 0.8..2.0_f64, quick in 3.0..6.0_f64, share in 0.0..0.15_f64) {
        let input = two_tones(slow, quick, share);
        let play = Backlash::hard(w);
        let output = respond(&play, &input);
        let found = undone(&play, &output);
        let again = respond(&play, &found);
        // The position in the gap before the first move is unknown, so the play starts settled at the first input that
        // was found.
        prop_assert!(apart(&again, &output) <= 0.2 * w + 1e-9, "{}", apart(&again, &output));
        // The result is closer to the input than the output is, and never off by more than the whole gap.
        let rms = |a: &[f64]| a.iter().zip(&input).map(|(a, x)| (a - x) * (a - x)).sum::<f64>().sqrt();
        prop_assert!(rms(&found) < rms(&output), "{} of {}", rms(&found), rms(&output));
        prop_assert!(apart(&found, &input) <= 2.0 * w + 1e-9);
        // The result crosses the gap while the output dwells, which takes as long as the input takes.
        prop_assert!(quickest(&found) <= 2.0 * quickest(&input) + 1e-9, "{}", quickest(&found));
    }

    /// A signal that never moves, and the output of a play of zero width, remain unchanged.
    #[test]
    fn nothing_is_undone_where_nothing_moved(level in -3.0..3.0_f64, signal in signal()) {
        prop_assert_eq!(undone(&Backlash::hard(0.5), &[level; 20]), vec![level; 20]);
        let off_by = apart(&undone(&Backlash::hard(0.0), &signal), &signal);
        prop_assert!(off_by == 0.0);
        prop_assert!(undone(&Backlash::hard(0.5), &[]).is_empty());
    }

    /// A row is undone in reverse order, and the memories of its operators are separate.
    #[test]
    fn a_row_is_undone_from_its_end(z in prop::collection::vec(0.0..=1.0_f64, 2..40), c in -0.2..0.2_f64, w in 0.1..0.5_f64) {
        let bend = |c: f64, zero: f64| Box::new(Bow { c, skew: 0.0, zero, span: 2.0 });
        let row = Row::new(vec![bend(c, 0.0), bend(-0.5 * c, 0.5)], 0);
        let (grid, mut y) = (samples(), z.clone());
        row.run(&Span::whole(&grid), &mut [], &mut y);
        row.undo(&mut y);
        prop_assert!(apart(&y, &z) <= 1e-9 * (1.0 + largest(&z)));
        // In a row, the second play is driven by the first.
        let row = Row::new(vec![Box::new(Backlash::hard(w)), Box::new(Offset { at_start: 1.0, per_s: 0.0 }), Box::new(Backlash::hard(2.0 * w))], 3);
        let mut cells = vec![7.0; row.end()];
        let mut both = z.clone();
        row.begin(&Span::whole(&grid), stretch_effects::Start::Settled, z[0], &mut cells);
        row.run(&Span::whole(&grid), &mut cells, &mut both);
        let first: Vec<f64> = respond(&Backlash::hard(w), &z).iter().map(|y| y + 1.0).collect();
        prop_assert_eq!(both, respond(&Backlash::hard(2.0 * w), &first));
        prop_assert_eq!(&cells[..3], &[7.0; 3], "cells before the row are another's");
    }
}
