//! Sessions of the rig itself, drawn within its tolerances, in clean noise; and their diagnoses.

use anyhow::Context;
use stretch_data::{Channel, SessionTrial, Trial, TrialEntry};
use stretch_gap::{Diagnosis, Options, diagnose};
use stretch_problem::{RigSession, RigSetup, RigSimulator};
use stretch_sim::{Catalogue, Effect, Key, Rig, RunSettings, Session, TrialPlan};

/// Share of the excitation in the further trial of `paper+`.
const LOW: f64 = 0.7;
/// Number of the further arbitrary trial: the paper has three.
const FURTHER: usize = 4;
/// Column that the further trial tells its excitation in.
const EXCITATION: &str = "excitation_share";

/// Which trials were done and what was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Protocol {
    /// The paper's seventeen trials, every channel.
    Paper,
    /// The same without the pressure.
    WithoutPressure,
    /// The paper's and one more to fit, at [`LOW`] of the excitation, every channel.
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

/// What is simulated: a seed of parameters, protocol and noise, and at most one effect.
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

    /// The session as it would be recorded.
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
                // What was before it leaves the same traces in it at either excitation: the muscle sees none.
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

    /// The diagnosis against the nominal rig.
    pub(crate) fn diagnosed(
        &self,
        protocol: Protocol,
        options: Options,
    ) -> anyhow::Result<Diagnosis> {
        let catalogue = Catalogue::default();
        let session = RigSession::new(&self.recorded(protocol)?)?;
        let setup = RigSetup { session, rig: Rig::default(), catalogue: &catalogue };
        // One thread each: the answers are the same, and sessions are shared out.
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
