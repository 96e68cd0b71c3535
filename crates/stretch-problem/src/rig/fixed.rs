//! Results of a diagnosis of the rig: notes, the next experiment, code for effects, and the fixed
//! rig file.

use stretch_data::Remarks;
use stretch_gap::{Diagnosis, Evidence, GapError, Proposal, next_experiment};
use stretch_sim::{EffectParameter, Grid, Rig};

use super::{
    RigSimulator,
    nominal::{TunedParameter, TunedRig},
    rails::rails,
};
use crate::{
    fix::{Chosen, Fix, Fixed, NoFix, names, with_line},
    implement::{Implementation, implementations},
    problem::Diagnosable,
};

impl Diagnosable for RigSimulator {
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn afterwards(&self) -> Vec<String> {
        rails(&self.base, &self.session)
    }

    fn next(
        &self,
        diagnosis: &Diagnosis,
        evidence: &Evidence,
    ) -> Result<Option<Proposal>, GapError> {
        next_experiment(self, diagnosis, evidence)
    }

    /// Code for the effects that a diagnosis of this rig names, with the fitted numbers, in the
    /// re-tuned rig.
    fn implementations(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Vec<Implementation> {
        // The sample time is valid, because a diagnosis ran with it.
        let Ok(grid) = Grid::samples(self.about.dt_s) else { return Vec::new() };
        let model = evidence.candidates.first().unwrap_or(&evidence.best);
        let around = TunedRig::of(&self.base, &self.tuned, model).params.surroundings(&grid);
        let place = (self.about.record().sensor.unwrap_or(0), 1.0);
        let answer = (diagnosis, evidence);
        implementations(answer, &self.about.effects, &self.rows, &around, |effect, values| {
            with_line(self, place, &self.rows, model, (effect, values))
        })
    }

    /// A rig file with the findings of a diagnosis of this rig: see [`Fix`]. A diagnosis of the
    /// same recording with this file gives `no_gap`.
    ///
    /// The file omits parameters of the recording (the pressure at a trial's start, the timing of
    /// commands, the initial hysteresis states). A diagnosis does not fit a hum's amplitude and
    /// phase, so the file has values that are estimated from the fit trials, on the session's
    /// clock.
    ///
    /// # Errors
    /// [`NoFix`] if the diagnosis names nothing to fix, or if a file cannot hold the fixed rig.
    fn fixed(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Result<Fix, NoFix> {
        let chosen = Chosen::of(diagnosis, evidence)?;
        let mut remarks = Remarks { head: chosen.head(), ..Remarks::default() };
        let mut rig =
            Rig { params: self.base, tolerances: self.tolerances, effects: self.effects.clone() };
        let tuned = self.tuned.iter().zip(&chosen.model.parameters).enumerate();
        for (index, (parameter, value)) in tuned {
            let TunedParameter::Rig(key) = *parameter else { continue };
            let info = key.info();
            let old = rig.tolerances[key as usize];
            rig.tolerances[key as usize] = chosen.tolerance(index, *value, old);
            let remark = chosen.remark(index, info.unit, (self.base[key], *value));
            remarks.parameters.insert((info.stage.name().into(), info.name.into()), remark);
            rig.params[key] = *value;
        }
        for effect in self.effects.iter() {
            let own = vec!["This effect was in the rig file already.".to_owned()];
            remarks.effects.insert(effect.name().into(), own);
        }
        let stage = self.about.record().sensor.unwrap_or(0);
        for (index, values) in chosen.effects(&self.about.effects) {
            let effect = self.rows[index];
            // Rounding may put a value at the end of a logarithmic range outside of that range.
            let allowed = effect.parameters.iter().map(EffectParameter::allowed);
            let within = allowed.zip(values).map(|(ends, x)| x.clamp(*ends.start(), *ends.end()));
            let found = (effect, within.collect());
            let values = with_line(self, (stage, 1.0), &self.rows, chosen.model, found);
            chosen.describe(effect.into(), &mut remarks);
            rig.effects.push(effect, &values)?;
        }
        let file = rig.to_file(None);
        // A file that could not be read again is refused here.
        Rig::from_file(&file)?;
        Ok(Fix { effects: names(&file), file: Fixed::Rig(file), remarks })
    }
}
