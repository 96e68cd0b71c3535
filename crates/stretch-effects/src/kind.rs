//! Kinds of effect: an operator with its name, parameters, search points and code.

use alloc::{boxed::Box, vec::Vec};

use crate::{
    drift::Offset,
    extent::Extent,
    grid::Grid,
    operator::Operator,
    parameter::EffectParameter,
    sketch::{Quantity, Sketch},
};

/// The side of a stage at which a kind acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// In front of the stage, on one of its inputs.
    Input,
    /// Behind the stage, on its output.
    Output,
}

/// The second signal that a kind reads, in addition to the channel that it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    /// Nothing.
    Nothing,
    /// The channel itself, before the kind changes it. In a gauge, the strain that determines the resistance.
    Itself,
    /// Another channel. Each other channel gives a separate effect.
    Another,
    /// The velocity of the rubbing contact in the stage.
    Velocity,
    /// The position of the rubbing contact in the stage.
    Position,
    /// The velocity of the contact and another channel that loads it. Each other channel gives a separate effect.
    VelocityAndLoad,
    /// The position of the contact and another channel that loads it. Each other channel gives a separate effect.
    PositionAndLoad,
}

/// Computes from an effect's values the size of the property that its `Family` shares.
pub type Measure = fn(&[f64]) -> f64;

/// A property that kinds of one family share. Data may determine this property without distinguishing the kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum Family {
    /// A delay, in seconds.
    Late,
    /// A lag behind the input after a reversal: half of the loop's width, in the unit of the channel.
    Loop,
}

/// Returns the points at which the search for an effect starts, from the extent of its channel. Form parameters at the
/// end of a point may be left out.
pub type Starts = fn(&Extent) -> Vec<Vec<f64>>;

/// Measured samples, from which numbers that only a recording contains may be estimated. Test samples are
/// never included.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Samples of the trial, from its start, that may be used for fitting.
    pub samples: &'a [f64],
    /// Standard deviation of the samples' noise.
    pub noise: f64,
    /// Size of a strength of 1, in the unit of the samples.
    pub unit: f64,
    /// Sample time, s.
    pub dt_s: f64,
}

/// Estimates from a recording the numbers that only a recording contains, and applies the effect to the simulated
/// samples. The arguments are the values of the effect's parameters, the recording and the simulated samples.
pub type Find = fn(&[f64], &Measured<'_>, &mut [f64]);

/// A spectral line of unknown phase. In test data the phase must not be estimated; then the frequency and the amplitude
/// are all that is known of the effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency, Hz.
    pub hertz: f64,
    /// Amplitude, in the unit of the strength.
    pub amplitude: f64,
}

/// The signals that the generated code of a kind at a place uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Signals {
    /// The channel that the kind changes.
    pub x: Quantity,
    /// The second signal that the kind reads.
    pub beside: Quantity,
    /// The channel that loads the contact, if the kind reads one.
    pub load: Quantity,
    /// Sample time, s.
    pub dt_s: f64,
}

/// Writes a kind with these values at a place as code that a user can type into a simulator.
pub type Sketched = fn(&[f64], &Extent, &Signals) -> Sketch;

/// A kind of effect: an operator and its description. A kind at a place is an effect. A place is a side of a stage of a
/// user's simulator, or the strain of a gauge.
///
/// One `static`, in one file with the operator, holds the name, the parameters with their ranges (which follow from the
/// [`Extent`] of the channel), the places and values at which a search starts, the kinds that are hard to distinguish
/// from it, and its code.
///
/// ```
/// use stretch_effects::{Extent, Side, kind_named};
/// let backlash = kind_named("backlash").unwrap();
/// assert!(backlash.usual.contains(&Side::Output));
/// assert!(backlash.equation.contains("play"));
/// let w = &(backlash.parameters)(&Extent::between(0.0, 30.0), "mm")[0];
/// assert_eq!((&*w.name, &*w.unit, w.max), ("w", "mm", 15.0));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// Name, as in `output.backlash`.
    pub name: &'static str,
    /// Noun for headlines and tables, such as "backlash" at the output.
    pub title: &'static str,
    /// Explanation for readers who do not know the name.
    pub words: &'static str,
    /// Equation that gives the output y from the input x.
    pub equation: &'static str,
    /// Sides at which `wrap = "all"` places the kind.
    pub usual: &'static [Side],
    /// The second signal that the kind reads.
    pub beside: Beside,
    /// Whether the kind is a force that opposes a motion. Behind a stage the force is added to the signal; in front of
    /// a stage it is subtracted.
    pub opposes: bool,
    /// The parameters on a channel of the given extent and unit: strengths first, then shapes, choices and forms, then
    /// numbers that are found in a recording.
    pub parameters: fn(&Extent, &str) -> Vec<EffectParameter>,
    /// Values at which the search starts. If `None`, those of [`EffectParameter::starts`] are used.
    pub starts: Option<Starts>,
    /// The operator with these values.
    pub operator: fn(&[f64], &Extent, &Grid) -> Box<dyn Operator>,
    /// The code that a user can type into a simulator; `None` if it is not written down.
    pub sketch: Option<Sketched>,
    /// Names of kinds that are hard to distinguish from this one on the same channel.
    pub twins: &'static [&'static str],
    /// The family of the kind, and the function that computes the size of the property that the family shares. Data may
    /// determine this property without distinguishing the kinds of the family.
    pub family: Option<(Family, Measure)>,
    /// Whether the memory accumulates over the whole session.
    pub counts_session: bool,
    /// Whether the effect depends on session time, so that trials outside the fitted time are extrapolated.
    pub drifts: bool,
    /// Whether the input cannot be computed from the output.
    pub hides_input: bool,
    /// Whether the kind needs integration steps shorter than a sample if a measured input drives its stage.
    pub needs_fine_steps: bool,
    /// Estimates the [`Role::Found`](crate::Role::Found) numbers from a recording; only hum has this.
    pub find: Option<Find>,
    /// The spectral line that remains if the [`Role::Found`](crate::Role::Found) numbers must not be estimated; only
    /// hum has this.
    pub line: Option<fn(&[f64]) -> Line>,
    /// Lowest sample rate, Hz, at which the kind with these values is recognisable; `None` if any rate will do. At
    /// lower rates the search leaves the kind out.
    pub shown_from_hz: Option<fn(&[f64]) -> f64>,
}

/// Kinds are equal if their names are equal.
impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Kind {
    /// A kind that does nothing; a base for struct updates.
    pub const PLAIN: Self = Self {
        name: "",
        title: "",
        words: "",
        equation: "",
        usual: &[],
        beside: Beside::Nothing,
        opposes: false,
        parameters: |_, _| Vec::new(),
        starts: None,
        operator: |_, _, _| Box::new(Offset::default()),
        sketch: None,
        twins: &[],
        family: None,
        counts_session: false,
        drifts: false,
        hides_input: false,
        needs_fine_steps: false,
        find: None,
        line: None,
        shown_from_hz: None,
    };

    /// Returns the lowest sample rate, Hz, at which the kind with these values is recognisable; 0 if any rate will do.
    pub fn least_rate_hz(&self, values: &[f64]) -> f64 {
        self.shown_from_hz.map_or(0.0, |least| least(values))
    }

    /// Returns the parameters whose values are part of a model: all except those found in a recording.
    pub fn fitted(&self, extent: &Extent, unit: &str) -> Vec<EffectParameter> {
        let mut all = (self.parameters)(extent, unit);
        all.retain(|p| !p.is_found());
        all
    }
}
