//! Effects of a model: those that stages run, and those whose numbers are found in the record.

use stretch_gap::Model;
use stretch_sim::{Effect, EffectSet, Find, Measured, SimError};

/// The effects of a model.
pub(crate) struct Acting<'a> {
    /// Those that the stages run.
    pub(crate) inside: EffectSet,
    found: Vec<(Find, &'a [f64])>,
}

impl<'a> Acting<'a> {
    /// Sorts the effects of a model; `rows` are the entries of its catalogue.
    pub(crate) fn of(rows: &[&'static Effect], model: &'a Model) -> Result<Self, SimError> {
        let mut acting = Self { inside: EffectSet::new(), found: Vec::new() };
        for (index, values) in &model.effects {
            match rows[*index].find {
                Some(find) => acting.found.push((find, values)),
                None => acting.inside.push(rows[*index], values)?,
            }
        }
        Ok(acting)
    }

    /// Lets what is found in the record act on a simulated trial.
    pub(crate) fn follow(&self, record: Measured<'_>, simulated: &mut [f64]) {
        for (find, values) in &self.found {
            find(values, &record, simulated);
        }
    }
}

/// The effects of a model where there is no record: a guess stands for what would be found in it.
pub(crate) fn unrecorded(rows: &[&'static Effect], model: &Model) -> Result<EffectSet, SimError> {
    let mut effects = EffectSet::new();
    for (index, values) in &model.effects {
        effects.push(rows[*index], &rows[*index].with_stand_ins(values))?;
    }
    Ok(effects)
}
