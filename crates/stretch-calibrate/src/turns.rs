//! Where the movements of a calibration turn, and how far a later one may be off.

use stretch_core::{
    Calibration, CalibrationSpec, DesignError, Interval, Model, Runner, Turns, Volts,
};
use stretch_fit::student_two_sided;
use stretch_receptor::{Receptor, TurnFinder, TurnMemory};

use crate::{
    levels::{Levels, independent, levels},
    series::{extent, noise},
};

/// False alarms an hour. The array's share for a gauge that has shifted is the same.
const FALSE_ALARMS_AN_HOUR: f64 = 0.25;
/// Share of the signal's range, without the twentieths at its ends, that a movement goes through at least.
const LEAST_SPAN: f64 = 1.0 / 3.0;
/// Parts of the extent that samples are counted in.
const PARTS: usize = 4096;
/// Standard deviations of the noise that are no movement.
const LEAST_NOISES: f64 = 6.0;
/// Fewest movements, counted as independent ones: from fewer their correlation is a guess.
const LEAST_MOVEMENTS: f64 = 8.0;
/// Variance of the median of five normal values over that of one.
const MEDIAN_VARIANCE: f64 = 0.2868;
/// A zero is not followed faster than the median of five can tell a shift from it.
const MOST_FOLLOW: f64 = 0.2;
/// A constant signal is held this long, so that what a model remembers has faded.
const HELD_S: f64 = 5.0;
/// The slope is taken over this share of a movement.
const SLOPE_SHARE: f64 = 0.25;

/// A calibration that holds where the movements of these signals turn, each a stretch without a gap; without levels where they
/// hold too few movements, or none.
pub(crate) fn with_turns(
    calibration: Calibration,
    signals: &[&[f64]],
) -> Result<Calibration, DesignError> {
    let turns = turns(&calibration, signals);
    holding(calibration, turns)
}

/// A calibration that holds these turns.
pub(crate) fn holding(
    calibration: Calibration,
    turns: Option<Turns>,
) -> Result<Calibration, DesignError> {
    Calibration::new(CalibrationSpec { turns, ..calibration.into_spec() })
}

fn turns(calibration: &Calibration, signals: &[&[f64]]) -> Option<Turns> {
    let mut spread = Spread::new(extent(signals.iter().copied().flatten().copied()));
    signals.iter().for_each(|signal| spread.take(signal));
    let mut movements = Movements::new(calibration, &spread, noise(signals.iter().copied()))?;
    for signal in signals {
        movements.begin();
        movements.take(signal);
    }
    movements.turns(calibration)
}

/// How many samples of a signal lie in each of equal parts of its extent.
pub(crate) struct Spread {
    extent: Interval,
    counts: Vec<u64>,
}

impl Spread {
    pub(crate) fn new(extent: Interval) -> Self {
        Self { extent, counts: vec![0; PARTS] }
    }

    pub(crate) fn take(&mut self, signal: &[f64]) {
        let Interval { min, max } = self.extent;
        for v in signal {
            let part = (v - min) / (max - min) * PARTS as f64;
            self.counts[(part as usize).min(PARTS - 1)] += 1;
        }
    }

    /// Span of the samples without the lowest and the highest twentieth, to a part of the extent.
    fn middle(&self) -> Option<f64> {
        let all = self.counts.iter().sum::<u64>();
        // the part that the sample of a rank lies in
        let part_of = |rank: u64| {
            let mut seen = 0;
            self.counts.iter().position(|count| {
                seen += count;
                seen > rank
            })
        };
        let (low, high) = (part_of(all / 20)?, part_of(all.checked_sub(1 + all / 20)?)?);
        let span = (high - low) as f64 / PARTS as f64 * (self.extent.max - self.extent.min);
        (low < high).then_some(span)
    }
}

/// The movements of a signal that is given stretch by stretch, and a stretch in one piece or in several.
pub(crate) struct Movements {
    finder: TurnFinder<f64>,
    memory: TurnMemory<f64>,
    sign: f64,
    /// The ends of movements, times the sign of the polarity, stretch by stretch.
    found: Vec<Vec<(f64, f64)>>,
    samples: usize,
}

