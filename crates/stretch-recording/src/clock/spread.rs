//! Stamps that repeat or come in coarse ticks: samples are spread evenly within the ticks.

use crate::clock::{Stamps, Steps};

/// One stamp in so many that repeats makes the clock a coarse one.
const ONE_IN: usize = 20;
/// One step in so many of another number of ticks does, too: fewer may be lost samples, also at regular times.
const OTHER_ONE_IN: usize = 5;
/// Fewest steps of another number of ticks that do.
const FEWEST: usize = 8;
/// Most ticks between two samples of a clock that is called coarse.
const MOST_TICKS: f64 = 3.5;
/// By how much of a tick a step may differ from whole ticks: clocks of 15.6 ms are written as 15 and 16.
const WHOLE: f64 = 0.15;
/// How far stamps may be from an even clock, in ticks, beyond the one by which ticks are coarse.
const ROUNDING: f64 = 0.02;
/// The same if stamps repeat: ticks themselves come early and late.
const JITTERED: f64 = 1.0;
/// Ticks after which a coarse clock has a gap.
const GAP: f64 = 3.5;

/// Spreads samples with the same stamp evenly up to the next one, and those of a coarse clock along an even one; the samples for which
/// there is no time left.
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
                "the clock has ticks of {} ms; the samples are spread evenly within them, {} a second",
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
            "row {row} has the stamp of the row before ({stamp}); it is spread evenly up to the next stamp"
        )),
        many => notes.push(format!(
            "{many} rows have the stamp of the row before, the first of them row {row} ({stamp}); they are spread evenly up to the next stamp"
        )),
    }
    left_out
}

/// Whether an even clock of this step is nowhere farther from the stamps than a tick.
pub(super) fn is_even(counts: &[f64], step: f64, tick: f64) -> bool {
    let (least, greatest) = offsets(counts, step);
    greatest - least <= (1.0 + ROUNDING) * tick
}

/// With one digit and so many more.
pub(super) fn rounded(value: f64, more: i32) -> f64 {
    let scale = 10_f64.powi(more.saturating_sub(value.abs().log10().floor() as i32));
    let rounded = (value * scale).round() / scale;
    if rounded.is_finite() { rounded } else { value }
}

/// The tick of a clock without repeated stamps whose steps are now one number of ticks, now another.
pub(super) fn tick_of(counts: &[f64], steps: Steps) -> Option<f64> {
    if steps.repeated > 0 {
        return None;
    }
    let all = || counts.windows(2).map(|t| t[1] - t[0]);
    let least = all().fold(f64::INFINITY, f64::min);
    if steps.tick > MOST_TICKS * least {
        return None;
    }
    // Most clocks are even; that needs no division.
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

/// Puts the samples between gaps on an even clock that no stamp is more than `most` ticks away from; the step of that clock. None, and
/// nothing is changed, if there is no such clock.
fn even_out(counts: &mut [f64], tick: f64, most: f64, per_second: f64) -> Option<f64> {
    let parts: Vec<&mut [f64]> = counts.chunk_by_mut(|a, b| b - a <= GAP * tick).collect();
    let longest = parts.iter().max_by_key(|part| part.len())?;
    let fitted = slope(longest)?;
    let most = most * tick;
    let range = |part: &[f64], step: f64| {
        let (least, greatest) = offsets(part, step);
        greatest - least
    };
    // The rate with the fewest digits that fits as well as any.
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

/// Step of the straight line through samples.
fn slope(part: &[f64]) -> Option<f64> {
    let middle = (part.len() as f64 - 1.0) / 2.0;
    let (mut across, mut along) = (0.0, 0.0);
    for (i, count) in part.iter().enumerate() {
        let x = i as f64 - middle;
        (across, along) = (across + x * x, along + x * (count - part[0]));
    }
    Some(along / across).filter(|slope| *slope > 0.0 && slope.is_finite())
}

/// Least and greatest stamp less the time of an even clock.
fn offsets(part: &[f64], step: f64) -> (f64, f64) {
    let offset = part.iter().enumerate().map(|(i, count)| count - i as f64 * step);
    offset.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
}

/// Spreads each run of samples with one stamp up to the next stamp; the samples for which there is no room: on a clock that is not
/// coarse, those that came within less than their usual steps.
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
