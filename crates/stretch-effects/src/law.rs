//! Laws of the rig that an effect may bend.

use core::fmt;

/// A memoryless law y = f(x).
pub trait Law: fmt::Debug + Send + Sync {
    /// Its value at `x`.
    fn at(&self, x: f64) -> f64;
}

/// A pressure that the supply loses to the flow drawn from it: y' = rate(y, flow).
pub trait Droop: fmt::Debug + Send + Sync {
    /// Rate of the droop, Pa/s, at the droop y (Pa) and the flow through the inlet (kg/s).
    fn rate(&self, droop_pa: f64, flow_kg_s: f64) -> f64;
    /// What is left of it after `rest_s` seconds without flow.
    fn relaxed(&self, droop_pa: f64, rest_s: f64) -> f64;
}
