//! One file a model: from its numbers to its constants and step, in integers and in `float`.
//!
//! A further model is a file here, its step in `../c`, and an arm in `../export.rs`. Several gauges are a model of their own.

mod array_float;
mod diagnosed_float;
mod observer;
mod surfaces;

pub(crate) use array_float::array_float;
pub(crate) use diagnosed_float::diagnosed_float;
pub(crate) use observer::{observer_fixed, observer_float};
pub(crate) use surfaces::{surfaces_fixed, surfaces_float};
