//! Result of a fit, one row per group: numbers, and a calibration for `stretch apply`.

use std::sync::Arc;

use datafusion::arrow::{
    array::{ArrayRef, Float64Builder, ListBuilder, StringBuilder, StructArray, UInt64Builder},
    datatypes::{DataType, Field, Fields},
};
use stretch_calibrate::calibration_to_json;
use stretch_core::{
    BranchSurface, Calibration, CalibrationSpec, Degree, FitSummary, Interval, Label, LinearMap,
    Model, Normalisation, Polarity, Provenance, Range, RangeSpec, RateSource, SampleRate, Schema,
    Surface, Target,
};
use stretch_fit::{Factor, Fit, FitError};

use crate::{
    about::About,
    state::{Outcome, Partial, Span},
};

/// The columns of numbers between the counts and the coefficients.
const NUMBERS: [&str; 7] =
    ["rmse", "rate_min", "rate_max", "signal_min", "signal_max", "reference_min", "reference_max"];

/// Returns the fields of a fit's result.
pub(crate) fn fields() -> Fields {
    let number = |name: &str| Field::new(name, DataType::Float64, true);
    let count = |name: &str| Field::new(name, DataType::UInt64, true);
    let list = DataType::List(Arc::new(Field::new_list_field(DataType::Float64, true)));
    let text = |name: &str| Field::new(name, DataType::Utf8, true);
    [count("rows"), count("rows_left_out")]
        .into_iter()
        .chain(NUMBERS.map(number))
        .chain([Field::new("coefficients", list, true), text("record"), text("refused")])
        .collect()
}

/// The result of a fit.
#[derive(Default)]
struct Answer {
    rows: u64,
    left_out: u64,
    rmse: Option<f64>,
    span: Option<Span>,
    coefficients: Option<Vec<f64>>,
    record: Option<String>,
    refused: Option<String>,
}

/// Converts the results of many groups to an array of structs. A line has no rate.
pub(crate) fn answers<const TERMS: usize>(
    degree: Degree,
    is_line: bool,
    outcomes: &[Outcome<TERMS>],
) -> ArrayRef {
    let (mut rows, mut left_out) = (UInt64Builder::new(), UInt64Builder::new());
    let mut numbers = NUMBERS.map(|_| Float64Builder::new());
    let mut coefficients = ListBuilder::new(Float64Builder::new());
    let (mut record, mut refused) = (StringBuilder::new(), StringBuilder::new());
    for outcome in outcomes {
        let answer = answer(degree, is_line, outcome);
        rows.append_value(answer.rows);
        left_out.append_value(answer.left_out);
        numbers[0].append_option(answer.rmse);
        for column in 0..3 {
            let span = answer.span.filter(|_| column > 0 || !is_line);
            numbers[1 + 2 * column].append_option(span.map(|span| span.least[column]));
            numbers[2 + 2 * column].append_option(span.map(|span| span.most[column]));
        }
        coefficients.append_option(answer.coefficients.map(|all| all.into_iter().map(Some)));
        record.append_option(answer.record);
        refused.append_option(answer.refused);
    }
    let arrays = [Arc::new(rows.finish()) as ArrayRef, Arc::new(left_out.finish())]
        .into_iter()
        .chain(numbers.iter_mut().map(|numbers| Arc::new(numbers.finish()) as ArrayRef))
        .chain([
            Arc::new(coefficients.finish()) as ArrayRef,
            Arc::new(record.finish()),
            Arc::new(refused.finish()),
        ])
        .collect();
    Arc::new(StructArray::new(fields(), arrays, None))
}

fn answer<const TERMS: usize>(degree: Degree, is_line: bool, outcome: &Outcome<TERMS>) -> Answer {
    let partial = match outcome {
        Ok(partial) => partial,
        Err(sentence) => {
            return Answer { refused: Some(sentence.to_string()), ..Answer::default() };
        }
    };
    let sides = partial.sides.iter().flatten();
    let rows = sides.fold(0, |rows: u64, (factor, _)| rows.saturating_add(factor.samples()));
    let counted = Answer { rows, left_out: partial.left_out, ..Answer::default() };
    match fitted(degree, is_line, partial, rows) {
        Err(sentence) => Answer { refused: Some(sentence), ..counted },
        Ok((sides, polarity)) => {
            let span = sides.iter().fold(Span::EMPTY, |span, side| span.joined(&side.span));
            let dof = sides.iter().fold(0, |dof: u64, side| dof.saturating_add(side.fit.dof()));
            let sse: f64 = sides.iter().map(|side| side.fit.sse()).sum();
            let whole = Whole { sides: &sides, polarity, span };
            // This library wrote the text. If its bytes are damaged, there is no calibration.
            let about = serde_json::from_str::<About>(&partial.about).ok();
            let record = about.map_or(Ok(None), |about| whole.record(&about));
            Answer {
                rmse: (dof > 0).then(|| (sse / dof as f64).sqrt()),
                span: Some(span),
                coefficients: Some(
                    sides.iter().flat_map(|side| side.fit.coefficients().to_vec()).collect(),
                ),
                refused: record.as_ref().err().map(|why| format!("no calibration: {why}")),
                record: record.ok().flatten(),
                ..counted
            }
        }
    }
}

