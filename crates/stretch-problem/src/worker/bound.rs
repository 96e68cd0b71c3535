//! A problem and the workers of its simulator, bound together.

use super::pool::{Workers, WorkersSpec};
use crate::{
    black_box::{
        checked::Checked,
        source::Source,
        spec::{ONLY_BEHIND, ProblemSpec},
    },
    error::ProblemError,
};

impl Workers {
    /// Checks a problem, starts the workers of its simulator, and fits the problem to what they say of themselves: effects on the states
    /// that they declare are looked for, and nothing in front of a stage where they take no altered inputs.
    ///
    /// # Errors
    /// A problem that does not do, workers that cannot be started, effects on states that nobody declares.
    pub fn bound(spec: ProblemSpec, workers: WorkersSpec) -> Result<(Checked, Self), ProblemError> {
        let mut bare = spec.clone();
        bare.wrap.retain(|name| !name.starts_with("state."));
        let mut checked = Checked::new(bare)?;
        let mut source = Self::start(workers.clone(), checked.session())?;
        let mut spec = spec.with_states(source.states())?;
        if spec.effects.len() > checked.session().effects.len() {
            // the session of the first worker knows nothing of its states' effects
            drop(source);
            checked = Checked::new(spec.clone())?;
            source = Self::start(workers, checked.session())?;
        }
        if !source.takes_inputs()
            && let Some(behind) = spec.only_behind()
        {
            spec = behind;
            checked = Checked::new(spec)?.noting(ONLY_BEHIND);
        }
        Ok((checked, source))
    }
}
