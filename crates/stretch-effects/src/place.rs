//! Where an effect acts in a rig, and what it may need to know of its surroundings.

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

/// A stage of the rig: what is simulated alone on a measured input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RigStage {
    /// Openings to pressure.
    Pneumatics,
    /// Pressure to length.
    Muscle,
    /// Openings to length, both of the above as one.
    Actuation,
    /// Length (and pressure, for cross-talk) to bridge voltage.
    Sensing,
    /// True length to measured length.
    Reference,
}

impl RigStage {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Pneumatics, Self::Muscle, Self::Actuation, Self::Sensing, Self::Reference];

    /// Its name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pneumatics => "pneumatics",
            Self::Muscle => "muscle",
            Self::Actuation => "actuation",
            Self::Sensing => "sensing",
            Self::Reference => "reference",
        }
    }

    /// Whether an effect or a parameter of the stage `other` acts in it: `actuation` holds `pneumatics` and `muscle`.
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
    /// Static contraction of the muscle, before its lag.
    StaticContraction,
    /// Moving contraction, behind the lag.
    MovingContraction,
    /// Gauge strain.
    Strain,
    /// Resistance of the gauge, with the strain as the second signal.
    Resistance,
    /// Amplified voltage.
    Volts,
    /// When the bridge is sampled: a skew in seconds and its rate.
    Sampling,
    /// Recorded samples of the bridge, after a skew.
    Record,
    /// Length as the reference sees it.
    Length,
}

/// Strain of the stroke of the catalogue's rig.
const STROKE: f64 = 0.2;

impl Place {
    /// A kind that acts here.
    pub(crate) fn action(self, kind: &Kind, values: &[f64], around: &Surroundings<'_>) -> Action {
        if self == Self::Sampling {
            return Action::Skew(SkewSpec { skew_s: values[0], rate: values[1], empty: 0.0 });
        }
        let operator = (kind.operator)(values, &self.extent(around), around.grid);
        Action::At(self, operator)
    }

    /// How far the signal goes here.
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
            // Where a voltage ends only an effect on it says.
            Self::Volts | Self::Sampling | Self::Record => {
                Extent::between(f64::NEG_INFINITY, f64::INFINITY)
            }
            Self::Length => {
                Extent::between(around.length_zero, around.length_zero + around.length_span)
            }
        }
    }

    /// What goes into the code of a kind here.
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
/// Contraction behind it.
const MOVING: Quantity = Quantity::new("x", "1", "contraction k, behind the lag of the muscle");

/// What an effect may need to know of the rig it acts in.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// Steps of time.
    pub grid: &'a Grid,
    /// Strain that is used as e0: the pre-stretch, 1 for a gauge alone.
    pub strain_scale: f64,
    /// Stroke of the strain, for what begins as a move left it: (1 + e0) k_max, 1 for a gauge alone.
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
    /// Strokes of the rig in its own units, which the ranges of its catalogue are divided by for a gauge alone: strain, mm and V for the
    /// whole stroke.
    pub const STROKES: [(&'static str, f64); 3] = [("strain", STROKE), ("mm", 30.0), ("V", 1.07)];

    /// Those of a gauge alone, in units of its range and its span.
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

    /// A signal of the rig, or the signal that replaces it in a gauge alone.
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
    fn strain_beside(&self) -> Quantity {
        let meaning = "gauge strain e, as the effects on it leave it".into();
        Quantity { name: "e", meaning, ..self.strain() }
    }

    /// What effects on the resistance act on.
    fn resistance(&self) -> Quantity {
        let rig = ("ohm", "resistance R of the gauge, before the bridge");
        self.signal(rig, "1 + e, where the signal is offset + gain e")
    }

    /// What effects on the voltage act on.
    fn volts(&self) -> Quantity {
        self.signal(("V", "amplified voltage v"), "(signal - offset)/gain")
    }

    /// What effects on recorded samples act on.
    fn record(&self) -> Quantity {
        let rig = ("V", "amplified voltage, sample by sample, before it is recorded");
        self.signal(rig, "(signal - offset)/gain, sample by sample, before it is recorded")
    }

    /// What effects on the reference act on.
    fn length(&self) -> Quantity {
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
    /// On the signal at a place: of a resistance the span holds the strain.
    At(Place, Box<dyn Operator>),
    /// Samples of the bridge show the voltage of some time earlier.
    Skew(SkewSpec),
}

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
