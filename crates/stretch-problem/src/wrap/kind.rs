//! What a kind of wrapper is.

use stretch_effects::{Grid, Operator};
use stretch_gap::EffectParameterSpec;

use super::extent::Extent;

/// Where a wrapper stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// In front of the stage, on one of its inputs.
    Input,
    /// Behind it, on its output.
    Output,
}

/// What a wrapper looks at beside the channel that it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    /// Nothing.
    Nothing,
    /// The channel itself, before the wrapper changes it.
    Itself,
    /// Another channel: one wrapper for each.
    Another,
    /// The velocity at which the stage rubs.
    Velocity,
}

/// Values to screen a wrapper at, from the extent of its channel.
pub type Starts = fn(&Extent) -> Vec<Vec<f64>>;

/// How much of what its family shares the numbers of a wrapper make.
pub type Measure = fn(&[f64]) -> f64;

/// What wrappers of one family agree on where data do not tell them apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// They are late, by so many seconds.
    Late,
    /// They lag behind a turn by half of a loop, in the unit of the channel.
    Loop,
}

/// A kind of wrapper: an operator, what it is called, and how its numbers are looked for.
///
/// ```
/// use stretch_problem::{Side, wrapper_named};
/// let backlash = wrapper_named("backlash").unwrap();
/// assert!(backlash.usual.contains(&Side::Output));
/// assert!(backlash.equation.contains("play"));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Wrapper {
    /// Name, as in `output.backlash`.
    pub name: &'static str,
    /// What it is, for someone who does not know its name.
    pub words: &'static str,
    /// Its equation: x becomes y.
    pub equation: &'static str,
    /// Where `wrap = "all"` puts it.
    pub usual: &'static [Side],
    /// What it looks at beside the channel.
    pub beside: Beside,
    /// Its numbers, their ranges from the channel's own span.
    pub parameters: fn(&Extent, &str) -> Vec<EffectParameterSpec>,
    /// Values to screen it at; without any those of [`EffectSpec::new`](stretch_gap::EffectSpec::new).
    pub starts: Option<Starts>,
    /// The operator with these values.
    pub operator: fn(&[f64], &Extent, &Grid) -> Box<dyn Operator>,
    /// Kinds that are hard to tell from it on the same channel.
    pub twins: &'static [&'static str],
    /// What it shares with others of its family that data may not tell apart, and how much of it its numbers make.
    pub family: Option<(Family, Measure)>,
    /// Whether its memory goes on from trial to trial.
    pub counts_session: bool,
    /// Whether its course is found in the record (the phase of a hum).
    pub is_found: bool,
    /// Least sample rate, Hz, at which it can be told.
    pub least_rate_hz: f64,
}

impl Wrapper {
    /// A wrapper to be filled in.
    pub(crate) const PLAIN: Self = Self {
        name: "",
        words: "",
        equation: "",
        usual: &[],
        beside: Beside::Nothing,
        parameters: |_, _| Vec::new(),
        starts: None,
        operator: |_, _, _| Box::new(stretch_effects::Offset::default()),
        twins: &[],
        family: None,
        counts_session: false,
        is_found: false,
        least_rate_hz: 0.0,
    };
}

/// A strength from 0, at which it does nothing, or of both signs.
pub(super) fn strength(name: &str, unit: &str, min: f64, max: f64) -> EffectParameterSpec {
    EffectParameterSpec::strength(name, unit, min..=max)
}

/// A threshold that does nothing at `off`.
pub(super) fn threshold(
    name: &str,
    unit: &str,
    [min, max]: [f64; 2],
    off: f64,
) -> EffectParameterSpec {
    EffectParameterSpec { off: Some(off), ..EffectParameterSpec::strength(name, unit, min..=max) }
}

/// A shape, searched in equal ratios.
pub(super) fn shape(name: &str, unit: &str, min: f64, max: f64) -> EffectParameterSpec {
    EffectParameterSpec::shape(name, unit, min..=max)
}

/// A freedom of form around its usual value.
pub(super) fn form(
    name: &str,
    unit: &str,
    [min, max]: [f64; 2],
    usual: f64,
) -> EffectParameterSpec {
    EffectParameterSpec {
        off: None,
        form: Some(usual),
        ..EffectParameterSpec::strength(name, unit, min..=max)
    }
}

/// The same, looked for in equal ratios.
pub(super) fn log_form(name: &str, unit: &str, range: [f64; 2], usual: f64) -> EffectParameterSpec {
    EffectParameterSpec { is_log: true, ..form(name, unit, range, usual) }
}
