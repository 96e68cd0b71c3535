//! Candidate experiments on a user's own simulator, and the outputs that a model predicts for each.
//!
//! A candidate moves one input over the range in which it was measured, no faster than it was
//! measured, for as long as the first trial lasted. The other inputs rest at their median. Every
//! input begins at its first measured value. The simulator runs a candidate as it runs any altered
//! input, so that every simulator that takes altered inputs predicts experiments.

use std::{
    collections::hash_map::DefaultHasher,
    hash::{Hash, Hasher},
};

use stretch_data::{Trial, ends};
use stretch_effects::{Beside, Side};
use stretch_gap::{GapError, Laboratory, Model, Plan, Run, Simulator};

use super::{BlackBox, runs::Altered, source::SourceError};
use crate::bench::{
    courses::{course, lasting, moving, paced},
    even_trial,
};

/// Greatest number of inputs that candidates move.
const MOVED: usize = 3;
/// Time to prepare a candidate, minutes.
const PREPARE_MIN: f64 = 0.25;
/// Smallest noise of an output, a share of its range.
const LEAST_NOISE: f64 = 1e-6;

/// An external input: its name, and its range, median, first value and greatest rate per second over
/// the samples outside the test samples.
struct Driven {
    name: String,
    range: (f64, f64),
    median: f64,
    first: f64,
    fastest: f64,
}

impl BlackBox {
    /// The external inputs: inputs that are not the output of any stage.
    fn driven(&self) -> Vec<Driven> {
        let session = self.problem.session();
        let is_output = |name: &str| session.stages.iter().any(|s| s.output == name);
        let mut out: Vec<Driven> = Vec::new();
        for name in session.stages.iter().flat_map(|s| &s.inputs) {
            if is_output(name) || out.iter().any(|d| d.name == *name) {
                continue;
            }
            let column = self.problem.columns.all(name);
            let looked = self.problem.columns.fitted();
            let mut values: Vec<f64> = looked.flat_map(|r| &column[r]).copied().collect();
            let Some(&first) = values.first() else { continue };
            let range = ends(&values);
            let middle = values.len() / 2;
            let median = *values.select_nth_unstable_by(middle, f64::total_cmp).1;
            let fastest = self.problem.columns.fastest(column);
            out.push(Driven { name: name.clone(), range, median, first, fastest });
        }
        out
    }

    /// A trial in which one input goes through points and all others rest at their medians.
    fn moved(&self, name: &str, all: &[Driven], moved: Option<(usize, &[(f64, f64)])>) -> Trial {
        let (samples, dt_s) = (self.problem.session().samples(1), self.description().spec().dt_s);
        let one = |(at, d): (usize, &Driven)| -> Vec<f64> {
            let (low, high) = d.range;
            let span = high - low;
            if d.fastest <= 0.0 {
                return vec![d.first; samples];
            }
            let share = |x: f64| (x - low) / span;
            let rest = [(share(d.median), 0.0)];
            let points =
                moved.filter(|(own, _)| *own == at).map_or(&rest[..], |(_, points)| points);
            let points = [&[(share(d.first), 0.0)], points].concat();
            let last = points[points.len() - 1].0;
            let points = paced(&points, span / d.fastest);
            let shares = course(&points, dt_s).chain(std::iter::repeat(last)).take(samples);
            shares.map(|x| low + span * x).collect()
        };
        let names = all.iter().map(|d| d.name.clone());
        even_trial(name, dt_s, names.zip(all.iter().enumerate().map(one)))
    }

    /// The inputs of a stage in an experiment in which the stages before it gave `outputs`.
    fn inputs_in(
        &self,
        stage: usize,
        course: &Trial,
        outputs: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, GapError> {
        let session = self.problem.session();
        let of = |column: &String| {
            let before = session.stages[..stage].iter().position(|s| s.output == *column);
            let known =
                course.channel(column).or(before.and_then(|at| outputs.get(at)).map(Vec::as_slice));
            known.map(<[f64]>::to_vec).ok_or_else(|| {
                let stage = &session.stages[stage].name;
                let why = format!("{stage} is driven by {column}, the output of a later stage");
                GapError::simulator(SourceError::Refused(why))
            })
        };
        session.stages[stage].inputs.iter().map(of).collect()
    }

    /// Wrappers that act around a stage in an experiment, on one of its sides, with their values.
    fn around<'a>(
        &'a self,
        run: &Run<'a>,
        stage: usize,
        side: Side,
    ) -> Result<Vec<(usize, &'a Vec<f64>)>, GapError> {
        let all = self.acting_at(run, stage, side);
        let unpredicted = |(at, _): &&(usize, &Vec<f64>)| {
            !matches!(self.problem.wrappers[*at].kind.beside, Beside::Nothing | Beside::Itself)
        };
        match all.iter().find(unpredicted) {
            Some((at, _)) => {
                let name = &self.problem.wrappers[*at].name;
                let why = format!("{name} needs a column that no experiment predicts");
                Err(GapError::simulator(SourceError::Refused(why)))
            }
            None => Ok(all),
        }
    }

