//! The aggregates in SQL, compared with the underlying fits.

mod damage;
mod groups;
mod refusals;
mod support;
mod truth;
