//! Finds the turning points of the movements in a calibration, and the limit for a shift of later movements.

use stretch_calibrate::{
    CalibrateError, Options,
    toolkit::{even_signals, extent, noise},
};
use stretch_core::{Calibration, Interval, Model, Runner, SampleRate, Volts};
use stretch_data::Trial;
use stretch_metrics::student_t::critical;
use stretch_receptor::Receptor;

use crate::{GaugeCalibration, TurnFinder, Turns};

use super::{
    channels::{Levels, independent, levels},
    prior::LEAST_SESSIONS,
};

/// Share of the pauses without a shift at which a shift is reported, if levels are independent and normal. A recording
/// has few pauses, so one false report in a hundred pauses is rare. With a smaller share more shifts would be missed.
const FALSE_SHARE: f64 = 0.01;
/// Shortest time without the end of a movement that counts as a pause, s. Putting a sensor on again takes longer.
const LEAST_PAUSE_S: f64 = 4.0;
/// Shortest pause, in multiples of the median time between the ends of movements. A slow movement is shorter and does
/// not count as a pause.
const LEAST_PAUSE: f64 = 4.0;
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
/// Largest gain with which a zero is followed. With a larger gain the zero would follow the scatter of single levels.
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
    let sign = calibration.spec().polarity.sign();
    let (learnt, ends) = learn(signals, sign, calibration.spec().sample_rate_hz)?;
    let level = sign * learnt.level;
    let ends = ends.map(|end| sign * end);
    let ends = Interval { min: ends[0].min(ends[1]), max: ends[0].max(ends[1]) };
    let reference_per_signal = slope(calibration, level, ends)?;
    let turns = Turns { level, reference_per_signal, ..learnt };
    Some(turns).filter(|turns| turns.validate().is_ok())
}

/// Returns a note for a calibration that lacks the turning points of movements. The note states the number of movements
/// in the trials; `None` if the calibration has turning points, or if it needs only the signal, as for a load cell.
pub fn missing_turns(gauge: &GaugeCalibration, trials: &[Trial]) -> Option<String> {
    let spec = gauge.calibration().spec();
    if gauge.turns().is_some() || spec.model.needs_signal_only() {
        return None;
    }
    let signals = trials.iter().filter_map(|trial| trial.require(spec.signal.as_str()).ok());
    let finite = |signal: &[f64]| signal.iter().copied().filter(|v| v.is_finite()).collect();
    let signals: Vec<Vec<f64>> = signals.map(finite).collect();
    let signals: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
    let finder = TurnFinder::new(LEAST_SPAN * middle_span(&signals)?);
    let ends = |signal: &&[f64]| moves(finder, signal, spec.polarity.sign()).count();
    Some(format!(
        "the calibration lacks the levels at which movements reverse, so that stretch apply cannot detect that the gauge was put on again: \
         it needs at least {LEAST_MOVEMENTS} movements that return to the same end, without a drift, and of {} movements too few do; record a minute \
         or more of movements that all reach the same end, such as a fully stretched limb",
        signals.iter().map(ends).sum::<usize>()
    ))
}

/// Returns the movements of a signal, which is multiplied by `sign`: the index of the sample at which each ends, and its
/// low and high end.
fn moves(
    finder: TurnFinder<f64>,
    signal: &[f64],
    sign: f64,
) -> impl Iterator<Item = (usize, (f64, f64))> {
    let mut memory = finder.memory();
    let ends = signal.iter().map(move |v| finder.step(&mut memory, sign * v));
    ends.enumerate().filter_map(|(at, ends)| Some((at, ends?)))
}

/// Returns the largest change of the zero within a session in which the sensor was not put on again, in standard
/// deviations of levels. The first half of the session is used as a calibration. The change is the largest difference
/// in the second half between two medians of five consecutive levels, or between one of them and the calibration's
/// level. A detector that runs over the second half cannot find a larger difference, wherever the pauses are. Returns
/// `None` if either half has too few movements.
///
/// Signals are multiplied by `sign`, the sign of the polarity.
pub(crate) fn zero_move(signals: &[&[f64]], sign: f64, rate: SampleRate) -> Option<f64> {
    let mut left = signals.iter().map(|signal| signal.len()).sum::<usize>() / 2;
    let (mut first, mut second) = (Vec::new(), Vec::new());
    for signal in signals {
        let (before, after) = signal.split_at(left.min(signal.len()));
        left -= before.len();
        first.extend((!before.is_empty()).then_some(before));
        second.push(after);
    }
    let (turns, _) = learn(&first, sign, rate)?;
    let finder = TurnFinder::new(turns.least_span);
    let mut memory = finder.memory();
    let ends = second.into_iter().flatten().filter_map(|v| finder.step(&mut memory, sign * v));
    let levels: Vec<f64> = ends.map(|ends| level(ends, turns.high_share)).collect();
    zero_span(&levels, &turns)
}

