//! A menu of experiments on a gauge alone, and what a model predicts of each.

use stretch_data::{Channel, Trial};
use stretch_gap::{GapError, Laboratory, Model, Plan};
use stretch_sim::{Gauge, Stage, Start};

use super::GaugeSimulator;
use crate::bench::{acting::unrecorded, error::BenchError};

/// An experiment on a gauge: the course of e.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    e: Vec<f64>,
    /// Whether gauge blocks stand in for the reference.
    is_known: bool,
    /// Share of the pressure's range, where one is applied.
    pressure: Vec<f64>,
}

/// A course through points (e, seconds to get there), the first where it begins; eased where it turns.
fn course(points: &[(f64, f64)], dt_s: f64) -> Course {
    let mut e = Vec::new();
    for pair in points.windows(2) {
        let (from, (to, seconds)) = (pair[0].0, pair[1]);
        let samples = ((seconds / dt_s).round() as usize).max(1);
        let way = |i: usize| i as f64 / samples as f64;
        e.extend((0..samples).map(|i| {
            let x = way(i);
            from + (to - from) * x * x * (3.0 - 2.0 * x)
        }));
    }
    Course { pressure: vec![0.0; e.len()], e, is_known: false }
}

/// The gauge held in the middle while the pressure goes up and down.
fn held_under_pressure(dt_s: f64) -> Course {
    let swept = course(&[vec![(0.0, 0.0), (0.0, 1.0)], loops(0.0, 1.0, 4.0, 4)].concat(), dt_s);
    Course { e: vec![0.5; swept.e.len()], is_known: true, pressure: swept.e }
}

/// Up and down between two levels, `times` times, `half_s` each way.
fn loops(low: f64, high: f64, half_s: f64, times: usize) -> Vec<(f64, f64)> {
    [(high, half_s), (low, half_s)].repeat(times)
}

/// What is on the menu: name, how, minutes to prepare, points, whether blocks hold it.
type Dish = (&'static str, &'static str, f64, Vec<(f64, f64)>, bool);

fn dishes() -> Vec<Dish> {
    let begin = |more: &[Vec<(f64, f64)>]| [vec![(0.0, 0.0), (0.0, 1.0)], more.concat()].concat();
    let mut chirp = Vec::new();
    let mut half_s: f64 = 4.0;
    while half_s > 0.2 {
        chirp.extend([(1.0, half_s), (0.0, half_s)]);
        half_s *= 0.88;
    }
    let dwell = |e: f64| [(e, 0.3), (e, 6.0)];
    let steps = [dwell(0.3), dwell(0.7), dwell(1.0), dwell(0.4), dwell(0.0)].concat().repeat(2);
    let block = |e: f64| [(e, 3.0), (e, 10.0)];
    vec![
        (
            "slow_fast_loops",
            "Half a minute of slow loops over the whole range, half a minute of fast ones.",
            0.25,
            begin(&[loops(0.0, 1.0, 5.0, 3), loops(0.0, 1.0, 0.5, 30)]),
            false,
        ),
        (
            "minor_loops",
            "Small loops at three levels, reached from below and from above.",
            0.25,
            begin(&[
                vec![(0.2, 1.0)],
                loops(0.2, 0.4, 0.8, 6),
                vec![(0.7, 1.0)],
                loops(0.7, 0.9, 0.8, 6),
                vec![(1.0, 1.0), (0.6, 1.0)],
                loops(0.6, 0.4, 0.8, 6),
                vec![(0.0, 1.0)],
                loops(0.0, 0.1, 0.8, 6),
            ]),
            false,
        ),
        (
            "steps_with_dwells",
            "Quick steps, each followed by six seconds at rest.",
            0.25,
            begin(&[steps]),
            false,
        ),
        ("chirp", "Loops over the whole range, ever faster.", 0.25, begin(&[chirp]), false),
        (
            "gauge_blocks",
            "Hold the gauge at known lengths with blocks: the reference is then the blocks', not the recorder's.",
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
    fn prediction(&self, model: &Model, course: &Course) -> Result<Vec<Vec<f64>>, BenchError> {
        let (mut model, mut base) = (model.clone(), self.nominal.effects.clone());
        if course.is_known {
            model.effects.retain(|(i, _)| self.rows[*i].stage != Stage::Reference);
            let shown =
                self.nominal.effects.iter().filter(|e| e.effect().stage == Stage::Reference);
            shown.for_each(|known| drop(base.remove(known.name())));
        }
        let effects = unrecorded(&base, &self.rows, &model)?;
        let gauge = Gauge::new(self.nominal(&model), &effects, self.record.dt_s)?;
        let shown = self.reference_of(course);
        let mut signal = vec![0.0; shown.len()];
        // Without a pressure column there is no effect of it either.
        let pressure = match self.record.pressure.is_empty() {
            true => Vec::new(),
            false => self.pressure_of(course),
        };
        gauge.run(&mut gauge.memory(), Start::Settled, 0.0, &shown, &pressure, &mut signal)?;
        let noise = self.noise.max(1e-6 * self.spread);
        signal.iter_mut().for_each(|y| *y /= noise);
        Ok(vec![signal])
    }
}

impl GaugeSimulator {
    fn reference_of(&self, course: &Course) -> Vec<f64> {
        course.e.iter().map(|e| self.nominal.spec.zero + self.nominal.spec.span * e).collect()
    }

    fn pressure_of(&self, course: &Course) -> Vec<f64> {
        let scale = self.nominal.spec.pressure_scale.unwrap_or(0.0);
        course.pressure.iter().map(|share| share * scale).collect()
    }

    /// The trial that sets a course: the reference, and the pressure where one is applied.
    fn trial(&self, name: &str, course: &Course) -> Trial {
        let channel = |name: String, values| Channel { name, values };
        let reference = format!("set_{}", self.reference);
        let mut channels = vec![channel(reference, self.reference_of(course))];
        if course.pressure.iter().any(|share| *share != 0.0) {
            channels.push(channel("set_pressure_kpa".into(), self.pressure_of(course)));
        }
        let time_s = (0..course.e.len()).map(|i| i as f64 * self.record.dt_s).collect();
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

    fn menu(&self) -> Vec<(Plan, Course)> {
        let dt_s = self.record.dt_s;
        let plan = |(name, how, prepare_min, points, is_known): Dish| {
            let course = Course { is_known, ..course(&points, dt_s) };
            self.experiment((name, how), prepare_min, course)
        };
        let mut menu: Vec<(Plan, Course)> = dishes().into_iter().map(plan).collect();
        if !self.record.pressure.is_empty() {
            let how =
                "Hold the gauge at one length, with a block, while the pressure goes up and down.";
            let told = ("held_under_pressure", how);
            menu.push(self.experiment(told, 3.0, held_under_pressure(dt_s)));
        }
        menu
    }

    /// The first minute of the record.
    fn done(&self) -> Course {
        let samples = ((60.0 / self.record.dt_s) as usize).min(self.inputs[0].values.len());
        let values = &self.inputs[0].values[..samples];
        let e: Vec<f64> =
            values.iter().map(|x| (x - self.nominal.spec.zero) / self.nominal.spec.span).collect();
        Course { pressure: vec![0.0; e.len()], e, is_known: false }
    }

    fn predict(&self, model: &Model, course: &Course) -> Result<Vec<Vec<f64>>, GapError> {
        Ok(self.prediction(model, course)?)
    }
}
