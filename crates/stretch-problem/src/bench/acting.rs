//! Divides the effects of a model into effects that stages simulate and effects whose values are
//! estimated from the recording.

use std::ops::Range;

use stretch_gap::{Line, Model, SampleRoles, TrialSpec};
use stretch_sim::{Effect, EffectSet, Find, Measured, SimError};

/// The measured samples of a channel outside the test samples, from which effects may be estimated.
#[derive(Debug, Clone)]
pub(crate) struct FitRecord {
    /// By trial, from its start; empty for a test trial.
    parts: Vec<Vec<f64>>,
    dt_s: f64,
}

impl FitRecord {
    /// The fit samples of a channel that holds all trials end to end.
    pub(crate) fn of(trials: &[TrialSpec], measured: &[f64], dt_s: f64) -> Self {
        let parts = TrialSpec::ranges(trials).into_iter().zip(SampleRoles::not_tested(trials));
        let part =
            |(all, fit): (Range<usize>, usize)| measured[all.start..all.start + fit].to_vec();
        Self { parts: parts.map(part).collect(), dt_s }
    }

    /// The samples of all trials.
    pub(crate) fn samples(&self) -> impl Iterator<Item = f64> {
        self.parts.iter().flatten().copied()
    }

    /// The samples of one trial; noise and unit as in [`Measured`].
    pub(crate) fn of_trial(&self, trial: usize, noise: f64, unit: f64) -> Measured<'_> {
        Measured { samples: &self.parts[trial], noise, unit, dt_s: self.dt_s }
    }
}

/// The effects of a model.
pub(crate) struct Acting<'a> {
    /// Effects that the stages simulate.
    pub(crate) inside: EffectSet,
    /// Effects whose values are estimated from the recording.
    found: Vec<(Find, &'a [f64])>,
}

/// Effects that a simulator already has, then the effects of a model, with their values; `rows` are
/// the entries of the model's catalogue.
fn all<'a>(
    base: &'a EffectSet,
    rows: &'a [&'static Effect],
    model: &'a Model,
) -> impl Iterator<Item = (&'static Effect, &'a [f64])> {
    let own = base.iter().map(|e| (e.effect(), e.values()));
    own.chain(model.effects.iter().map(|(i, values)| (rows[*i], values.as_slice())))
}

/// Returns the spectral lines that the effects of a simulator and of a model add to the test samples. Their amplitudes
/// are multiplied by `unit`.
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
    /// Divides the effects of a model, and the effects that the simulator already has, into `inside` (simulated) and
    /// `found` (estimated from the recording), by their kinds.
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

    /// Applies the effects that are estimated from the recording to the samples of a simulated
    /// trial outside the test samples.
    pub(crate) fn follow(&self, record: Measured<'_>, simulated: &mut [f64]) {
        let fit = &mut simulated[..record.samples.len()];
        for (find, values) in &self.found {
            find(values, &record, fit);
        }
    }
}

/// The effects of a model without a recording: typical values replace those that would be estimated
/// from a recording.
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
