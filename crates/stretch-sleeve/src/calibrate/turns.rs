//! Finds the turning points of the movements in a calibration, and the limits for later movements.

use stretch_calibrate::{
    CalibrateError, Options,
    toolkit::{even_signals, extent, noise},
};
use stretch_core::{Calibration, Interval, Model, Runner, Volts};
use stretch_data::Trial;
use stretch_metrics::student_t::critical;
use stretch_receptor::Receptor;

use crate::{GaugeCalibration, TurnFinder, Turns};

use super::channels::{Levels, independent, levels};

/// Rate of false alarms per hour, the same as that with which one of several gauges is reported as shifted.
const FALSE_ALARMS_AN_HOUR: f64 = 0.25;
/// Smallest span of a movement, as a share of the signal's range without the lowest and highest 5 % of the samples.
const LEAST_SPAN: f64 = 1.0 / 3.0;
/// Number of bins in the histogram of samples.
const PARTS: usize = 4096;
/// Smallest span of a movement, in standard deviations of the noise.
const LEAST_NOISES: f64 = 6.0;
/// Smallest number of independent movements. With fewer, their correlation cannot be estimated.
const LEAST_MOVEMENTS: f64 = 8.0;
/// Variance of the median of five normal values, divided by that of one value.
const MEDIAN_VARIANCE: f64 = 0.2868;
/// Largest gain with which a zero is followed. With a larger gain, the median of five could not detect a shift before
/// the followed zero absorbs it.
const MOST_FOLLOW: f64 = 0.2;
/// Time for which a constant signal is held, so that the memory of a model has faded.
const HELD_S: f64 = 5.0;
/// Share of the span of a movement over which the slope is computed.
const SLOPE_SHARE: f64 = 0.25;

/// Adds the turning points of the movements in the fitted trials to a calibration.
///
/// # Errors
/// The errors of [`calibrate`](stretch_calibrate::calibrate()) about the trials.
pub fn calibrate_gauge(
    calibration: Calibration,
    trials: &[Trial],
    options: &Options,
) -> Result<GaugeCalibration, CalibrateError> {
    let signals = even_signals(trials, options)?;
    let signals: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
    let turns = find_turns(&calibration, &signals);
    Ok(GaugeCalibration::new(calibration, turns)?)
}

/// Finds the turning points in signals. Each signal is a stretch without a gap. Returns `None` if there are too few
/// movements.
pub fn find_turns(calibration: &Calibration, signals: &[&[f64]]) -> Option<Turns> {
    let finder = TurnFinder::new(LEAST_SPAN * middle_span(signals)?);
    // Noise as large as a movement would be mistaken for movements.
    if finder.least_span <= LEAST_NOISES * noise(signals.iter().copied()) {
        return None;
    }
    let sign = calibration.spec().polarity.sign();
    let movements: Vec<Vec<(f64, f64)>> = signals
        .iter()
        .map(|signal| {
            let mut memory = finder.memory();
            signal.iter().filter_map(|v| finder.step(&mut memory, sign * v)).collect()
        })
        .collect();
    let samples: usize = signals.iter().map(|signal| signal.len()).sum();
    let hours = samples as f64 * calibration.spec().sample_rate_hz.period_s() / 3600.0;
    let (learnt, ends) = measure_levels(&movements, hours)?;
    let level = sign * learnt.level;
    let ends = ends.map(|end| sign * end);
    let ends = Interval { min: ends[0].min(ends[1]), max: ends[0].max(ends[1]) };
    let reference_per_signal = slope(calibration, level, ends)?;
    let turns = Turns { level, least_span: finder.least_span, reference_per_signal, ..learnt };
    Some(turns).filter(|turns| turns.validate().is_ok())
}

/// Returns the span of the samples without the lowest and the highest 5 %, to the resolution of the histogram.
fn middle_span(signals: &[&[f64]]) -> Option<f64> {
    let all = || signals.iter().copied().flatten();
    let Interval { min, max } = extent(all().copied());
    let mut counts = vec![0; PARTS];
    for v in all() {
        let part = (v - min) / (max - min) * PARTS as f64;
        counts[(part as usize).min(PARTS - 1)] += 1;
    }
    let count = counts.iter().sum::<u64>();
    // Returns the bin of the sample with this rank.
    let part_of = |rank: u64| {
        let mut seen = 0;
        counts.iter().position(|count| {
            seen += count;
            seen > rank
        })
    };
    let (low, high) = (part_of(count / 20)?, part_of(count.checked_sub(1 + count / 20)?)?);
    (low < high).then(|| (high - low) as f64 / PARTS as f64 * (max - min))
}

