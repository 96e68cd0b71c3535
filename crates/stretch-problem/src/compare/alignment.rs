//! Brings two recordings onto one clock.

use stretch_data::{Channel, Trial, in_digits};
use stretch_metrics::lag;

use super::Line;
use crate::{bench::straight_line, error::ProblemError};

/// Longest delay that the fit of the clock reaches without a shift of the recordings, s, and in samples.
pub(super) const LATE: (f64, usize) = (0.2, 20);
/// An alignment is preferred only if it reduces the unexplained part (1 - correlation) to this share.
const BETTER: f64 = 0.5;
/// Share of the correlation at the best lag below which the recordings are shifted before the fit.
const NEAR: f64 = 0.9;
/// Number of samples of the shorter recording in the cross-correlation of whole recordings. Lags up
/// to half of it are tried.
const COARSE: usize = 2000;
/// Longest time between two samples over which a recording is interpolated, in sample times.
const BRIDGED: f64 = 4.5;

/// The correlation of two columns at their best lag.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Likeness {
    /// Samples by which the second column is late.
    lag: f64,
    /// Correlation at that lag; negative if one column is upside down.
    pub(super) r: f64,
    at_zero: f64,
}

impl Likeness {
    pub(super) fn of(x: &[f64], y: &[f64], reach: usize) -> Self {
        let reach = reach.min((x.len().max(3) - 3) / 2);
        let signed = |sign: f64| {
            let y: Vec<f64> = y.iter().map(|y| sign * y).collect();
            // a constant column is like none
            lag(x, &y, reach).map_or_else(
                |_| Self::default(),
                |l| Self { lag: l.samples, r: l.correlation, at_zero: l.correlation_at_zero },
            )
        };
        let (up, down) = (signed(1.0), signed(-1.0));
        // half a period of a periodic motion looks like the other sign
        match up.r < NEAR * down.r {
            true => Self { r: -down.r, ..down },
            false => up,
        }
    }

    /// The likeness of the columns that are most alike.
    fn best(pairs: impl Iterator<Item = [Vec<f64>; 2]>, reach: usize) -> Self {
        let all = pairs.map(|[x, y]| Self::of(&x, &y, reach));
        all.max_by(|x, y| x.r.abs().total_cmp(&y.r.abs())).unwrap_or_default()
    }

    /// The line from the first to the second column at the best lag.
    pub(super) fn line(&self, x: &[f64], y: &[f64]) -> Line {
        let lag = self.lag.round() as isize;
        let (early, late) = ((-lag).max(0) as usize, lag.max(0) as usize);
        let pairs = || x[early..].iter().zip(&y[late..]);
        let (offset, gain) = straight_line(|| pairs().map(|(x, y)| (*x, *y)), 0.0);
        Line { gain, offset, left: pairs().map(|(x, y)| y - gain * x - offset).collect() }
    }
}

/// Number of samples of a time, at least those of [`LATE`].
pub(super) fn reach(dt_s: f64, time_s: f64) -> usize {
    ((time_s / dt_s).round() as usize).max(LATE.1)
}

pub(super) fn too_short(a: &Trial, b: &Trial, common_s: f64) -> ProblemError {
    let found = format!("{} and {} have {common_s:.3} s in common", a.name, b.name);
    ProblemError::too_little(found, "record both at the same time for 20 s or more")
}

/// Sample time, s; infinite for a single sample.
fn step_s(trial: &Trial) -> f64 {
    1.0 / trial.rate_hz().unwrap_or(0.0)
}

/// Time in which both were recorded, if `shift_s` is added to the clock of the first, s.
fn common_s(a: &Trial, b: &Trial, shift_s: f64) -> f64 {
    let end = |t: &Trial| t.time_s[t.len() - 1];
    (end(a) + shift_s).min(end(b)) - (a.time_s[0] + shift_s).max(b.time_s[0])
}

/// Time that aligns the starts of two recordings whose clocks share no time, s; otherwise 0.
pub(super) fn base_s(a: &Trial, b: &Trial) -> f64 {
    if common_s(a, b, 0.0) > 0.0 { 0.0 } else { b.time_s[0] - a.time_s[0] }
}

