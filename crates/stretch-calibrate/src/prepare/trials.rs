//! Prepares trials for a fit: puts them on one even time grid and computes the ranges over all trials.

use stretch_core::{
    Calibration, CalibrationSpec, DesignError, FitSummary, Interval, Label, Model, Normalisation,
    Polarity, Provenance, Range, RangeSpec, RateEstimator, SampleRate, Schema, Target,
};
use stretch_data::{Even, EvenSpec, Rows, Trial, check_rows, in_digits, resampling};
use stretch_filter::RateFilter;

use crate::{CalibrateError, ModelKind, Options, PRESSURE};

use super::{
    doubts::{Line, doubts},
    series::{DeadBands, Series, extent, noise, polarity, sample_rate_hz, series},
};

/// Smallest number of samples of a part; shorter parts have no rate.
const SHORTEST: usize = 3;

/// Greatest number of rows of all trials together to which a calibration is fitted or on which it is evaluated: about a
/// day at 100 Hz. The measured memory is 110 bytes a row (linear), 120 (poly13) and 140 (evaluate).
pub const MOST_ROWS: usize = 10_000_000;
/// The same limit for models with memory, which take 145 (history) to 180 bytes (observer) a row.
const MOST_REMEMBERED: usize = 3_000_000;

/// Smallest number of trials for a cross-validation that leaves out whole trials. With fewer trials, parts are left out.
pub(crate) const LEAST_TRIALS: usize = 3;

/// Greatest number of folds of whole trials. If there are more trials, each fold holds several, because with one fit
/// for each trial the time would grow with the square of their number.
const MOST_FOLDS: usize = 16;

/// Returns the fold of a trial in a cross-validation that leaves out whole trials.
pub(crate) fn fold_of(trial: usize) -> usize {
    trial % MOST_FOLDS
}

/// All trials on an even time grid, with the ranges over all of them.
pub(crate) struct Prepared {
    pub series: Vec<Series>,
    pub sample_rate: SampleRate,
    pub target: Target,
    pub polarity: Polarity,
    pub signal_range: Range,
    pub target_range: Range,
    pub dead: DeadBands,
    /// What may be wrong with the data, one sentence each.
    pub doubts: Vec<String>,
    /// Changes made to the data, one sentence each.
    pub notes: Vec<String>,
    pub options: Options,
    /// Name of the first trial.
    pub first_trial: String,
}

impl Prepared {
    pub(crate) fn new(trials: &[Trial], options: &Options) -> Result<Self, CalibrateError> {
        let options = &options.named_as(trials);
        if options.signal == options.reference {
            return Err(CalibrateError::Refused(format!(
                "{} is both the signal and the reference, but a calibration needs two columns: choose another column, or record a reference, such as length_mm, in the same file",
                options.signal
            )));
        }
        let (sample_rate, Evened { pieces, rows, gaps, mut notes, .. }) =
            Evened::of(trials, options)?;
        notes.extend(rows.note());
        let names: Vec<&str> = trials.iter().map(|trial| trial.name.as_str()).collect();
        let of_trials = doubts(&names, &pieces, sample_rate.hz(), options);
        let doubts = [gaps, of_trials].concat();
        let target = target(options, &pieces, sample_rate.hz())?;
        let pairs = pieces.iter().flat_map(|(_, [signal, reference, _])| {
            signal.iter().zip(reference).map(|(&v, &x)| (v, target.from_reference(x)))
        });
        let polarity = polarity(pairs.clone());
        let range =
            |column: &str, zero, seen| pooled_range(column, options.normalisation, zero, seen);
        let seen = extent(pairs.clone().map(|(v, _)| v));
        let signal_range = range(&options.signal, options.zero(seen), seen)?;
        let target_range = range(&options.reference, 0.0, extent(pairs.map(|(_, t)| t)));
        let target_range = target_range.map_err(|error| match (error, pieces.first()) {
            // The message gives the value in the file, not the contraction computed from it.
            (CalibrateError::Constant { column, .. }, Some((_, [_, reference, _]))) => {
                let value = reference.first().copied().unwrap_or_default();
                CalibrateError::Constant { column, value }
            }
            (other, _) => other,
        })?;
        let noise_v = noise(pieces.iter().map(|(_, [v, ..])| v.as_slice()));
        // The default is three standard deviations of the rate's noise.
        let signal = match options.dead_band {
            Some(dead_band) => dead_band,
            None => 3.0 * noise_v * noise_gain(options.rate, sample_rate)?,
        };
        let target_dead = signal * target_range.span() / signal_range.span();
        let dead = DeadBands { signal, target: target_dead };
        let series = pieces
            .into_iter()
            .map(|(trial, piece)| series(trial, piece, target, polarity, options.rate, sample_rate))
            .collect::<Result<_, _>>()?;
        let options = options.clone();
        Ok(Self {
            series,
            sample_rate,
            target,
            polarity,
            signal_range,
            target_range,
            dead,
            doubts,
            notes,
            options,
            first_trial: trials[0].name.clone(),
        })
    }

