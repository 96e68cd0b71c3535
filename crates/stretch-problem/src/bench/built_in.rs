//! Results of a diagnosis of a built-in simulator: notes, code for effects, and the fixed rig file.

use std::fmt::Debug;

use stretch_data::{Remarks, RigFile};
use stretch_gap::{Diagnosis, Evidence, Laboratory, Model, Run};
use stretch_sim::{Effect, EffectSet, Grid, Sketch, Surroundings};

use super::Bench;
use crate::{
    fix::{Chosen, Fix, Fixed, NoFix, names, sine},
    problem::Diagnosable,
};

/// Parts of the results of a diagnosis that a whole rig and a gauge alone compute in different
/// ways.
pub(crate) trait BuiltIn: Laboratory {
    /// The recording and the effects.
    fn bench(&self) -> &Bench;

    /// The surroundings of an effect in the simulator, re-tuned as in a model.
    fn surroundings<'a>(&self, model: &Model, grid: &'a Grid) -> Surroundings<'a>;

    /// Size of a spectral line of unit amplitude in the sensor's signal.
    fn line_unit(&self, model: &Model) -> f64;

    /// Limits the values of an effect to the ranges of a file, because rounding may put a value outside of its
    /// range.
    fn within(_: &Effect, values: &[f64]) -> Vec<f64> {
        values.to_vec()
    }

    /// The file of the simulator with re-tuned parameters and with `effects`. It adds the comments on parameters, and
    /// omits the parameters of the recording.
    ///
    /// # Errors
    /// The written file cannot be read again.
    fn file(
        &self,
        chosen: &Chosen<'_>,
        effects: EffectSet,
        remarks: &mut Remarks,
    ) -> Result<RigFile, NoFix>;
}

/// Replaces the amplitude and phase of an effect's spectral line by values from the recording, as a
/// diagnosis does. They are the amplitude and phase of the residual of the model without the
/// effect, over the samples outside the test samples. An effect without a line keeps its values.
fn complete<B: BuiltIn>(own: &B, model: &Model, effect: &Effect, values: Vec<f64>) -> Vec<f64> {
    let Bench { about, columns, rows, sensor, .. } = own.bench();
    let Some(line) = effect.line(&values) else { return values };
    let mut without = model.clone();
    without.effects.retain(|(index, _)| rows[*index].name != effect.name);
    let (measured, unit) = (own.measured(*sensor), own.line_unit(model));
    let mut simulated = vec![0.0; measured.len()];
    let run = Run::exact(*sensor, &without, about.spec().trials.len());
    if own.simulate(run, &mut simulated).is_err() {
        return values;
    }
    let mut left = Vec::new();
    for (trial, range) in about.spec().trials.iter().zip(columns.fitted()) {
        let at = |i: usize| trial.start_s + (i - range.start) as f64 * about.spec().dt_s;
        left.extend(range.clone().map(|i| (at(i), (measured[i] - simulated[i]) / unit)));
    }
    let [amplitude, phase] = sine(line.hertz, &left);
    [&[amplitude], values.get(1..).unwrap_or(&[]), &[phase]].concat()
}

impl<B: BuiltIn + Debug + Send> Diagnosable for B {
    fn notes(&self) -> Vec<String> {
        self.bench().columns.notes.clone()
    }

    fn doubts(&self) -> Vec<String> {
        self.bench().columns.doubts.clone()
    }

    fn column(&self, name: &str) -> Option<Vec<f64>> {
        self.bench().columns.of(name).map(<[f64]>::to_vec)
    }

    fn in_words(&self, effect: usize) -> [&str; 2] {
        let effect = self.bench().rows[effect];
        [effect.words, effect.equation]
    }

    fn sketch(&self, effect: usize, values: &[f64], model: &Model) -> Option<Sketch> {
        let grid = Grid::samples(self.bench().about.spec().dt_s).ok()?;
        let effect = self.bench().rows[effect];
        let values = complete(self, model, effect, values.to_vec());
        effect.sketch(&values, &self.surroundings(model, &grid))
    }

    /// A rig file with the findings of a diagnosis: see [`Fix`]. A diagnosis of the same recording with this file gives
    /// `no_gap`.
    ///
    /// A diagnosis does not fit a hum's amplitude and phase, so the file has values that are estimated from the fit
    /// trials, on the session's clock.
    fn fixed(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Result<Fix, NoFix> {
        let Bench { about, rows, effects, .. } = self.bench();
        let chosen = Chosen::of(diagnosis, evidence)?;
        let mut remarks = Remarks { head: chosen.head(), ..Remarks::default() };
        for effect in effects.iter() {
            let own = vec!["This effect was in the rig file already.".to_owned()];
            remarks.effects.insert(effect.name().into(), own);
        }
        let mut effects = effects.clone();
        for (index, values) in chosen.effects(&about.spec().effects) {
            let effect = rows[index];
            let values = complete(self, chosen.model, effect, Self::within(effect, values));
            chosen.describe(effect.name, self.in_words(index), &mut remarks);
            effects.push(effect, &values)?;
        }
        let file = self.file(&chosen, effects, &mut remarks)?;
        Ok(Fix { effects: names(&file), file: Fixed::Rig(file), remarks })
    }
}