/// Returns the statistics of the levels of movements, and the mean low and high end. Each list in `movements` comes
/// from one stretch without gaps, and all were recorded in `hours`. Signals are multiplied by the sign of the polarity.
/// The fields `least_span` and `reference_per_signal` are still zero.
fn measure_levels(movements: &[Vec<(f64, f64)>], hours: f64) -> Option<(Turns, [f64; 2])> {
    let all: Vec<(f64, f64)> = movements.iter().flatten().copied().collect();
    let (low, high, high_share) = weighted(&all)?;
    let level = |(low, high): &(f64, f64)| (1.0 - high_share) * low + high_share * high;
    let sequences: Vec<Vec<f64>> =
        movements.iter().map(|own| own.iter().map(level).collect()).collect();
    let Levels { mean, variance, alike, count } = levels(&sequences)?;
    // The estimate of a correlation is too low by (1 + 4 r)/n (Kendall, Biometrika 41 (1954) 403).
    let alike = (alike + (1.0 + 4.0 * alike) / count).clamp(0.0, 0.99);
    let (independent, scatter) = independent(count, variance, alike);
    if !(independent >= LEAST_MOVEMENTS && variance > 0.0) {
        return None;
    }
    let movements_an_hour = count / hours;
    // Half of the alarms are for the median, half for the running mean.
    let share = 0.5 * FALSE_ALARMS_AN_HOUR / movements_an_hour;
    let t = critical(share, (independent - 1.0).floor());
    let spread = |variance: f64| t * scatter * (variance + 1.0 / independent).sqrt();
    let mean_variance = Turns::MEAN_SHARE / (2.0 - Turns::MEAN_SHARE) * count / independent;
    let level = clipped_mean(&sequences, mean, Turns::MOST_INNOVATION * scatter);
    let learnt = Turns {
        level,
        high_share,
        least_span: 0.0,
        scatter,
        movements: count as u32,
        limit: spread(median_variance(alike)).max(tail(&sequences, level, share)),
        mean_limit: spread(mean_variance.min(1.0)),
        false_alarms_an_hour: FALSE_ALARMS_AN_HOUR,
        movements_an_hour,
        follow: follow(&sequences, count, variance),
        reference_per_signal: 0.0,
    };
    Some((learnt, [low, high]))
}

/// Returns the mean low and high ends, and the weight of the high end with which levels scatter least. The weight is
/// `(v - c)/(v + w - 2 c)` for the variances `v` and `w` of low and high ends and their covariance `c`.
fn weighted(all: &[(f64, f64)]) -> Option<(f64, f64, f64)> {
    let n = all.len() as f64;
    if n < LEAST_MOVEMENTS {
        return None;
    }
    let mean = |of: fn(&(f64, f64)) -> f64| all.iter().map(of).sum::<f64>() / n;
    let (low, high) = (mean(|m| m.0), mean(|m| m.1));
    let (mut lows, mut highs, mut both) = (0.0, 0.0, 0.0);
    for (l, h) in all.iter().map(|m| (m.0 - low, m.1 - high)) {
        lows += l * l;
        highs += h * h;
        both += l * h;
    }
    let whole = lows + highs - 2.0 * both;
    let share = if whole > 0.0 { ((lows - both) / whole).clamp(0.0, 1.0) } else { 0.0 };
    Some((low, high, share))
}

/// Returns the level from which the deviations, clipped at `most`, have a mean of zero (Huber, Ann. Math. Stat. 35
/// (1964) 73).
fn clipped_mean(sequences: &[Vec<f64>], mean: f64, most: f64) -> f64 {
    let count = sequences.iter().flatten().count() as f64;
    let moved = |level: f64| {
        let off = sequences.iter().flatten().map(|own| (own - level).clamp(-most, most));
        level + off.sum::<f64>() / count
    };
    (0..50).fold(mean, |level, _| moved(level))
}

