//! Checks of the columns alone, without any simulation, for copied, dead and stuck channels.
//!
//! Every test asks whether noise can explain the recording. The standard deviation s of the noise
//! is estimated from differences of second and of fourth order. Both pass white noise, but almost
//! no slow motion:
//!
//! ```text
//! s2^2 = median(d2^2)/(6 * 0.4549),   s4^2 = median(d4^2)/(70 * 0.4549),   white where s4 is about s2
//! ```
//!
//! A copied column shares the noise of another. A dead one shows only noise, and a stuck one
//! repeats a single value, while other columns move. The functions below state the exact criteria.

use stretch_data::ends;

use crate::{
    problem::{
        column::Column,
        fault::DELAY_S,
        noise::{median, take_waves_out},
        spec::TrialSpec,
    },
    record::gross::Gross,
};

/// Largest residual of a copy, as a share of the standard deviation that independent noises would
/// leave.
const COPY: f64 = 0.5;
/// Correlation of second differences above which two columns have the same noise.
const ALIKE: f64 = 0.9;
/// Range of s4/s2 in which noise counts as white.
const WHITE: (f64, f64) = (0.7, 1.4);
/// Share of its range that another column must cover during a stretch in which a column seems dead.
/// The same share proves that a constant column is stuck and not behind a play (backlash).
const RANGE: f64 = 0.8;
/// Number of standard deviations of a block's mean by which the block means of a dead column differ
/// at most from their centre.
const KEEPS: f64 = 4.0;
/// Number of samples in a block of the check for dead columns.
const BLOCK: usize = 10;
/// Size of the autocorrelation, at lags up to [`BLOCK`] samples, that noise does not exceed.
const REPEATS: f64 = 0.5;
/// Smallest share of its range by which another column moves while one is stuck.
const MOVES: f64 = 0.3;
/// Smallest jump at the end of a stuck stretch, in multiples of the 99.9 % quantile of all steps.
const JUMP: f64 = 3.0;
/// Natural logarithm of the probability (1e-9) below which repetitions are not attributed to
/// chance.
const CHANCE: f64 = -20.7;

/// Returns the errors that are visible in the columns of a session alone; usually there are none.
pub(crate) fn columns_alone(columns: &[Column<'_>], trials: &[TrialSpec], dt_s: f64) -> Vec<Gross> {
    let own: Vec<&Column<'_>> = columns.iter().filter(|c| !c.values.is_empty()).collect();
    let mut out = Vec::new();
    for (i, a) in own.iter().enumerate() {
        for b in &own[i + 1..] {
            if let Some(factor) = copied(&a.values, &b.values) {
                out.push(Gross::copied(b, a, factor));
            }
        }
    }
    let Some(shortest) = own.iter().map(|c| c.values.len()).min() else { return out };
    let ranges = TrialSpec::ranges(trials).into_iter().map(|range| (range.start, range.end));
    let bounds: Vec<(usize, usize)> = ranges.filter(|(_, to)| *to <= shortest).collect();
    for (i, column) in own.iter().enumerate() {
        let others: Vec<&[f64]> =
            own.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, c)| &*c.values).collect();
        let dead = dead(&column.values, &others, &bounds, dt_s);
        let stretches = match dead.is_empty() {
            true => stuck(&column.values, &others, &bounds),
            false => dead,
        };
        let placed = |(from, to): (usize, usize)| {
            let trial = bounds.iter().position(|(_, end)| from < *end).unwrap_or(0);
            let s = |at: usize| (at - bounds[trial].0) as f64 * dt_s;
            (trials[trial].name.clone(), s(from), s(to))
        };
        let places: Vec<(String, f64, f64)> = stretches.into_iter().map(placed).collect();
        if let Some(first) = places.first() {
            out.push(Gross::still(column, first, places.len()));
        }
    }
    out
}

/// Estimates the standard deviation of white noise from differences of order two and of order four.
fn noise(values: &[f64]) -> (f64, f64) {
    let of = |weights: &[f64]| {
        let power: f64 = weights.iter().map(|w| w * w).sum();
        let bends = values.windows(weights.len());
        let bends = bends.map(|w| w.iter().zip(weights).map(|(x, w)| x * w).sum::<f64>());
        let squares = bends.map(|bend| bend.powi(2) / power).collect();
        // The median of a squared normal variable is 0.4549 of its mean.
        (median(squares).unwrap_or(0.0) / 0.4549).sqrt()
    };
    (of(&[1.0, -2.0, 1.0]), of(&[1.0, -4.0, 6.0, -4.0, 1.0]))
}

