//! Divides the effects of a model into effects that stages simulate and effects whose values are
//! estimated from the recording.

use stretch_gap::{Line, Model};
use stretch_sim::{Effect, EffectSet, Find, Measured, SimError};

use super::Bench;

/// The effects of a model.
pub(crate) struct Acting<'a> {
    /// Effects that the stages simulate.
    pub(crate) inside: EffectSet,
    /// Effects whose values are estimated from the recording.
    found: Vec<(Find, &'a [f64])>,
}

impl Bench {
    /// Effects that the simulator already has, then the effects of a model, with their values.
    fn all<'a>(&'a self, model: &'a Model) -> impl Iterator<Item = (&'static Effect, &'a [f64])> {
        let own = self.effects.iter().map(|e| (e.effect(), e.values()));
        own.chain(model.effects.iter().map(|(i, values)| (self.rows[*i], values.as_slice())))
    }

    /// The effects of the simulator and of a model, divided into those that stages simulate and those that are
    /// estimated from the recording.
    pub(crate) fn acting<'a>(&'a self, model: &'a Model) -> Result<Acting<'a>, SimError> {
        let mut acting = Acting { inside: EffectSet::new(), found: Vec::new() };
        for (effect, values) in self.all(model) {
            match effect.find() {
                Some(find) => acting.found.push((find, values)),
                None => acting.inside.push(effect, values)?,
            }
        }
        Ok(acting)
    }

    /// The spectral lines that the effects of the simulator and of a model add to the sensor's signal in the test
    /// samples.
    pub(crate) fn lines(&self, model: &Model) -> Vec<Line> {
        let line = |(effect, values): (&Effect, &[f64])| {
            let line = effect.line(values)?;
            Some(Line { hertz: line.hertz, amplitude: self.unit * line.amplitude })
        };
        self.all(model).filter_map(line).collect()
    }
}

impl Acting<'_> {
    /// Applies the effects that are estimated from the recording to the samples of a simulated
    /// trial outside the test samples.
    pub(crate) fn follow(&self, record: Measured<'_>, simulated: &mut [f64]) {
        let fit = &mut simulated[..record.samples.len()];
        for (find, values) in &self.found {
            find(values, &record, fit);
        }
    }
}
