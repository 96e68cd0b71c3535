//! What a report of a diagnosis is about.

use stretch_bench::Implementation;
use stretch_gap::{Diagnosis, Evidence, Simulator};

/// What a report is about.
#[derive(Clone, Copy)]
pub(crate) struct Subject<'a> {
    /// What the data are called.
    pub(crate) name: &'a str,
    /// What was found.
    pub(crate) diagnosis: &'a Diagnosis,
    /// What it was found from.
    pub(crate) evidence: &'a Evidence,
    /// What is named, as something to type.
    pub(crate) implementations: &'a [Implementation],
    /// The simulator beside its measurements.
    pub(crate) simulator: &'a dyn Simulator,
}
