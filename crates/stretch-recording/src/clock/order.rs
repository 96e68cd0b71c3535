//! Stamps that go back: counters that roll over, and rows whose stamps are out of order.

use crate::clock::{BRIDGED, Stamps};

/// Bits after which counters begin again.
const BITS: [i32; 4] = [16, 24, 31, 32];
/// Seconds after which times begin again: the hour, half a day, a day, a week of GPS.
const PERIODS_S: [f64; 4] = [3600.0, 43_200.0, 86_400.0, 604_800.0];
/// Steps that a counter holds at least.
const SHORTEST: f64 = 3.0;
/// A counter that holds more steps than this may lose samples where it rolls over; steps over the end of a shorter one, which may be so
/// long by chance, differ by less than this share.
const LONG: f64 = 100.0;
const SAME: f64 = 0.02;
/// Share of what a counter holds, at either end, between which samples may be lost where it rolls over.
const END: f64 = 0.01;
/// Gap after stamps of a clock that was not set yet, in lengths of all that follows, and in steps.
const UNSET: (f64, f64) = (10.0, 1e6);

/// Counts after which a clock with so many a second may begin again: those of a counter, also one whose counts were divided.
fn moduli(per_second: f64) -> impl Iterator<Item = f64> {
    let units = [1.0, per_second / 1e3, per_second / 1e6, per_second / 1e9];
    let counters = BITS.into_iter().flat_map(move |bits| units.map(|unit| 2_f64.powi(bits) * unit));
    counters.chain(PERIODS_S.map(|period_s| period_s * per_second))
}

/// What is added to a stamp that goes back, if a clock rolled over: the step over its end is then as long as the others, or leads from
/// the end of a counter to its beginning. The stamps are as recorded.
pub(super) fn roll_over(from: f64, to: f64, step: f64, per_second: f64) -> Option<f64> {
    moduli(per_second).find(|modulus| {
        let (over_the_end, length) = (to - from + modulus, modulus / step);
        let is_end = || from < *modulus && to >= 0.0 && over_the_end < END * modulus;
        match length > LONG {
            true => over_the_end > 0.0 && (over_the_end <= BRIDGED * step || is_end()),
            false => length >= SHORTEST && (over_the_end / step - 1.0).abs() <= SAME,
        }
    })
}

/// Adds what a clock lost where it rolled over, and says so.
pub(super) fn unroll(stamps: &mut Stamps, step: f64, per_second: f64) -> Option<String> {
    let (mut added, mut first, mut times) = (0.0, None, 0);
    for i in 1..stamps.counts.len() {
        let (from, to) = (stamps.recorded(i - 1) - added, stamps.recorded(i));
        if to < from
            && let Some(modulus) = roll_over(from, to, step, per_second)
        {
            added += modulus;
            times += 1;
            first.get_or_insert((i, modulus / per_second));
        }
        stamps.counts[i] += added;
    }
    let (first, added_s) = first?;
    Some(note(stamps.rows.row(first), added_s, times))
}

/// A note on a clock that rolled over.
pub(super) fn note(row: u64, added_s: f64, times: usize) -> String {
    match times {
        1 => format!("the clock rolls over in row {row}: {added_s} s are added from there on"),
        _ => format!(
            "the clock rolls over {times} times, first in row {row}: {added_s} s are added each time"
        ),
    }
}

/// How many of the first samples were stamped before the clock was set: the gap behind them is many times what follows.
pub(super) fn before_the_clock_was_set(counts: &[f64], step: f64) -> usize {
    let Some(last) = counts.last() else { return 0 };
    let is_gap = |i: &usize| {
        let gap = counts[*i] - counts[i - 1];
        gap > UNSET.1 * step && gap > UNSET.0 * (last - counts[*i])
    };
    (1..=counts.len() / 5).rfind(is_gap).unwrap_or(0)
}
