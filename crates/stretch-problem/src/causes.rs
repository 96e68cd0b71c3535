//! From a diagnosis to what a calibration can use of it.

use stretch_calibrate::{Cause, Options};
use stretch_data::{SessionTrial, Trial};
use stretch_effects::{Effect as Known, EffectParameter, Need, gauge_effect};
use stretch_gap::{Candidate, Diagnosis, Options as Diagnosing, VerdictKind, diagnose};
use stretch_sim::{Catalogue, Gauge};

use crate::{GaugeSetup, GaugeSimulator};

/// What a calibration builds on: effects of the gauge, and what there is to say of how they were found.
#[derive(Debug, Clone, Default)]
pub struct Causes {
    /// The effects.
    pub found: Vec<Cause>,
    /// Sentences.
    pub notes: Vec<String>,
}

impl Causes {
    /// Of trials, diagnosed as a gauge alone; none where they cannot be, which is said.
    ///
    /// `progress` and `stop` as [`diagnose`] takes them.
    pub fn of(
        trials: &[Trial],
        options: &Options,
        progress: &(dyn Fn(&str) + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Self {
        let session: Vec<SessionTrial> = trials.iter().cloned().map(SessionTrial::new).collect();
        let catalogue = Catalogue::default();
        let gauge = GaugeSimulator::new(&GaugeSetup {
            trials: &session,
            reference: &options.reference,
            signal: &options.signal,
            rig: None,
            catalogue: &catalogue,
        });
        let done = gauge.map_err(|error| error.to_string()).and_then(|gauge| {
            let done = diagnose(&gauge, &Diagnosing::default(), progress, stop);
            done.map(|(diagnosis, _)| diagnosis).map_err(|error| error.to_string())
        });
        match done {
            Ok(diagnosis) => {
                let notes = vec![format!("the gauge alone: {}", diagnosis.sentence)];
                Self { found: causes(&diagnosis), notes }
            }
            Err(error) => {
                let notes = vec![format!("the trials could not be diagnosed: {error}")];
                Self { found: Vec::new(), notes }
            }
        }
    }

    /// Without those that need a pressure, where some trial has none; which is said.
    pub fn felt(mut self, trials: &[Trial], options: &Options) -> Self {
        let has_pressure = trials.iter().all(|t| t.channel(&options.pressure).is_some());
        let needs = |cause: &Cause| {
            let effect = gauge_effect(&cause.effect);
            !has_pressure && effect.is_some_and(|e| e.needs == Some(Need::Pressure))
        };
        let left_out: Vec<Cause> = self.found.extract_if(.., |cause| needs(cause)).collect();
        self.notes.extend(left_out.iter().map(|cause| {
            let (effect, column) = (&cause.effect, &options.pressure);
            format!("{effect} needs the pressure, and no {column} was recorded: it is left out")
        }));
        self
    }
}

/// The effects of the gauge and its reference in the best set of a diagnosis, with their values in shares of the reference's range:
/// those of the whole rig divided by its strokes, those of a gauge alone as they are. Empty where the simulator
/// is not short of any, and where the record is wrong.
///
/// A set that the verdict does not name is among them: whether it is of use a calibration finds out on trials left out.
pub fn causes(diagnosis: &Diagnosis) -> Vec<Cause> {
    use VerdictKind::{Effect, Partial, Unknown};
    let first: Option<&Candidate> = diagnosis.candidates.first();
    let Some(first) = first.filter(|_| matches!(diagnosis.verdict, Effect | Partial | Unknown))
    else {
        return Vec::new();
    };
    let is_alone = diagnosis.location.stages.len() == 1;
    let cause = |effect: &'static Known| {
        // A voltage's own zero is not told: where the rails lie a fit finds.
        let is_level = |p: &EffectParameter| p.unit == "V" && p.off().is_some_and(|off| off != 0.0);
        let value = |p: &EffectParameter| {
            let mut own = first.parameters.iter().filter(|own| own.effect == effect.name);
            let found = own.find(|own| own.name == p.name).filter(|_| is_alone || !is_level(p))?;
            Some((p.name.to_string(), found.value * if is_alone { 1.0 } else { Gauge::unit(p) }))
        };
        let values = effect.parameters.iter().filter_map(value).collect();
        Cause { effect: effect.name.to_owned(), values }
    };
    first.effects.iter().filter_map(|name| gauge_effect(name)).map(cause).collect()
}
