//! What a lab does with its trials: calibrate, judge, and ask why the simulator disagrees.

use indicatif::{MultiProgress, ProgressBar};
use stretch_calibrate::{
    Calibrated, Candidate, Evaluation, MethodErrors, ModelChoice, ModelKind, Options, calibrate,
    choose_model, evaluate, rank_signals,
};
use stretch_data::{Trial, TrialKind};
use stretch_problem::{Examined, Problem};

use super::sessions::Sessions;
use crate::commands::{diagnose::told_on, shared::spinner};

/// Everything that was found.
pub(super) struct Job {
    /// Signals by error, the best first.
    pub(super) ranking: Vec<Candidate>,
    pub(super) problem: Problem,
    pub(super) examined: Examined,
    pub(super) calibrations: Calibrations,
}

/// The paper's two calibrations, the chosen one, and their errors on the test trials.
pub(super) struct Calibrations {
    pub(super) linear: Calibrated,
    pub(super) surfaces: Calibrated,
    pub(super) chosen: Calibrated,
    pub(super) choice: ModelChoice,
    /// What the chosen one is called.
    pub(super) name: String,
    pub(super) evaluation: Evaluation,
    /// Errors by kind of trial, where there are several.
    pub(super) kinds: Vec<(String, Vec<MethodErrors>)>,
}

impl Job {
    /// # Errors
    /// Trials that cannot be calibrated on or diagnosed.
    pub(super) fn of(sessions: &Sessions) -> anyhow::Result<Self> {
        let bars = MultiProgress::new();
        let [fitting, asking] = [(); 2].map(|()| bars.add(spinner()));
        let options = Options { reference: sessions.reference.clone(), ..Options::default() };
        let fit: Vec<Trial> = sessions.fit.iter().map(|(_, trial)| trial.clone()).collect();
        let ranking = match &sessions.signals[..] {
            [_] => Vec::new(),
            several => rank_signals(&fit, several, &options)?,
        };
        let best = ranking.first().map(|best| &best.signal).or(sessions.signals.first());
        let options = Options { signal: best.cloned().unwrap_or_default(), ..options };
        // neither waits for the other
        let (calibrations, examined) = std::thread::scope(|scope| {
            let asked = scope.spawn(|| -> anyhow::Result<(Problem, Examined)> {
                let problem = sessions.problem(&options.signal)?;
                let options = stretch_gap::Options { responses: true, ..Default::default() };
                let examined = problem.examine(&options, true, &told_on(&asking), &|| false)?;
                asking.finish_and_clear();
                Ok((problem, examined))
            });
            let calibrations = Calibrations::of(sessions, &fit, &options, &fitting);
            fitting.finish_and_clear();
            (calibrations, asked.join())
        });
        let (problem, examined) = match examined {
            Ok(examined) => examined?,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        Ok(Self { ranking, problem, examined, calibrations: calibrations? })
    }
}

impl Calibrations {
    fn of(
        sessions: &Sessions,
        fit: &[Trial],
        options: &Options,
        bar: &ProgressBar,
    ) -> anyhow::Result<Self> {
        bar.set_message("calibrating");
        let ramps = sessions.ramps();
        let linear = calibrate(&ramps, &Options { model: ModelKind::Linear, ..options.clone() })?;
        let surfaces = calibrate(&ramps, options)?;
        bar.set_message("choosing a model by cross-validation");
        let choice = choose_model(fit, options)?;
        let chosen = calibrate(fit, &Options { model: choice.model, ..options.clone() })?;
        let name = format!("chosen ({})", choice.model);
        bar.set_message("judging");
        let methods = [
            ("linear", &linear.calibration),
            ("non-linear", &surfaces.calibration),
            (name.as_str(), &chosen.calibration),
        ];
        let test: Vec<Trial> = sessions.test.iter().map(|(_, trial)| trial.clone()).collect();
        let evaluation = evaluate(&methods, &test)?;
        let mut names: Vec<TrialKind> = sessions.test.iter().map(|(kind, _)| *kind).collect();
        names.sort();
        names.dedup();
        let mut kinds = Vec::new();
        for kind in names.iter().filter(|_| names.len() > 1) {
            let own = sessions.test.iter().filter(|(k, _)| k == kind);
            let trials: Vec<Trial> = own.map(|(_, trial)| trial.clone()).collect();
            kinds.push((kind.to_string(), evaluate(&methods, &trials)?.pooled));
        }
        Ok(Self { linear, surfaces, chosen, choice, name, evaluation, kinds })
    }

    /// By the names that the evaluation knows them by.
    pub(super) fn shown(&self) -> [(&str, &Calibrated); 3] {
        [("linear", &self.linear), ("non-linear", &self.surfaces), (&self.name, &self.chosen)]
    }
}
