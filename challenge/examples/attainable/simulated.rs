//! Simulated sessions of the built-in rig, drawn within its tolerances, with white noise; and their
//! diagnoses.

use anyhow::Context;
use stretch_data::{Channel, SessionTrial, Trial, TrialEntry};
use stretch_gap::{Diagnosis, Options, diagnose};
use stretch_problem::{RigSession, RigSetup, RigSimulator};
use stretch_sim::{Catalogue, Effect, Key, Rig, RunSettings, Session, TrialPlan};

/// Excitation in the additional trial of `paper+`, as a share of the usual one.
const LOW: f64 = 0.7;
/// Number of the additional arbitrary trial; the paper has three.
const FURTHER: usize = 4;
/// Column of the excitation in the additional trial.
const EXCITATION: &str = "excitation_share";

/// The trials of a session, and the recorded channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Protocol {
    /// The seventeen trials of the paper, with all channels.
    Paper,
    /// The same trials without the pressure.
    WithoutPressure,
    /// The trials of the paper and one more for fitting, at [`LOW`] of the excitation, with all
    /// channels.
    Plus,
}

impl Protocol {
    pub(crate) const ALL: [Self; 3] = [Self::Paper, Self::WithoutPressure, Self::Plus];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::WithoutPressure => "paper, no pressure",
            Self::Plus => "paper+",
        }
    }
}

/// The simulated system: a seed of parameters, protocol and noise, and at most one effect.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) seed: u64,
    pub(crate) effect: Option<(&'static Effect, Vec<f64>)>,
}

impl Source {
    fn rig(&self) -> anyhow::Result<Rig> {
        let mut rig = Rig::default().draw(self.seed).context("no rig could be drawn")?;
        if let Some((effect, values)) = &self.effect {
            rig.effects.push(effect, values)?;
        }
        Ok(rig)
    }

    /// Simulates the recorded session.
    pub(crate) fn recorded(&self, protocol: Protocol) -> anyhow::Result<Vec<SessionTrial>> {
        let rig = self.rig()?;
        let settings = RunSettings { seed: self.seed, ..RunSettings::default() };
        let mut plans = TrialPlan::paper(self.seed);
        let mut trials = run(&rig, &settings, &plans)?;
        match protocol {
            Protocol::Paper => {}
            Protocol::WithoutPressure => {
                let without = |t: &mut Trial| t.channels.retain(|c| c.name != "pressure_kpa");
                trials.iter_mut().for_each(|t| without(&mut t.trial));
            }
            Protocol::Plus => {
                // The previous trials run at the low excitation here, too. Their after-effects are the same, because the muscle does not depend on the excitation.
                let mut low = rig.clone();
                low.params[Key::VExc] *= LOW;
                plans.push(TrialPlan::arbitrary(FURTHER, self.seed));
                let more =
                    run(&low, &settings, &plans)?.pop().context("a session without trials")?;
                trials.push(at_low_excitation(more));
            }
        }
        Ok(trials)
    }

    /// Diagnoses the session with the nominal rig as simulator.
    pub(crate) fn diagnosed(
        &self,
        protocol: Protocol,
        options: Options,
    ) -> anyhow::Result<Diagnosis> {
        let catalogue = Catalogue::default();
        let session = RigSession::new(&self.recorded(protocol)?)?;
        let setup = RigSetup { session, rig: Rig::default(), catalogue: &catalogue };
        // Each diagnosis uses one thread, because sessions run in parallel. The answers do not depend on it.
        let options = Options { threads: 1, ..options };
        Ok(diagnose(&RigSimulator::new(setup)?, &options, &|_| (), &|| false)?.0)
    }
}

fn run(
    rig: &Rig,
    settings: &RunSettings,
    plans: &[TrialPlan],
) -> anyhow::Result<Vec<SessionTrial>> {
    let mut session = Session::new(rig, settings)?;
    let trial = |plan: &TrialPlan| -> anyhow::Result<SessionTrial> {
        let (entry, trial) = session.run(plan)?;
        let TrialEntry { kind, start_s, split, .. } = entry;
        Ok(SessionTrial { kind, start_s, split, ..SessionTrial::new(trial) })
    };
    plans.iter().map(trial).collect()
}

fn at_low_excitation(mut low: SessionTrial) -> SessionTrial {
    let values = vec![LOW; low.trial.len()];
    low.trial.channels.push(Channel { name: EXCITATION.into(), values });
    low
}