/// Returns the factor by which column `b` is a copy of column `a`, including its noise; `None` if
/// it is no copy.
/// The residual of the regression of `b` on `a` must be less than half of sqrt(s_b^2 + factor^2
/// s_a^2), which independent noises would leave; a copy leaves only rounding. The second
/// differences must be correlated as well, because hum in one column could be taken for its noise.
/// Without white noise the result is `None`, because two good sensors would look the same.
///
/// ```
/// use stretch_gap::{RandomGenerator, copied};
/// let mut random = RandomGenerator::new(1, 0);
/// let a: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i) + 0.1 * random.gauss()).collect();
/// let b: Vec<f64> = a.iter().map(|x| 2.0 * x + 1.0).collect();
/// let c: Vec<f64> = (0..1000).map(|i| 0.02 * f64::from(i) + 0.1 * random.gauss()).collect();
/// assert!(copied(&a, &b).is_some_and(|factor| (factor - 2.0).abs() < 1e-9));
/// assert_eq!(copied(&a, &c), None);
/// ```
pub fn copied(a: &[f64], b: &[f64]) -> Option<f64> {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum::<f64>() / n as f64
    };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    if n < 10 || xx <= 0.0 || yy <= 0.0 {
        return None;
    }
    let factor = xy / xx;
    let left = sum(&|x, y| (y - factor * x).powi(2));
    let ((a2, a4), (b2, b4)) = (noise(a), noise(b));
    let is_white = |s2: f64, s4: f64| (WHITE.0 * s2..=WHITE.1 * s2).contains(&s4) && s2 > 0.0;
    let independent = b2 * b2 + factor * factor * a2 * a2;
    let is_copy = left < COPY * COPY * independent && alike(a, b) > ALIKE;
    (is_copy && is_white(a2, a4) && is_white(b2, b4)).then_some(factor)
}

/// Returns the absolute correlation of the second differences of two columns.
fn alike(a: &[f64], b: &[f64]) -> f64 {
    let bend = |w: &[f64]| w[0] - 2.0 * w[1] + w[2];
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.windows(3).zip(b.windows(3)) {
        let (x, y) = (bend(x), bend(y));
        aa += x * x;
        ab += x * y;
        bb += y * y;
    }
    ab.abs() / (aa * bb).sqrt().max(f64::MIN_POSITIVE)
}

/// Whether any other column covers at least the share `share` of its range within a stretch.
fn others_move(others: &[&[f64]], (from, to): (usize, usize), share: f64) -> bool {
    others.iter().any(|other| {
        let ((low, high), (a, b)) = (ends(*other), ends(&other[from..to]));
        high > low && b - a >= share * (high - low)
    })
}

/// Returns the stretches in which a column stays within its noise while another column covers most of its range. A
/// loose sleeve hides a smaller part of the range, so its slack is not reported. A signal that repeats within ten
/// samples counts as fast motion, not as noise, unless it is mains hum.
fn dead(
    values: &[f64],
    others: &[&[f64]],
    trials: &[(usize, usize)],
    dt_s: f64,
) -> Vec<(usize, usize)> {
    let late = (DELAY_S / dt_s) as usize;
    let (sd, _) = noise(values);
    let reach = 2.0 * KEEPS * sd / (BLOCK as f64).sqrt();
    let mut out = Vec::new();
    for &(begin, end) in trials {
        let blocks = (end - begin) / BLOCK;
        let mean = |i: usize| {
            let from = begin + i * BLOCK;
            values[from..from + BLOCK].iter().sum::<f64>() / BLOCK as f64
        };
        let (mut first, mut low, mut high) = (0, f64::INFINITY, f64::NEG_INFINITY);
        for i in 0..=blocks {
            let next = if i < blocks { mean(i) } else { f64::INFINITY };
            if high.max(next) - low.min(next) > reach {
                let run = (begin + first * BLOCK, begin + i * BLOCK);
                // A late column is not dead. If the column were only late, the other columns would
                // not move this much within the stretch after it is shortened by the longest delay
                // at both ends.
                let inner = (run.0 + late, run.1.saturating_sub(late));
                let is_seen = inner.1 > inner.0 && others_move(others, inner, RANGE);
                if is_seen && !repeats_itself(&values[run.0..run.1], dt_s) {
                    out.push(run);
                }
                (first, low, high) = (i, next, next);
            } else {
                (low, high) = (low.min(next), high.max(next));
            }
        }
    }
    out
}

