//! One branch of a calibration in the units of its data.

use std::ops::Range;

use stretch_calibrate::{Calibrated, FitReport};
use stretch_core::{Branch, Calibration, Model, Polarity, RateSource, Target};

use super::thin::{extent, quantile, sorted};

/// A fit's samples and surface, converted from normalised numbers to the units of the data.
pub(crate) struct BranchView<'a> {
    /// The fit.
    pub(crate) fit: &'a FitReport,
    /// Samples: rate, signal, target.
    pub(crate) cloud: Vec<[f64; 3]>,
    /// Span of the rates without the outermost percent on either side.
    pub(crate) rate: Range<f64>,
    /// Span of the signal.
    pub(crate) signal: Range<f64>,
    /// Span of the target.
    pub(crate) target: Range<f64>,
    /// Labels of the axes: rate, signal, target.
    pub(crate) labels: [String; 3],
    /// Whether the signal falls as the target rises.
    pub(crate) falling: bool,
    calibration: &'a Calibration,
    rate_scale: Option<stretch_core::Range>,
}

impl<'a> BranchView<'a> {
    /// The view of each branch; empty for a linear calibration, or without samples.
    pub(crate) fn all(calibrated: &'a Calibrated) -> Vec<Self> {
        calibrated.fits.iter().filter_map(|fit| Self::new(&calibrated.calibration, fit)).collect()
    }

    fn new(calibration: &'a Calibration, fit: &'a FitReport) -> Option<Self> {
        let Model::Surfaces { inflation, deflation } = &calibration.spec().model else {
            return None;
        };
        let surface = match fit.branch? {
            Branch::Inflation => inflation,
            Branch::Deflation => deflation,
        };
        // if a fit used the rate of the reference, samples and surface share only the normalised
        // rate as an axis
        let rate_scale =
            (calibration.spec().rate_source == RateSource::Voltage).then_some(surface.rate_range);
        let (signal, reference) = (&calibration.spec().signal, &calibration.spec().reference);
        let rate_label = match rate_scale {
            Some(_) => format!("rate of {signal}, per s"),
            None => "rate, normalised".to_owned(),
        };
        let target_label = match calibration.spec().target {
            Target::Contraction { .. } => "contraction, %".to_owned(),
            Target::Direct => reference.to_string(),
        };
        let mut view = Self {
            fit,
            cloud: Vec::new(),
            rate: 0.0..1.0,
            signal: 0.0..1.0,
            target: 0.0..1.0,
            labels: [rate_label, signal.to_string(), target_label],
            falling: calibration.spec().polarity == Polarity::Falling,
            calibration,
            rate_scale,
        };
        view.cloud = fit
            .cloud
            .iter()
            .filter(|sample| sample.iter().all(|x| x.is_finite()))
            .map(|&[rate, signal, target]| {
                [
                    view.rate_of(rate),
                    calibration.spec().signal_range.denormalise(signal),
                    view.shown(target),
                ]
            })
            .collect();
        let column = |i: usize| view.cloud.iter().map(move |sample| sample[i]);
        let rates = sorted(column(0));
        let (signal, target) = (extent(column(1))?, extent(column(2))?);
        (view.rate, view.signal, view.target) =
            (quantile(&rates, 0.01)..quantile(&rates, 0.99), signal, target);
        let some = |span: &Range<f64>| span.end > span.start;
        (some(&view.rate) && some(&view.signal) && some(&view.target)).then_some(view)
    }

    /// The surface at a rate and a signal in the units of the data.
    pub(crate) fn surface(&self, rate: f64, signal: f64) -> f64 {
        let rate = self.rate_scale.map_or(rate, |scale| scale.normalise(rate));
        let signal = self.calibration.spec().signal_range.normalise(signal);
        self.shown(self.fit.surface.eval(rate, signal))
    }

    /// Name of the branch.
    pub(crate) fn name(&self) -> &'static str {
        self.calibration.spec().target.branch_name(self.fit.branch.unwrap_or_default())
    }

    fn rate_of(&self, normalised: f64) -> f64 {
        self.rate_scale.map_or(normalised, |scale| scale.denormalise(normalised))
    }

    fn shown(&self, normalised: f64) -> f64 {
        let target = self.calibration.spec().target_range.denormalise(normalised);
        match self.calibration.spec().target {
            Target::Contraction { .. } => 100.0 * target,
            Target::Direct => target,
        }
    }
}
