//! Stamps that repeat or have a coarse resolution (tick). Their samples are spread evenly within the ticks.

use crate::clock::{Stamps, Steps};

/// A clock is coarse if at least one stamp in this many repeats.
const ONE_IN: usize = 20;
/// A clock without repeated stamps is coarse if at least one step in this many differs from the usual number of ticks.
/// If fewer steps differ, they may be lost samples, even at regular intervals.
const OTHER_ONE_IN: usize = 5;
/// A clock is coarse only if at least this number of steps have an unusual number of ticks.
const FEWEST: usize = 8;
/// Largest ratio of the median step to the shortest step on a coarse clock.
const MOST_TICKS: f64 = 3.5;
/// Largest difference between a step and a whole number of ticks, in ticks. Recorded steps are rounded: 15.6 ms are
/// written as 15 or 16.
const WHOLE: f64 = 0.15;
/// Allowed range of the deviations of stamps from an even clock, in ticks, in addition to the one tick of the coarse
/// resolution.
const ROUNDING: f64 = 0.02;
/// The value that replaces `ROUNDING` for stamps that repeat. It is larger because their ticks have jitter.
const JITTERED: f64 = 1.0;
/// Longest step of a coarse clock without a gap, in ticks.
const GAP: f64 = 3.5;

/// Spreads samples with the same stamp evenly up to the next stamp, and the samples of a coarse clock along an even
/// clock. Returns the samples for which there is no time left.
pub(super) fn spread(
    stamps: &mut Stamps,
    steps: Steps,
    per_second: f64,
    notes: &mut Vec<String>,
) -> Vec<usize> {
    let count = stamps.counts.len();
    let is_coarse = steps.repeated * ONE_IN >= count && steps.repeated > 1;
    let tick = if is_coarse { Some(steps.tick) } else { tick_of(&stamps.counts, steps) };
    if let Some(tick) = tick {
        let most = 1.0 + if is_coarse { JITTERED } else { ROUNDING };
        if let Some(sample) = even_out(&mut stamps.counts, tick, most, per_second) {
            notes.push(format!(
                "the clock advances in ticks of {} ms; the samples are spread evenly, at {} per second",
                rounded(1e3 * tick / per_second, 4),
                rounded(per_second / sample, 4)
            ));
            return Vec::new();
        }
    }
    if steps.repeated == 0 {
        return Vec::new();
    }
    let first = stamps.counts.windows(2).position(|t| t[0] == t[1]).unwrap_or(0) + 1;
    let (row, stamp) = (stamps.rows.row(first), stamps.recorded(first));
    let left_out = spread_runs(&mut stamps.counts, steps, is_coarse);
    match steps.repeated.saturating_sub(left_out.len()) {
        0 => {}
        1 => notes.push(format!(
            "row {row} has the time stamp of the row before ({stamp}); it is spread evenly up to the next stamp"
        )),
        many => notes.push(format!(
            "{many} rows have the time stamp of the row before, the first of them row {row} ({stamp}); they are spread evenly up to the next stamp"
        )),
    }
    left_out
}

/// Returns whether the deviations of the stamps from an even clock of this step span at most about one tick.
pub(super) fn is_even(counts: &[f64], step: f64, tick: f64) -> bool {
    let (least, greatest) = offsets(counts, step);
    greatest - least <= (1.0 + ROUNDING) * tick
}

/// Rounds a value to `1 + more` significant digits.
pub(super) fn rounded(value: f64, more: i32) -> f64 {
    let scale = 10_f64.powi(more.saturating_sub(value.abs().log10().floor() as i32));
    let rounded = (value * scale).round() / scale;
    if rounded.is_finite() { rounded } else { value }
}

