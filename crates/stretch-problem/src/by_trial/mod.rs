//! Fits every run separately and tests which values differ from run to run. A run is a trial, or
//! all samples in which a column has one value.

mod groups;
mod heterogeneity;

use serde::Serialize;
use stretch_gap::{GapError, SampleFit, SampleValue, Simulator, fit_samples};

use crate::{error::ProblemError, examine::Examined, problem::Problem};
use groups::Group;

pub use heterogeneity::{Apart, Heterogeneity, q_values};

/// Fit to one run, or to all runs together.
#[derive(Debug, Clone, Serialize)]
pub struct RunFit {
    /// Name of the run; `all` for all runs together.
    pub run: String,
    /// Root mean square error in multiples of the noise with these values.
    pub times_noise: f64,
    /// The same error with the values from the fit to all runs together.
    pub times_noise_of_all: f64,
    /// The values: parameters stage by stage, then the numbers of the effects.
    pub values: Vec<SampleValue>,
}

/// Whether runs agree, by value and by run. Its serde form is the key `by_trial` of a diagnosis' JSON.
#[derive(Debug, Clone, Serialize)]
pub struct ByTrial {
    /// `trial` if each run is a trial, or the column that defines the runs.
    pub by: String,
    /// All runs fitted together.
    pub all: RunFit,
    /// Every run by itself.
    pub runs: Vec<RunFit>,
    /// For each value, the test of whether it is the same in all runs that determine it.
    pub values: Vec<Heterogeneity>,
    /// Runs that differ from the others.
    pub apart: Vec<Apart>,
}

impl ByTrial {
    /// The findings in sentences: which values differ, which run has another set-up, and which
    /// values are poorly determined.
    pub fn sentences(&self) -> Vec<String> {
        let differ = self.values.iter().filter(|v| v.differs);
        let mut out: Vec<String> = differ.map(Heterogeneity::sentence).collect();
        out.extend(self.apart.iter().map(Apart::sentence));
        if out.is_empty() {
            out.push(format!(
                "the {} runs agree within their intervals in every value that they determine",
                self.runs.len()
            ));
        }
        out.extend(self.all.values.iter().filter_map(|v| v.identified.sentence()));
        out
    }
}

impl Problem {
    /// Fits every run of an examined problem separately, and tests which runs disagree in which
    /// values. The fit has the nominal parameters within their tolerances, and the parameters of
    /// the named effects.
    ///
    /// Values are maximum a posteriori (Levenberg-Marquardt), their covariance is that of the linearised fit times
    ///
    /// ```text
    /// max(1, X tau),     X = mean (r/noise)^2,     tau = 1 + 2 sum of the residual's autocorrelations while they are positive
    /// ```
    ///
    /// so that a correlated error counts as fewer observations. The effects are those that the
    /// diagnosis names; their forms keep the values of the diagnosis. Test trials are fitted as
    /// well, because the verdict is already given.
    ///
    /// # Errors
    /// A simulator whose nuisance parameters cannot be fitted for each run (the built-in rig), a
    /// single run, and errors of the simulator.
    pub fn by_trial(
        &self,
        examined: &Examined,
        progress: &(dyn Fn(&str) + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<ByTrial, GapError> {
        let trials = self.simulator().trials();
        if trials.len() < 2 {
            return refused("there is only one run");
        }
        compared(self.simulator(), ("trial", &groups::by_trial(trials)), examined, progress, stop)
    }

    /// As [`Problem::by_trial`], but a run is all samples in which a column has one value, from any
    /// trial. The column may be a load or a voltage that was set, or a tension that was measured.
    ///
    /// - A column that is set (held from sample to sample, with twelve values at most) gives one
    ///   run for each value.
    /// - A measured column that differs from trial to trial gives one run for the trials of each
    ///   set-up.
    /// - A column that moves within trials gives four runs of equal size.
    ///
    /// Samples of a run that are not adjacent are treated as if they were, which underestimates how
    /// long an error is correlated.
    ///
    /// # Errors
    /// As [`Problem::by_trial`]; a column that was not recorded, or never changes.
    pub fn by_column(
        &self,
        column: &str,
        examined: &Examined,
        progress: &(dyn Fn(&str) + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<ByTrial, GapError> {
        let simulator = self.simulator();
        let Some(values) = self.source().column(column) else {
            return refused(&format!("no recording has a column {column}"));
        };
        let groups = groups::by_column(column, &values, simulator.trials());
        if groups.len() < 2 {
            return refused(&format!("{column} never changes"));
        }
        compared(simulator, (column, &groups), examined, progress, stop)
    }
}

fn refused<T>(why: &str) -> Result<T, GapError> {
    Err(GapError::simulator(ProblemError::too_little(why, HINT)))
}

fn compared(
    simulator: &dyn Simulator,
    (by, groups): (&str, &[Group]),
    examined: &Examined,
    progress: &(dyn Fn(&str) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<ByTrial, GapError> {
    let is_nuisance = |p: &stretch_gap::ParameterSpec| {
        p.drift.is_some() || p.per_trial_sd.is_some() || p.per_tick_sd.is_some()
    };
    if simulator.parameters().iter().any(is_nuisance) {
        return refused(
            "the runs share parameters that drift or differ between trials, so they cannot be fitted separately",
        );
    }
    let Examined { diagnosis, evidence, .. } = examined;
    let found = evidence.candidates.first().filter(|_| !diagnosis.named().is_empty());
    let mut start = found.unwrap_or(&evidence.retuned).clone();
    start.effects.retain(|(e, _)| diagnosis.named().contains(&simulator.effects()[*e].name));
    let noise: Vec<f64> = evidence.stages.iter().map(|s| s.noise).collect();
    progress("fitting all runs together");
    let samples: usize = simulator.trials().iter().map(|t| t.samples).sum();
    let whole: Vec<usize> = (0..samples).collect();
    let all = fit_samples(simulator, &noise, &whole, &start, stop)?;
    let mut runs = Vec::new();
    for (i, group) in groups.iter().enumerate() {
        progress(&format!("fitting run {} of {}", i + 1, groups.len()));
        let fit = fit_samples(simulator, &noise, &group.samples, &all.model, stop)?;
        runs.push((group.name.clone(), fit));
    }
    let values = heterogeneity::values(&runs);
    let apart = heterogeneity::apart(&runs);
    let run_fit = |(run, fit): (String, SampleFit)| RunFit {
        run,
        times_noise: fit.times_noise,
        times_noise_of_all: fit.times_noise_of_start,
        values: fit.values,
    };
    let all = RunFit { times_noise_of_all: all.times_noise, ..run_fit(("all".to_owned(), all)) };
    let runs = runs.into_iter().map(run_fit).collect();
    Ok(ByTrial { by: by.to_owned(), all, runs, values, apart })
}

/// Advice if runs cannot be compared.
const HINT: &str = "comparing runs needs a simulator of your own or a gauge alone, with at least two recordings or a recorded column that changes";
