//! Do the runs agree: every run fitted by itself, and what differs from run to run.

mod fit;
mod heterogeneity;
mod told;
mod unknowns;

use serde::Serialize;
use stretch_gap::{GapError, Simulator};

use crate::{error::ProblemError, examine::Examined, problem::Problem};
use fit::{Fit, Target};
use unknowns::Unknowns;

pub use heterogeneity::{Apart, Heterogeneity};
pub use told::{FittedValue, Standing};

/// What some runs say when they are fitted without the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunFit {
    /// Name of the run; of all runs together `all`.
    pub run: String,
    /// Root mean square error in multiples of the noise with these values.
    pub times_noise: f64,
    /// The same with the values of all runs together.
    pub times_noise_of_all: f64,
    /// The values, in the order of the problem's parameters, the effects' behind them.
    pub values: Vec<FittedValue>,
}

/// Whether runs agree, by value and by run. Its serde form is the key `by_trial` of a diagnosis' JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ByTrial {
    /// All runs fitted together.
    pub all: RunFit,
    /// Every run by itself.
    pub runs: Vec<RunFit>,
    /// By value: whether it is the same in all runs that tell it.
    pub values: Vec<Heterogeneity>,
    /// Runs that stand apart from the others.
    pub apart: Vec<Apart>,
}

impl ByTrial {
    /// What is found, in sentences: which values differ, and which run is another set-up.
    pub fn sentences(&self) -> Vec<String> {
        let differ = self.values.iter().filter(|v| v.differs);
        let mut out: Vec<String> = differ.map(Heterogeneity::sentence).collect();
        out.extend(self.apart.iter().map(Apart::sentence));
        if out.is_empty() {
            out.push(format!(
                "the {} runs agree in every value that they tell, within their intervals",
                self.runs.len()
            ));
        }
        let untold = self.all.values.iter().filter(|v| v.standing != Standing::Identified);
        out.extend(untold.map(|v| match v.standing {
            Standing::Absorbed => {
                format!("{} is absorbed by {}", v.name, v.absorbed_by.join(" and "))
            }
            _ => format!("{} is free: these runs say little more of it than its tolerance", v.name),
        }));
        out
    }
}

impl Problem {
    /// Fits every run of an examined problem by itself: nominal parameters within their tolerances, and the parameters of the named effects;
    /// and says which runs disagree, in what.
    ///
    /// Values are maximum a posteriori (Levenberg-Marquardt), their covariance is that of the linearised fit times
    ///
    /// ```text
    /// max(1, X tau),     X = mean (r/noise)^2,     tau = 1 + 2 sum of the residual's autocorrelations while they are positive
    /// ```
    ///
    /// so that an error that lasts counts as the fewer observations that it is. Effects are those that the diagnosis names; their forms stay
    /// as they were found. Test trials are fitted, too: the verdict stands when this is asked.
    ///
    /// # Errors
    /// A simulator whose nuisances cannot be fitted by run (the built-in rig), a single run, and what the simulator says.
    pub fn by_trial(
        &self,
        examined: &Examined,
        progress: &(dyn Fn(&str) + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<ByTrial, GapError> {
        by_trial(self.simulator(), examined, progress, stop)
    }
}

fn by_trial(
    simulator: &dyn Simulator,
    examined: &Examined,
    progress: &(dyn Fn(&str) + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<ByTrial, GapError> {
    let refused = |why: &str| Err(GapError::simulator(ProblemError::too_little(why, HINT)));
    let trials = simulator.trials();
    if trials.len() < 2 {
        return refused("there is one run");
    }
    let is_nuisance = |p: &stretch_gap::ParameterSpec| {
        p.drift.is_some() || p.per_trial_sd.is_some() || p.per_tick_sd.is_some()
    };
    if simulator.parameters().iter().any(is_nuisance) {
        return refused("its nuisances are of all runs together");
    }
    let unknowns = Unknowns::of(simulator, &examined.diagnosis, &examined.evidence);
    let noise: Vec<f64> = examined.evidence.stages.iter().map(|s| s.noise).collect();
    let target = |trials| Target { simulator, unknowns: &unknowns, noise: &noise, trials, stop };
    progress("all runs together");
    let start = unknowns.start();
    let whole = target(0..trials.len());
    let all = Fit::of(&whole, &start)?;
    let mut runs = Vec::new();
    for (i, trial) in trials.iter().enumerate() {
        progress(&format!("run {} of {}", i + 1, trials.len()));
        let own = target(i..i + 1);
        let fit = Fit::of(&own, &all.at)?;
        let of_all = own.times_noise(&all.at)?;
        runs.push((trial.name.clone(), fit, of_all));
    }
    let values = heterogeneity::values(&unknowns, &runs);
    let apart = heterogeneity::apart(&unknowns, &runs);
    let one = |(name, fit, of_all): &(String, Fit, f64)| RunFit {
        run: name.clone(),
        times_noise: fit.times_noise,
        times_noise_of_all: *of_all,
        values: told::values(&unknowns, fit),
    };
    let together = ("all".to_owned(), all.clone(), all.times_noise);
    Ok(ByTrial { all: one(&together), runs: runs.iter().map(one).collect(), values, apart })
}

/// What to do where runs cannot be told apart.
const HINT: &str = "runs are compared of a simulator of your own, or of a gauge alone, with two recordings or more";
