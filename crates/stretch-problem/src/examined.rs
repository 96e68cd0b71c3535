//! A whole rig or a gauge alone, and everything that comes of asking it.

use std::fmt;

use stretch_data::Trial;
use stretch_gap::{
    Diagnosis, Evidence, GapError, Laboratory, Options, Simulator, diagnose, next_experiment,
};

use crate::{Fix, GaugeSimulator, Implementation, NoFix, RigSimulator};

/// What is diagnosed: a whole rig, or a gauge alone.
#[derive(Debug)]
pub enum Bench {
    /// All stages of the rig.
    Rig(Box<RigSimulator>),
    /// Any stretch sensor beside a reference.
    Gauge(Box<GaugeSimulator>),
}

/// A diagnosis, what it was found from, and what follows from it.
pub struct Examined {
    /// What was found, with the notes of the record around its own.
    pub diagnosis: Diagnosis,
    /// What a report draws.
    pub evidence: Evidence,
    /// The experiment that would tell rivals apart, where it was looked for and there is one.
    pub experiment: Option<Trial>,
    /// What is named, as something to type.
    pub implementations: Vec<Implementation>,
}

impl fmt::Debug for Examined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Examined").field("diagnosis", &self.diagnosis).finish_non_exhaustive()
    }
}

impl From<RigSimulator> for Bench {
    fn from(rig: RigSimulator) -> Self {
        Self::Rig(Box::new(rig))
    }
}

impl From<GaugeSimulator> for Bench {
    fn from(gauge: GaugeSimulator) -> Self {
        Self::Gauge(Box::new(gauge))
    }
}

impl Bench {
    /// The simulator beside its measurements.
    pub fn simulator(&self) -> &dyn Simulator {
        match self {
            Self::Rig(rig) => rig.as_ref(),
            Self::Gauge(gauge) => gauge.as_ref(),
        }
    }

    /// Diagnoses; with `looks_on` also looks for the experiment that would tell rivals apart, where there are any. `progress` and `stop` as
    /// [`diagnose`] takes them.
    ///
    /// # Errors
    /// Those of [`diagnose`] and [`next_experiment`].
    ///
    /// ```
    /// # use stretch_data::{Channel, SessionTrial, Trial};
    /// # use stretch_problem::{Bench, GaugeSetup, GaugeSimulator};
    /// # use stretch_gap::Options;
    /// # use stretch_sim::Catalogue;
    /// # let rod = |t: f64| 40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
    /// # let time_s: Vec<f64> = (0..4000).map(|i| 0.01 * i as f64).collect();
    /// # let noise = |i: usize| 1e-3 * ((i * i * 7919) % 1000) as f64 / 1000.0;
    /// # let channel = |name: &str, values| Channel { name: name.into(), values };
    /// # let length = time_s.iter().map(|t| rod(*t)).collect();
    /// # let signal = time_s.iter().enumerate().map(|(i, t)| 0.02 * rod(t - 0.05) + noise(i)).collect();
    /// # let channels = vec![channel("rod_mm", length), channel("s1", signal)];
    /// # let trials = [SessionTrial::new(Trial { name: "rod.csv".into(), time_s, channels })];
    /// # let catalogue = Catalogue::default();
    /// # let (reference, signal, rig, catalogue) = ("rod_mm", "s1", None, &catalogue);
    /// let gauge = GaugeSimulator::new(&GaugeSetup { trials: &trials, reference, signal, rig, catalogue })?;
    /// let examined = Bench::from(gauge).examine(&Options::default(), false, &|_| (), &|| false)?;
    /// assert_eq!(examined.diagnosis.named, ["channel_skew"]);
    /// assert_eq!(examined.implementations[0].effect.name, "channel_skew");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn examine(
        &self,
        options: &Options,
        looks_on: bool,
        progress: &(dyn Fn(&str) + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Examined, GapError> {
        let how = (options, looks_on);
        let (mut examined, before, after) = match self {
            Self::Gauge(gauge) => {
                (examine(gauge.as_ref(), how, progress, stop)?, gauge.notes(), Vec::new())
            }
            Self::Rig(rig) => {
                (examine(rig.as_ref(), how, progress, stop)?, rig.notes(), rig.rails())
            }
        };
        let notes = &mut examined.diagnosis.notes;
        notes.extend(after);
        notes.splice(0..0, before.iter().cloned());
        let Examined { diagnosis, evidence, .. } = &examined;
        let implementations = match self {
            Self::Rig(rig) => rig.implementations(diagnosis, evidence),
            Self::Gauge(gauge) => gauge.implementations(diagnosis, evidence),
        };
        // A sample time that was diagnosed is one.
        examined.implementations = implementations.unwrap_or_default();
        Ok(examined)
    }

    /// The rig or the gauge with what was found of it.
    ///
    /// # Errors
    /// Why there is no such file.
    pub fn fixed(&self, Examined { diagnosis, evidence, .. }: &Examined) -> Result<Fix, NoFix> {
        match self {
            Self::Rig(rig) => rig.fixed(diagnosis, evidence),
            Self::Gauge(gauge) => gauge.fixed(diagnosis, evidence),
        }
    }
}

/// The diagnosis with its own notes alone, and the experiment.
fn examine<L: Laboratory>(
    simulator: &L,
    (options, looks_on): (&Options, bool),
    progress: &(dyn Fn(&str) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Examined, GapError> {
    let (mut diagnosis, evidence) = diagnose(simulator, options, progress, stop)?;
    let mut proposal = None;
    if diagnosis.ambiguous.len() > 1 && looks_on {
        progress("the next experiment");
        proposal = next_experiment(simulator, &diagnosis, &evidence)?;
    }
    diagnosis.next_experiment = proposal.as_ref().map(|p| p.next.clone());
    let experiment = proposal.map(|p| p.trial);
    Ok(Examined { diagnosis, evidence, experiment, implementations: Vec::new() })
}
