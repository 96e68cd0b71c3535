//! Effects of a model: those that stages run, and those whose numbers are found in the record.

use stretch_gap::{Frame, Line, Model, TrialSpec};
use stretch_sim::{Effect, EffectSet, Find, Measured, SimError};

/// What was measured of a channel without the samples that are tested on: all that an effect may be found in.
#[derive(Debug, Clone)]
pub(crate) struct FitRecord {
    /// By trial, from its start; empty for a test trial.
    parts: Vec<Vec<f64>>,
    dt_s: f64,
}

impl FitRecord {
    /// Of a channel, all trials end to end.
    pub(crate) fn of(trials: &[TrialSpec], measured: &[f64], dt_s: f64) -> Self {
        let mut begin = 0;
        let part = |(trial, fit): (&TrialSpec, usize)| {
            let from = begin;
            begin += trial.samples;
            measured[from..from + fit].to_vec()
        };
        Self { parts: trials.iter().zip(Frame::not_tested(trials)).map(part).collect(), dt_s }
    }

    /// All of it.
    pub(crate) fn samples(&self) -> impl Iterator<Item = f64> {
        self.parts.iter().flatten().copied()
    }

    /// Of one trial; noise and unit as in [`Measured`].
    pub(crate) fn of_trial(&self, trial: usize, noise: f64, unit: f64) -> Measured<'_> {
        Measured { samples: &self.parts[trial], noise, unit, dt_s: self.dt_s }
    }
}

/// The effects of a model.
pub(crate) struct Acting<'a> {
    /// Those that the stages run.
    pub(crate) inside: EffectSet,
    found: Vec<(Find, &'a [f64])>,
}

/// Effects that a simulator already has, then those of a model, with their values; `rows` are the entries of its catalogue.
fn all<'a>(
    base: &'a EffectSet,
    rows: &'a [&'static Effect],
    model: &'a Model,
) -> impl Iterator<Item = (&'static Effect, &'a [f64])> {
    let own = base.iter().map(|e| (e.effect(), e.values()));
    own.chain(model.effects.iter().map(|(i, values)| (rows[*i], values.as_slice())))
}

/// Lines, in `unit`s, that the effects of a simulator and of a model leave where they may not be found.
pub(crate) fn lines(
    base: &EffectSet,
    rows: &[&'static Effect],
    model: &Model,
    unit: f64,
) -> Vec<Line> {
    all(base, rows, model)
        .filter_map(|(effect, values)| effect.line(values))
        .map(|line| Line { hertz: line.hertz, amplitude: unit * line.amplitude })
        .collect()
}

impl<'a> Acting<'a> {
    /// Sorts the effects of a model on top of those that the simulator already has. What is found in the record is found
    /// there for a rig file's effect, too.
    pub(crate) fn of(
        base: &'a EffectSet,
        rows: &'a [&'static Effect],
        model: &'a Model,
    ) -> Result<Self, SimError> {
        let mut acting = Self { inside: EffectSet::new(), found: Vec::new() };
        for (effect, values) in all(base, rows, model) {
            match effect.find() {
                Some(find) => acting.found.push((find, values)),
                None => acting.inside.push(effect, values)?,
            }
        }
        Ok(acting)
    }

    /// Lets what is found in the record act on the samples of a simulated trial that it was found in.
    pub(crate) fn follow(&self, record: Measured<'_>, simulated: &mut [f64]) {
        let fit = &mut simulated[..record.samples.len()];
        for (find, values) in &self.found {
            find(values, &record, fit);
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
