//! What an effect is.

use std::fmt;

use stretch_operators::{Grid, Operator};

use crate::{
    law::{Droop, Law},
    params::{Key, RigParams},
    stage::Stage,
};

/// How a parameter's range is best walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// In equal differences.
    Linear,
    /// In equal ratios.
    Log,
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Name in files and on the command line.
    pub name: &'static str,
    /// Unit; `1` when it has none, `strain` and `mm` for what scales with the stroke.
    pub unit: &'static str,
    /// Least plausible value.
    pub min: f64,
    /// Greatest plausible value.
    pub max: f64,
    /// Value at which it does nothing; none for what only shapes the effect (a scale, a time constant).
    pub off: Option<f64>,
    /// Used when a shape is not given, and where a search starts.
    pub typical: f64,
    /// How its range is best walked.
    pub scale: Scale,
}

impl EffectParameter {
    /// A strength that is off at zero, searched in equal differences.
    pub const fn strength(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        typical: f64,
    ) -> Self {
        Self { name, unit, min, max, off: Some(0.0), typical, scale: Scale::Linear }
    }

    /// A shape (a scale, a time constant), searched in equal ratios.
    pub const fn shape(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        typical: f64,
    ) -> Self {
        Self { name, unit, min, max, off: None, typical, scale: Scale::Log }
    }
}

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
    /// Stroke of the bridge voltage, V: about 1, 1 for a gauge alone.
    pub volts_stroke: f64,
    /// Length (or reference) at which y = 0.
    pub length_zero: f64,
    /// Change of the length (or reference) from y = 0 to y = 1, with its sign.
    pub length_span: f64,
    /// Reference pressure, kPa.
    pub pressure_scale_kpa: f64,
    /// What one unit of strain of the catalogue is in the signal: 1, or its share of the range for a gauge alone.
    pub strain_unit: f64,
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
            volts_stroke: 1.0,
            length_zero: params[Key::L0],
            length_span: -params[Key::L0] * k_max,
            pressure_scale_kpa: 1e-3 * params[Key::PRef],
            strain_unit: 1.0,
        }
    }
}

/// Where and how an effect acts, once its values are known.
#[derive(Debug)]
#[non_exhaustive]
pub enum Action {
    /// Openings act later, s.
    Delay(f64),
    /// Opening of either valve, before the least conductance.
    Opening(Box<dyn Law>),
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
    /// Samples of the bridge show the voltage of so many seconds earlier.
    Skew(f64),
    /// Recorded samples of the bridge, after a skew.
    Record(Box<dyn Operator>),
    /// Length as the reference sees it, mm.
    Length(Box<dyn Operator>),
}

/// One row of the catalogue: an effect that the nominal rig leaves out.
///
/// A new effect needs a type that implements this in a file of its own and one line in [`CATALOGUE`](crate::CATALOGUE),
/// or, outside of this crate, a `static` handed to [`EffectSet::push`](crate::EffectSet::push).
pub trait Effect: fmt::Debug + Send + Sync {
    /// Name: the vocabulary of every file and report.
    fn name(&self) -> &'static str;
    /// Stage it acts in.
    fn stage(&self) -> Stage;
    /// Its equation, in plain text.
    fn equation(&self) -> &'static str;
    /// Its parameters, the strength first.
    fn parameters(&self) -> &'static [EffectParameter];
    /// Where and how it acts with these values, which are not off.
    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action;
    /// What it needs beside the stage's own input, in words; none for most.
    fn needs(&self) -> Option<&'static str> {
        None
    }
    /// Whether these values leave the rig as if the effect were absent: every strength is at its off value.
    fn is_off(&self, values: &[f64]) -> bool {
        self.parameters().iter().zip(values).all(|(p, v)| p.off.is_none_or(|off| *v == off))
    }
}
