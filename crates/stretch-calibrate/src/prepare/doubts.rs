//! Doubts about a trial, alone and compared with other trials.

use std::ops::RangeInclusive;

use rayon::prelude::*;
use stretch_data::{Trial, in_digits};

use crate::Options;

use super::{gross_errors::rows, series::extent, trials::Piece};

/// Smallest squared correlation of signal and reference at which the line of a trial can be compared with another: the
/// line then explains at least half of the variance.
const HAS_LINE: f64 = 0.5;
/// Ratios of two trials' slopes that hysteresis, another rate or another range can cause.
const USUAL_SLOPES: RangeInclusive<f64> = 0.5..=2.0;
/// Numbers of decimals, or of digits after the first significant one, with which a file may have been saved.
const DIGITS: RangeInclusive<i32> = 0..=12;
/// Smallest number of equal readings in a row at which a signal counts as stuck.
const STANDS: usize = 5;
/// Share of its range by which the reference must move while the signal is stuck.
const MOVES_ON: f64 = 0.1;
/// Rates below this limit, Hz, are probably due to time stamps in milliseconds.
const SLOW_HZ: f64 = 0.5;
/// A fit with fewer samples causes a doubt. From this number on, a low rate is attributed to a wrong unit of time.
const TELLING: usize = 50;

/// Greatest number of trials with which each trial is compared. If there are more, they are chosen evenly.
const OTHERS: usize = 32;
/// To find copies, trials are sorted by their mean reference, and each is compared with this many neighbours.
const NEXT: usize = 8;

/// A possible mistake in one trial: a function and a message. The arguments of the function are the regression lines of
/// this trial and of another trial. It returns two lines: that of this trial as recorded, and that of this trial
/// without the mistake.
type Mistake = (fn(Line, Line) -> [Line; 2], &'static str);

/// Degrees in a radian.
pub(crate) const DEGREES_IN_A_RADIAN: f64 = 180.0 / std::f64::consts::PI;

const MISTAKES: [Mistake; 8] = [
    (
        |own, _| [own, Line { means: swap(own.means), spreads: swap(own.spreads), ..own }],
        "{trial} has {signal} and {reference} exchanged, compared with {other}: swap the two column names with stretch convert, or leave the trial out",
    ),
    (
        // The zero of a reversed column is unknown.
        |own, other| {
            let own = Line { means: other.means, ..own };
            [own, Line { correlation: -own.correlation, ..own }]
        },
        "{trial} has {signal} or {reference} reversed, compared with {other}: change the sign of one with stretch convert, \
         or leave the trial out",
    ),
    (
        |own, _| [own, own.times([1e-3, 1.0])],
        "{signal} of {trial} is about 1000 times that of {other}: is one in millivolts and the other in volts? Convert one with \
         stretch convert --column '{signal}={signal}/1000'",
    ),
    (
        |own, _| [own, own.times([1e3, 1.0])],
        "{signal} of {trial} is about a thousandth of that of {other}: is one in volts and the other in millivolts? Convert one with \
         stretch convert --column '{signal}={signal}*1000'",
    ),
    (
        |own, _| [own, own.times([1.0, 1e-3])],
        "{reference} of {trial} is about 1000 times that of {other}: are they in different units? Convert one with stretch convert \
         --column '{reference}={reference}/1000'",
    ),
    (
        |own, _| [own, own.times([1.0, 1e3])],
        "{reference} of {trial} is about a thousandth of that of {other}: are they in different units? Convert one with stretch convert \
         --column '{reference}={reference}*1000'",
    ),
    (
        |own, _| [own, own.times([1.0, 1.0 / DEGREES_IN_A_RADIAN])],
        "{reference} of {trial} is about 57.3 times that of {other}: is one in degrees and the other in radians? Convert one with \
         stretch convert --column '{reference}={reference}*0.0174533'",
    ),
    (
        |own, _| [own, own.times([1.0, DEGREES_IN_A_RADIAN])],
        "{reference} of {trial} is about 1/57.3 of that of {other}: is one in radians and the other in degrees? Convert one with \
         stretch convert --column '{reference}={reference}*57.2958'",
    ),
];

/// The least-squares line through signal and reference, with the standard deviations of both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Line {
    /// Means of signal and reference.
    pub(super) means: [f64; 2],
    /// Standard deviations of signal and reference.
    spreads: [f64; 2],
    /// Correlation of signal and reference; 0 if one of them is constant.
    correlation: f64,
}

