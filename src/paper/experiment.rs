//! Simulates the experiment of the published method ("the paper"): calibration, application and
//! evaluation with the published method and with ours.

use serde_json::{Value, json};
use stretch_calibrate::{
    Calibrated, Evaluation, FitReport, Memory, ModelKind, Options, calibrate, evaluate,
    on_own_ranges,
};
use stretch_data::{Trial, TrialKind};
use stretch_sim::{Rig, RunSettings, Session, TrialPlan};

/// The paper's experiment on a simulated rig.
#[derive(Debug, Clone)]
pub(crate) struct Experiment {
    /// Seed of commands and noise.
    pub(crate) seed: u64,
    /// Published method: central differences, strain rate for calibration and voltage rate for use,
    /// each trial normalised by its own range, no dead band.
    pub(crate) published: Pipeline,
    /// Our method: the rate is from the same causal estimator in calibration and in use, every
    /// trial is normalised by the ranges of the calibration, and there is a dead band.
    pub(crate) ours: Pipeline,
}

impl Experiment {
    /// Runs the experiment: twelve ramps for fitting, an arbitrary and a pulse trial for testing.
    pub(crate) fn run(rig: &Rig, seed: u64) -> anyhow::Result<Self> {
        let settings = RunSettings { seed, ..RunSettings::default() };
        let mut session = Session::new(rig, &settings)?;
        let (mut ramps, mut arbitrary, mut pulses) = (Vec::new(), Vec::new(), Vec::new());
        for plan in TrialPlan::paper(seed).into_iter().take(14) {
            let (entry, trial) = session.run(&plan)?;
            match entry.kind {
                TrialKind::Arbitrary => arbitrary.push(trial),
                TrialKind::Pulses => pulses.push(trial),
                _ => ramps.push(trial),
            }
        }
        let published = Pipeline::run(&Options::paper(), &ramps, &arbitrary, &pulses, true)?;
        let ours = Pipeline::run(&Options::default(), &ramps, &arbitrary, &pulses, false)?;
        Ok(Self { seed, published, ours })
    }

    /// Returns all results as JSON.
    pub(super) fn to_json(&self) -> Value {
        json!({
            "seed": self.seed,
            "published": self.published.to_json(),
            "ours": self.ours.to_json(),
        })
    }
}

/// Calibrations fitted and applied with one method.
#[derive(Debug, Clone)]
pub(crate) struct Pipeline {
    /// The linear calibration.
    pub(crate) linear: Calibrated,
    /// Two poly13 surfaces.
    pub(crate) non_linear: Calibrated,
    /// A model with memory, fitted to the same ramps; only for our method.
    pub(crate) observer: Option<Calibrated>,
    /// Errors of raw signal, linear, non-linear and observer on arbitrary actuation.
    pub(crate) arbitrary: Evaluation,
    /// Errors of raw signal, linear, non-linear and observer on pulses.
    pub(crate) pulses: Evaluation,
}

impl Pipeline {
    fn run(
        options: &Options,
        ramps: &[Trial],
        arbitrary: &[Trial],
        pulses: &[Trial],
        own_ranges: bool,
    ) -> anyhow::Result<Self> {
        let linear = calibrate(ramps, &Options { model: ModelKind::Linear, ..options.clone() })?;
        let non_linear = calibrate(ramps, options)?;
        // The published method has no model with memory.
        let model = ModelKind::Remembering { kind: Memory::Observer, rest: true };
        let observer = if own_ranges {
            None
        } else {
            Some(calibrate(ramps, &Options { model, ..options.clone() })?)
        };
        let judge = |trials: &[Trial]| -> anyhow::Result<Evaluation> {
            let (mut line, mut surfaces) =
                (linear.calibration.clone(), non_linear.calibration.clone());
            if own_ranges && let [trial] = trials {
                line = on_own_ranges(&line, trial)?;
                surfaces = on_own_ranges(&surfaces, trial)?;
            }
            let mut methods = vec![("linear", &line), ("non-linear", &surfaces)];
            methods.extend(observer.as_ref().map(|observer| ("observer", &observer.calibration)));
            Ok(evaluate(&methods, trials)?)
        };
        let (arbitrary, pulses) = (judge(arbitrary)?, judge(pulses)?);
        Ok(Self { linear, non_linear, observer, arbitrary, pulses })
    }

    fn to_json(&self) -> Value {
        let calibrated = [&self.linear, &self.non_linear].into_iter().chain(&self.observer);
        let fits: Vec<&FitReport> = calibrated.flat_map(|calibrated| &calibrated.fits).collect();
        json!({ "fits": fits, "arbitrary": self.arbitrary, "pulses": self.pulses })
    }
}
