//! Where and how an effect acts, and what it may need to know of the rig around it.

use stretch_effects::{Grid, Operator, SkewSpec};

use crate::{
    law::{Droop, Law},
    params::{Key, RigParams},
    sketch::Quantity,
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
    pub fn of_rig(params: &RigParams, grid: &'a Grid) -> Self {
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

    /// Those of a gauge alone, in units of its range and its span.
    pub(crate) fn of_gauge(pressure_scale: Option<f64>, strain_unit: f64, grid: &'a Grid) -> Self {
        Self {
            grid,
            strain_scale: 1.0,
            strain_stroke: 1.0,
            contraction_stroke: 1.0,
            resistance_zero: 1.0,
            length_zero: 0.0,
            length_span: 1.0,
            pressure_scale_kpa: pressure_scale.unwrap_or(1.0),
            strain_unit,
            least_opening: 0.0,
        }
    }

    /// A signal of the rig, or what stands in its place in a gauge alone.
    fn signal(&self, rig: (&'static str, &'static str), alone: &'static str) -> Quantity {
        match self.strain_unit == 1.0 {
            true => Quantity::new("x", rig.0, rig.1),
            false => Quantity::new("x", "1", alone),
        }
    }

    /// What effects on the strain act on.
    pub(crate) fn strain(&self) -> Quantity {
        let rig = ("strain", "gauge strain e, before the resistance");
        self.signal(rig, "e = (reference - zero)/span")
    }

    /// The strain where an effect on the resistance needs it.
    pub(crate) fn strain_beside(&self) -> Quantity {
        let meaning = "gauge strain e, as the effects on it leave it";
        Quantity { name: "e", meaning, ..self.strain() }
    }

    /// What effects on the resistance act on.
    pub(crate) fn resistance(&self) -> Quantity {
        let rig = ("ohm", "resistance R of the gauge, before the bridge");
        self.signal(rig, "1 + e, where the signal is offset + gain e")
    }

    /// What effects on the voltage act on.
    pub(crate) fn volts(&self) -> Quantity {
        let rig = ("V", "amplified voltage v");
        self.signal(rig, "(signal - offset)/gain")
    }

    /// What effects on recorded samples act on.
    pub(crate) fn record(&self) -> Quantity {
        let rig = ("V", "amplified voltage, sample by sample, before it is recorded");
        let name = "v";
        Quantity {
            name,
            ..self.signal(rig, "(signal - offset)/gain, sample by sample, before it is recorded")
        }
    }

    /// What effects on the reference act on.
    pub(crate) fn length(&self) -> Quantity {
        let rig = ("mm", "true length, before the reference shows it");
        self.signal(rig, "e as it is, before the reference shows it")
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
