//! Verdicts that end a diagnosis with a status of their own.

use stretch_gap::{Diagnosis, VerdictKind};

/// What `stretch diagnose --fail-on` names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum FailOn {
    Effect,
    Unknown,
    Record,
    Faint,
    Parameters,
    Gap,
    Any,
}

impl FailOn {
    /// Whether a diagnosis is one of those.
    pub(super) fn covers(self, diagnosis: &Diagnosis) -> bool {
        use VerdictKind::{Effect, NoGap, Parameters, Partial, Record, Unknown};
        let verdict = diagnosis.verdict;
        match self {
            // a partial answer names an effect, and leaves what nothing explains
            Self::Effect => matches!(verdict, Effect | Partial),
            Self::Unknown => matches!(verdict, Unknown | Partial),
            Self::Record => verdict == Record,
            Self::Faint => diagnosis.is_faint(),
            Self::Parameters => verdict == Parameters,
            // what hides a gap is no agreement
            Self::Gap => !diagnosis.is_agreement(),
            Self::Any => verdict != NoGap || diagnosis.is_faint() || !diagnosis.is_agreement(),
        }
    }
}
