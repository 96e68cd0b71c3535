//! Divides the effects of a model into effects that stages simulate and effects whose values are
//! estimated from the recording.

use stretch_gap::Model;
use stretch_sim::{Effect, EffectSet, Find, Measured, SimError};

/// The effects of a model.
pub(crate) struct Acting<'a> {
    /// Effects that the stages simulate.
    pub(crate) inside: EffectSet,
    /// Effects whose values are estimated from the recording.
    found: Vec<(Find, &'a [f64])>,
}

/// Effects that a simulator already has, then the effects of a model, with their values; `rows` are
/// the entries of the model's catalogue.
pub(super) fn all<'a>(
    base: &'a EffectSet,
    rows: &'a [&'static Effect],
    model: &'a Model,
) -> impl Iterator<Item = (&'static Effect, &'a [f64])> {
    let own = base.iter().map(|e| (e.effect(), e.values()));
    own.chain(model.effects.iter().map(|(i, values)| (rows[*i], values.as_slice())))
}

impl<'a> Acting<'a> {
    /// Divides effects into `inside` (simulated) and `found` (estimated from the recording), by their kinds.
    pub(super) fn of(
        effects: impl Iterator<Item = (&'static Effect, &'a [f64])>,
    ) -> Result<Self, SimError> {
        let mut acting = Self { inside: EffectSet::new(), found: Vec::new() };
        for (effect, values) in effects {
            match effect.find() {
                Some(find) => acting.found.push((find, values)),
                None => acting.inside.push(effect, values)?,
            }
        }
        Ok(acting)
    }

    /// Applies the effects that are estimated from the recording to the samples of a simulated
    /// trial outside the test samples.
    pub(crate) fn follow(&self, record: Measured<'_>, simulated: &mut [f64]) {
        let fit = &mut simulated[..record.samples.len()];
        for (find, values) in &self.found {
            find(values, &record, fit);
        }
    }
}
