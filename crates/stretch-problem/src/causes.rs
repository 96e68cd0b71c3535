//! The effects of a diagnosis that a calibration can use.

use stretch_calibrate::{Cause, Options, PRESSURE};
use stretch_data::{SessionTrial, Trial};
use stretch_effects::{Effect as Known, EffectParameter, Need, gauge_effect};
use stretch_gap::{Candidate, Diagnosis, Options as Diagnosing, VerdictKind, diagnose};
use stretch_sim::{Catalogue, Gauge};

use crate::{GaugeSetup, GaugeSimulator, in_words};

/// Effects of the gauge that a diagnosis found and a calibration corrects, with notes on the diagnosis.
#[derive(Debug, Clone, Default)]
pub struct Causes {
    /// The effects of the gauge.
    pub found: Vec<Cause>,
    /// Notes, in sentences.
    pub notes: Vec<String>,
}

impl Causes {
    /// Diagnoses trials of a gauge alone (a stretch sensor and its reference, without the rig) and returns the effects
    /// of the gauge. If the trials cannot be diagnosed, the result has no effects but a note that says why.
    ///
    /// `progress` and `stop` are those of [`diagnose`].
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
                let notes = vec![format!("the gauge alone: {}", in_words(&diagnosis).sentence)];
                Self { found: causes(&diagnosis), notes }
            }
            Err(error) => {
                let notes = vec![format!("the trials could not be diagnosed: {error}")];
                Self { found: Vec::new(), notes }
            }
        }
    }

    /// Leaves out effects that need a pressure, with a note for each, if some trial has no
    /// pressure.
    pub fn without_missing_pressure(mut self, trials: &[Trial]) -> Self {
        let has_pressure = trials.iter().all(|t| t.channel(PRESSURE).is_some());
        let needs = |cause: &Cause| {
            let effect = gauge_effect(&cause.effect);
            !has_pressure && effect.is_some_and(|e| e.needs == Some(Need::Pressure))
        };
        let left_out: Vec<Cause> = self.found.extract_if(.., |cause| needs(cause)).collect();
        self.notes.extend(left_out.iter().map(|cause| {
            let effect = &cause.effect;
            format!("{effect} is left out, because it needs the pressure and some trial has no column {PRESSURE}")
        }));
        self
    }
}

/// The effects of the gauge and its reference in the first candidate of a diagnosis. Values are in shares of the
/// reference's range. Values of a whole rig are divided by the strokes of the rig for this; values of a gauge alone
/// already are in these units. The list is empty if no effect is missing, or if the recording is wrong.
///
/// The first candidate is used even if the verdict does not name it, because a calibration tests on
/// held-out trials whether its effects help.
pub fn causes(diagnosis: &Diagnosis) -> Vec<Cause> {
    let first: Option<&Candidate> = diagnosis.candidates.first();
    let is_gap = !diagnosis.answer.agrees() && diagnosis.verdict() != VerdictKind::Record;
    let Some(first) = first.filter(|_| is_gap) else {
        return Vec::new();
    };
    let is_alone = diagnosis.location.stages.len() == 1;
    let cause = |effect: &'static Known| {
        // Voltage limits of the amplifier in a whole rig are left out, because the calibration's fit finds these limits
        // itself.
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
