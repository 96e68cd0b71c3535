//! Places in a rig at which effects act, and the properties of the rig that effects need.

use alloc::boxed::Box;
use core::fmt;

use crate::{
    extent::Extent,
    grid::Grid,
    kind::{Kind, Signals},
    operator::Operator,
    sketch::Quantity,
    skew::SkewSpec,
};

/// A stage of the rig: a part that is simulated alone on a measured input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RigStage {
    /// Valve openings to pressure.
    Pneumatics,
    /// Pressure to length.
    Muscle,
    /// Valve openings to length: pneumatics and muscle as one stage.
    Actuation,
    /// Length (and pressure, for cross-talk) to bridge voltage.
    Sensing,
    /// True length to measured length.
    Reference,
}

impl RigStage {
    /// All stages.
    pub const ALL: [Self; 5] =
        [Self::Pneumatics, Self::Muscle, Self::Actuation, Self::Sensing, Self::Reference];

    /// Name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pneumatics => "pneumatics",
            Self::Muscle => "muscle",
            Self::Actuation => "actuation",
            Self::Sensing => "sensing",
            Self::Reference => "reference",
        }
    }

    /// Whether an effect or a parameter of the stage `other` acts in this stage: `actuation` holds `pneumatics` and
    /// `muscle`.
    pub fn holds(self, other: Self) -> bool {
        self == other
            || (self == Self::Actuation && matches!(other, Self::Pneumatics | Self::Muscle))
    }
}

impl fmt::Display for RigStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The place in a rig at which a kind acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Static contraction of the muscle, before the muscle's lag.
    StaticContraction,
    /// Contraction of the muscle, after the muscle's lag.
    MovingContraction,
    /// Gauge strain.
    Strain,
    /// Resistance of the gauge, with the strain as the second signal.
    Resistance,
    /// Amplified voltage.
    Volts,
    /// Sampling times of the bridge: a skew in seconds and its rate.
    Sampling,
    /// Recorded samples of the bridge, after the skew has been applied.
    Record,
    /// Length before the reference measures it.
    Length,
}

/// Strain over the full stroke of the catalogue's rig.
const STROKE: f64 = 0.2;

impl Place {
    /// Returns the action of a kind at this place.
    pub(crate) fn action(self, kind: &Kind, values: &[f64], around: &Surroundings<'_>) -> Action {
        if self == Self::Sampling {
            return Action::Skew(SkewSpec { skew_s: values[0], rate: values[1], empty: 0.0 });
        }
        let operator = (kind.operator)(values, &self.extent(around), around.grid);
        Action::At(self, operator)
    }

    /// Returns the range of the signal at this place.
    pub(crate) fn extent(self, around: &Surroundings<'_>) -> Extent {
        let strain = around.strain_scale;
        match self {
            Self::StaticContraction | Self::MovingContraction => {
                Extent::between(0.0, around.contraction_stroke)
            }
            Self::Strain => Extent::between(0.0, around.strain_stroke),
            Self::Resistance => Extent {
                beside: [strain - STROKE * around.strain_unit, strain],
                ..Extent::between(around.resistance_zero, 2.0 * around.resistance_zero)
            },
            // A voltage has no bounds here; only an effect on it (saturation) sets them.
            Self::Volts | Self::Sampling | Self::Record => {
                Extent::between(f64::NEG_INFINITY, f64::INFINITY)
            }
            Self::Length => {
                Extent::between(around.length_zero, around.length_zero + around.length_span)
            }
        }
    }

    /// Returns the signals in the code of a kind at this place.
    pub(crate) fn signals(self, around: &Surroundings<'_>) -> Signals {
        let x = match self {
            Self::StaticContraction => STATIC,
            Self::MovingContraction => MOVING,
            Self::Strain => around.strain(),
            Self::Resistance => around.resistance(),
            Self::Volts => around.volts(),
            Self::Sampling | Self::Record => around.record(),
            Self::Length => around.length(),
        };
        Signals {
            x,
            beside: around.strain_beside(),
            load: Quantity::LOAD,
            dt_s: around.grid.dt_s(),
        }
    }
}

/// Contraction before the lag of the muscle.
const STATIC: Quantity =
    Quantity::new("x", "1", "static contraction k_s, before the lag of the muscle");
/// Contraction after the lag.
const MOVING: Quantity = Quantity::new("x", "1", "contraction k, behind the lag of the muscle");

