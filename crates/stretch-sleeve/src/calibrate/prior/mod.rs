//! Priors: predictions for a new session from earlier ones.
//!
//! [`Session`] sums up a session with a reference. [`Prior`] is learnt from sessions: mean and
//! covariance of the coefficients of one linear model with a memory, for each sensor and wearer
//! that was seen and for unseen ones. [`Prior::update`] adds ten seconds to a minute of reference,
//! or nothing at all. [`Prior::renew`] adds a session without a reference, by the ends and rests of
//! its movement.

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

pub use expected::{ErrorSpread, Expected};
pub use learnt::Prior;
pub use renew::{Assumed, RenewOptions, RenewSummary, Renewed};
pub use session::{Session, SessionOptions};
pub use update::{UpdateOptions, UpdateSummary, Updated};
