//! The passes over a long log after the first pass, which looks for gross errors.

use stretch_core::{
    Branch, BranchSurface, Calibration, Degree, Interval, LinearMap, MAX_TERMS, Model, Polarity,
    Range, RangeSpec, RateSource, SampleRate, Surface, Turns,
};
use stretch_data::Rows;
use stretch_fit::{FitError, SurfaceAccumulator};
use stretch_receptor::MAX_BRIDGED;

use crate::{
    CalibrateError, FitReport, Options,
    blocks::{GrossErrors, LONGEST, Log},
    fitting::{CLOUD, Factors, Sample, Seen, merged, report, widest},
    prepared::{Evened, Prepared, dead_bands, pooled_range, target_below},
    series::{Series, extent, noise, sample_rate_hz, series},
    split::branches,
    turns::{Movements, Spread},
};

/// Most notes about single blocks that are shown; further notes are only counted.
const MOST_NOTES: usize = 12;

/// Least number of rows of a block other than the first.
const SHORTEST: usize = 100;

/// The inputs of a pass.
#[derive(Clone, Copy)]
pub(crate) struct Passes<'a> {
    pub log: &'a Log<'a>,
    pub gross: &'a GrossErrors<'a>,
    pub options: &'a Options,
    /// Number of trials.
    pub trials: usize,
}

/// What the second pass saw of the signal.
pub(crate) struct Signal {
    pub samples: u64,
    pub extent: Interval,
    /// Median of the noises of the blocks.
    pub noise: f64,
}

/// Sums of the second pass.
struct Extents {
    signal: Interval,
    reference: Interval,
    /// Means of signal and reference.
    mean: [f64; 2],
    /// Sum of the products of the deviations from the means.
    product: f64,
    samples: u64,
    noises: Vec<f64>,
}

impl Extents {
    fn new() -> Self {
        let (mean, noises) = ([0.0; 2], Vec::new());
        Self { signal: NOTHING, reference: NOTHING, mean, product: 0.0, samples: 0, noises }
    }

    fn take(&mut self, [signal, reference, _]: &[Vec<f64>; 3]) {
        self.signal = joined(self.signal, extent(signal.iter().copied()));
        self.reference = joined(self.reference, extent(reference.iter().copied()));
        for (x, y) in signal.iter().zip(reference) {
            // Welford's recursion for a covariance
            self.samples += 1;
            let count = self.samples as f64;
            let before = x - self.mean[0];
            self.mean[0] += before / count;
            self.mean[1] += (y - self.mean[1]) / count;
            self.product += before * (y - self.mean[1]);
        }
        self.noises.push(noise(std::iter::once(signal.as_slice())));
    }
}

/// Counts of the rows, and the notes about them.
#[derive(Default)]
struct RowNotes {
    rows: Rows,
    first: Vec<String>,
    more: usize,
}

impl RowNotes {
    fn take(&mut self, evened: Evened) {
        self.rows.add(evened.rows);
        for note in evened.notes {
            if self.first.len() < MOST_NOTES { self.first.push(note) } else { self.more += 1 }
        }
    }

    fn notes(self) -> Vec<String> {
        let more = (self.more > 0).then(|| format!("{} more sentences like these", self.more));
        let read = self.rows.read;
        let how = format!(
            "{read} rows are more than {LONGEST}: they were read block by block, several times"
        );
        self.first.into_iter().chain(more).chain(self.rows.note()).chain([how]).collect()
    }
}

fn joined(a: Interval, b: Interval) -> Interval {
    Interval { min: a.min.min(b.min), max: a.max.max(b.max) }
}

const NOTHING: Interval = Interval { min: f64::INFINITY, max: f64::NEG_INFINITY };

const BRANCHES: [&str; 2] = ["inflation", "deflation"];

/// Index of a branch in `BRANCHES`.
fn place(branch: Branch) -> usize {
    usize::from(branch == Branch::Deflation)
}

/// Ranges of one branch's samples, and the number of these samples.
#[derive(Clone, Copy)]
struct Span {
    signal: Interval,
    signal_rate: Interval,
    target_rate: Interval,
    samples: u64,
}

/// A sample of a branch before normalisation.
struct Raw {
    index: u64,
    trial: usize,
    signal: f64,
    signal_rate: f64,
    target: f64,
    target_rate: f64,
}