/// Whether a stretch repeats itself, or its negative, at a lag k of at most [`BLOCK`] samples, as
/// motion does: |r_k| above [`REPEATS`] with r_k = sum x_i x_(i+k) / sum x_i^2 about the mean.
/// Mains hum is removed first.
fn repeats_itself(values: &[f64], dt_s: f64) -> bool {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let mut apart: Vec<f64> = values.iter().map(|x| x - mean).collect();
    take_waves_out(&mut apart, [0.0; 2], dt_s, (0, 1.0));
    let all: f64 = apart.iter().map(|x| x * x).sum();
    let product =
        |lag: usize| -> f64 { apart.iter().skip(lag).zip(&apart).map(|(a, b)| a * b).sum() };
    (1..=BLOCK).any(|lag| product(lag).abs() > REPEATS * all)
}

/// Returns the stretches in which a column repeats one value while another column moves. The value is not an end of the
/// range, and it is repeated so often that noise alone would repeat it in one of a billion recordings.
///
/// A sensor behind a play or a dead band also repeats values. A stretch therefore counts only in
/// three cases:
///
/// - the column has white noise;
/// - the column jumps at the end of the stretch, whereas the output of a play would continue from
///   its last value;
/// - during the stretch another column covers at least [`RANGE`] of its own range, which no play
///   could hide.
fn stuck(values: &[f64], others: &[&[f64]], trials: &[(usize, usize)]) -> Vec<(usize, usize)> {
    let (low, high) = ends(values);
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &(begin, end) in trials {
        let mut from = begin;
        for i in begin + 1..=end {
            if i == end || values[i] != values[from] {
                runs.push((from, i));
                from = i;
            }
        }
    }
    runs.sort_by_key(|(from, to)| std::cmp::Reverse(to - from));
    // The probability of a repetition is estimated without the longest runs, because these are the
    // ones in doubt.
    let doubted = |(from, to): &(usize, usize)| to - from > 20;
    let (mut equal, mut all) = (1.0, 2.0);
    for (from, to) in runs.iter().filter(|run| !doubted(run)) {
        equal += (to - from - 1) as f64;
        all += (to - from) as f64;
    }
    let (samples, repeats) = ((values.len() as f64).ln(), f64::ln(equal / all));
    let is_chance = |(from, to): (usize, usize)| samples + (to - from) as f64 * repeats > CHANCE;
    let is_end = |from: usize| values[from] == low || values[from] == high;
    runs.retain(|run| doubted(run) && !is_chance(*run) && !is_end(run.0));
    runs.retain(|run| others_move(others, *run, MOVES));
    let shows_noise = shows_noise(values);
    let most = JUMP * greatest_step(values);
    runs.retain(|&(from, to)| {
        let is_inside = trials.iter().all(|(_, end)| *end != to);
        let jumps = is_inside && (values[to] - values[to - 1]).abs() > most;
        shows_noise || jumps || others_move(others, (from, to), RANGE)
    });
    runs.sort_unstable();
    runs
}

/// Whether a column has white noise that exceeds its resolution, the smallest step between samples.
fn shows_noise(values: &[f64]) -> bool {
    let (s2, s4) = noise(values);
    let steps = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0);
    let step = steps.fold(f64::INFINITY, f64::min);
    (WHITE.0 * s2..=WHITE.1 * s2).contains(&s4) && s2 > step
}

