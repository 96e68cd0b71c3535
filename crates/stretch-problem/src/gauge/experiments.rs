//! Candidate experiments on a gauge alone, and the signal that a model predicts for each.

use stretch_data::Trial;
use stretch_gap::{GapError, Laboratory, Model, Plan};
use stretch_sim::{Gauge, RigStage, Start};

use super::{
    GaugeSimulator,
    session::{REFERENCE, pressure},
};
use crate::{
    bench::{
        courses::{Points, begin, course, loops, moving, paced},
        even_trial,
    },
    error::ProblemError,
};

/// Greatest length of an experiment if the first trial is not longer, s.
const LONGEST_S: f64 = 120.0;
/// Experiments in which blocks of known length (gauge blocks) replace the reference.
const KNOWN: [&str; 2] = ["gauge_blocks", "held_under_pressure"];
/// Column of the pressure that is applied; an experiment without it has none.
const SET_PRESSURE: &str = "set_pressure_kpa";

/// An experiment's name, instructions, and minutes to prepare it.
type Head = (&'static str, &'static str, f64);

/// Experiments in which the gauge is held at known lengths with blocks, or left alone, with the points of their courses.
fn still() -> [(Head, Points); 2] {
    let block = |e: f64| [(e, 3.0), (e, 10.0)];
    let hold = "Hold the gauge at known lengths with blocks, which replace the recorded reference.";
    let leave = "Leave the gauge alone for two minutes: what changes does not come from motion.";
    let blocks = [block(0.1), block(0.5), block(0.9), block(0.5), block(0.1)].concat();
    [
        ((KNOWN[0], hold, 3.0), begin(&[blocks])),
        (("rest", leave, 0.0), vec![(0.0, 0.0), (0.0, 120.0)]),
    ]
}

impl GaugeSimulator {
    /// Name of the column that prescribes the reference.
    fn set_reference(&self) -> String {
        format!("set_{}", self.bench.columns.names[REFERENCE])
    }

    /// The signal in an experiment, in units of its noise.
    fn prediction(&self, model: &Model, trial: &Trial) -> Result<Vec<Vec<f64>>, ProblemError> {
        let mut effects = self.bench.unrecorded(model)?;
        if KNOWN.contains(&trial.name.as_str()) {
            effects = effects.only(|effect| effect.stage != RigStage::Reference);
        }
        let gauge = Gauge::new(self.tuned(model), &effects, self.bench.about.spec().dt_s)?;
        let reference = trial.require(&self.set_reference())?;
        let mut signal = vec![0.0; reference.len()];
        // Without a pressure column there is no effect of pressure either.
        let has_pressure = !pressure(&self.bench.columns).is_empty();
        let none = if has_pressure { signal.clone() } else { Vec::new() };
        let pressure = trial.channel(SET_PRESSURE).unwrap_or(&none);
        gauge.run(&mut gauge.memory(), Start::Settled, 0.0, reference, pressure, &mut signal)?;
        let noise = self.bench.noise.max(1e-6 * self.bench.unit);
        signal.iter_mut().for_each(|y| *y /= noise);
        Ok(vec![signal])
    }

    /// The plan of a course of the reference and, if one is applied, of the pressure, each in shares of its range.
    fn plan(
        &self,
        (name, how, prepare_min): Head,
        reference: impl Iterator<Item = f64>,
        pressure: Option<Vec<f64>>,
    ) -> Plan {
        let spec = &self.spec;
        let reference = reference.map(|e| spec.zero + spec.span * e).collect();
        let scale = spec.pressure_scale.unwrap_or(0.0);
        let applied = |pressure: Vec<f64>| {
            (SET_PRESSURE.to_owned(), pressure.iter().map(|share| scale * share).collect())
        };
        let columns = [(self.set_reference(), reference)].into_iter();
        let columns = columns.chain(pressure.map(applied));
        let trial = even_trial(name, self.bench.about.spec().dt_s, columns);
        Plan { how: how.to_owned(), prepare_min, trial }
    }
}

impl Laboratory for GaugeSimulator {
    fn experiments(&self) -> Vec<Plan> {
        let dt_s = self.bench.about.spec().dt_s;
        let columns = &self.bench.columns;
        // The reference moves no faster than it was recorded.
        let least_s = self.spec.span.abs() / columns.fastest(&columns.values[REFERENCE]);
        let most = self.bench.about.spec().trials[0].samples.max((LONGEST_S / dt_s) as usize);
        let moving = moving().into_iter().map(|(name, how, points)| ((name, how, 0.25), points));
        let all = moving.chain(still()).map(|(head, points)| {
            self.plan(head, course(&paced(&points, least_s), dt_s).take(most), None)
        });
        let mut candidates: Vec<Plan> = all.collect();
        if !pressure(columns).is_empty() {
            let how =
                "Hold the gauge at one length, with a block, while the pressure goes up and down.";
            let pressure: Vec<f64> = course(&begin(&[loops(0.0, 1.0, 4.0, 4)]), dt_s).collect();
            let held = std::iter::repeat_n(0.5, pressure.len());
            candidates.push(self.plan((KNOWN[1], how, 3.0), held, Some(pressure)));
        }
        candidates
    }

    /// The first minute of the recording.
    fn done(&self) -> Trial {
        let dt_s = self.bench.about.spec().dt_s;
        let mut reference = self.input.trial(0, None);
        reference.truncate((60.0 / dt_s) as usize);
        even_trial("done", dt_s, [(self.set_reference(), reference)])
    }

    fn predict(&self, model: &Model, trial: &Trial) -> Result<Vec<Vec<f64>>, GapError> {
        Ok(self.prediction(model, trial)?)
    }
}
