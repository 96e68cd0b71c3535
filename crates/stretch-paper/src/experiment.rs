//! Simulate, calibrate, apply, judge.

use serde::Serialize;
use stretch_calibrate::{
    Calibrated, Evaluation, Memory, ModelKind, Options, calibrate, evaluate, on_own_ranges,
};
use stretch_data::{Trial, TrialKind};
use stretch_sim::{Rig, RunSettings, Session, TrialPlan};

use crate::{FrequencyPoint, GapPoint, PaperError, frequency_response, pulse_gaps};

/// Both calibrations, fitted and applied one way.
#[derive(Debug, Clone)]
pub struct Pipeline {
    /// The linear calibration.
    pub linear: Calibrated,
    /// Two poly13 surfaces.
    pub non_linear: Calibrated,
    /// A model that remembers, fitted to the same ramps; ours alone.
    pub observer: Option<Calibrated>,
    /// Raw, linear, non-linear and the observer on arbitrary actuation.
    pub arbitrary: Evaluation,
    /// Raw, linear, non-linear and the observer on pulses.
    pub pulses: Evaluation,
}

/// The paper's experiment on a simulated rig.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Seed of commands and noise.
    pub seed: u64,
    /// Central differences, strain rate at calibration and voltage rate at use,
    /// each trial normalised by its own range, no dead band.
    pub published: Pipeline,
    /// Live rates at calibration and use, ranges frozen, dead band.
    pub ours: Pipeline,
    /// Error against the gap between two pulses.
    pub gaps: Vec<GapPoint>,
    /// What the sensor makes of sines.
    pub frequency: Vec<FrequencyPoint>,
}

/// The serialisable part of an [`Experiment`].
#[derive(Debug, Serialize)]
pub(crate) struct Serial<'a> {
    seed: u64,
    published: SerialPipeline<'a>,
    ours: SerialPipeline<'a>,
    gaps: &'a [GapPoint],
    frequency: &'a [FrequencyPoint],
}

#[derive(Debug, Serialize)]
struct SerialPipeline<'a> {
    fits: Vec<&'a stretch_calibrate::FitReport>,
    arbitrary: &'a Evaluation,
    pulses: &'a Evaluation,
}

impl Experiment {
    /// Runs it all: twelve ramps to fit, an arbitrary and a pulse trial to judge.
    ///
    /// # Errors
    /// [`PaperError`] for a rig that cannot be simulated or calibrated.
    pub fn run(rig: &Rig, seed: u64) -> Result<Self, PaperError> {
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
    pub fn to_serialise(&self) -> impl Serialize + '_ {
        Serial {
            seed: self.seed,
            published: self.published.serial(),
            ours: self.ours.serial(),
            gaps: &self.gaps,
            frequency: &self.frequency,
        }
    }
}

impl Pipeline {
    fn run(
        options: &Options,
        ramps: &[Trial],
        arbitrary: &[Trial],
        pulses: &[Trial],
        own_ranges: bool,
    ) -> Result<Self, PaperError> {
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
    pub(crate) fn judge(
        &self,
        trials: &[Trial],
        own_ranges: bool,
    ) -> Result<Evaluation, PaperError> {
        judge(&self.linear, &self.non_linear, self.observer.as_ref(), trials, own_ranges)
    }

    fn serial(&self) -> SerialPipeline<'_> {
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
) -> Result<Evaluation, PaperError> {
    let (mut line, mut surfaces) = (linear.calibration.clone(), non_linear.calibration.clone());
    if own_ranges && let [trial] = trials {
        line = on_own_ranges(&line, trial)?;
        surfaces = on_own_ranges(&surfaces, trial)?;
    }
    let mut methods = vec![("linear", &line), ("non-linear", &surfaces)];
    methods.extend(observer.map(|observer| ("observer", &observer.calibration)));
    Ok(evaluate(&methods, trials)?)
}
