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
    /// Sorts the effects of a model on top of those that the simulator already has; `rows` are the entries of its
    /// catalogue. What is found in the record is found there for a rig file's effect, too.
    pub(crate) fn of(
        base: &'a EffectSet,
        rows: &[&'static Effect],
        model: &'a Model,
    ) -> Result<Self, SimError> {
        let mut acting = Self { inside: EffectSet::new(), found: Vec::new() };
        let own = base.iter().map(|e| (e.effect(), e.values()));
        let missing = model.effects.iter().map(|(i, values)| (rows[*i], values.as_slice()));
        for (effect, values) in own.chain(missing) {
            match effect.find {
                Some(find) => acting.found.push((find, values)),
                None => acting.inside.push(effect, values)?,
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
pub(crate) fn unrecorded(
    base: &EffectSet,
    rows: &[&'static Effect],
    model: &Model,
) -> Result<EffectSet, SimError> {
    let mut effects = base.clone();
    for (index, values) in &model.effects {
        effects.push(rows[*index], &rows[*index].with_stand_ins(values))?;
    }
    Ok(effects)
}
