//! What a kind of effect is.

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
    /// Behind it, on its output.
    Output,
}

/// The second signal that a kind looks at, in addition to the channel that it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    /// Nothing.
    Nothing,
    /// The channel itself, before the kind changes it; in a gauge the strain that makes the resistance.
    Itself,
    /// Another channel: one effect for each.
    Another,
    /// The velocity at which the stage rubs.
    Velocity,
    /// The position at which the stage rubs.
    Position,
    /// That velocity and another channel that loads the contact: one effect for each.
    VelocityAndLoad,
    /// That position and another channel that loads the contact: one effect for each.
    PositionAndLoad,
}

/// How much of what its family shares the values of an effect make.
pub type Measure = fn(&[f64]) -> f64;

/// What kinds of one family agree on where data do not tell them apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// They are late, by so many seconds.
    Late,
    /// They lag behind a turn by half of a loop, in the unit of the channel.
    Loop,
}

/// Points to look for an effect at, from the extent of its channel; forms at their end may be left out.
pub type Starts = fn(&Extent) -> Vec<Vec<f64>>;

/// What was measured and may be fitted, for numbers that are found in the record. Samples to test on are never in one.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Samples of the trial, from its start, that may be fitted.
    pub samples: &'a [f64],
    /// Their noise, one standard deviation.
    pub noise: f64,
    /// What a strength of one is in the unit of the samples.
    pub unit: f64,
    /// Sample time, s.
    pub dt_s: f64,
}

/// Finds what a record alone can tell, and acts with it: values, the record, the simulated samples.
pub type Find = fn(&[f64], &Measured<'_>, &mut [f64]);

/// A line in the record whose phase cannot be predicted: what is known of a found effect where nothing may be fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency, Hz.
    pub hertz: f64,
    /// Amplitude, in the unit of the strength.
    pub amplitude: f64,
}

/// What goes into the code of a kind at a place.
#[derive(Debug, Clone, PartialEq)]
pub struct Signals {
    /// The channel.
    pub x: Quantity,
    /// The second signal that it looks at.
    pub beside: Quantity,
    /// The channel that loads it, where it looks at one.
    pub load: Quantity,
    /// Sample time, s.
    pub dt_s: f64,
}

/// How a user would type a kind with these values at a place.
pub type Sketched = fn(&[f64], &Extent, &Signals) -> Sketch;

/// A kind of effect: an operator and what it means. At a place (a side of a stage of a user's simulator, the strain of a gauge) it is
/// an effect.
///
/// One `static` holds all of it, in one file with its operator: its name, its parameters and their ranges, which follow from the
/// [`Extent`] of the channel that it acts on; where it is looked for; what is hard to distinguish from it; how a user would type it.
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
    /// What it is called in headlines and tables: a noun, as in "backlash" at the output.
    pub title: &'static str,
    /// What it is, for someone who does not know its name.
    pub words: &'static str,
    /// Its equation: x becomes y.
    pub equation: &'static str,
    /// Where `wrap = "all"` puts it.
    pub usual: &'static [Side],
    /// The second signal that it looks at.
    pub beside: Beside,
    /// Whether it opposes a motion: behind a stage it is added to the force, in front of one it is subtracted.
    pub opposes: bool,
    /// Its parameters on a channel of that extent and unit: strengths first, then shapes, choices and forms; what is found in the
    /// record last.
    pub parameters: fn(&Extent, &str) -> Vec<EffectParameter>,
    /// Values to look for it at; without any those of [`EffectParameter::starts`].
    pub starts: Option<Starts>,
    /// The operator with these values.
    pub operator: fn(&[f64], &Extent, &Grid) -> Box<dyn Operator>,
    /// How a user would type it; `None` if that is not written down.
    pub sketch: Option<Sketched>,
    /// Kinds that are hard to tell from it on the same channel.
    pub twins: &'static [&'static str],
    /// What it shares with others of its family that data may not tell apart, and how much of it its values make.
    pub family: Option<(Family, Measure)>,
    /// Whether its memory goes on from trial to trial.
    pub counts_session: bool,
    /// Whether it is a law of session time, so that trials outside the time that was fitted are extrapolated.
    pub drifts: bool,
    /// Whether its input does not follow from its output.
    pub hides_input: bool,
    /// Whether it asks for steps shorter than a sample where a measured input drives its stage.
    pub needs_fine_steps: bool,
    /// How its [`Role::Found`](crate::Role::Found) numbers are found in a record; none for all but hum.
    pub find: Option<Find>,
    /// The line that it leaves where they may not be found; none for all but hum.
    pub line: Option<fn(&[f64]) -> Line>,
    /// Least sample rate, Hz, at which it shows as itself with these values; `None` if any rate will do. Below it the kind is
    /// not looked for.
    pub shown_from_hz: Option<fn(&[f64]) -> f64>,
}

/// Kinds of one name are the same.
impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Kind {
    /// A kind that does nothing, to be filled in.
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

    /// Least sample rate, Hz, at which it shows as itself with these values; 0 where any will do.
    pub fn least_rate_hz(&self, values: &[f64]) -> f64 {
        self.shown_from_hz.map_or(0.0, |least| least(values))
    }

    /// Parameters that a model has values of: all but what is found in the record.
    pub fn fitted(&self, extent: &Extent, unit: &str) -> Vec<EffectParameter> {
        let mut all = (self.parameters)(extent, unit);
        all.retain(|p| !p.is_found());
        all
    }
}
