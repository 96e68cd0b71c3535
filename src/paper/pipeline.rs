//! Calibrate, apply, judge: the paper's way or ours.

use serde::Serialize;
use stretch_calibrate::{
    Calibrated, Evaluation, FitReport, Memory, ModelKind, Options, calibrate, evaluate,
    on_own_ranges,
};
use stretch_data::Trial;

/// Both calibrations, fitted and applied one way.
#[derive(Debug, Clone)]
pub(crate) struct Pipeline {
    /// The linear calibration.
    pub(crate) linear: Calibrated,
    /// Two poly13 surfaces.
    pub(crate) non_linear: Calibrated,
    /// A model that remembers, fitted to the same ramps; ours alone.
    pub(crate) observer: Option<Calibrated>,
    /// Raw, linear, non-linear and the observer on arbitrary actuation.
    pub(crate) arbitrary: Evaluation,
    /// Raw, linear, non-linear and the observer on pulses.
    pub(crate) pulses: Evaluation,
}

#[derive(Debug, Serialize)]
pub(crate) struct SerialPipeline<'a> {
    fits: Vec<&'a FitReport>,
    arbitrary: &'a Evaluation,
    pulses: &'a Evaluation,
}

impl Pipeline {
    pub(crate) fn run(
        options: &Options,
        ramps: &[Trial],
        arbitrary: &[Trial],
        pulses: &[Trial],
        own_ranges: bool,
    ) -> anyhow::Result<Self> {
        let linear = calibrate(ramps, &Options { model: ModelKind::Linear, ..options.clone() })?;
        let non_linear = calibrate(ramps, options)?;
        // the paper's way has no such model
        let model = ModelKind::Remembering { kind: Memory::Observer, rest: true };
        let observer = if own_ranges {
            None
        } else {
            Some(calibrate(ramps, &Options { model, ..options.clone() })?)
        };
        let judge = |trials| judge(&linear, &non_linear, observer.as_ref(), trials, own_ranges);
        let (arbitrary, pulses) = (judge(arbitrary)?, judge(pulses)?);
        Ok(Self { linear, non_linear, observer, arbitrary, pulses })
    }

    /// All methods on other trials, ranges frozen or each trial's own.
    pub(crate) fn judge(&self, trials: &[Trial], own_ranges: bool) -> anyhow::Result<Evaluation> {
        judge(&self.linear, &self.non_linear, self.observer.as_ref(), trials, own_ranges)
    }

    pub(crate) fn serial(&self) -> SerialPipeline<'_> {
        SerialPipeline {
            fits: (self.linear.fits.iter())
                .chain(&self.non_linear.fits)
                .chain(self.observer.iter().flat_map(|observer| &observer.fits))
                .collect(),
            arbitrary: &self.arbitrary,
            pulses: &self.pulses,
        }
    }
}

/// Raw and every method on trials, with ranges frozen or each trial's own.
fn judge(
    linear: &Calibrated,
    non_linear: &Calibrated,
    observer: Option<&Calibrated>,
    trials: &[Trial],
    own_ranges: bool,
) -> anyhow::Result<Evaluation> {
    let (mut line, mut surfaces) = (linear.calibration.clone(), non_linear.calibration.clone());
    if own_ranges && let [trial] = trials {
        line = on_own_ranges(&line, trial)?;
        surfaces = on_own_ranges(&surfaces, trial)?;
    }
    let mut methods = vec![("linear", &line), ("non-linear", &surfaces)];
    methods.extend(observer.map(|observer| ("observer", &observer.calibration)));
    Ok(evaluate(&methods, trials)?)
}
