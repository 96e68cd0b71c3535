//! The rig with what a diagnosis found of it.

use stretch_data::Remarks;
use stretch_gap::{Diagnosis, Evidence};
use stretch_sim::{Effect, Grid, GridError, Rig, Surroundings};

use super::{RigSimulator, nominal::Knob};
use crate::{
    fix::{Chosen, Fix, NoFix, with_line},
    implement::{Implementation, implementations},
};

impl RigSimulator {
    /// What a diagnosis of this rig names, as something to type: with its numbers, in the rig as it was re-tuned.
    ///
    /// # Errors
    /// None for a rig that was diagnosed: its sample time is positive.
    pub fn implementations(
        &self,
        diagnosis: &Diagnosis,
        evidence: &Evidence,
    ) -> Result<Vec<Implementation>, GridError> {
        let grid = Grid::samples(self.about.dt_s)?;
        let mut params = self.base;
        let model = evidence.candidates.first().unwrap_or(&evidence.best);
        for (knob, value) in self.knobs.iter().zip(&model.parameters) {
            if let Knob::Rig(key) = *knob {
                params[key] = *value;
            }
        }
        let around = Surroundings::of_rig(&params, &grid);
        let place = (self.about.record().sensor.unwrap_or(0), 1.0);
        Ok(implementations(diagnosis, evidence, &self.rows, &around, |effect, values| {
            with_line(self, place, &self.rows, model, (effect, values))
        }))
    }

    /// A rig file with what a diagnosis of this rig found: see [`Fix`]. Held against the same record it says `no_gap`.
    ///
    /// What belongs to the record and not to the rig (the pressure at a trial's start, the timing of commands) stays out. A hum's
    /// amplitude and phase, which no diagnosis answers, are those that the fit trials show on the session's clock.
    ///
    /// # Errors
    /// [`NoFix`] where the diagnosis names nothing to fix, or a rig that no file may hold.
    pub fn fixed(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Result<Fix, NoFix> {
        let chosen = Chosen::of(diagnosis, evidence)?;
        let mut remarks = Remarks { head: chosen.head(), ..Remarks::default() };
        let mut rig =
            Rig { params: self.base, tolerances: self.tolerances, effects: self.effects.clone() };
        let tuned = self.knobs.iter().zip(&chosen.model.parameters).enumerate();
        for (index, (knob, value)) in tuned {
            let Knob::Rig(key) = *knob else { continue };
            let info = key.info();
            let old = rig.tolerances[key as usize];
            rig.tolerances[key as usize] = chosen.tolerance(index, *value, old);
            let told = chosen.told(index, info.unit, (self.base[key], *value));
            remarks.parameters.insert((info.stage.name().into(), info.name.into()), told);
            rig.params[key] = *value;
        }
        for effect in self.effects.iter() {
            let own = vec!["It was in the rig file already.".to_owned()];
            remarks.effects.insert(effect.name().into(), own);
        }
        // A fit in equal ratios may end a rounding beyond its range.
        let within = |effect: &Effect, values: &mut [f64]| {
            for (p, x) in effect.parameters.iter().zip(values) {
                *x = x.clamp(*p.allowed().start(), *p.allowed().end());
            }
        };
        let stage = self.about.record().sensor.unwrap_or(0);
        for (effect, values) in chosen.effects(&self.rows, within) {
            let values = with_line(self, (stage, 1.0), &self.rows, chosen.model, (effect, values));
            chosen.tell(effect, &mut remarks);
            rig.effects.push(effect, &values)?;
        }
        let file = rig.to_file(None);
        // Whatever could not be read again is refused here.
        Rig::from_file(&file)?;
        Ok(Fix { file, remarks })
    }
}