    /// Returns the calibration of a model that was fitted to these trials.
    pub(crate) fn calibration(
        &self,
        model: Model,
        provenance: Provenance,
    ) -> Result<Calibration, CalibrateError> {
        Ok(Calibration::new(CalibrationSpec {
            schema: Schema::CURRENT,
            signal: Label::new(&self.options.signal)?,
            reference: Label::new(&self.options.reference)?,
            sample_rate_hz: self.sample_rate,
            target: self.target,
            polarity: self.polarity,
            signal_range: self.signal_range,
            target_range: self.target_range,
            rate_estimator: self.options.rate,
            rate_source: self.options.rate_source,
            dead_band: self.dead.signal,
            model,
            provenance,
        })?)
    }

    /// Returns each series with the fold of each of its samples in cross-validation. Each trial is a fold. If there
    /// are fewer than [`LEAST_TRIALS`] trials, each tenth of all samples is a fold.
    pub(crate) fn folds(&self) -> impl Iterator<Item = (&Series, Vec<usize>)> {
        let trials = self.series.iter().map(|s| s.trial).max().map_or(0, |last| last + 1);
        let total: usize = self.series.iter().map(|s| s.signal.len()).sum();
        let mut before = 0;
        self.series.iter().map(move |series| {
            let own = before..before + series.signal.len();
            before = own.end;
            let whole = trials >= LEAST_TRIALS;
            let fold = |place| if whole { fold_of(series.trial) } else { place * 10 / total };
            (series, own.map(fold).collect())
        })
    }
}

/// Trials, or their parts between gaps, on the time grid of the first trial, with the counts of their rows.
#[derive(Default)]
struct Evened {
    pieces: Vec<Piece>,
    rows: Rows,
    gaps: Vec<String>,
    notes: Vec<String>,
    /// The jump of a reference that wraps, in its unit, if the reference wraps in any trial.
    turn: Option<f64>,
}

impl Evened {
    /// Returns all trials on the time grid of the first one, and the sample rate.
    fn of(trials: &[Trial], options: &Options) -> Result<(SampleRate, Self), CalibrateError> {
        let first = trials.first().ok_or(CalibrateError::NoTrials)?;
        check_rows(trials, most_rows(options.model))?;
        let sample_rate = SampleRate::new(sample_rate_hz(first)?)?;
        let mut evened = Self::default();
        for (index, trial) in trials.iter().enumerate() {
            evened.take(index, trial, (&first.name, sample_rate), options)?;
        }
        if evened.pieces.is_empty() {
            return Err(CalibrateError::too_short(first));
        }
        if let Some(turn) = evened.turn
            && let Some(moved) = align_turns(&mut evened.pieces, turn)
        {
            let column = &options.reference;
            let signal = &options.signal;
            evened.notes.push(format!(
                "{column} is an angle that begins in different turns: {moved} of the trial parts were moved by whole turns to agree with {signal}"
            ));
        }
        Ok((sample_rate, evened))
    }

    /// Adds a trial. `first` is the name of the trial whose time grid is used.
    fn take(
        &mut self,
        index: usize,
        trial: &Trial,
        (first, sample_rate): (&str, SampleRate),
        options: &Options,
    ) -> Result<(), CalibrateError> {
        check_rate(trial, first, sample_rate)?;
        let mut columns = vec![options.signal.as_str(), options.reference.as_str()];
        // The column is added only if the pressure was recorded. If the pressure is missing, a later error names the
        // effect that needs it.
        let has_pressure = options.needs_pressure() && trial.channel(PRESSURE).is_some();
        columns.extend(has_pressure.then_some(PRESSURE));
        let even = even(trial, &columns, 1, sample_rate)?;
        self.turn = self.turn.or(even.turns[1]);
        self.rows.add(even.rows);
        self.gaps.extend(even.gaps);
        self.notes.extend(even.notes);
        self.pieces.extend(even.parts.into_iter().filter_map(|part| {
            let mut columns = part.columns.into_iter();
            Some((index, [columns.next()?, columns.next()?, columns.next().unwrap_or_default()]))
        }));
        Ok(())
    }
}

