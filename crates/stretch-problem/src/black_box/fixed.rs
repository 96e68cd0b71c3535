//! Results of a diagnosis of a user's own problem: notes, the next experiment, code for effects,
//! and the fixed problem file.

use std::num::NonZeroUsize;

use stretch_data::{EffectEntry, Remarks, significant};
use stretch_effects::Sketch;
use stretch_gap::{Diagnosis, Evidence, Model, Simulator};

use super::{BlackBox, catalogue::Acting, spec::ProblemSpec};
use crate::{
    card::Card,
    fix::{Chosen, Fix, Fixed, NoFix},
    problem::Diagnosable,
};

/// Words and equation of an effect that the simulator has itself.
const OWN: [&str; 2] = ["an effect that the simulator has itself", "arguments of the simulator"];

impl BlackBox {
    /// Writes the values of an effect that was found into the file, so that the effect acts in every run.
    fn add(&self, file: &mut ProblemSpec, effect: usize, values: &[f64]) {
        let spec = &self.description().spec().effects[effect];
        let named =
            || spec.parameters.iter().map(|p| p.name.to_string()).zip(values.iter().copied());
        match self.problem.acting[effect] {
            Acting::Own(_) => {
                let own = file.effects.iter_mut().find(|own| own.name == spec.name);
                let arguments = own.into_iter().flat_map(|own| &mut own.arguments);
                arguments.zip(values).for_each(|(a, value)| a.value = Some(*value));
            }
            Acting::Wrapper(_) | Acting::Recorder(_) => {
                let (name, parameters) = (spec.name.clone(), named().collect());
                file.wrapped.push(EffectEntry { name, parameters });
            }
        }
    }
}

impl Diagnosable for BlackBox {
    fn notes(&self) -> Vec<String> {
        self.problem.notes().to_vec()
    }

    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let apart = self.problem.by.as_ref().filter(|(by, _)| by == name).map(|(_, v)| v.clone());
        apart.or_else(|| self.problem.columns.of(name).map(<[f64]>::to_vec))
    }

    /// Returns the notes of the source on its runs, and notes on coupled stages and on undeclared
    /// parameters.
    fn afterwards(&self) -> Vec<String> {
        let mut notes = self.runs.notes();
        notes.extend(self.coupled.get().and_then(|coupled| coupled.note.clone()));
        notes.extend(self.undeclared.notes(&self.problem));
        notes
    }

    fn in_words(&self, effect: usize) -> [&str; 2] {
        self.problem.wrapper(effect).map_or(OWN, |kind| [kind.words, kind.equation])
    }

    fn sketch(&self, effect: usize, values: &[f64], _: &Model) -> Option<Sketch> {
        self.problem.sketch(effect, values)
    }

    fn fixed(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Result<Fix, NoFix> {
        let chosen = Chosen::of(diagnosis, evidence)?;
        let mut remarks = Remarks { head: chosen.head(), ..Remarks::default() };
        let mut file = self.problem.spec.clone();
        file.budget = file.budget.or(self.runs.budget().and_then(NonZeroUsize::new));
        // a prediction and the next diagnosis use the noise of this diagnosis
        for (stage, found) in file.stages.iter_mut().zip(&evidence.stages) {
            stage.noise.get_or_insert(significant(found.noise, 4));
        }
        let is_bare = chosen.effects(&self.description().spec().effects).next().is_none();
        let tuned = file.parameters.iter_mut().zip(&chosen.model.parameters).enumerate();
        for (index, (parameter, value)) in tuned {
            if self.description().spec().parameters[index].sd == 0.0 {
                continue;
            }
            let remark = chosen.remark(index, &parameter.unit, (parameter.value, *value));
            remarks.parameters.insert(("parameter".into(), parameter.name.clone()), remark);
            parameter.tolerance = chosen.tolerance(index, *value, parameter.tolerance);
            parameter.value = *value;
            if !is_bare {
                // if the file already is a fix, the value from the first fix is kept
                parameter.alone.get_or_insert(evidence.retuned.parameters[index]);
            }
        }
        let mut effects = Vec::new();
        for (effect, values) in chosen.effects(&self.description().spec().effects) {
            let name = &self.description().spec().effects[effect].name;
            chosen.describe(name, self.in_words(effect), &mut remarks);
            self.add(&mut file, effect, values);
            effects.push(name.clone());
        }
        file.card = Some(Card::of(&self.problem, diagnosis, &effects));
        Ok(Fix { file: Fixed::Problem(Box::new(file)), effects, remarks })
    }
}
