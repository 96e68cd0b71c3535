//! Priors: distributions that are learnt from earlier sessions and predict a new one.
//!
//! A [`Session`] holds the sums of a session with a reference. A [`Prior`] is learnt from sessions.
//! It contains the mean and covariance of the coefficients of one linear model with a memory, for
//! each known sensor and wearer and for unknown ones. [`Prior::update`] makes a calibration from a
//! prior and ten seconds to a minute of reference, or from the prior alone. [`Prior::renew`] makes
//! one from a prior and a session without a reference, by the ends and rests of its movement.

mod expected;
mod gauges;
mod landmarks;
mod learnt;
mod record;
mod renew;
mod session;
#[cfg(test)]
mod tests;
mod tree;
mod update;

pub use expected::Expected;
pub(crate) use learnt::LEAST_SESSIONS;
pub use learnt::Prior;
pub use renew::{Assumed, RenewSummary};
pub use session::Session;
pub use update::UpdateSummary;