impl Line {
    /// Returns the line of a trial's parts.
    pub(super) fn of<'a>(parts: impl Iterator<Item = &'a Piece> + Clone) -> Self {
        let pairs = parts.flat_map(|(_, [signal, reference, _])| signal.iter().zip(reference));
        Self::through(pairs.map(|(signal, reference)| (*signal, *reference)))
    }

    /// Returns the line through pairs of signal and reference.
    pub(crate) fn through(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Self {
        let count = pairs.clone().count().max(1) as f64;
        let [v, x] = pairs.clone().fold([0.0; 2], |[v, x], (a, b)| [v + a, x + b]);
        let means = [v / count, x / count];
        let [mut along, mut up, mut across] = [0.0; 3];
        for (v, x) in pairs {
            let [v, x] = [v - means[0], x - means[1]];
            along += v * v;
            up += x * x;
            across += v * x;
        }
        let correlation = across / (along * up).sqrt();
        Self {
            means,
            spreads: [along, up].map(|squares| (squares / count).sqrt()),
            correlation: if correlation.is_finite() { correlation } else { 0.0 },
        }
    }

    /// Whether the line explains at least half of the variance.
    pub(crate) fn is_clear(&self) -> bool {
        self.correlation.powi(2) >= HAS_LINE
    }

    pub(crate) fn slope(&self) -> f64 {
        let slope = self.correlation * self.spreads[1] / self.spreads[0];
        if slope.is_finite() { slope } else { 0.0 }
    }

    /// Returns the reference that the regression line gives for a signal.
    pub(super) fn at(&self, signal: f64) -> f64 {
        self.means[1] + self.slope() * (signal - self.means[0])
    }

    fn times(self, [of_signal, of_reference]: [f64; 2]) -> Self {
        let [means, spreads] = [self.means, self.spreads]
            .map(|[signal, reference]| [of_signal * signal, of_reference * reference]);
        Self { means, spreads, ..self }
    }

    /// Returns the root mean square distance to another line, over the samples of this one.
    fn misfit(&self, other: &Self) -> f64 {
        let off = self.means[1] - other.at(self.means[0]);
        off.hypot((self.slope() - other.slope()) * self.spreads[0])
    }

    /// Returns the message about the mistake that best explains why two fitted straight lines differ; `None` if no
    /// mistake explains it.
    fn mistake(self, other: Self) -> Option<&'static str> {
        if ![self, other].iter().all(Self::is_clear) {
            return None;
        }
        let is_usual = |line: &Self| USUAL_SLOPES.contains(&(line.slope() / other.slope()));
        let explained = MISTAKES.iter().filter_map(|(lines, says)| {
            let [own, without] = lines(self, other);
            let [is, would] = [own, without].map(|line| line.misfit(&other));
            let is_one = !is_usual(&own) && is_usual(&without) && would < 0.5 * is;
            (is_one && is > 0.5 * other.spreads[1]).then_some((would, *says))
        });
        explained.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, says)| says)
    }
}

fn swap([a, b]: [f64; 2]) -> [f64; 2] {
    [b, a]
}

/// The parts and the line of a trial.
struct Held<'a> {
    name: &'a str,
    parts: Vec<&'a Piece>,
    line: Line,
}

impl Held<'_> {
    /// Whether two trials have the same samples, within the digits with which one of them was saved.
    fn is_copy_of(&self, other: &Self) -> bool {
        let mut both = self.parts.iter().zip(&other.parts);
        self.parts.len() == other.parts.len()
            && both.all(|((_, own), (_, its))| (0..2).all(|i| is_same(&own[i], &its[i])))
    }

    /// Returns a sentence if the signal is stuck at an end of its range while the reference moves further.
    fn clipped(&self, signal: &str, reference: &str) -> Option<String> {
        let (end, name) = (self.stands_at()?, self.name);
        Some(format!(
            "{signal} stays at {end} in {name} while {reference} moves on: the amplifier or the converter is probably at its limit, and values \
             beyond it are lost. Lower the gain and record again, or leave that part out"
        ))
    }

    /// Returns the end of the signal's range at which the signal is stuck, while the reference moves further in the
    /// same direction.
    fn stands_at(&self) -> Option<f64> {
        // If the signal does not follow the reference, a constant signal is no sign of a fault.
        if !self.line.is_clear() {
            return None;
        }
        let reach = |column: usize| {
            let all = self.parts.iter().flat_map(|(_, columns)| columns[column].iter().copied());
            extent(all)
        };
        let (signal, reference) = (reach(0), reach(1));
        let enough = MOVES_ON * (reference.max - reference.min);
        let ends = [(signal.max, 1.0), (signal.min, -1.0)];
        let ends = ends.map(|(end, side)| (end, side * self.line.correlation.signum()));
        let stands = |(end, way): (f64, f64)| {
            self.parts.iter().any(|(_, [signal, reference, _])| {
                let mut at = 0;
                signal.chunk_by(|a, b| a == b).any(|run| {
                    let began = at;
                    at += run.len();
                    let moves = |x: &f64| way * (x - reference[began]) > enough;
                    // A run of equal readings from the first sample on is ignored, because hysteresis may hold the
                    // signal there.
                    let is_run = began > 0 && run.len() >= STANDS && run[0] == end;
                    is_run && reference[began..at].iter().any(moves)
                })
            })
        };
        ends.into_iter().find(|end| stands(*end)).map(|(end, _)| end)
    }
}

