//! What a report of a diagnosis is about.

use std::fmt;

use stretch_gap::{Diagnosis, Evidence, Simulator};
use stretch_problem::{Examined, Implementation, Problem};

/// What a report is about.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// What the data are called.
    pub name: &'a str,
    /// What was found.
    pub diagnosis: &'a Diagnosis,
    /// What it was found from.
    pub evidence: &'a Evidence,
    /// What is named, as something to type.
    pub implementations: &'a [Implementation],
    /// The simulator beside its measurements.
    pub simulator: &'a dyn Simulator,
}

impl<'a> Subject<'a> {
    /// A problem that was examined.
    pub fn of(problem: &'a Problem, examined: &'a Examined) -> Self {
        let Examined { name, diagnosis, evidence, implementations, .. } = examined;
        Self { name, diagnosis, evidence, implementations, simulator: problem.simulator() }
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
