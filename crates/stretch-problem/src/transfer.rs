//! Computes the cost of the gap (the difference between simulator and recording) for a calibration that is trained in
//! the simulator and used on the rig.
//!
//! The *transfer gap* is a difference of two errors on measured test trials: that of a calibration trained in the
//! simulator minus that of a calibration trained on measured trials. For a user it is more important than the
//! chi-square, because a true effect can close the gap without any change of the calibration's error.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use stretch_calibrate::{CalibrateError, ModelKind, Options, calibrate, evaluate_errors};
use stretch_core::Degree;
use stretch_data::{Trial, ends};
use stretch_gap::{
    Evidence, GapError, Model, Noise, RandomGenerator, Role, Run, SampleRoles, Simulator, Transfer,
    TransferError,
};

use crate::bench::even_trial;

const SIGNAL: &str = "signal";
const REFERENCE: &str = "reference";

/// The motion and the signal that a calibration is trained on or applied to, all trials concatenated.
struct Records {
    reference: Vec<f64>,
    signal: Vec<f64>,
}

/// Errors on the measured test trials of three calibrations. They were trained on the measured fit trials, in the
/// re-tuned simulator, and in the simulator with the effects. `None` if the simulator has no sensor, or if the
/// recordings do not determine a calibration.
///
/// In the simulator only the input of the first stage is measured. Each other stage runs on the output of the stage
/// before, and the simulated reference and signal get the known noise of their channels. If the sensor is the first
/// stage, the reference is the measured motion. Every run of a stage is added to `simulations`.
pub(crate) fn transfer(
    simulator: &dyn Simulator,
    evidence: &Evidence,
    (seed, simulations): (u64, &AtomicUsize),
) -> Result<Option<Transfer>, GapError> {
    let Some(sensor) = simulator.record().sensor else { return Ok(None) };
    let motion = simulator.motion().values;
    let real = Records { reference: motion.to_vec(), signal: simulator.measured(sensor).to_vec() };
    let first = &evidence.stages[0];
    let models = [(&evidence.retuned, &first.retuned), (&evidence.best, &first.after)];
    let simulated: Result<Vec<_>, GapError> = models
        .par_iter()
        .map(|(model, first)| {
            let chain = Chain { simulator, evidence, sensor, seed, simulations };
            chain.records(model, first)
        })
        .collect();
    let [Some(retuned), Some(best)] = &simulated?[..] else { return Ok(None) };
    let roles = &evidence.roles;
    let dt_s = simulator.dt_s();
    let trained = [&real, retuned, best].map(|records| trials(records, roles, dt_s, false));
    let tested = trials(&real, roles, dt_s, true);
    let (low, high) = ends(trained[0].iter().flat_map(|t| &t.channels[0].values));
    let scale = high - low;
    let kinds = [ModelKind::Linear, ModelKind::Surface(Degree::POLY13)];
    let jobs: Vec<_> = kinds.iter().flat_map(|k| trained.iter().map(move |t| (*k, t))).collect();
    let errors: Result<Vec<f64>, CalibrateError> =
        jobs.par_iter().map(|(kind, trained)| error(*kind, trained, &tested)).collect();
    let Ok(errors) = errors else { return Ok(None) };
    let of = |at: usize| TransferError {
        real: 100.0 * errors[at] / scale,
        sim: 100.0 * errors[at + 1] / scale,
        sim_with_effect: 100.0 * errors[at + 2] / scale,
    };
    let is_sound = scale > 0.0 && errors.iter().all(|e| e.is_finite());
    let unit = "percent_full_scale".to_owned();
    Ok(is_sound.then(|| Transfer { linear: of(0), poly13: of(3), unit }))
}

/// The stages of a simulator up to the sensor, each run on the output of the stage before.
struct Chain<'a> {
    simulator: &'a dyn Simulator,
    evidence: &'a Evidence,
    sensor: usize,
    seed: u64,
    /// Runs of a stage so far.
    simulations: &'a AtomicUsize,
}

impl Chain<'_> {
    /// Reference and signal of the fitted trials as a model simulates them, with `first` as the
    /// output of the first stage; `None` if a stage cannot run on the output of the stage before.
    fn records(&self, model: &Model, first: &[f64]) -> Result<Option<Records>, GapError> {
        let samples = self.evidence.roles.samples(self.evidence.roles.fit_trials);
        let mut output = first[..samples].to_vec();
        let mut before = None;
        for stage in 1..=self.sensor {
            let Some(next) = self.run_on(stage, model, &output)? else { return Ok(None) };
            before = Some(std::mem::replace(&mut output, next));
        }
        let reference = match before {
            Some(motion) => self.noisy(motion, self.sensor - 1),
            None => self.simulator.motion().values[..samples].to_vec(),
        };
        Ok(Some(Records { reference, signal: self.noisy(output, self.sensor) }))
    }

    /// The output of a stage on an input that was not measured; `None` if the stage cannot run on
    /// such an input.
    fn run_on(
        &self,
        stage: usize,
        model: &Model,
        input: &[f64],
    ) -> Result<Option<Vec<f64>>, GapError> {
        // Only the sum is read, and only after the work is done, so that no memory order is needed.
        self.simulations.fetch_add(1, Ordering::Relaxed);
        let run = Run::exact(stage, model, self.evidence.roles.fit_trials);
        let mut out = vec![0.0; input.len()];
        let run = Run { step: self.evidence.step, ..run };
        if !self.simulator.simulate_on(run, input, &mut out)? {
            return Ok(None);
        }
        match out.iter().position(|x| !x.is_finite()) {
            None => Ok(Some(out)),
            Some(at) => Err(GapError::not_finite(self.simulator, stage, (at, out[at]))),
        }
    }

    /// The output of a stage with the known noise of its channel.
    fn noisy(&self, mut values: Vec<f64>, stage: usize) -> Vec<f64> {
        let known = self.simulator.stages()[stage].noise.as_ref();
        let sd = known.map_or(self.evidence.stages[stage].noise, Noise::sd);
        let mut random = RandomGenerator::new(self.seed, 900 + stage as u64);
        values.iter_mut().for_each(|x| *x += sd * random.gauss());
        values
    }
}

/// The trials to train on, or the trials to test on.
fn trials(records: &Records, roles: &SampleRoles, dt_s: f64, is_test: bool) -> Vec<Trial> {
    let mut spans: Vec<(usize, usize, usize)> = Vec::new();
    for segment in roles.segments.iter().filter(|s| (s.role == Role::Test) == is_test) {
        match spans.last_mut() {
            Some((trial, _, to)) if *trial == segment.trial && *to == segment.from => {
                *to = segment.to;
            }
            _ => spans.push((segment.trial, segment.from, segment.to)),
        }
    }
    let part = |(trial, from, to): (usize, usize, usize)| {
        let column = |name: &str, values: &[f64]| (name.to_owned(), values[from..to].to_vec());
        let columns = [column(REFERENCE, &records.reference), column(SIGNAL, &records.signal)];
        even_trial(&format!("trial {}", trial + 1), dt_s, columns)
    };
    spans.into_iter().map(part).collect()
}

/// Root mean square error on the test trials of a calibration that runs live.
fn error(kind: ModelKind, trained: &[Trial], tested: &[Trial]) -> Result<f64, CalibrateError> {
    let options = Options {
        signal: SIGNAL.into(),
        reference: REFERENCE.into(),
        model: kind,
        ..Options::default()
    };
    let calibration = calibrate(trained, &options)?.calibration;
    Ok(evaluate_errors(&[("", &calibration)], tested)?.pooled[1].rmse)
}
