//! Where and how an effect acts, and what it may need to know of the rig around it.

use stretch_operators::{Grid, Operator, SkewSpec};

use crate::{
    law::{Droop, Law},
    params::{Key, RigParams},
};

/// What an effect may need to know of the rig it acts in.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// Steps of time.
    pub grid: &'a Grid,
    /// Strain that stands for e0: the pre-stretch, 1 for a gauge alone.
    pub strain_scale: f64,
    /// Stroke of the strain, for what is wound by a move: (1 + e0) k_max, 1 for a gauge alone.
    pub strain_stroke: f64,
    /// Stroke of the contraction: k_max.
    pub contraction_stroke: f64,
    /// Resistance at zero strain: R0, 1 for a gauge alone.
    pub resistance_zero: f64,
    /// Length (or reference) at which y = 0.
    pub length_zero: f64,
    /// Change of the length (or reference) from y = 0 to y = 1, with its sign.
    pub length_span: f64,
    /// Reference pressure, kPa.
    pub pressure_scale_kpa: f64,
    /// What one unit of strain of the catalogue is in the signal: 1, or its share of the range for a gauge alone.
    pub strain_unit: f64,
    /// Share of the conductance of a barely open valve.
    pub least_opening: f64,
}

impl<'a> Surroundings<'a> {
    /// Those of the whole rig.
    pub(crate) fn of_rig(params: &RigParams, grid: &'a Grid) -> Self {
        let (stretch, k_max) = (1.0 + params[Key::E0], params[Key::KMax]);
        Self {
            grid,
            strain_scale: params[Key::E0],
            strain_stroke: stretch * k_max,
            contraction_stroke: k_max,
            resistance_zero: params[Key::R0],
            length_zero: params[Key::L0],
            length_span: -params[Key::L0] * k_max,
            pressure_scale_kpa: 1e-3 * params[Key::PRef],
            strain_unit: 1.0,
            least_opening: params[Key::UMin],
        }
    }
}

/// Where and how an effect acts, once its values are known.
#[derive(Debug)]
#[non_exhaustive]
pub enum Action {
    /// Nowhere.
    Nothing,
    /// Openings act later, s.
    Delay(f64),
    /// Commanded openings of inlet and outlet, sample by sample, before the least conductance.
    Commands([Box<dyn Operator>; 2]),
    /// The supply gives way to the flow.
    Droop(Box<dyn Droop>),
    /// Gauge pressure (Pa) to a mass flow out of the chamber (kg/s).
    Leak(Box<dyn Law>),
    /// k/k_max to V/V0.
    Volume(Box<dyn Law>),
    /// Static contraction k_s, before the lag.
    StaticContraction(Box<dyn Operator>),
    /// Moving contraction, behind the lag.
    MovingContraction(Box<dyn Operator>),
    /// Gauge strain.
    Strain(Box<dyn Operator>),
    /// Resistance; the span holds the strain.
    Resistance(Box<dyn Operator>),
    /// Amplified voltage.
    Volts(Box<dyn Operator>),
    /// Samples of the bridge show the voltage of some time earlier.
    Skew(SkewSpec),
    /// Recorded samples of the bridge, after a skew.
    Record(Box<dyn Operator>),
    /// Length as the reference sees it, mm.
    Length(Box<dyn Operator>),
}
