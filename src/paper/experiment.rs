//! The paper's experiment: simulate, then run both pipelines.

use serde::Serialize;
use stretch_calibrate::Options;
use stretch_data::TrialKind;
use stretch_sim::{Rig, RunSettings, Session, TrialPlan};

use super::{
    frequency::{FrequencyPoint, frequency_response},
    gaps::{GapPoint, pulse_gaps},
    pipeline::{Pipeline, SerialPipeline},
};

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

/// The serialisable part of an [`Experiment`].
#[derive(Debug, Serialize)]
pub(crate) struct Serial<'a> {
    seed: u64,
    published: SerialPipeline<'a>,
    ours: SerialPipeline<'a>,
    gaps: &'a [GapPoint],
    frequency: &'a [FrequencyPoint],
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
    pub(crate) fn to_serialise(&self) -> impl Serialize + '_ {
        Serial {
            seed: self.seed,
            published: self.published.serial(),
            ours: self.ours.serial(),
            gaps: &self.gaps,
            frequency: &self.frequency,
        }
    }
}
