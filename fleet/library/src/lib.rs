#![doc = include_str!("../README.md")]

mod about;
mod answer;
mod estimate;
mod fit;
mod one;
mod state;
mod triangles;

use std::sync::Arc;

use datafusion::{
    logical_expr::{AggregateUDF, ScalarUDF},
    prelude::SessionContext,
};

pub use about::{RATE_ESTIMATOR_KEY, SAMPLE_RATE_KEY};
pub use state::{STATE_VERSION, StateError, poly13_factors};

/// Release of the functions. All machines that take part in a query must have the same release.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Returns the aggregate functions, for a session or the registry of an executor.
pub fn aggregates() -> Vec<Arc<AggregateUDF>> {
    fit::functions().collect()
}

/// Returns the scalar functions, for a session or the registry of an executor.
pub fn scalars() -> Vec<Arc<ScalarUDF>> {
    vec![estimate::function()]
}

/// Registers all functions in a session.
pub fn register(session: &SessionContext) {
    for aggregate in aggregates() {
        session.register_udaf(aggregate.as_ref().clone());
    }
    for scalar in scalars() {
        session.register_udf(scalar.as_ref().clone());
    }
}
