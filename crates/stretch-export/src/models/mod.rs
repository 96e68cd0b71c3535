//! One file a model and form: from its numbers to its constants and step.
//!
//! A further model is a file here, its step in `../c`, and an arm in `../export.rs`. Several gauges are a model of their own.

mod array_float;
mod diagnosed_float;
mod observer_fixed;
mod observer_float;
mod surfaces_fixed;
mod surfaces_float;
mod zero_float;

pub(crate) use array_float::array_float;
pub(crate) use diagnosed_float::diagnosed_float;
pub(crate) use observer_fixed::observer_fixed;
pub(crate) use observer_float::observer_float;
pub(crate) use surfaces_fixed::surfaces_fixed;
pub(crate) use surfaces_float::surfaces_float;
pub(crate) use zero_float::with_zero;
