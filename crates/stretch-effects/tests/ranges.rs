//! Grids of time, the extent of a channel, and ranges of parameters.

use proptest::prelude::*;
use stretch_effects::{EffectParameter, Extent, Grid, Search, Span};

use crate::support::{cases, signal};

fn grids() -> impl Strategy<Value = Grid> {
    (0.001..0.1_f64, 0.05..2.0_f64, 0.0..5.0_f64)
        .prop_map(|(dt_s, step, delay)| Grid::new(dt_s, step * dt_s, delay * dt_s).expect("a grid"))
}

fn parameters() -> impl Strategy<Value = EffectParameter> {
    (-3.0..3.0_f64, 0.1..5.0_f64, 0.0..=1.0_f64, 0..5_u8).prop_map(|(low, span, at, role)| {
        let (high, inside) = (low + span, low + at * span);
        let log = low.abs() + 0.01..=low.abs() + 0.01 + span;
        match role {
            0 => EffectParameter::sized("w", "mm", 0.0..=high.abs() + 0.1),
            1 => EffectParameter::sized("w", "mm", -span..=span),
            2 => EffectParameter::sized("low", "mm", low..=high).off_at(low),
            3 => EffectParameter::shaped("tau", "s", log),
            _ => EffectParameter::formed("knee", "mm", low..=high, inside),
        }
    })
}

proptest! {
    #![proptest_config(cases(32))]

    /// Pieces fill a sample, no piece exceeds the maximum length, and a delayed switch coincides with a border.
    #[test]
    fn pieces_fill_a_sample(dt_s in 0.001..0.1_f64, step in 0.05..2.0_f64, delay in 0.0..5.0_f64) {
        let (step_s, delay_s) = (step * dt_s, delay * dt_s);
        let grid = Grid::new(dt_s, step_s, delay_s).unwrap();
        prop_assert!((grid.steps().iter().sum::<f64>() - dt_s).abs() <= 1e-14);
        prop_assert!(grid.steps().iter().all(|h| *h > 0.0 && *h <= step_s * (1.0 + 1e-9)));
        let switch = delay_s % dt_s;
        let borders = (0..=grid.pieces()).map(|node| grid.time_s(node));
        prop_assert!(borders.into_iter().any(|t| (t - switch).abs() <= 1e-9 * dt_s + 1e-12));
        for node in 1..4 * grid.pieces() {
            let step = grid.steps()[(node - 1) % grid.pieces()];
            prop_assert!((grid.time_s(node) - grid.time_s(node - 1) - step).abs() <= 1e-12);
        }
        // A command acts after the delay.
        for sample in 0..8 {
            for piece in 0..grid.pieces() {
                let middle = sample as f64 * dt_s + grid.time_s(piece) + 0.5 * grid.steps()[piece];
                let due = ((middle - delay_s) / dt_s).floor();
                prop_assert_eq!(grid.command(sample, piece), (due >= 0.0).then_some(due as usize));
            }
        }
    }

    /// For any segment of a signal, each value belongs to the same grid step.
    #[test]
    fn every_value_has_its_piece(grid in grids(), first in 0..50_usize, count in 0..50_usize) {
        let mut visited = Vec::new();
        Span { first_node: first, ..Span::whole(&grid) }.each(count, |step, i| visited.push((i, step)));
        let wanted = |i: usize| (first + i).checked_sub(1).map(|before| before % grid.pieces());
        prop_assert_eq!(visited, (0..count).map(|i| (i, wanted(i))).collect::<Vec<_>>());
    }

    /// Quantisation steps are found in recorded data, also with a large offset.
    #[test]
    fn a_lattice_is_found(
        numbers in prop::collection::vec(-40..40_i32, 60..200),
        offset in prop_oneof![Just(0), -2_000..2_000, -2_000_000..2_000_000],
        step in 0.01..1.0_f64
    ) {
        let values: Vec<f64> = numbers.iter().map(|n| step * f64::from(n + offset)).collect();
        let extent = Extent::of([&values[..]].into_iter(), 0.01);
        prop_assume!(extent.span() > 20.0 * step);
        // A step divided by a whole number describes the same lattice.
        let times = step / extent.lattice;
        prop_assert!((times - times.round()).abs() < 0.02 && times > 0.9, "{times}");
        let phase = |x: &f64| (x / extent.lattice - (x / extent.lattice).round()).abs();
        // The search has a resolution of a tenth of a turn at the farthest value.
        prop_assert!(values.iter().all(|x| phase(x) <= 0.06), "{} of {step} at {offset}", extent.lattice);
    }

    #[test]
    fn an_extent_is_that_of_all_parts(one in signal(), other in signal(), dt_s in 0.001..0.1_f64) {
        let parts = [&one[..], &other];
        let extent = Extent::of(parts.into_iter(), dt_s);
        let all = || parts.iter().copied().flatten();
        prop_assert!(all().all(|x| (extent.low..=extent.high).contains(x)));
        prop_assert!(all().any(|x| *x == extent.low) && all().any(|x| *x == extent.high));
        let quickest = |p: &[f64]| p.windows(2).map(|w| (w[1] - w[0]).abs() / dt_s).fold(0.0, f64::max);
        prop_assert!(extent.quickest <= quickest(&one).max(quickest(&other)));
        prop_assert!(extent.late_s() >= dt_s && extent.late_s() <= (0.1 * extent.trial_s).max(dt_s));
    }

    /// Points are within the range and have an effect. A change of units scales the points.
    #[test]
    fn points_are_within_the_range(p in parameters(), unit in 0.1..100.0_f64) {
        let (low, high) = p.allowed().into_inner();
        let rounding = 1e-9 * (high - low);
        for x in p.points() {
            prop_assert!((low - rounding..=high + rounding).contains(&x) && p.off() != Some(x), "{x} of {p:?}");
        }
        let scaled = p.times(unit, "inch");
        for (a, b) in p.points().iter().zip(scaled.points()) {
            prop_assert!((a * unit - b).abs() <= 1e-9 * unit * (high - low), "{a} {b}");
        }
        let search = Search { ranges: vec![[p.min, p.max]], starts: p.points().into_iter().map(|x| vec![x]).collect() };
        let times = search.clone().times(&[unit]);
        prop_assert_eq!(times.ranges[0], [p.min * unit, p.max * unit]);
        prop_assert_eq!(times.starts[0][0], search.starts[0][0] * unit);
        prop_assert_eq!(EffectParameter::complete(std::slice::from_ref(&p), Vec::new()), vec![p.off().unwrap_or(p.usual())]);
    }
}

/// Points that need a higher sample rate are left out; if none is left, the lowest rate that would do is returned.
#[test]
fn a_search_leaves_out_what_a_rate_cannot_show() {
    let search = Search {
        ranges: vec![[0.0, 1.0], [50.0, 60.0]],
        starts: vec![vec![0.1, 50.0], vec![0.1, 60.0]],
    };
    let least = |values: &[f64]| 1.5 * values[1];
    for (rate_hz, left, needed) in [(100.0, 2, None), (80.0, 1, None), (50.0, 0, Some(75.0))] {
        let mut search = search.clone();
        assert_eq!(search.at_rate(least, rate_hz), needed);
        assert_eq!(search.starts.len(), left, "{rate_hz}");
    }
}