impl Movements {
    /// None yet; `None` where the signal's noise is as large as a movement would be.
    pub(crate) fn new(calibration: &Calibration, spread: &Spread, noise: f64) -> Option<Self> {
        let finder = TurnFinder::new(LEAST_SPAN * spread.middle()?);
        (finder.least_span > LEAST_NOISES * noise).then(|| Self {
            finder,
            memory: finder.memory(),
            sign: calibration.polarity.sign(),
            found: Vec::new(),
            samples: 0,
        })
    }

    /// What follows begins another stretch.
    pub(crate) fn begin(&mut self) {
        self.memory = self.finder.memory();
        self.found.push(Vec::new());
    }

    pub(crate) fn take(&mut self, signal: &[f64]) {
        self.samples += signal.len();
        let (finder, sign) = (self.finder, self.sign);
        let found = signal.iter().filter_map(|v| finder.step(&mut self.memory, sign * v));
        if let Some(own) = self.found.last_mut() {
            own.extend(found);
        }
    }

    /// What they say of their levels; `None` where they are too few.
    pub(crate) fn turns(&self, calibration: &Calibration) -> Option<Turns> {
        let hours = self.samples as f64 * calibration.sample_rate_hz.period_s() / 3600.0;
        let learnt = Learnt::of(&self.found, hours)?;
        let level = self.sign * learnt.level;
        let slope = slope(calibration, level, learnt.ends(self.sign))?;
        let turns = learnt.turns(level, self.finder.least_span, slope);
        Some(turns).filter(|turns| turns.validate().is_ok())
    }
}

/// What movements say of their levels, times the sign of the polarity.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Learnt {
    high_share: f64,
    level: f64,
    scatter: f64,
    movements: u32,
    limit: f64,
    mean_limit: f64,
    movements_an_hour: f64,
    follow: f64,
    low: f64,
    high: f64,
}

impl Learnt {
    /// Of movements in stretches, recorded in so many hours.
    fn of(movements: &[Vec<(f64, f64)>], hours: f64) -> Option<Self> {
        let all: Vec<(f64, f64)> = movements.iter().flatten().copied().collect();
        let (low, high, high_share) = weighted(&all)?;
        let level = |(low, high): &(f64, f64)| (1.0 - high_share) * low + high_share * high;
        let sequences: Vec<Vec<f64>> =
            movements.iter().map(|own| own.iter().map(level).collect()).collect();
        let Levels { mean, variance, alike, count } = levels(&sequences)?;
        // the estimate of a correlation is low by (1 + 4 r)/n (Kendall, Biometrika 41 (1954) 403)
        let alike = (alike + (1.0 + 4.0 * alike) / count).clamp(0.0, 0.99);
        let (independent, scatter) = independent(count, variance, alike);
        if !(independent >= LEAST_MOVEMENTS && variance > 0.0) {
            return None;
        }
        let movements_an_hour = count / hours;
        // half for the median, half for the mean
        let share = 0.5 * FALSE_ALARMS_AN_HOUR / movements_an_hour;
        let t = student_two_sided(1.0 - share, (independent - 1.0) as u64);
        let spread = |variance: f64| t * scatter * (variance + 1.0 / independent).sqrt();
        let mean_variance = Turns::MEAN_SHARE / (2.0 - Turns::MEAN_SHARE) * count / independent;
        let level = clipped_mean(&sequences, mean, Turns::MOST_INNOVATION * scatter);
        Some(Self {
            high_share,
            level,
            scatter,
            movements: count as u32,
            limit: spread(median_variance(alike)).max(tail(&sequences, level, share)),
            mean_limit: spread(mean_variance.min(1.0)),
            movements_an_hour,
            follow: follow(&sequences, count, variance),
            low,
            high,
        })
    }

    /// For a record, with what is in the signal's unit: the level, the least span, and the change of the estimate per change of the signal.
    fn turns(self, level: f64, least_span: f64, reference_per_signal: f64) -> Turns {
        Turns {
            level,
            high_share: self.high_share,
            least_span,
            scatter: self.scatter,
            movements: self.movements,
            limit: self.limit,
            mean_limit: self.mean_limit,
            false_alarms_an_hour: FALSE_ALARMS_AN_HOUR,
            movements_an_hour: self.movements_an_hour,
            follow: self.follow,
            reference_per_signal,
        }
    }

