//! Results of a diagnosis of a user's own problem: notes, the next experiment, code for effects,
//! and the fixed problem file.

use std::num::NonZeroUsize;

use stretch_data::{EffectEntry, Remarks, significant};
use stretch_gap::{Diagnosis, Evidence, GapError, Proposal, Simulator, next_experiment};

use super::{BlackBox, catalogue::Acting, spec::ProblemSpec};
use crate::{
    fix::{Chosen, Fix, Fixed, Meaning, NoFix},
    implement::Implementation,
    problem::Diagnosable,
};

/// Words and equation of an effect that the simulator has itself.
const OWN: (&str, &str) = ("an effect that the simulator has itself", "arguments of the simulator");

impl BlackBox {
    /// An effect of the catalogue in words.
    fn meaning(&self, effect: usize) -> Meaning<'_> {
        let name = self.description().effects[effect].name.as_str();
        match self.problem.wrapper(effect) {
            Some(kind) => Meaning { name, words: kind.words, equation: kind.equation },
            None => Meaning { name, words: OWN.0, equation: OWN.1 },
        }
    }

    /// Writes the values of an effect that was found into the file, so that the effect acts in every run.
    fn add(&self, file: &mut ProblemSpec, effect: usize, values: &[f64]) {
        let spec = &self.description().effects[effect];
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

    fn next(
        &self,
        diagnosis: &Diagnosis,
        evidence: &Evidence,
    ) -> Result<Option<Proposal>, GapError> {
        match next_experiment(self, diagnosis, evidence) {
            // There is no prediction if the run budget is spent or a model cannot be run on other
            // inputs.
            Err(GapError::Simulator(_) | GapError::Spent { .. }) => Ok(None),
            proposal => proposal,
        }
    }

    fn implementations(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Vec<Implementation> {
        let Ok(chosen) = Chosen::of(diagnosis, evidence) else { return Vec::new() };
        let one = |(effect, values): (usize, &[f64])| {
            let Meaning { name, words, equation } = self.meaning(effect);
            Implementation {
                name: name.to_owned(),
                words: words.to_owned(),
                stage: self.description().effects[effect].stage.clone(),
                formula: equation.to_owned(),
                numbers: chosen.numbers(name),
                sketch: self.problem.sketch(effect, values),
            }
        };
        chosen.named(&self.description().effects).into_iter().map(one).collect()
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
        let is_bare = chosen.effects(&self.description().effects).next().is_none();
        let tuned = file.parameters.iter_mut().zip(&chosen.model.parameters).enumerate();
        for (index, (parameter, value)) in tuned {
            if self.description().parameters[index].sd == 0.0 {
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
        for (effect, values) in chosen.effects(&self.description().effects) {
            let meaning = self.meaning(effect);
            chosen.describe(meaning, &mut remarks);
            self.add(&mut file, effect, values);
            effects.push(meaning.name.to_owned());
        }
        Ok(Fix { file: Fixed::Problem(Box::new(file)), effects, remarks })
    }
}