/// Returns the deviation that the median of five levels exceeds with probability `share`, for any distribution of
/// levels. If a share `q` of the levels exceeds the deviation on one side, the median does so with probability `share/2
/// = 10 q^3`, up to terms in `q^4` (David and Nagaraja, Order Statistics, 2003, section 2.1). The `j`-th largest of `n`
/// levels is exceeded with probability `j/(n + 1)`.
fn tail(sequences: &[Vec<f64>], mean: f64, share: f64) -> f64 {
    let mut off: Vec<f64> = sequences.iter().flatten().map(|level| level - mean).collect();
    off.sort_by(f64::total_cmp);
    let beyond = (share / 20.0).cbrt() * (off.len() + 1) as f64;
    let rank = (beyond as usize).clamp(1, off.len());
    off[off.len() - rank].max(-off[rank - 1])
}

/// Returns the variance of the median of five levels divided by that of one level, if neighbours have the correlation
/// `alike`. The ratio grows with the correlation as the variance of the mean of five levels does, by the factor
/// `1 + 2 sum (1 - k/5) alike^k`, and is at most 1.
fn median_variance(alike: f64) -> f64 {
    let mut power = 1.0;
    let mut factor = 1.0;
    for k in 1..Turns::MEDIAN_OF {
        power *= alike;
        factor += 2.0 * (1.0 - k as f64 / Turns::MEDIAN_OF as f64) * power;
    }
    (MEDIAN_VARIANCE * factor).min(1.0)
}

/// Returns the steady gain of the scalar Kalman filter of a zero that is a random walk and is observed through levels
/// with noise.
///
/// `d1` and `d2` are the mean squared differences of levels one and two movements apart. The variance of the walk per
/// movement is `q = d2 - d1`, and that of the noise is `r = d1 - d2/2`. The variance before a level is `p = (q +
/// sqrt(q^2 + 4 q r))/2`, and the gain is `p/(p + r)` (Harvey, Forecasting, structural time series models and the
/// Kalman filter, 1989, section 3.3). For independent levels of variance `v`, `d2 - d1` has the standard error `v
/// sqrt(8/n)`, and two of these are subtracted from `q`. The gain is at least `1/n`, because `n` movements cannot
/// distinguish a walk with a smaller gain from no walk.
fn follow(sequences: &[Vec<f64>], count: f64, variance: f64) -> f64 {
    let apart = |k: usize| {
        let squares: Vec<f64> = sequences
            .iter()
            .flat_map(|own| own.iter().zip(own.iter().skip(k)).map(|(a, b)| (b - a).powi(2)))
            .collect();
        squares.iter().sum::<f64>() / squares.len().max(1) as f64
    };
    let (d1, d2) = (apart(1), apart(2));
    let error = variance * (8.0 / count).sqrt();
    let (q, r) = ((d2 - d1 - 2.0 * error).max(0.0), (d1 - 0.5 * d2).max(0.0));
    let p = 0.5 * (q + (q * q + 4.0 * q * r).sqrt());
    let gain = if p + r > 0.0 { p / (p + r) } else { 0.0 };
    gain.clamp((1.0 / count).min(MOST_FOLLOW), MOST_FOLLOW)
}

/// Returns the change of the estimate per change of the signal about a level, from two constant signals.
fn slope(calibration: &Calibration, level: f64, ends: Interval) -> Option<f64> {
    let unmoved = without_rest(calibration)?;
    let receptor = Receptor::<f64>::new(&unmoved).ok()?;
    let samples = (HELD_S * calibration.spec().sample_rate_hz.hz()).ceil().min(1e5) as usize;
    let held = |signal: f64| {
        let mut receptor = Runner::new(receptor);
        let readings = (0..samples).map(|_| receptor.step(Volts(signal)));
        readings.last()?.ok().map(|reading| reading.estimate)
    };
    let half = 0.5 * SLOPE_SHARE * (ends.max - ends.min);
    let (from, to) = ((level - half).max(ends.min), (level + half).min(ends.max));
    Some((held(to)? - held(from)?) / (to - from)).filter(|slope| slope.is_finite())
}

/// Returns the same calibration without a baseline. A baseline would follow a constant signal.
fn without_rest(calibration: &Calibration) -> Option<Calibration> {
    let mut spec = calibration.clone().into_spec();
    match &mut spec.model {
        Model::History(map) => map.rest = None,
        Model::Observer(map) => map.rest = None,
        Model::Diagnosed(map) => map.rest = None,
        _ => {}
    }
    Calibration::new(spec).ok()
}

/// Returns whether a calibration's model itself follows the level of its signal at rest.
pub(crate) fn follows_rest(calibration: &Calibration) -> bool {
    without_rest(calibration)
        .is_some_and(|unmoved| unmoved.spec().model != calibration.spec().model)
}

#[cfg(test)]
mod tests;
