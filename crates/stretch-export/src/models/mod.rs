//! One file per model: it turns the model's numbers into constants and selects the step, in integers and in `float`.
//!
//! To add a model, add a file here, its step in `../c`, and an arm in `../export.rs`. Several gauges count as a
//! separate model.

mod array_float;
mod diagnosed_float;
mod observer;
mod surfaces;

pub(crate) use array_float::array_float;
pub(crate) use diagnosed_float::diagnosed_float;
pub(crate) use observer::{observer_fixed, observer_float};
pub(crate) use surfaces::{surfaces_fixed, surfaces_float};
