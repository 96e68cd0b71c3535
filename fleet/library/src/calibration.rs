//! Makes a calibration that `stretch apply` takes from two triangles.

use stretch_calibrate::calibration_to_json;
use stretch_core::{
    BranchSurface, Calibration, CalibrationSpec, Degree, FitSummary, Interval, Label, LinearMap,
    Model, Normalisation, Polarity, Provenance, Range, RangeSpec, RateEstimator, RateSource,
    SampleRate, Schema, Surface, Target,
};
use stretch_fit::{Factor, Fit};

use crate::{about::About, span::Span};

/// A branch of a fit, or the one line.
pub(crate) struct Side<const TERMS: usize> {
    pub factor: Factor<f64, TERMS>,
    pub span: Span,
    pub fit: Fit<f64, TERMS>,
}

/// A complete fit: a line, or inflation and deflation.
pub(crate) struct Whole<'a, const TERMS: usize> {
    pub sides: &'a [Side<TERMS>],
    pub polarity: Polarity,
    /// Of all sides.
    pub span: Span,
}

/// Everything of a record but its model's numbers.
struct Frame {
    sample_rate_hz: SampleRate,
    rate_estimator: RateEstimator,
    signal: Range,
    target: Range,
}

const RATE: usize = 0;
const SIGNAL: usize = 1;
const REFERENCE: usize = 2;

impl<const TERMS: usize> Whole<'_, TERMS> {
    /// The record in JSON, sealed; `None` if it is unknown how the rates were estimated.
    ///
    /// Signal and target are normalised to 0..1 over the range of the rows, and the surfaces are
    /// about the smallest signal, because coefficients about zero volts would cancel.
    pub(crate) fn record(&self, about: &About) -> Result<Option<String>, String> {
        let (Some(hz), Some(rate_estimator)) = (about.sample_rate_hz, about.rate_estimator) else {
            return Ok(None);
        };
        let frame = Frame {
            sample_rate_hz: SampleRate::new(hz).map_err(|e| e.to_string())?,
            rate_estimator,
            signal: range(Normalisation::MinMax, self.span, SIGNAL)?,
            target: range(Normalisation::MinMax, self.span, REFERENCE)?,
        };
        let model = self.model(&frame)?;
        let spec = CalibrationSpec {
            schema: Schema::CURRENT,
            signal: Label::new(&about.signal).map_err(|e| e.to_string())?,
            reference: Label::new(&about.reference).map_err(|e| e.to_string())?,
            sample_rate_hz: frame.sample_rate_hz,
            target: Target::Direct,
            polarity: self.polarity,
            signal_range: frame.signal,
            target_range: frame.target,
            rate_estimator: frame.rate_estimator,
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
        // the sign with which a positive rate means a rising target
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

/// The surface over normalised signal and rate, to the normalised target; `rate` is the factor from
/// a normalised rate to one of the signal.
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
