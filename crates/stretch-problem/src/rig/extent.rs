//! Ranges of the gauge in a measured session.

use stretch_sim::{Bridge, Effect, Extent, Key, Place, RigParams};

use super::session::Inputs;
use crate::bench::acting::FitRecord;

/// Share of the samples at either end of the voltage that are left out as noise.
const OUTERMOST: f64 = 0.002;

/// Ranges of voltage and strain over the trials that are fitted.
pub(super) struct Extents {
    volts: Extent,
    strain: Extent,
}

impl Extents {
    pub(super) fn of(params: &RigParams, inputs: &Inputs, bridge: &FitRecord) -> Self {
        let mut volts: Vec<f64> = bridge.samples().collect();
        volts.sort_by(f64::total_cmp);
        let at = |q: f64| volts[(q * (volts.len() - 1) as f64) as usize];
        let strain = Bridge::new(params).strain(inputs.stroke.0);
        Self {
            volts: Extent::between(at(OUTERMOST), at(1.0 - OUTERMOST)),
            strain: Extent::between(strain, params[Key::E0]),
        }
    }

    /// The range of the channel that an effect acts on.
    pub(super) fn at(&self, effect: &Effect) -> &Extent {
        match effect.at() {
            Some((_, Place::Volts)) => &self.volts,
            _ => &self.strain,
        }
    }
}