/// Returns the 99.9 % quantile of the changes from one sample to the next.
fn greatest_step(values: &[f64]) -> f64 {
    let mut steps: Vec<f64> = values.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let at = steps.len() * 999 / 1000;
    match steps.is_empty() {
        true => 0.0,
        false => *steps.select_nth_unstable_by(at, f64::total_cmp).1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;

    const N: usize = 4000;
    const DT_S: f64 = 0.01;

    fn wave(noise: f64, seed: u64) -> Vec<f64> {
        let mut random = RandomGenerator::new(seed, 0);
        let rounded = |x: f64| (x * 1e3).round() * 1e-3;
        (0..N).map(|i| rounded(10.0 * (5e-3 * i as f64).sin() + noise * random.gauss())).collect()
    }

    #[test]
    fn a_copy_shares_its_noise_and_a_line_does_not() {
        let (a, b) = (wave(0.05, 1), wave(0.05, 2));
        let copy: Vec<f64> = a.iter().map(|x| 3.0 - 2.0 * x).collect();
        assert!(copied(&a, &copy).is_some_and(|factor| (factor + 2.0).abs() < 1e-3));
        assert_eq!(copied(&a, &b), None);
        // A column with hum larger than the residual of the regression is not a copy either.
        let hum = |i: usize| if i.is_multiple_of(2) { 0.2 } else { -0.2 };
        let humming: Vec<f64> = b.iter().enumerate().map(|(i, x)| x + hum(i)).collect();
        assert_eq!(copied(&a, &humming), None);
        // Without noise a copy cannot be distinguished from an equally good sensor.
        let smooth: Vec<f64> = (0..N).map(|i| 10.0 * (5e-3 * i as f64).sin()).collect();
        assert_eq!(copied(&smooth, &smooth), None);
    }

    #[test]
    fn a_dead_channel_is_told_from_a_loose_sleeve() {
        let other = wave(0.05, 1);
        let mut random = RandomGenerator::new(3, 0);
        let trials = [(0, N / 2), (N / 2, N)];
        let mut died = wave(0.05, 2);
        died[N / 2..].iter_mut().for_each(|x| *x = 4.0 + 0.05 * random.gauss());
        let found = dead(&died, &[&other], &trials, DT_S);
        assert!(matches!(found[..], [(from, to)] if from >= N / 2 - BLOCK && to == N), "{found:?}");
        // The slack conceals half of the stroke.
        let slack: Vec<f64> =
            wave(0.0, 2).iter().map(|x| x.max(0.0) + 0.05 * random.gauss()).collect();
        assert_eq!(dead(&slack, &[&other], &trials, DT_S), []);
    }

    /// A motion with seven samples per period looks like noise to differences, but is not dead. A
    /// broken wire that picks up hum is dead.
    #[test]
    fn quick_motion_is_not_dead_and_a_humming_wire_is() {
        let other = wave(0.05, 1);
        let mut random = RandomGenerator::new(4, 0);
        let mut waving = |turns: f64, size: f64| -> Vec<f64> {
            let wave = |i: usize| size * (std::f64::consts::TAU * turns * i as f64).sin();
            (0..N).map(|i| wave(i) + 0.05 * random.gauss()).collect()
        };
        let (quick, humming) = (waving(1.0 / 7.0, 3.0), waving(60.0 * DT_S, 0.2));
        assert_eq!(dead(&quick, &[&other], &[(0, N)], DT_S), []);
        assert_eq!(dead(&humming, &[&other], &[(0, N)], DT_S), [(0, N)]);
    }

    #[test]
    fn what_repeats_itself_is_stuck_and_a_rail_is_not() {
        let other = wave(0.05, 1);
        let trials = [(0, N)];
        let mut held = wave(0.05, 2);
        assert_eq!(stuck(&held, &[&other], &trials), []);
        let value = held[1000];
        held[1000..1300].iter_mut().for_each(|x| *x = value);
        let found = stuck(&held, &[&other], &trials);
        assert!(
            matches!(found[..], [(from, to)] if from.abs_diff(1000) < 3 && to.abs_diff(1300) < 3)
        );
        let railed: Vec<f64> = wave(0.05, 2).iter().map(|x| x.min(5.0)).collect();
        assert_eq!(stuck(&railed, &[&other], &trials), []);
        // The sensor is behind a play of a third of the range and is read by a coarse encoder. It
        // is constant at every turn and then continues from its last value.
        let step = |x: f64| (20.0 * x).round() / 20.0;
        let mut at = 0.0_f64;
        let behind = |x: &f64| {
            at = at.clamp(x - 4.0, x + 4.0);
            step(at)
        };
        let played: Vec<f64> = wave(0.0, 2).iter().map(behind).collect();
        assert_eq!(stuck(&played, &[&other], &trials), []);
        // The same encoder gets stuck. At the end it jumps to the current value.
        let mut held: Vec<f64> = wave(0.0, 2).iter().map(|x| step(*x)).collect();
        let value = held[1000];
        held[1000..1300].iter_mut().for_each(|x| *x = value);
        let found = stuck(&held, &[&other], &trials);
        assert!(matches!(found[..], [(from, to)] if from <= 1000 && to >= 1300), "{found:?}");
        // A converter with few bits repeats values throughout.
        let coarse: Vec<f64> = wave(0.05, 2).iter().map(|x| (2.0 * x).round() / 2.0).collect();
        assert_eq!(stuck(&coarse, &[&other], &trials), []);
    }
}