/// Leaves out the samples in which the signal is stuck at an end of its range while the reference moves further, because
/// the values beyond that end are lost. Also returns a sentence for each end of each trial.
///
/// ```
/// use stretch_calibrate::without_clipped;
/// use stretch_data::{Channel, Trial};
///
/// let length: Vec<f64> = (0..1000).map(|n| 165.0 - 15.0 * (0.02 * f64::from(n)).cos()).collect();
/// let voltage = length.iter().map(|x| (0.01 * x).min(1.75)).collect();
/// let channel = |name: &str, values| Channel { name: name.into(), values };
/// let time_s = (0..1000).map(|n| 0.01 * f64::from(n)).collect();
/// let channels = vec![channel("length_mm", length), channel("bridge_v", voltage)];
/// let trial = Trial { name: "a.csv".into(), time_s, channels };
/// let (kept, sentences) = without_clipped(vec![trial], ["bridge_v", "length_mm"]);
/// assert!(kept[0].channel("bridge_v").is_some_and(|v| v.len() < 800 && v.iter().all(|v| *v < 1.75)));
/// assert!(sentences[0].contains("of 1000 samples of a.csv are left out"), "{}", sentences[0]);
/// ```
pub fn without_clipped(
    trials: Vec<Trial>,
    [signal, reference]: [&str; 2],
) -> (Vec<Trial>, Vec<String>) {
    let mut sentences = Vec::new();
    let one = |trial: Trial| {
        let mut kept = trial;
        let all = kept.len();
        // The signal may be clipped at both ends of its range.
        for _ in 0..2 {
            let Some(end) = held(&kept, [signal, reference], |held| held.stands_at()) else {
                break;
            };
            let Ok(values) = kept.require(signal) else { break };
            let stays: Vec<bool> = values.iter().map(|value| *value != end).collect();
            let count = stays.iter().filter(|stays| !**stays).count();
            sentences.push(format!(
                "{count} of {all} samples of {} are left out, because {signal} stays at {end} while {reference} moves on: the amplifier or the \
                 converter is probably at its limit, and values beyond it are lost. Lower the gain and record again",
                kept.name
            ));
            kept = rows(&kept, &stays);
        }
        kept
    };
    let kept = trials.into_iter().map(one).collect();
    (kept, sentences)
}

/// Returns a sentence if the signal of a trial is stuck at an end of its range while the reference moves further.
pub(crate) fn clipped(trial: &Trial, [signal, reference]: [&str; 2]) -> Option<String> {
    held(trial, [signal, reference], |held| held.clipped(signal, reference))
}