/// Shifts the reference of each part by whole turns, so that its mean is nearest to the line
/// `reference = a + b signal`. The line is fitted to the part with the widest range of the signal.
///
/// The turn of an angle that wraps is unknown, so a trial may begin on the other side of the seam. Returns the number
/// of shifted parts, or `None` if there are none.
fn align_turns(pieces: &mut [Piece], turn: f64) -> Option<usize> {
    let width = |(_, [signal, ..]): &Piece| {
        let seen = extent(signal.iter().copied());
        seen.max - seen.min
    };
    let widest = pieces.iter().max_by(|a, b| width(a).total_cmp(&width(b)))?;
    let widest = Line::of(std::iter::once(widest));
    let mut moved = 0;
    for piece in pieces {
        let [signal, reference] = Line::of(std::iter::once(&*piece)).means;
        let off = widest.at(signal) - reference;
        let shift = turn * (off / turn).round();
        if shift != 0.0 && shift.is_finite() {
            piece.1[1].iter_mut().for_each(|x| *x += shift);
            moved += 1;
        }
    }
    (moved > 0).then_some(moved)
}

fn most_rows(model: ModelKind) -> usize {
    if matches!(model, ModelKind::Remembering { .. }) { MOST_REMEMBERED } else { MOST_ROWS }
}

/// Checks that a trial has the sample rate of the `first` one.
///
/// # Errors
/// [`CalibrateError::Refused`] for rates that differ by more than 5 %: such trials cannot share an estimator.
pub fn check_rate(
    trial: &Trial,
    first: &str,
    sample_rate: SampleRate,
) -> Result<(), CalibrateError> {
    let (rate_hz, first_hz) = (sample_rate_hz(trial)?, sample_rate.hz());
    if (rate_hz / first_hz - 1.0).abs() <= 0.05 {
        return Ok(());
    }
    Err(CalibrateError::Refused(format!(
        "{} was sampled at {} Hz and {first} at {} Hz; resample one of them ({}), or calibrate them separately",
        trial.name,
        in_digits(rate_hz, 6),
        in_digits(first_hz, 6),
        resampling(first_hz)
    )))
}

/// Resamples a trial to an even time grid. The first `signals` of its columns must not wrap.
///
/// # Errors
/// [`CalibrateError::Refused`] for a signal that wraps, and [`CalibrateError::Data`] for a missing column.
pub fn even(
    trial: &Trial,
    columns: &[&str],
    signals: usize,
    rate: SampleRate,
) -> Result<Even, CalibrateError> {
    let rate_hz = rate.hz();
    let spec = EvenSpec { rate_hz, shortest: SHORTEST, bridged_s: 0.0, over_switches: true };
    let even = trial.even(columns, spec)?;
    let mut turns = columns.iter().zip(&even.turns).take(signals);
    match turns.find_map(|(column, turn)| Some((column, (*turn)?))) {
        Some((column, turn)) => Err(CalibrateError::Refused(format!(
            "{}: the signal {column} jumps by {turn} between neighbouring samples, because it is an angle that wraps; unwrap it before you calibrate \
             and before you apply the calibration, or move its zero so that the motion stays within one turn",
            trial.name
        ))),
        None => Ok(even),
    }
}

/// Returns the signals of trials, resampled as [`calibrate`](crate::calibrate()) does before a fit: a list for each
/// part without gaps.
///
/// # Errors
/// The errors of [`calibrate`](crate::calibrate()) that concern the trials.
pub fn even_signals(trials: &[Trial], options: &Options) -> Result<Vec<Vec<f64>>, CalibrateError> {
    let (_, evened) = Evened::of(trials, options)?;
    Ok(evened.pieces.into_iter().map(|(_, [signal, ..])| signal).collect())
}

/// Sums over samples of the normalised target and of its estimation errors, from which R^2 and the
/// root mean square error are computed.
#[derive(Default)]
pub(crate) struct Tally {
    squares: f64,
    sum: f64,
    power: f64,
    count: f64,
}

impl Tally {
    /// Adds a normalised target and its error.
    pub(crate) fn take(&mut self, truth: f64, error: f64) {
        self.squares += error * error;
        self.sum += truth;
        self.power += truth * truth;
        self.count += 1.0;
    }

