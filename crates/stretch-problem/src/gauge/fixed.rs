//! Results of a diagnosis of a gauge alone: notes, the next experiment, code for effects, and the
//! fixed file.

use stretch_data::Remarks;
use stretch_gap::{Diagnosis, Evidence, GapError, Proposal, next_experiment};
use stretch_sim::{Gauge, GaugeRig, Grid};

use super::{GAIN, GaugeSimulator, OFFSET};
use crate::{
    fix::{Chosen, Fix, Fixed, NoFix, names, with_line},
    implement::{Implementation, implementations},
    problem::Diagnosable,
};

/// Table of the file that holds offset and gain.
const TABLE: &str = "sensing";

impl Diagnosable for GaugeSimulator {
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn next(
        &self,
        diagnosis: &Diagnosis,
        evidence: &Evidence,
    ) -> Result<Option<Proposal>, GapError> {
        next_experiment(self, diagnosis, evidence)
    }

    /// Code for the effects that a diagnosis of this gauge names, with the fitted numbers, in units
    /// of e.
    fn implementations(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Vec<Implementation> {
        // The sample time is valid, because a diagnosis ran with it.
        let Ok(grid) = Grid::samples(self.session.dt_s) else { return Vec::new() };
        let model = evidence.candidates.first().unwrap_or(&evidence.best);
        let around = Gauge::surroundings(&self.nominal.spec, &grid);
        let place = (0, model.parameters[GAIN]);
        let answer = (diagnosis, evidence);
        implementations(answer, &self.about.effects, &self.rows, &around, |effect, values| {
            with_line(self, place, &self.rows, model, (effect, values))
        })
    }

    /// A gauge file (`kind = "gauge"`) with the findings of a diagnosis of this gauge: see [`Fix`].
    /// The file omits the initial hysteresis state, because it belongs to the recording.
    ///
    /// # Errors
    /// [`NoFix`] if the diagnosis names nothing to fix, or if a file cannot hold the fixed gauge.
    fn fixed(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Result<Fix, NoFix> {
        let chosen = Chosen::of(diagnosis, evidence)?;
        let mut remarks = Remarks { head: chosen.head(), ..Remarks::default() };
        let old = &self.nominal;
        let mut rig = GaugeRig { spec: self.nominal(chosen.model), ..old.clone() };
        rig.offset = chosen.tolerance(OFFSET, rig.spec.offset, old.offset);
        rig.gain = chosen.tolerance(GAIN, rig.spec.gain, old.gain);
        for (index, name, values) in [
            (OFFSET, "offset", (self.nominal.spec.offset, rig.spec.offset)),
            (GAIN, "gain", (self.nominal.spec.gain, rig.spec.gain)),
        ] {
            let remark = chosen.remark(index, &self.about.parameters[index].unit, values);
            remarks.parameters.insert((TABLE.into(), name.into()), remark);
        }
        for effect in self.nominal.effects.iter() {
            let own = vec!["This effect was in the rig file already.".to_owned()];
            remarks.effects.insert(effect.name().into(), own);
        }
        let gain = rig.spec.gain;
        for (index, values) in chosen.effects(&self.about.effects) {
            let effect = self.rows[index];
            let found = (effect, values.to_vec());
            let values = with_line(self, (0, gain), &self.rows, chosen.model, found);
            chosen.describe(effect.into(), &mut remarks);
            rig.effects.push(effect, &values)?;
        }
        let file = rig.to_file();
        GaugeRig::from_file(&file)?;
        Ok(Fix { effects: names(&file), file: Fixed::Rig(file), remarks })
    }
}
