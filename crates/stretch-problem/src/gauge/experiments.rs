//! Candidate experiments on a gauge alone, and the signal that a model predicts for each.

use stretch_data::{Channel, Trial};
use stretch_gap::{GapError, Laboratory, Model, Plan};
use stretch_sim::{Gauge, RigStage, Start};

use super::{
    GaugeSimulator,
    session::{REFERENCE, pressure},
};
use crate::{
    bench::courses::{Points, begin, course, loops, moving, paced},
    error::ProblemError,
};

/// Greatest length of an experiment if the first trial is not longer, s.
const LONGEST_S: f64 = 120.0;

/// An experiment on a gauge.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    reference: Vec<f64>,
    /// Whether blocks of known length (gauge blocks) replace the reference.
    is_known: bool,
    /// Applied pressure; 0 if none is applied.
    pressure: Vec<f64>,
}

/// Experiments in which the gauge is held at known lengths with blocks, or left alone. Each has a name, instructions,
/// the minutes to prepare it, the points of its course, and whether blocks hold the gauge.
fn still() -> [(&'static str, &'static str, f64, Points, bool); 2] {
    let block = |e: f64| [(e, 3.0), (e, 10.0)];
    [
        (
            "gauge_blocks",
            "Hold the gauge at known lengths with blocks, which replace the recorded reference.",
            3.0,
            begin(&[[block(0.1), block(0.5), block(0.9), block(0.5), block(0.1)].concat()]),
            true,
        ),
        (
            "rest",
            "Leave the gauge alone for two minutes: what changes does not come from motion.",
            0.0,
            vec![(0.0, 0.0), (0.0, 120.0)],
            false,
        ),
    ]
}

impl GaugeSimulator {
    /// The signal over a course, in units of its noise.
    fn prediction(&self, model: &Model, course: &Course) -> Result<Vec<Vec<f64>>, ProblemError> {
        let mut effects = self.bench.unrecorded(model)?;
        if course.is_known {
            effects = effects.only(|effect| effect.stage != RigStage::Reference);
        }
        let gauge = Gauge::new(self.tuned(model), &effects, self.bench.about.dt_s)?;
        let mut signal = vec![0.0; course.reference.len()];
        // Without a pressure column there is no effect of pressure either.
        let pressure: &[f64] = match pressure(&self.bench.columns) {
            [] => &[],
            _ => &course.pressure,
        };
        let (mut memory, start) = (gauge.memory(), Start::Settled);
        gauge.run(&mut memory, start, 0.0, &course.reference, pressure, &mut signal)?;
        let noise = self.bench.noise.max(1e-6 * self.bench.unit);
        signal.iter_mut().for_each(|y| *y /= noise);
        Ok(vec![signal])
    }

    /// A course from the reference and the pressure, each as shares of its range.
    fn course(
        &self,
        e: impl Iterator<Item = f64>,
        pressure: Option<Vec<f64>>,
        is_known: bool,
    ) -> Course {
        let spec = &self.spec;
        let reference: Vec<f64> = e.map(|e| spec.zero + spec.span * e).collect();
        let mut pressure = pressure.unwrap_or_else(|| vec![0.0; reference.len()]);
        pressure.iter_mut().for_each(|share| *share *= spec.pressure_scale.unwrap_or(0.0));
        Course { reference, is_known, pressure }
    }

    /// The plan of a course: a trial that prescribes the reference, and the pressure if one is applied.
    fn plan(&self, (name, how): (&str, &str), prepare_min: f64, course: Course) -> (Plan, Course) {
        let channel = |name: String, values: &[f64]| Channel { name, values: values.to_vec() };
        let reference = format!("set_{}", self.bench.columns.names[REFERENCE]);
        let mut channels = vec![channel(reference, &course.reference)];
        if course.pressure.iter().any(|pressure| *pressure != 0.0) {
            channels.push(channel("set_pressure_kpa".into(), &course.pressure));
        }
        let dt_s = self.bench.about.dt_s;
        let time_s = (0..course.reference.len()).map(|i| i as f64 * dt_s).collect();
        let trial = Trial { name: name.into(), time_s, channels };
        (Plan { name: name.into(), how: how.into(), prepare_min, trial }, course)
    }
}

impl Laboratory for GaugeSimulator {
    type Setting = Course;

    fn experiments(&self) -> Vec<(Plan, Course)> {
        let dt_s = self.bench.about.dt_s;
        let columns = &self.bench.columns;
        // The reference moves no faster than it was recorded.
        let least_s = self.spec.span.abs() / columns.fastest(&columns.values[REFERENCE]);
        let most = self.bench.about.trials[0].samples.max((LONGEST_S / dt_s) as usize);
        let moving =
            moving().into_iter().map(|(name, how, points)| (name, how, 0.25, points, false));
        let all = moving.chain(still()).map(|(name, how, prepare_min, points, is_known)| {
            let points = paced(&points, least_s);
            let e = course(&points, dt_s).take(most);
            self.plan((name, how), prepare_min, self.course(e, None, is_known))
        });
        let mut candidates: Vec<(Plan, Course)> = all.collect();
        if !pressure(&self.bench.columns).is_empty() {
            let how =
                "Hold the gauge at one length, with a block, while the pressure goes up and down.";
            let pressure: Vec<f64> = course(&begin(&[loops(0.0, 1.0, 4.0, 4)]), dt_s).collect();
            let held = std::iter::repeat_n(0.5, pressure.len());
            let held = self.course(held, Some(pressure), true);
            candidates.push(self.plan(("held_under_pressure", how), 3.0, held));
        }
        candidates
    }

    /// The first minute of the recording, as a course.
    fn done(&self) -> Course {
        let mut reference = self.input.trial(0, None);
        reference.truncate((60.0 / self.bench.about.dt_s) as usize);
        Course { pressure: vec![0.0; reference.len()], reference, is_known: false }
    }

    fn predict(&self, model: &Model, course: &Course) -> Result<Vec<Vec<f64>>, GapError> {
        Ok(self.prediction(model, course)?)
    }
}