    /// Returns the number of errors.
    pub(crate) fn count(&self) -> f64 {
        self.count
    }

    pub(crate) fn summary(&self) -> FitSummary {
        let count = f64::max(self.count, 1.0);
        let total = (self.power - self.sum * self.sum / count).max(f64::MIN_POSITIVE);
        FitSummary {
            samples: self.count as u64,
            r_squared: 1.0 - self.squares / total,
            rmse: (self.squares / count).sqrt(),
        }
    }
}

/// Returns the standard deviation of an estimator's rate for white noise with a standard deviation of one.
pub(crate) fn noise_gain(
    estimator: RateEstimator,
    rate: SampleRate,
) -> Result<f64, CalibrateError> {
    match estimator {
        RateEstimator::CentralDifference => Ok(rate.hz() / 2f64.sqrt()),
        live => Ok(RateFilter::<f64>::new(live, rate)?.noise_gain()),
    }
}

/// Index of the trial, and its signal, reference and, if needed, pressure.
pub(super) type Piece = (usize, [Vec<f64>; 3]);

/// A reference is at rest if it changes by less than [`STILL`] within this time, s.
const STILL_S: f64 = 0.2;
/// Largest change of a reference at rest, as a share of its range.
const STILL: f64 = 0.01;
/// A rest is at an end of the range if its distance from this end is less than this share of the range.
const AT_AN_END: f64 = 0.15;
/// Smallest total duration of the rests at one end from which the resting end is detected, s.
const LEAST_REST_S: f64 = 1.0;

/// Whether a reference rests at its greatest value. The answer is `usually`, unless the reference rests at the other
/// end for more than a second and more than twice as long.
fn rests_at_greatest(pieces: &[Piece], rate_hz: f64, usually: bool) -> bool {
    let references = || pieces.iter().map(|(_, [_, reference, _])| reference);
    let seen = extent(references().flatten().copied());
    let (range, steps) = (seen.max - seen.min, ((STILL_S * rate_hz) as usize).max(1));
    let rests_s = [seen.min, seen.max].map(|end| {
        let is_rest = |(from, to): (&f64, &f64)| {
            (to - from).abs() < STILL * range && (to - end).abs() < AT_AN_END * range
        };
        let pairs = references().flat_map(|x| x.iter().zip(x.iter().skip(steps)));
        pairs.filter(|pair| is_rest(*pair)).count() as f64 / rate_hz
    });
    let [own, other] = if usually { [rests_s[1], rests_s[0]] } else { rests_s };
    usually != (other > LEAST_REST_S && other > 2.0 * own)
}

fn target(options: &Options, pieces: &[Piece], rate_hz: f64) -> Result<Target, CalibrateError> {
    let all = pieces.iter().flat_map(|(_, [_, reference, _])| reference.iter().copied());
    let longest = all.fold(f64::MIN, f64::max);
    let is_length = options.reference.starts_with("length");
    // A baseline is followed at the low end of the target, so the sensor has to rest there.
    let follows_rest = matches!(options.model, ModelKind::Remembering { rest: true, .. });
    let from_longest = match follows_rest {
        true => rests_at_greatest(pieces, rate_hz, is_length) && (is_length || longest > 0.0),
        false => is_length,
    };
    let rest_length = options.rest_length.or(from_longest.then_some(longest));
    Ok(match rest_length {
        Some(rest_length) => {
            DesignError::check("rest_length", rest_length, rest_length > 0.0)?;
            Target::Contraction { rest_length }
        }
        None => Target::Direct,
    })
}

/// Returns the origin of a calibration: its date, and its trials with the checksums of their columns.
pub fn provenance<'a>(
    date: &str,
    trials: &[Trial],
    columns: impl IntoIterator<Item = &'a String>,
) -> Provenance {
    let columns: Vec<&str> = columns.into_iter().map(String::as_str).collect();
    Provenance::new(date, trials.iter().map(|trial| trial.name.as_str()))
        .with_checksums(trials.iter().filter_map(|trial| trial.checksum(&columns)))
}

/// Returns the range of a column from its least and greatest value.
///
/// # Errors
/// [`CalibrateError::Constant`] for a column that never changes.
pub fn pooled_range(
    column: &str,
    mode: Normalisation,
    zero: f64,
    Interval { min, max }: Interval,
) -> Result<Range, CalibrateError> {
    Range::new(RangeSpec { mode, zero, min, max })
        .map_err(|_| CalibrateError::Constant { column: column.to_owned(), value: min })
}
