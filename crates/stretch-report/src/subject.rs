//! The subject of a report: a diagnosis and its simulator.

use std::fmt;

use stretch_gap::{Diagnosis, Evidence, Simulator};
use stretch_problem::{ByTrial, Examined, Implementation, Problem};

/// The subject of a report.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Name of the data.
    pub name: &'a str,
    /// The diagnosis.
    pub diagnosis: &'a Diagnosis,
    /// The evidence of the diagnosis.
    pub evidence: &'a Evidence,
    /// The named effects as code.
    pub implementations: &'a [Implementation],
    /// The simulator with its measurements.
    pub simulator: &'a dyn Simulator,
    /// The fits of every run by itself, if they were requested.
    pub by_trial: Option<&'a ByTrial>,
}

impl<'a> Subject<'a> {
    /// The subject of an examined problem.
    pub fn of(problem: &'a Problem, examined: &'a Examined) -> Self {
        let Examined { name, diagnosis, evidence, implementations, .. } = examined;
        let simulator = problem.simulator();
        Self { name, diagnosis, evidence, implementations, simulator, by_trial: None }
    }

    /// Returns the subject with the fits of every run by itself.
    #[must_use]
    pub fn by_trial(self, by_trial: Option<&'a ByTrial>) -> Self {
        Self { by_trial, ..self }
    }
}

impl fmt::Debug for Subject<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, diagnosis, .. } = self;
        f.debug_struct("Subject")
            .field("name", name)
            .field("diagnosis", diagnosis)
            .finish_non_exhaustive()
    }
}
