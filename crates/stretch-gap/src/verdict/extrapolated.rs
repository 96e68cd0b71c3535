//! Named effects that are laws of session time, on test trials that lie outside the time that was fitted.
//!
//! How a drift goes on is an assumption of its law: within the fitted span one law is as good as another, beyond it each goes its own way. So a
//! gap that is left there is told as what it may be.

use crate::problem::{
    sample_roles::{Role, SampleRoles},
    simulator::Simulator,
};

/// Share of the fitted span by which test trials must lie outside of it.
const BEYOND: f64 = 0.1;

/// A note for each named effect that was extrapolated: from where to where.
pub(crate) fn extrapolated(
    simulator: &dyn Simulator,
    roles: &SampleRoles,
    named: &[String],
) -> Vec<String> {
    let drifts = |name: &&String| {
        simulator.effects().iter().any(|effect| effect.name == **name && effect.drifts)
    };
    let fitted = span_s(simulator, roles, |role| role != Role::Test);
    let tested = span_s(simulator, roles, |role| role == Role::Test);
    let least = BEYOND * (fitted[1] - fitted[0]);
    let is_beyond = fitted[0] - tested[0] > least || tested[1] - fitted[1] > least;
    let note = |name: &String| {
        format!(
            "{name} is a law of session time: it was fitted from {:.0} to {:.0} s and extrapolated to the test trials, from {:.0} to {:.0} s; \
             a drift of another law is far off there",
            fitted[0], fitted[1], tested[0], tested[1]
        )
    };
    named.iter().filter(drifts).filter(|_| is_beyond).map(note).collect()
}

/// Session time of the first and behind the last sample in some roles, s.
fn span_s(
    simulator: &dyn Simulator,
    roles: &SampleRoles,
    is_in: impl Fn(Role) -> bool,
) -> [f64; 2] {
    let (trials, dt_s) = (simulator.trials(), simulator.dt_s());
    let own = roles.segments.iter().filter(|s| is_in(s.role));
    own.fold([f64::INFINITY, f64::NEG_INFINITY], |[first, last], s| {
        let before: usize = trials[..s.trial].iter().map(|t| t.samples).sum();
        let at = |sample: usize| trials[s.trial].start_s + (sample - before) as f64 * dt_s;
        [first.min(at(s.from)), last.max(at(s.to))]
    })
}