    /// The inputs of a stage in an experiment, after the wrappers in front of it have acted.
    fn driven_in(
        &self,
        run: &Run<'_>,
        stage: usize,
        course: &Trial,
        outputs: &[Vec<f64>],
    ) -> Result<Altered, GapError> {
        let mut columns = self.inputs_in(stage, course, outputs)?;
        for (at, values) in self.around(run, stage, Side::Input)? {
            let wrapper = &self.problem.wrappers[at];
            wrapper.act(values, &self.trials_of(), &mut [], &mut columns[wrapper.site.input]);
        }
        let mut hasher = DefaultHasher::new();
        columns.iter().flatten().for_each(|x| x.to_bits().hash(&mut hasher));
        let which = self.problem.unshared(stage).collect();
        Ok(Altered { stage, columns, which, how: vec![u64::MAX, hasher.finish()] })
    }
}

impl Laboratory for BlackBox {
    fn experiments(&self) -> Vec<Plan> {
        let all = self.driven();
        let dt_s = self.description().spec().dt_s;
        let lasts_s = self.problem.session().samples(1) as f64 * dt_s;
        if all.is_empty() || !self.runs.source().takes_inputs() {
            return Vec::new();
        }
        let mut candidates = Vec::new();
        for (at, d) in all.iter().enumerate().filter(|(_, d)| d.fastest > 0.0).take(MOVED) {
            for (name, how, points) in moving() {
                let scaled = lasting(&points, lasts_s);
                let (name, how) = match all.len() {
                    1 => (name.to_owned(), how.to_owned()),
                    _ => (format!("{name} of {}", d.name), format!("{how} By {}.", d.name)),
                };
                let trial = self.moved(&name, &all, Some((at, &scaled)));
                candidates.push(Plan { how, prepare_min: PREPARE_MIN, trial });
            }
        }
        let how = "Leave all inputs at their median: what changes does not come from motion.";
        let trial = self.moved("rest", &all, None);
        candidates.push(Plan { how: how.to_owned(), prepare_min: PREPARE_MIN, trial });
        candidates
    }

    /// Returns the measured inputs of the first trial.
    fn done(&self) -> Trial {
        let samples = self.problem.session().samples(1);
        let measured = |d: Driven| {
            let values = self.problem.columns.all(&d.name)[..samples].to_vec();
            (d.name, values)
        };
        even_trial("done", self.description().spec().dt_s, self.driven().into_iter().map(measured))
    }

    fn predict(&self, model: &Model, course: &Trial) -> Result<Vec<Vec<f64>>, GapError> {
        let session = self.problem.session();
        let trials = self.trials_of();
        let mut outputs: Vec<Vec<f64>> = Vec::new();
        for stage in 0..session.stages.len() {
            let run = Run::exact(stage, model, 1);
            let own = self.driven_in(&run, stage, course, &outputs)?;
            // A simulator with coupled stages needs the inputs of all stages, as far as these are
            // already predicted.
            let all = if self.is_coupled() { 0..session.stages.len() } else { 0..0 };
            let others = all.filter(|other| *other != stage);
            let others = others.filter_map(|s| self.driven_in(&run, s, course, &outputs).ok());
            let mut altered: Vec<Altered> = others.chain([own]).collect();
            altered.sort_by_key(|a| a.stage);
            let inner = self.driven_by(&run, altered);
            let answer = self.runs.outputs(&[inner], 0).pop();
            let answer = answer.unwrap_or_else(|| Err(SourceError::Gone("no answer".into())));
            let mut output =
                answer.map_err(|error| super::refused(error, self.least_runs()))?.to_vec();
            for (at, values) in self.around(&run, stage, Side::Output)? {
                self.problem.wrappers[at].act(values, &trials, &mut [], &mut output);
            }
            outputs.push(output);
        }
        for (stage, output) in outputs.iter_mut().enumerate() {
            let (low, high) = ends(self.measured(stage));
            let noise = self.problem.recorded[stage].noise.sd().max(LEAST_NOISE * (high - low));
            output.iter_mut().for_each(|y| *y /= noise);
        }
        Ok(outputs)
    }
}