/// Returns the range of the medians of five consecutive levels and of the calibration's level, in standard deviations of
/// levels; `None` if there are fewer than five levels.
fn zero_span(levels: &[f64], turns: &Turns) -> Option<f64> {
    let medians = levels.windows(Turns::MEDIAN_OF).filter_map(|own| median(own.to_vec()));
    let range = extent(medians.chain([turns.level]));
    let span = (range.max - range.min) / turns.scatter;
    (levels.len() >= Turns::MEDIAN_OF && span > 0.0).then_some(span)
}

/// Returns the turning points with the limit of a prior: the largest of the changes of the zero in its sessions
/// ([`zero_move`]). If the prior has too few sessions, the turning points keep the limit from their own calibration.
pub(crate) fn with_limit_of(turns: Turns, zero_moves: &[f64]) -> Turns {
    if zero_moves.len() < LEAST_SESSIONS {
        return turns;
    }
    let most = zero_moves.iter().copied().fold(0.0, f64::max);
    Turns { limit: most * turns.scatter, sessions: zero_moves.len() as u32, ..turns }
}

/// Returns the statistics of the movements in signals, and their mean low and high end. Signals are multiplied by `sign`,
/// the sign of the polarity. The field `reference_per_signal` is still zero.
fn learn(signals: &[&[f64]], sign: f64, rate: SampleRate) -> Option<(Turns, [f64; 2])> {
    let finder = TurnFinder::new(LEAST_SPAN * middle_span(signals)?);
    // Noise of the size of a movement would be taken for movements.
    if finder.least_span <= LEAST_NOISES * noise(signals.iter().copied()) {
        return None;
    }
    let (mut movements, mut periods) = (Vec::new(), Vec::new());
    for signal in signals {
        let (at, own): (Vec<usize>, Vec<(f64, f64)>) = moves(finder, signal, sign).unzip();
        periods.extend(at.windows(2).map(|pair| (pair[1] - pair[0]) as f64 * rate.period_s()));
        movements.push(own);
    }
    let (learnt, ends) = measure_levels(&movements)?;
    // If every stretch has a single movement, a movement takes at most the mean length of a stretch.
    let samples: usize = signals.iter().map(|signal| signal.len()).sum();
    let mean_s = samples as f64 * rate.period_s() / f64::from(learnt.movements);
    let pause_s = LEAST_PAUSE_S.max(LEAST_PAUSE * median(periods).unwrap_or(mean_s));
    Some((Turns { least_span: finder.least_span, pause_s, ..learnt }, ends))
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

/// Returns the level of a movement with these low and high ends.
fn level((low, high): (f64, f64), high_share: f64) -> f64 {
    (1.0 - high_share) * low + high_share * high
}

/// Returns the statistics of the levels of movements, and the mean low and high end. Each list in `movements` comes
/// from one stretch without gaps. The fields `least_span`, `pause_s` and `reference_per_signal` are still zero.
fn measure_levels(movements: &[Vec<(f64, f64)>]) -> Option<(Turns, [f64; 2])> {
    let all: Vec<(f64, f64)> = movements.iter().flatten().copied().collect();
    let (low, high, high_share) = weighted(&all)?;
    let sequences: Vec<Vec<f64>> = movements
        .iter()
        .map(|own| own.iter().map(|&ends| level(ends, high_share)).collect())
        .collect();
    let Levels { mean, variance, alike, count } = levels(&sequences)?;
    // The estimate of a correlation is too low by (1 + 4 r)/n (Kendall, Biometrika 41 (1954) 403).
    let alike = (alike + (1.0 + 4.0 * alike) / count).clamp(0.0, 0.99);
    let (independent, scatter) = independent(count, variance, alike);
    if !(independent >= LEAST_MOVEMENTS && variance > 0.0) {
        return None;
    }
    let t = critical(FALSE_SHARE, (independent - 1.0).floor());
    let learnt = Turns {
        level: clipped_mean(&sequences, mean, Turns::MOST_INNOVATION * scatter),
        high_share,
        least_span: 0.0,
        scatter,
        movements: count as u32,
        // The factor 2 is needed because the medians before and after a pause both scatter.
        limit: t * scatter * (2.0 * median_variance(alike)).sqrt(),
        pause_s: 0.0,
        sessions: 0,
        follow: follow(&sequences, count, variance),
        reference_per_signal: 0.0,
    };
    Some((learnt, [low, high]))
}

/// Returns the median; `None` if there are no values. Of an even number of values it is the larger one in the middle.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
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

/// Returns the same calibration without a baseline, because a baseline would follow the constant signals that are used
/// here.
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