/// Returns the tick of a coarse clock without repeated stamps. Its steps are different whole numbers of ticks.
pub(super) fn tick_of(counts: &[f64], steps: Steps) -> Option<f64> {
    if steps.repeated > 0 {
        return None;
    }
    let all = || counts.windows(2).map(|t| t[1] - t[0]);
    let least = all().fold(f64::INFINITY, f64::min);
    if steps.tick > MOST_TICKS * least {
        return None;
    }
    // Most clocks are even. This check needs no division.
    let is_other = |step: &f64| (step - steps.tick).abs() > 0.5 * least;
    if all().filter(is_other).count() < FEWEST {
        return None;
    }
    let ones = all().filter(|step| *step <= (1.0 + WHOLE) * least);
    let (sum, one) = ones.fold((0.0, 0_usize), |(sum, n), step| (sum + step, n + 1));
    let tick = sum / one as f64;
    let is_whole = |step: f64| {
        let ticks = step / tick;
        ticks > GAP || (ticks - ticks.round()).abs() <= WHOLE
    };
    let usual = (steps.tick / tick).round();
    let mut others = 0;
    for step in all() {
        if !is_whole(step) {
            return None;
        }
        others += usize::from((step / tick).round() != usual);
    }
    (others >= FEWEST && others * OTHER_ONE_IN >= counts.len()).then_some(tick)
}

/// Puts the samples between gaps on an even clock, and returns the step of that clock. The deviations of the stamps
/// from it span at most `most` ticks. If there is no such clock, nothing is changed and `None` is returned.
fn even_out(counts: &mut [f64], tick: f64, most: f64, per_second: f64) -> Option<f64> {
    let parts: Vec<&mut [f64]> = counts.chunk_by_mut(|a, b| b - a <= GAP * tick).collect();
    let longest = parts.iter().max_by_key(|part| part.len())?;
    let fitted = slope(longest)?;
    let most = most * tick;
    let range = |part: &[f64], step: f64| {
        let (least, greatest) = offsets(part, step);
        greatest - least
    };
    // Prefer the rate with the fewest digits that fits as well as the fitted rate.
    let as_good = range(longest, fitted).max(tick) * (1.0 + 1e-3);
    let nice = (0..6).find_map(|more| {
        let step = per_second / rounded(per_second / fitted, more);
        (step.is_normal() && range(longest, step) <= as_good).then_some(step)
    });
    let step = nice.unwrap_or(fitted);
    if !parts.iter().all(|part| range(part, step) <= most) {
        return None;
    }
    for part in parts {
        let (_, offset) = offsets(part, step);
        part.iter_mut().enumerate().for_each(|(i, count)| *count = offset + i as f64 * step);
    }
    Some(step)
}

/// Returns the slope of the least-squares line through the stamps of consecutive samples.
fn slope(part: &[f64]) -> Option<f64> {
    let middle = (part.len() as f64 - 1.0) / 2.0;
    let (mut across, mut along) = (0.0, 0.0);
    for (i, count) in part.iter().enumerate() {
        let x = i as f64 - middle;
        (across, along) = (across + x * x, along + x * (count - part[0]));
    }
    Some(along / across).filter(|slope| *slope > 0.0 && slope.is_finite())
}

/// Returns the smallest and largest difference between a stamp and an even clock that starts at 0.
fn offsets(part: &[f64], step: f64) -> (f64, f64) {
    let offset = part.iter().enumerate().map(|(i, count)| count - i as f64 * step);
    offset.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
}

/// Spreads each run of samples with the same stamp up to the next stamp. Returns the samples for which there is no
/// time. On a clock that is not coarse, these are the samples after the first in a run, if the time up to the next
/// stamp is too short for the run at the usual step.
fn spread_runs(counts: &mut [f64], steps: Steps, is_coarse: bool) -> Vec<usize> {
    let (mut left_out, mut begin) = (Vec::new(), 0);
    while begin < counts.len() {
        let stamp = counts[begin];
        let run = counts[begin..].iter().take_while(|count| **count == stamp).count();
        let end = begin + run;
        let room = counts.get(end).map_or(f64::INFINITY, |next| next - stamp);
        let is_full = !is_coarse && room < (run as f64 - 0.5) * steps.tick;
        let usual = if is_coarse { steps.sample } else { steps.tick };
        let is_gap = room > 1.5 * run as f64 * usual;
        let step = if is_gap { usual } else { room / run as f64 };
        for (j, count) in counts[begin..end].iter_mut().enumerate().skip(1) {
            let at = stamp + j as f64 * step;
            if is_full || at <= stamp || at >= stamp + room {
                left_out.push(begin + j);
            } else {
                *count = at;
            }
        }
        begin = end;
    }
    left_out
}
