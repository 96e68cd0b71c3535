//! Stamps that go back because a counter rolls over, and stamps from before the clock was set.

use crate::clock::{BRIDGED, Stamps};

/// Widths of counters that roll over, bits.
const BITS: [i32; 4] = [16, 24, 31, 32];
/// Periods after which a time of day or of the week starts again, s: an hour, half a day, a day, a GPS week.
const PERIODS_S: [f64; 4] = [3600.0, 43_200.0, 86_400.0, 604_800.0];
/// Shortest period of a counter, in steps.
const SHORTEST: f64 = 3.0;
/// Period of a counter, in steps, above which samples may be lost where it rolls over. With a shorter period, a step
/// back can look like a roll-over by chance. The step across the roll-over may then differ from the usual step by at
/// most the share `SAME`.
const LONG: f64 = 100.0;
const SAME: f64 = 0.02;
/// Longest step across a roll-over, as a share of the period, if both stamps lie within the range of the counter. More
/// samples may be lost there than `BRIDGED` allows.
const END: f64 = 0.01;
/// Shortest gap between the stamps from before a clock was set and the later stamps: as a multiple of the duration
/// after the gap, and as a multiple of the usual step. Both must be exceeded.
const UNSET: (f64, f64) = (10.0, 1e6);

/// Returns the periods, in counts, of clocks with `per_second` counts per second. They include counters of ms, us or ns
/// whose values were then converted to another unit.
fn moduli(per_second: f64) -> impl Iterator<Item = f64> {
    let units = [1.0, per_second / 1e3, per_second / 1e6, per_second / 1e9];
    let counters = BITS.into_iter().flat_map(move |bits| units.map(|unit| 2_f64.powi(bits) * unit));
    counters.chain(PERIODS_S.map(|period_s| period_s * per_second))
}

/// Returns the period to add if a stamp goes back because the clock rolled over. The step across the roll-over must be
/// about as long as the others, or lead from the end of the counter's range to its beginning. The stamps are as
/// recorded.
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

/// Adds the period of the clock after each roll-over, and returns a note.
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

/// Counts the first samples that were stamped before the clock was set. The gap after them is many times as long as the
/// rest of the recording.
pub(super) fn before_the_clock_was_set(counts: &[f64], step: f64) -> usize {
    let Some(last) = counts.last() else { return 0 };
    let is_gap = |i: &usize| {
        let gap = counts[*i] - counts[i - 1];
        gap > UNSET.1 * step && gap > UNSET.0 * (last - counts[*i])
    };
    (1..=counts.len() / 5).rfind(is_gap).unwrap_or(0)
}