/// Examines the signal and the reference of a whole trial. Returns `None` for columns of unequal length, because the fit
/// refuses them.
fn held<T>(
    trial: &Trial,
    columns: [&str; 2],
    examine: impl FnOnce(&Held<'_>) -> Option<T>,
) -> Option<T> {
    trial.check_lengths().ok()?;
    let [Ok(signals), Ok(references)] = columns.map(|name| trial.require(name)) else {
        return None;
    };
    let piece = (0, [signals.to_vec(), references.to_vec(), Vec::new()]);
    let line = Line::of(std::iter::once(&piece));
    examine(&Held { name: &trial.name, parts: vec![&piece], line })
}

/// Whether two columns are equal within the digits with which one of them was saved. Two recordings of
/// the same motion, repeated, are not equal in this sense.
fn is_same(one: &[f64], other: &[f64]) -> bool {
    one.len() == other.len() && (one == other || is_rounded(one, other) || is_rounded(other, one))
}

/// Whether one column is the other rounded to some decimals or significant digits, and is not constant.
fn is_rounded(coarse: &[f64], fine: &[f64]) -> bool {
    let is_one = |step: &dyn Fn(f64) -> f64| {
        coarse.iter().zip(fine).all(|(coarse, fine)| {
            let step = step(*coarse);
            let steps = coarse / step;
            (steps - steps.round()).abs() < 1e-4 && (coarse - fine).abs() <= 0.5001 * step
        })
    };
    let is_some = DIGITS.into_iter().any(|digits| {
        is_one(&|_| 10_f64.powi(-digits))
            || is_one(&|x| {
                10_f64.powi(x.abs().max(f64::MIN_POSITIVE).log10().floor() as i32 - digits)
            })
    });
    is_some && coarse.iter().any(|x| *x != coarse[0])
}

/// Returns for each trial an earlier trial of which it is a copy.
fn copies(held: &[Held<'_>]) -> Vec<Option<usize>> {
    let mean = |i: usize| held[i].line.means[1];
    let mut sorted: Vec<usize> = (0..held.len()).collect();
    sorted.sort_by(|a, b| mean(*a).total_cmp(&mean(*b)));
    let mut first: Vec<Option<usize>> = vec![None; held.len()];
    for (place, &i) in sorted.iter().enumerate() {
        for &j in sorted[place + 1..].iter().take(NEXT) {
            let (early, late) = (i.min(j), i.max(j));
            if first[late].is_none_or(|before| early < before)
                && held[late].is_copy_of(&held[early])
            {
                first[late] = Some(early);
            }
        }
    }
    first
}

/// Returns sentences about trials with probable mistakes, each with advice.
pub(super) fn doubts(
    names: &[&str],
    pieces: &[Piece],
    rate_hz: f64,
    options: &Options,
) -> Vec<String> {
    let (signal, reference) = (options.signal.as_str(), options.reference.as_str());
    let mut parts = vec![Vec::new(); names.len()];
    pieces.iter().for_each(|piece| parts[piece.0].push(piece));
    let held =
        names.iter().zip(parts).filter(|(_, parts)| !parts.is_empty()).map(|(name, parts)| {
            let line = Line::of(parts.iter().copied());
            Held { name, parts, line }
        });
    let held: Vec<Held<'_>> = held.collect();
    let mut said = Vec::new();
    let samples = pieces.iter().map(|(_, [signal, ..])| signal.len()).sum::<usize>();
    if rate_hz < SLOW_HZ && samples >= TELLING && !options.is_table {
        said.push(format!(
            "the trials have {} samples a second: are their times in milliseconds? If so, convert them to seconds (in the program with \
             --time COL:ms, where COL is the time column), which makes the rates 1000 times as high",
            in_digits(rate_hz, 6)
        ));
    }
    if samples < TELLING && !options.is_table {
        said.push(format!(
            "the trials have {samples} samples in total, too few for a reliable calibration: record half a minute over the whole range"
        ));
    }
    let all = Line::of(pieces.iter()).spreads[1];
    for trial in &held {
        let name = trial.name;
        if trial.parts.iter().all(|(_, [v, x, _])| is_same(v, x)) && trial.line.spreads[0] > 0.0 {
            said.push(format!(
                "{signal} equals {reference} in {name}: was one recorded in place of the other? If so, leave that trial out"
            ));
        } else if trial.line.spreads[0] == 0.0 && trial.line.spreads[1] > MOVES_ON * all {
            let value = trial.line.means[0];
            said.push(format!(
                "{signal} is {value} throughout {name} while {reference} moves: is the sensor connected? If it was not, leave that trial out"
            ));
        } else {
            said.extend(trial.clipped(signal, reference));
        }
    }
    let others = || (0..held.len()).step_by(held.len().div_ceil(OTHERS).max(1));
    let mistakes: Vec<Vec<_>> = held
        .par_iter()
        .map(|own| others().map(|j| (j, own.line.mistake(held[j].line))).collect())
        .collect();
    // A mistake is reported for the trial that contradicts more of the others. If there are only two trials, it is
    // reported for the second.
    let rank = |i: usize| (mistakes[i].iter().filter(|(_, says)| says.is_some()).count(), i);
    let copies = copies(&held);
    for (i, own) in held.iter().enumerate() {
        if let Some(first) = copies[i].map(|first| &held[first]) {
            said.push(format!(
                "{} has the same samples as {}: they count twice, and cross-validation judges a fit by samples that it was fitted on; leave one of the two out",
                own.name, first.name
            ));
        }
        let others = mistakes[i].iter().filter(|(j, _)| rank(*j) < rank(i));
        if let Some((says, other)) = others.filter_map(|(j, says)| Some(((*says)?, *j))).next() {
            let words = [
                ("{trial}", own.name),
                ("{other}", held[other].name),
                ("{signal}", signal),
                ("{reference}", reference),
            ];
            said.push(
                words.iter().fold(says.to_owned(), |text, (key, word)| text.replace(key, word)),
            );
        }
    }
    said
}