/// Fits all sides, the rising reference first, and determines whether signal and reference rise together.
fn fitted<const TERMS: usize>(
    degree: Degree,
    is_line: bool,
    partial: &Partial<TERMS>,
    rows: u64,
) -> Result<(Vec<Side<TERMS>>, Polarity), String> {
    if rows == 0 {
        return Err(match partial.left_out {
            0 => "there are no rows".to_owned(),
            n => format!("all {n} rows have a value that is missing or not finite"),
        });
    }
    let [up, down] = partial.sides;
    let all = [up, down].into_iter().flatten();
    let span = all.clone().fold(Span::EMPTY, |span, (_, side)| span.joined(&side));
    for (name, column) in [("signal", 1), ("reference", 2)] {
        if span.width(column) == 0.0 {
            let value = span.least[column];
            return Err(format!("the {name} is {value} in all {rows} rows: nothing can be fitted"));
        }
    }
    let polarity = polarity(all.map(|(factor, _)| factor))?;
    let (sides, names) = match (up, down) {
        (Some(line), None) if is_line => (vec![line], ["the line", ""]),
        (Some(up), Some(down)) => match polarity {
            Polarity::Rising => (vec![up, down], ["rising reference", "falling reference"]),
            Polarity::Falling => (vec![down, up], ["rising reference", "falling reference"]),
        },
        (Some(_), None) => return Err(one_branch("falls", "a rate of 0 or above", rows)),
        _ => return Err(one_branch("rises", "a rate below 0", rows)),
    };
    let mut fitted = Vec::with_capacity(sides.len());
    for ((factor, span), name) in sides.into_iter().zip(names) {
        let fit = factor.fit().map_err(|error| match error {
            FitError::TooFewSamples { needed, got } => {
                format!("{name}: {got} rows are too few for the {needed} terms of {degree}")
            }
            other => format!("{name}: {other}"),
        })?;
        fitted.push(Side { factor, span, fit });
    }
    Ok((fitted, polarity))
}

fn one_branch(moves: &str, have: &str, rows: u64) -> String {
    format!(
        "the signal never {moves} (all {rows} rows have {have}): a calibration needs rows with a rising and with a falling signal"
    )
}

/// Returns the sign of the slope of the signal over the reference, from a line through all rows.
fn polarity<const TERMS: usize>(
    mut factors: impl Iterator<Item = Factor<f64, TERMS>>,
) -> Result<Polarity, String> {
    let sentence = |error: FitError| format!("signal against reference: {error}");
    let mut all = factors.next().ok_or("there are no rows")?;
    for factor in factors {
        all.merge(&factor).map_err(sentence)?;
    }
    let fit = all.fit_degree(Degree::LINE).map_err(sentence)?;
    let falls = fit.coefficients().get(1).is_some_and(|slope| *slope < 0.0);
    Ok(if falls { Polarity::Falling } else { Polarity::Rising })
}

/// A branch of a fit, or the single line.
struct Side<const TERMS: usize> {
    factor: Factor<f64, TERMS>,
    span: Span,
    fit: Fit<f64, TERMS>,
}

/// A complete fit: a line, or a surface for each direction of the reference.
struct Whole<'a, const TERMS: usize> {
    sides: &'a [Side<TERMS>],
    polarity: Polarity,
    /// Ranges of the rows of all sides.
    span: Span,
}

/// The ranges over which signal and target are normalised.
struct Frame {
    signal: Range,
    target: Range,
}

const RATE: usize = 0;
const SIGNAL: usize = 1;
const REFERENCE: usize = 2;