/// Properties of the rig that effects in it need.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// Grid of integration steps.
    pub grid: &'a Grid,
    /// Strain that is used as e0. In a rig it is the pre-stretch; for a gauge without its rig it is 1.
    pub strain_scale: f64,
    /// Range of the strain over the stroke, (1 + e0) k_max; 1 for a gauge without its rig. States that are left
    /// by motion before the recording are multiples of this range.
    pub strain_stroke: f64,
    /// Stroke of the contraction: k_max.
    pub contraction_stroke: f64,
    /// Resistance at zero strain: R0; 1 for a gauge without its rig.
    pub resistance_zero: f64,
    /// Length (or reference) at which the normalised length y is 0.
    pub length_zero: f64,
    /// Change of the length (or reference) from y = 0 to y = 1, with its sign.
    pub length_span: f64,
    /// Reference pressure, kPa.
    pub pressure_scale_kpa: f64,
    /// One unit of strain of the catalogue, in the unit of the signal. In a rig it is 1; for a gauge without its rig it
    /// is 1 over the strain of the stroke.
    pub strain_unit: f64,
    /// Conductance of a barely open valve, as a share of the full conductance.
    pub least_opening: f64,
}

impl<'a> Surroundings<'a> {
    /// Full strokes of the rig in strain, mm and V. For a gauge without its rig, the ranges of the rig's catalogue are
    /// divided by these strokes.
    pub const STROKES: [(&'static str, f64); 3] = [("strain", STROKE), ("mm", 30.0), ("V", 1.07)];

    /// Properties of a gauge without its rig, in units of its range and its span.
    pub fn of_gauge(pressure_scale: Option<f64>, grid: &'a Grid) -> Self {
        Self {
            grid,
            strain_scale: 1.0,
            strain_stroke: 1.0,
            contraction_stroke: 1.0,
            resistance_zero: 1.0,
            length_zero: 0.0,
            length_span: 1.0,
            pressure_scale_kpa: pressure_scale.unwrap_or(1.0),
            strain_unit: 1.0 / STROKE,
            least_opening: 0.0,
        }
    }

    /// Returns a signal of the rig, or the signal that replaces it for a gauge without its rig.
    fn signal(&self, rig: (&'static str, &'static str), alone: &'static str) -> Quantity {
        match self.strain_unit == 1.0 {
            true => Quantity::new("x", rig.0, rig.1),
            false => Quantity::new("x", "1", alone),
        }
    }

    /// The signal on which effects on the strain act.
    pub(crate) fn strain(&self) -> Quantity {
        let rig = ("strain", "gauge strain e, before the resistance");
        self.signal(rig, "e = (reference - zero)/span")
    }

    /// The strain as the second signal of effects on the resistance.
    fn strain_beside(&self) -> Quantity {
        let meaning = "gauge strain e, with the effects on the strain".into();
        Quantity { name: "e", meaning, ..self.strain() }
    }

    /// The signal on which effects on the resistance act.
    fn resistance(&self) -> Quantity {
        let rig = ("ohm", "resistance R of the gauge, before the bridge");
        self.signal(rig, "1 + e, where the signal is offset + gain e")
    }

    /// The signal on which effects on the voltage act.
    fn volts(&self) -> Quantity {
        self.signal(("V", "amplified voltage v"), "(signal - offset)/gain")
    }

    /// The signal on which effects on recorded samples act.
    fn record(&self) -> Quantity {
        let rig = ("V", "amplified voltage, sample by sample, before it is recorded");
        self.signal(rig, "(signal - offset)/gain, sample by sample, before it is recorded")
    }

    /// The signal on which effects on the reference act.
    fn length(&self) -> Quantity {
        let rig = ("mm", "true length, before the reference sensor measures it");
        self.signal(
            rig,
            "true value of (reference - zero)/span, before the reference sensor measures it",
        )
    }
}

/// Place and operation of an effect with known values.
#[derive(Debug)]
#[non_exhaustive]
pub enum Action {
    /// No action.
    Nothing,
    /// Delay of the valve openings, s.
    Delay(f64),
    /// Operators on the commanded openings of inlet and outlet, sample by sample, before the least conductance is
    /// applied.
    Commands([Box<dyn Operator>; 2]),
    /// Drop of the supply pressure under flow.
    Droop(Box<dyn Droop>),
    /// Leak: the law that gives the mass flow out of the chamber (kg/s) at a gauge pressure (Pa).
    Leak(Box<dyn Law>),
    /// Volume of the chamber: the law that gives V/V0 at k/k_max.
    Volume(Box<dyn Law>),
    /// Operator on the signal at a place. For a resistance, the span holds the strain.
    At(Place, Box<dyn Operator>),
    /// Sampling of the bridge: samples show the voltage of an earlier time.
    Skew(SkewSpec),
}

/// A memoryless law y = f(x).
pub trait Law: fmt::Debug + Send + Sync {
    /// Returns the value at `x`.
    fn at(&self, x: f64) -> f64;
}

/// A pressure drop of the supply under the flow drawn from it: y' = rate(y, flow).
pub trait Droop: fmt::Debug + Send + Sync {
    /// Returns the rate of the droop, Pa/s, at the droop y (Pa) and the flow through the inlet (kg/s).
    fn rate(&self, droop_pa: f64, flow_kg_s: f64) -> f64;
    /// Returns the droop that remains after `rest_s` seconds without flow.
    fn relaxed(&self, droop_pa: f64, rest_s: f64) -> f64;
}
