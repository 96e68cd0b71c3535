//! What earlier sessions say of the next one.
//!
//! [`Session`] sums a session with a reference up; [`Prior`] is learnt from sessions: mean and covariance of the
//! coefficients of one linear model with a memory, for each sensor and wearer that was seen and for those that were
//! not; [`Prior::update`] takes ten seconds to a minute of reference to it, or nothing at all; [`Prior::renew`] takes a
//! session without a reference to it, by the ends and rests of its movement.

mod expected;
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