impl<const TERMS: usize> Whole<'_, TERMS> {
    /// Returns the calibration as JSON with its checksum, or `None` if the rate estimator is
    /// unknown.
    ///
    /// Signal and target are normalised to 0..1 over the range of the rows. The surfaces are
    /// expanded about the smallest signal, because coefficients about zero volts would suffer from
    /// cancellation.
    fn record(&self, about: &About) -> Result<Option<String>, String> {
        let (Some(hz), Some(rate_estimator)) = (about.sample_rate_hz, about.rate_estimator) else {
            return Ok(None);
        };
        let sample_rate_hz = SampleRate::new(hz).map_err(|e| e.to_string())?;
        let frame = Frame {
            signal: range(Normalisation::MinMax, self.span, SIGNAL)?,
            target: range(Normalisation::MinMax, self.span, REFERENCE)?,
        };
        let model = self.model(&frame)?;
        let spec = CalibrationSpec {
            schema: Schema::CURRENT,
            signal: Label::new(&about.signal).map_err(|e| e.to_string())?,
            reference: Label::new(&about.reference).map_err(|e| e.to_string())?,
            sample_rate_hz,
            target: Target::Direct,
            polarity: self.polarity,
            signal_range: frame.signal,
            target_range: frame.target,
            rate_estimator,
            rate_source: RateSource::Voltage,
            dead_band: 0.0,
            model,
            provenance: Provenance::new("", []),
        };
        let calibration = Calibration::new(spec).map_err(|e| e.to_string())?;
        calibration_to_json(&calibration).map(Some).map_err(|e| e.to_string())
    }

    fn model(&self, frame: &Frame) -> Result<Model, String> {
        match self.sides {
            [line] => {
                let surface = normalised(line, frame, 1.0)?;
                Ok(Model::Linear(LinearMap {
                    slope: surface.coefficient(0, 1),
                    intercept: surface.coefficient(0, 0),
                    signal_domain: extent(line.span, SIGNAL),
                    fit: summary(line, frame),
                }))
            }
            [up, down] => {
                let inflation = self.branch(up, frame)?;
                Ok(Model::Surfaces { inflation, deflation: self.branch(down, frame)? })
            }
            _ => Err("a fit has one side or two".to_owned()),
        }
    }

    fn branch(&self, side: &Side<TERMS>, frame: &Frame) -> Result<BranchSurface, String> {
        // With this sign, a positive rate means a rising target.
        let mut signed = side.span;
        if self.polarity == Polarity::Falling {
            (signed.least[RATE], signed.most[RATE]) =
                (-side.span.most[RATE], -side.span.least[RATE]);
        }
        let rate_range = range(Normalisation::Range, signed, RATE)?;
        Ok(BranchSurface {
            rate_range,
            surface: normalised(side, frame, self.polarity.sign() * rate_range.span())?,
            signal_domain: extent(side.span, SIGNAL),
            rate_domain: extent(signed, RATE),
            fit: summary(side, frame),
        })
    }
}

/// Returns the surface from normalised signal and rate to the normalised target. `rate` is the
/// factor from a normalised rate to a rate of the signal.
fn normalised<const TERMS: usize>(
    side: &Side<TERMS>,
    frame: &Frame,
    rate: f64,
) -> Result<Surface, String> {
    let (signal, target) = (frame.signal, frame.target);
    let fit = side.factor.counted_from(signal.offset()).fit().map_err(|e| e.to_string())?;
    let degree: Degree = fit.degree();
    let power = |x: f64, n: u8| (0..n).fold(1.0, |power, _| power * x);
    let scaled = degree.exponents().zip(fit.coefficients()).map(|((i, j), c)| {
        let offset = if (i, j) == (0, 0) { target.offset() } else { 0.0 };
        (c - offset) * power(rate, i) * power(signal.span(), j) / target.span()
    });
    let coefficients: Vec<f64> = scaled.collect();
    Surface::new(degree, &coefficients).map_err(|e| e.to_string())
}

fn summary<const TERMS: usize>(side: &Side<TERMS>, frame: &Frame) -> FitSummary {
    FitSummary {
        samples: side.fit.samples(),
        r_squared: side.fit.r_squared().unwrap_or(0.0),
        rmse: side.fit.rmse().unwrap_or(0.0) / frame.target.span(),
    }
}

fn extent(span: Span, column: usize) -> Interval {
    Interval { min: span.least[column], max: span.most[column] }
}

fn range(mode: Normalisation, span: Span, column: usize) -> Result<Range, String> {
    let Interval { min, max } = extent(span, column);
    Range::new(RangeSpec { mode, zero: 0.0, min, max }).map_err(|e| e.to_string())
}