    /// The mean ends of movements, in the signal's unit.
    fn ends(&self, sign: f64) -> Interval {
        let (one, other) = (sign * self.low, sign * self.high);
        Interval { min: one.min(other), max: one.max(other) }
    }
}

/// Mean low and high ends, and the weight of the high end with which levels scatter least: `(v - c)/(v + w - 2 c)` for the
/// variances `v`, `w` of low and high ends and their covariance `c`.
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

/// The level about which deviations, clipped at `most`, have a mean of zero (Huber, Ann. Math. Stat. 35 (1964) 73).
fn clipped_mean(sequences: &[Vec<f64>], mean: f64, most: f64) -> f64 {
    let count = sequences.iter().flatten().count() as f64;
    let moved = |level: f64| {
        let off = sequences.iter().flatten().map(|own| (own - level).clamp(-most, most));
        level + off.sum::<f64>() / count
    };
    (0..50).fold(mean, |level, _| moved(level))
}

/// How far levels are off that are so rare that the median of five is beyond them with a probability of `share`, whatever the
/// distribution of levels: on each side `share/2 = 10 q^3` for a level that a share `q` is beyond, up to terms in `q^4`
/// (David and Nagaraja, Order Statistics, 2003, section 2.1), and the `j`-th of `n` levels is one that `j/(n + 1)` are beyond.
fn tail(sequences: &[Vec<f64>], mean: f64, share: f64) -> f64 {
    let mut off: Vec<f64> = sequences.iter().flatten().map(|level| level - mean).collect();
    off.sort_by(f64::total_cmp);
    let beyond = (share / 20.0).cbrt() * (off.len() + 1) as f64;
    let rank = (beyond as usize).clamp(1, off.len());
    off[off.len() - rank].max(-off[rank - 1])
}

/// Variance of the median of five levels over that of one, where neighbours correlate with `alike`: as that of their mean
/// grows, `1 + 2 sum (1 - k/5) alike^k`, and at most 1.
fn median_variance(alike: f64) -> f64 {
    let mut power = 1.0;
    let mut factor = 1.0;
    for k in 1..Turns::MEDIAN_OF {
        power *= alike;
        factor += 2.0 * (1.0 - k as f64 / Turns::MEDIAN_OF as f64) * power;
    }
    (MEDIAN_VARIANCE * factor).min(1.0)
}

/// Steady gain of the scalar Kalman filter of a zero that walks at random below levels with noise.
///
/// With `d1`, `d2` the mean squared differences of levels one and two movements apart, the walk's variance is `q = d2 -
/// d1` and the noise's `r = d1 - d2/2`; the variance before a level is `p = (q + sqrt(q^2 + 4 q r))/2` and the gain
/// `p/(p + r)` (Harvey, Forecasting, structural time series models and the Kalman filter, 1989, section 3.3). Of independent
/// levels of variance `v`, `d2 - d1` has the standard error `v sqrt(8/n)`, two of which are taken off `q`. The gain is at
/// least `1/n`: `n` movements do not tell a slower walk, whose gain that is, from none.
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

/// Change of the estimate per change of the signal about a level, from two signals that are held.
fn slope(calibration: &Calibration, level: f64, ends: Interval) -> Option<f64> {
    let unmoved = without_rest(calibration)?;
    let receptor = Receptor::<f64>::new(&unmoved).ok()?;
    let samples = (HELD_S * calibration.sample_rate_hz.hz()).ceil().min(1e5) as usize;
    let held = |signal: f64| {
        let mut receptor = Runner::new(receptor);
        let readings = (0..samples).map(|_| receptor.step(Volts(signal)));
        readings.last()?.ok().map(|reading| reading.estimate)
    };
    let half = 0.5 * SLOPE_SHARE * (ends.max - ends.min);
    let (from, to) = ((level - half).max(ends.min), (level + half).min(ends.max));
    Some((held(to)? - held(from)?) / (to - from)).filter(|slope| slope.is_finite())
}

/// The same calibration without a baseline of its own, which would follow a signal that is held.
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

/// Whether a calibration's model follows the rest of its signal itself.
pub(crate) fn follows_rest(calibration: &Calibration) -> bool {
    without_rest(calibration).is_some_and(|unmoved| unmoved.model != calibration.model)
}

#[cfg(test)]
mod tests;
