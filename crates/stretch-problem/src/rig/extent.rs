//! What the screens need to know of a measured session.

use stretch_sim::{Bridge, Extent, RigParams};

use super::session::Inputs;
use crate::bench::acting::FitRecord;

/// Share of the samples beyond either end of the voltage: noise.
const OUTERMOST: f64 = 0.002;

/// Voltages and strains that the trials to fit span.
pub(super) fn extent_of(params: &RigParams, inputs: &Inputs, bridge: &FitRecord) -> Extent {
    let mut volts: Vec<f64> = bridge.samples().collect();
    volts.sort_by(f64::total_cmp);
    let at = |q: f64| volts[(q * (volts.len() - 1) as f64) as usize];
    let strain = Bridge::new(params).strain(inputs.stroke.0);
    Extent { volts: (at(OUTERMOST), at(1.0 - OUTERMOST)), strain }
}
