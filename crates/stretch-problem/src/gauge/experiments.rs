//! Candidate experiments on a gauge alone, and the signal that a model predicts for each.

use stretch_data::{Channel, Trial};
use stretch_gap::{GapError, Laboratory, Model, Plan, TrialSpec};
use stretch_sim::{Gauge, RigStage, Start};

use super::GaugeSimulator;
use crate::{
    bench::{
        acting::unrecorded,
        courses::{Points, begin, course, loops, moving, paced},
    },
    black_box::velocity::of_position,
    error::ProblemError,
};

/// Greatest length of an experiment if the first trial is not longer, s.
const LONGEST_S: f64 = 120.0;

/// An experiment on a gauge: the time course of e, which is the reference as a share of its range.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    e: Vec<f64>,
    /// Whether blocks of known length (gauge blocks) replace the reference.
    is_known: bool,
    /// Applied pressure as a share of its range; 0 if none is applied.
    pressure: Vec<f64>,
}

/// The gauge held in the middle while the pressure goes up and down.
fn held_under_pressure(dt_s: f64) -> Course {
    let pressure: Vec<f64> = course(&begin(&[loops(0.0, 1.0, 4.0, 4)]), dt_s).collect();
    Course { e: vec![0.5; pressure.len()], is_known: true, pressure }
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
        let (mut model, mut base) = (model.clone(), self.nominal.effects.clone());
        if course.is_known {
            model.effects.retain(|(i, _)| self.rows[*i].stage != RigStage::Reference);
            let shown =
                self.nominal.effects.iter().filter(|e| e.effect().stage == RigStage::Reference);
            shown.for_each(|known| drop(base.remove(known.name())));
        }
        let effects = unrecorded(&base, &self.rows, &model)?;
        let gauge = Gauge::new(self.nominal(&model), &effects, self.session.dt_s)?;
        let shown = self.reference_of(course);
        let mut signal = vec![0.0; shown.len()];
        // Without a pressure column there is no effect of pressure either.
        let pressure = match self.session.pressure.is_empty() {
            true => Vec::new(),
            false => self.pressure_of(course),
        };
        gauge.run(&mut gauge.memory(), Start::Settled, 0.0, &shown, &pressure, &mut signal)?;
        let noise = self.noise.max(1e-6 * self.spread);
        signal.iter_mut().for_each(|y| *y /= noise);
        Ok(vec![signal])
    }

    /// Greatest rate of the recorded reference, outside the test trials.
    fn fastest(&self) -> f64 {
        let session = &self.session;
        let ranges = TrialSpec::ranges(&session.trials);
        let rates = of_position(&session.reference, &ranges, session.dt_s);
        let rates = session.fitted().flat_map(|range| &rates[range]);
        rates.fold(0.0, |a: f64, rate| a.max(rate.abs()))
    }

    /// A course without pressure, in which the reference moves no faster than `fastest`; `is_known` states whether
    /// blocks of known length replace the reference.
    fn held(&self, points: &[(f64, f64)], is_known: bool, fastest: f64) -> Course {
        let dt_s = self.session.dt_s;
        let points = paced(points, self.nominal.spec.span.abs() / fastest);
        let most = self.inputs[0].values.len().max((LONGEST_S / dt_s) as usize);
        let e: Vec<f64> = course(&points, dt_s).take(most).collect();
        Course { pressure: vec![0.0; e.len()], e, is_known }
    }

    fn reference_of(&self, course: &Course) -> Vec<f64> {
        course.e.iter().map(|e| self.nominal.spec.zero + self.nominal.spec.span * e).collect()
    }

    fn pressure_of(&self, course: &Course) -> Vec<f64> {
        let scale = self.nominal.spec.pressure_scale.unwrap_or(0.0);
        course.pressure.iter().map(|share| share * scale).collect()
    }

    /// The trial that prescribes a course: the reference, and the pressure if one is applied.
    fn trial(&self, name: &str, course: &Course) -> Trial {
        let channel = |name: String, values| Channel { name, values };
        let reference = format!("set_{}", self.reference);
        let mut channels = vec![channel(reference, self.reference_of(course))];
        if course.pressure.iter().any(|share| *share != 0.0) {
            channels.push(channel("set_pressure_kpa".into(), self.pressure_of(course)));
        }
        let time_s = (0..course.e.len()).map(|i| i as f64 * self.session.dt_s).collect();
        Trial { name: name.into(), time_s, channels }
    }

    fn experiment(
        &self,
        (name, how): (&str, &str),
        prepare_min: f64,
        course: Course,
    ) -> (Plan, Course) {
        let trial = self.trial(name, &course);
        (Plan { name: name.into(), how: how.into(), prepare_min, trial }, course)
    }
}

impl Laboratory for GaugeSimulator {
    type Setting = Course;

    fn experiments(&self) -> Vec<(Plan, Course)> {
        let (dt_s, fastest) = (self.session.dt_s, self.fastest());
        let moving =
            moving().into_iter().map(|(name, how, points)| (name, how, 0.25, points, false));
        let all = moving.chain(still()).map(|(name, how, prepare_min, points, is_known)| {
            self.experiment((name, how), prepare_min, self.held(&points, is_known, fastest))
        });
        let mut candidates: Vec<(Plan, Course)> = all.collect();
        if !self.session.pressure.is_empty() {
            let how =
                "Hold the gauge at one length, with a block, while the pressure goes up and down.";
            let named = ("held_under_pressure", how);
            candidates.push(self.experiment(named, 3.0, held_under_pressure(dt_s)));
        }
        candidates
    }

    /// The first minute of the recording, as a course.
    fn done(&self) -> Course {
        let samples = ((60.0 / self.session.dt_s) as usize).min(self.inputs[0].values.len());
        let values = &self.inputs[0].values[..samples];
        let e: Vec<f64> =
            values.iter().map(|x| (x - self.nominal.spec.zero) / self.nominal.spec.span).collect();
        Course { pressure: vec![0.0; e.len()], e, is_known: false }
    }

    fn predict(&self, model: &Model, course: &Course) -> Result<Vec<Vec<f64>>, GapError> {
        Ok(self.prediction(model, course)?)
    }
}