/// The triangular factors of a fit's folds, and a few of its samples.
struct Sums {
    folds: Vec<SurfaceAccumulator<f64, MAX_TERMS, 128>>,
    step: u64,
    samples: u64,
    cloud: Vec<[f64; 3]>,
}

impl Sums {
    fn new(degree: Degree, folds: usize, samples: u64) -> Result<Self, FitError> {
        let one = SurfaceAccumulator::new(degree)?;
        let step = samples.div_ceil(CLOUD as u64).max(1);
        Ok(Self { folds: vec![one; folds], step, samples: 0, cloud: Vec::new() })
    }

    fn take(&mut self, sample: Sample) -> Result<(), FitError> {
        let Sample { fold, rate, signal, target } = sample;
        if self.samples.is_multiple_of(self.step) {
            self.cloud.push([rate, signal, target]);
        }
        self.samples += 1;
        self.folds[fold].push(rate, signal, target)
    }

    fn factors(&self) -> Factors {
        self.folds.iter().filter(|sums| sums.samples() > 0).map(|sums| sums.factor()).collect()
    }
}

impl Passes<'_> {
    /// Every block that has samples, even in time.
    fn evened(
        &self,
        first: &mut Option<(String, SampleRate)>,
        take: &mut dyn FnMut(Evened) -> Result<(), CalibrateError>,
    ) -> Result<(), CalibrateError> {
        // the trial and the last time of the block before
        let mut before: Option<(usize, f64)> = None;
        (self.log)(&mut |index, block| {
            let block = self.gross.without(block);
            // the last block of a trial may be too short to determine its sample rate
            if block.len() < SHORTEST && first.is_some() {
                let rows = Rows { read: block.len(), bridged: 0, dropped: block.len() };
                return take(Evened { rows, ..Evened::default() });
            }
            if first.is_none() {
                *first = Some((block.name.clone(), SampleRate::new(sample_rate_hz(&block)?)?));
            }
            let Some((name, rate)) = first.as_ref() else { return Ok(()) };
            let longest_s = (f64::from(MAX_BRIDGED) + 1.5) * rate.period_s();
            let goes_on = |begin_s: f64| {
                before.is_some_and(|(own, end_s)| own == index && begin_s - end_s < longest_s)
            };
            let continues = block.time_s.first().is_some_and(|begin_s| goes_on(*begin_s));
            before = block.time_s.last().map(|end_s| (index, *end_s));
            let mut evened = Evened { continues, ..Evened::default() };
            evened.take(index, &block, (name, *rate), self.options)?;
            take(evened)
        })
    }

    /// The second pass: ranges, polarity and dead bands, and what was seen of the signal.
    pub(crate) fn prepared(&self, names: &[String]) -> Result<(Prepared, Signal), CalibrateError> {
        let options = self.options;
        let mut seen = Extents::new();
        let mut row_notes = RowNotes::default();
        let mut first = None;
        self.evened(&mut first, &mut |evened| {
            evened.pieces.iter().for_each(|(_, piece)| seen.take(piece));
            row_notes.take(evened);
            Ok(())
        })?;
        let Some((first, sample_rate)) = first else { return Err(CalibrateError::NoTrials) };
        if seen.samples == 0 {
            return Err(CalibrateError::TooShort { trial: first, samples: row_notes.rows.read });
        }
        let target = target_below(options, seen.reference.max)?;
        let [low, high] = [seen.reference.min, seen.reference.max]
            .map(|reference| target.from_reference(reference));
        let target_extent = Interval { min: low.min(high), max: low.max(high) };
        let is_falling =
            (target.from_reference(1.0) - target.from_reference(0.0)) * seen.product < 0.0;
        let polarity = if is_falling { Polarity::Falling } else { Polarity::Rising };
        let range =
            |column: &str, zero, extent| pooled_range(column, options.normalisation, zero, extent);
        let signal_range = range(&options.signal, options.zero(), seen.signal)?;
        let target_range = range(&options.reference, 0.0, target_extent)?;
        seen.noises.sort_by(f64::total_cmp);
        let noise_v = seen.noises[seen.noises.len() / 2];
        let dead = dead_bands(options, sample_rate, noise_v, signal_range, target_range)?;
        let options = options.clone();
        let prepared = Prepared {
            series: Vec::new(),
            sample_rate,
            target,
            polarity,
            signal_range,
            target_range,
            dead,
            notes: row_notes.notes(),
            options,
            first: names.first().cloned().unwrap_or(first),
        };
        Ok((prepared, Signal { samples: seen.samples, extent: seen.signal, noise: noise_v }))
    }

    /// The last two passes: how the signal spreads over its extent, and where its movements turn.
    pub(crate) fn turns(
        &self,
        calibration: &Calibration,
        seen: &Signal,
        prepared: &Prepared,
    ) -> Result<Option<Turns>, CalibrateError> {
        let first = || Some((prepared.first.clone(), prepared.sample_rate));
        let mut spread = Spread::new(seen.extent);
        self.evened(&mut first(), &mut |evened| {
            evened.pieces.iter().for_each(|(_, [signal, ..])| spread.take(signal));
            Ok(())
        })?;
        let Some(mut movements) = Movements::new(calibration, &spread, seen.noise) else {
            return Ok(None);
        };
        self.evened(&mut first(), &mut |evened| {
            for (k, (_, [signal, ..])) in evened.pieces.iter().enumerate() {
                if k > 0 || !evened.continues {
                    movements.begin();
                }
                movements.take(signal);
            }
            Ok(())
        })?;
        Ok(movements.turns(calibration))
    }

    /// Calls `take` with every part of the log, its rates, and the index of its first sample in the whole log.
    fn series(
        &self,
        prepared: &Prepared,
        take: &mut dyn FnMut(&Series, u64) -> Result<(), CalibrateError>,
    ) -> Result<(), CalibrateError> {
        let mut before = 0;
        let mut first = Some((prepared.first.clone(), prepared.sample_rate));
        self.evened(&mut first, &mut |evened| {
            for (trial, piece) in evened.pieces {
                let (estimator, rate) = (self.options.rate, prepared.sample_rate);
                let (target, polarity) = (prepared.target, prepared.polarity);
                let series = series(trial, piece, target, polarity, estimator, rate)?;
                take(&series, before)?;
                before += series.signal.len() as u64;
            }
            Ok(())
        })
    }

    /// Calls `take` with every sample that belongs to a branch.
    fn raw(
        &self,
        prepared: &Prepared,
        take: &mut dyn FnMut(Branch, Raw) -> Result<(), CalibrateError>,
    ) -> Result<(), CalibrateError> {
        self.series(prepared, &mut |series, before| {
            for (i, branch) in branches(series, self.options, prepared.dead).into_iter().enumerate()
            {
                let (Some(branch), Some(signal_rate)) = (branch, series.signal_rate[i]) else {
                    continue;
                };
                let raw = Raw {
                    index: before + i as u64,
                    trial: series.trial,
                    signal: series.signal[i],
                    signal_rate,
                    target: series.target[i],
                    target_rate: series.target_rate[i],
                };
                take(branch, raw)?;
            }
            Ok(())
        })
    }

    /// Number of parts of the data that are left out in turn.
    fn folds(&self) -> usize {
        if self.trials >= 3 { self.trials } else { 10 }
    }

    fn fold(&self, trial: usize, index: u64, total: u64) -> usize {
        if self.trials >= 3 { trial } else { (index * 10 / total.max(1)).min(9) as usize }
    }

    /// The third pass of a line: a triangular factor for each fold.
    pub(crate) fn line(
        &self,
        prepared: &Prepared,
        total: u64,
    ) -> Result<(Model, Vec<FitReport>), CalibrateError> {
        let name = "linear fit";
        let failed = |cause| CalibrateError::Fit { branch: name, cause };
        let degree = Degree::new(0, 1)?;
        let mut sums = Sums::new(degree, self.folds(), total).map_err(failed)?;
        let mut domain = NOTHING;
        self.series(prepared, &mut |series, before| {
            domain = joined(domain, extent(series.signal.iter().copied()));
            for (i, (&v, &t)) in series.signal.iter().zip(&series.target).enumerate() {
                let sample = Sample {
                    fold: self.fold(series.trial, before + i as u64, total),
                    rate: 0.0,
                    signal: prepared.signal_range.normalise(v),
                    target: prepared.target_range.normalise(t),
                };
                sums.take(sample).map_err(failed)?;
            }
            Ok(())
        })?;
        let (report, surface) = fitted(name, None, degree, sums)?;
        let line = LinearMap {
            slope: surface.coefficient(0, 1),
            intercept: surface.coefficient(0, 0),
            signal_domain: domain,
            fit: report.summary(),
        };
        Ok((Model::Linear(line), vec![report]))
    }

    /// The third pass of surfaces: the ranges of each branch.
    fn spans(&self, prepared: &Prepared, degree: Degree) -> Result<[Span; 2], CalibrateError> {
        let none = Span { signal: NOTHING, signal_rate: NOTHING, target_rate: NOTHING, samples: 0 };
        let mut spans = [none; 2];
        self.raw(prepared, &mut |branch, raw| {
            let span = &mut spans[place(branch)];
            let point = |x| Interval { min: x, max: x };
            span.signal = joined(span.signal, point(raw.signal));
            span.signal_rate = joined(span.signal_rate, point(raw.signal_rate));
            span.target_rate = joined(span.target_rate, point(raw.target_rate));
            span.samples += 1;
            Ok(())
        })?;
        for (Span { samples, .. }, branch) in spans.into_iter().zip(BRANCHES) {
            if samples <= degree.terms() as u64 {
                return Err(CalibrateError::OneBranch { branch, samples, terms: degree.terms() });
            }
        }
        Ok(spans)
    }

    /// The third and the fourth pass of surfaces: the ranges of the rates by branch, then a triangular factor for
    /// each branch and fold.
    pub(crate) fn surfaces(
        &self,
        prepared: &Prepared,
        degree: Degree,
        total: u64,
    ) -> Result<(Model, Vec<FitReport>), CalibrateError> {
        let (spans, names) = (self.spans(prepared, degree)?, BRANCHES);
        let range = |name: &str, Interval { min, max }: Interval| {
            Range::new(RangeSpec { mode: self.options.normalisation, zero: 0.0, min, max }).map_err(
                |_| CalibrateError::Constant {
                    column: format!("the rate in the {name} branch"),
                    value: min,
                },
            )
        };
        let by_strain = self.options.rate_source == RateSource::Strain;
        let mut ranges = Vec::new();
        for (span, name) in spans.iter().zip(names) {
            let own = range(name, span.signal_rate)?;
            ranges.push((own, if by_strain { range(name, span.target_rate)? } else { own }));
        }
        let mut sums = Vec::new();
        for (span, branch) in spans.iter().zip(names) {
            let wide = widest(Some(Branch::Inflation), degree);
            let own = Sums::new(wide, self.folds(), span.samples);
            sums.push(own.map_err(|cause| CalibrateError::Fit { branch, cause })?);
        }
        self.raw(prepared, &mut |branch, raw| {
            let (i, name) = (place(branch), names[place(branch)]);
            let rate = if by_strain { raw.target_rate } else { raw.signal_rate };
            let sample = Sample {
                fold: self.fold(raw.trial, raw.index, total),
                rate: ranges[i].1.normalise(rate),
                signal: prepared.signal_range.normalise(raw.signal),
                target: prepared.target_range.normalise(raw.target),
            };
            sums[i].take(sample).map_err(|cause| CalibrateError::Fit { branch: name, cause })
        })?;
        let mut made = Vec::new();
        for (i, (sums, branch)) in
            sums.into_iter().zip([Branch::Inflation, Branch::Deflation]).enumerate()
        {
            let (report, surface) = fitted(names[i], Some(branch), degree, sums)?;
            let surface = BranchSurface {
                rate_range: ranges[i].0,
                surface,
                signal_domain: spans[i].signal,
                rate_domain: spans[i].signal_rate,
                fit: report.summary(),
            };
            made.push((surface, report));
        }
        let (surfaces, fits): (Vec<BranchSurface>, Vec<FitReport>) = made.into_iter().unzip();
        let [inflation, deflation] = [surfaces[0], surfaces[1]];
        Ok((Model::Surfaces { inflation, deflation }, fits))
    }
}

fn fitted(
    name: &'static str,
    branch: Option<Branch>,
    degree: Degree,
    sums: Sums,
) -> Result<(FitReport, Surface), CalibrateError> {
    let failed = |cause| CalibrateError::Fit { branch: name, cause };
    let folds = sums.factors();
    let fit = merged(&folds).and_then(|whole| whole.fit_degree(degree)).map_err(failed)?;
    report(name, branch, degree, &folds, fit, Seen { rejected: None, cloud: sums.cloud })
}
