//! The paper's experiment: simulate, then calibrate, apply and judge the paper's way and ours.

use serde_json::{Value, json};
use stretch_calibrate::{
    Calibrated, Evaluation, FitReport, Memory, ModelKind, Options, calibrate, evaluate,
    on_own_ranges,
};
use stretch_data::{Trial, TrialKind};
use stretch_sim::{Rig, RunSettings, Session, TrialPlan};

use super::responses::{FrequencyPoint, GapPoint, frequency_response, pulse_gaps};

/// The paper's experiment on a simulated rig.
#[derive(Debug, Clone)]
pub(crate) struct Experiment {
    /// Seed of commands and noise.
    pub(crate) seed: u64,
    /// Central differences, strain rate at calibration and voltage rate at use,
    /// each trial normalised by its own range, no dead band.
    pub(crate) published: Pipeline,
    /// Live rates at calibration and use, ranges frozen, dead band.
    pub(crate) ours: Pipeline,
    /// Error against the gap between two pulses.
    pub(crate) gaps: Vec<GapPoint>,
    /// What the sensor makes of sines.
    pub(crate) frequency: Vec<FrequencyPoint>,
}

impl Experiment {
    /// Runs it all: twelve ramps to fit, an arbitrary and a pulse trial to judge.
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
        let gaps = pulse_gaps(&mut session, &published, &ours)?;
        let frequency = frequency_response(rig)?;
        Ok(Self { seed, published, ours, gaps, frequency })
    }

    /// All tables, for a file.
    pub(super) fn to_json(&self) -> Value {
        json!({
            "seed": self.seed,
            "published": self.published.to_json(),
            "ours": self.ours.to_json(),
            "gaps": self.gaps,
            "frequency": self.frequency,
        })
    }
}

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
    pub(super) fn judge(&self, trials: &[Trial], own_ranges: bool) -> anyhow::Result<Evaluation> {
        judge(&self.linear, &self.non_linear, self.observer.as_ref(), trials, own_ranges)
    }

    fn to_json(&self) -> Value {
        let calibrated = [&self.linear, &self.non_linear].into_iter().chain(&self.observer);
        let fits: Vec<&FitReport> = calibrated.flat_map(|calibrated| &calibrated.fits).collect();
        json!({ "fits": fits, "arbitrary": self.arbitrary, "pulses": self.pulses })
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