/// Returns the time in which the first recording is shifted in addition to [`base_s`], and notes.
pub(super) fn aligned(
    a: &Trial,
    b: &Trial,
    columns: &[[String; 2]],
) -> Result<(f64, Vec<String>), ProblemError> {
    a.check()?;
    b.check()?;
    let (base_s, dt_s) = (base_s(a, b), step_s(a).max(step_s(b)));
    if !dt_s.is_finite() {
        return Err(too_short(a, b, 0.0));
    }
    let mut notes = Vec::new();
    if base_s != 0.0 {
        notes
            .push("the clocks share no time; delays count from the start of each recording".into());
    }
    let look = |shift_s: f64, reach_s: f64| {
        let both = merged(a, b, columns, shift_s);
        let pairs = both.channels.chunks(2).map(|c| [c[0].values.clone(), c[1].values.clone()]);
        Likeness::best(pairs, reach(dt_s, reach_s))
    };
    let coarse_s = a.duration_s().min(b.duration_s()) / COARSE as f64;
    let thinned = |trial: &Trial, name: &str| {
        let values = trial.channel(name).unwrap_or(&[]);
        let time_s = |i: usize| trial.time_s[0] + i as f64 * coarse_s;
        let at = |i| interpolated((&trial.time_s, values), time_s(i), f64::INFINITY);
        (0..COARSE).map_while(at).collect::<Vec<f64>>()
    };
    let pairs = columns.iter().map(|[x, y]| [thinned(a, x), thinned(b, y)]);
    let far_s = b.time_s[0] - a.time_s[0] + Likeness::best(pairs, COARSE / 2).lag * coarse_s;
    let given = look(base_s, LATE.0);
    let far = look(far_s, LATE.0.max(2.0 * coarse_s));
    let by_s = far_s - base_s - given.lag * dt_s;
    // Columns of one file have one clock.
    let is_far = by_s.abs() > LATE.0 && a.name != b.name;
    let lag = (by_s.abs() / coarse_s).round() as usize;
    let is_repeated = || columns.iter().all(|[x, _]| is_repeated(&thinned(a, x), lag));
    let is_better = 1.0 - far.r.abs() < BETTER * (1.0 - given.r.abs());
    let is_long = common_s(a, b, far_s) > 0.5 * a.duration_s().min(b.duration_s());
    let (mut shift_s, best) = match is_far && is_better && is_long && !is_repeated() {
        true => (far_s - base_s, far),
        false => (0.0, given),
    };
    if best.at_zero.abs() < NEAR * best.r.abs() {
        shift_s += best.lag * dt_s;
    }
    // whole samples, so that samples on the same grid stay as they are
    shift_s = (shift_s / dt_s).round() * dt_s;
    if shift_s != 0.0 {
        let (by_s, a, b) = (in_digits(shift_s, 4), &a.name, &b.name);
        notes.push(format!(
            "{b} is {by_s} s later than {a} by cross-correlation, and is shifted before the fit"
        ));
    }
    Ok((shift_s, notes))
}

/// Whether a motion resembles itself after this many samples, and less in between. A shift by such a
/// time would be a guess, because the motion looks the same without it.
fn is_repeated(x: &[f64], samples: usize) -> bool {
    let like = |k: usize| {
        let (start, rest) = (x.get(..x.len().saturating_sub(k)), x.get(k..));
        let found = lag(start.unwrap_or(&[]), rest.unwrap_or(&[]), 0);
        found.map_or(0.0, |found| found.correlation_at_zero)
    };
    let there = like(samples);
    there > NEAR && (1..samples).any(|k| like(k) < NEAR * there)
}

/// Both recordings at the sample times of the slower one, in the time in which both were recorded.
/// The columns alternate; `shift_s` is added to the clock of the first recording.
pub(super) fn merged(a: &Trial, b: &Trial, columns: &[[String; 2]], shift_s: f64) -> Trial {
    let times: Vec<f64> = match step_s(a) > 1.01 * step_s(b) {
        true => a.time_s.iter().map(|t| t + shift_s).collect(),
        false => b.time_s.clone(),
    };
    let has = |trial: &Trial, t: f64| {
        interpolated((&trial.time_s, &trial.time_s), t, BRIDGED * step_s(trial)).is_some()
    };
    let times: Vec<f64> = times.into_iter().filter(|t| has(a, t - shift_s) && has(b, *t)).collect();
    let column = |trial: &Trial, name: &str, as_name: String, shift_s: f64| {
        let values = trial.channel(name).unwrap_or(&[]);
        let at = |t: &f64| interpolated((&trial.time_s, values), t - shift_s, f64::INFINITY);
        Channel { name: as_name, values: times.iter().filter_map(at).collect() }
    };
    let both = |[x, y]: &[String; 2]| {
        [column(a, x, format!("first {x}"), shift_s), column(b, y, y.clone(), 0.0)]
    };
    let channels = columns.iter().flat_map(both).collect();
    let start_s = times.first().copied().unwrap_or(0.0);
    let time_s = times.iter().map(|t| t - start_s).collect();
    Trial { name: format!("{} and {}", a.name, b.name), time_s, channels }
}

/// Interpolates with a cubic through four samples, linearly next to an end; `None` outside the
/// samples and in gaps longer than `longest_s`.
fn interpolated((time_s, values): (&[f64], &[f64]), t: f64, longest_s: f64) -> Option<f64> {
    // a time stamp that was shifted is equal but for rounding
    let after = time_s.partition_point(|own| *own < t - 1e-9);
    let (t1, x1) = (*time_s.get(after)?, *values.get(after)?);
    if (t1 - t).abs() <= 1e-9 {
        return Some(x1);
    }
    let before = after.checked_sub(1)?;
    let nodes = match before > 0 && after + 1 < time_s.len() {
        true => before - 1..after + 2,
        false => before..after + 1,
    };
    let weight = |i: usize| {
        let others = nodes.clone().filter(|j| *j != i);
        others.map(|j| (t - time_s[j]) / (time_s[i] - time_s[j])).product::<f64>()
    };
    let value = nodes.clone().map(|i| values[i] * weight(i)).sum();
    (t1 - time_s[before] <= longest_s).then_some(value)
}
