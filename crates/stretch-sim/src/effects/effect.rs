//! What an effect is.

use crate::{
    effects::{Action, EffectParameter, Role, Search, Surroundings},
    sketch::Sketch,
    stage::Stage,
};

/// What an effect needs beside the input of its stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// The pressure inside the muscle.
    Pressure,
    /// An amplifier with rails.
    Amplifier,
}

impl Need {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Pressure => "a pressure",
            Self::Amplifier => "an amplifier",
        }
    }
}

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

/// A line in the record whose phase nothing foretells: what is known of a found effect where nothing may be fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency, Hz.
    pub hertz: f64,
    /// Amplitude, in the unit of the strength.
    pub amplitude: f64,
}

/// Points to look for an effect at, from what was measured.
pub type Starts = fn(&Extent) -> Vec<Vec<f64>>;

/// What the screens need to know of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Least and greatest measured bridge voltage but for noise, V.
    pub volts: (f64, f64),
    /// Least nominal gauge strain.
    pub strain: f64,
}

/// What the search needs to know of the measurement of a gauge alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alone {
    /// From the first to the last sample, s.
    pub session_s: f64,
    /// Time by which the signal seems to trail the reference, s.
    pub lag_s: f64,
}

/// An effect that the nominal rig leaves out: an operator at a place, and how it is looked for.
///
/// One `static` holds all of it: the simulator runs it, the diagnosis fits it, reports speak of it. A new effect is such a
/// `static` in a file of its own and one line in [`CATALOGUE`](crate::CATALOGUE); or, outside of this crate, a `static` handed to
/// [`EffectSet::push`](crate::EffectSet::push) to be simulated and to [`Catalogue::with`](crate::Catalogue::with) to be diagnosed.
///
/// ```
/// use stretch_effects::Backlash;
/// use stretch_sim::{Action, Effect, EffectParameter, EffectSet, Stage};
/// static CLAMP_PLAY: Effect = Effect {
///     name: "clamp_play",
///     words: "the clamp of the sleeve has play",
///     stage: Stage::Sensing,
///     equation: "e -> play(e, w)",
///     parameters: &[EffectParameter::strength("w", "strain", 0.0, 0.02, 0.005)],
///     action: |values, _| Action::Strain(Box::new(Backlash::hard(values[0]))),
///     ..Effect::PLAIN
/// };
/// let mut effects = EffectSet::new();
/// effects.push(&CLAMP_PLAY, &[0.004])?;
/// assert!(CLAMP_PLAY.is_off(&[0.0]) && !effects.find("clamp_play").unwrap().is_off());
/// # Ok::<(), stretch_sim::SimError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    /// Name: the vocabulary of every file and report.
    pub name: &'static str,
    /// What it is, for someone who does not know its name, in one line.
    pub words: &'static str,
    /// Stage it acts in.
    pub stage: Stage,
    /// Its equation, in plain text.
    pub equation: &'static str,
    /// Its parameters: the strengths first, then shapes, then forms; what is found in the record last.
    pub parameters: &'static [EffectParameter],
    /// Where and how it acts with these values, which are not off.
    pub action: fn(&[f64], &Surroundings<'_>) -> Action,
    /// How somebody would type it; none where nobody has written that down.
    pub sketch: Option<fn(&[f64], &Surroundings<'_>) -> Sketch>,
    /// What it needs beside the stage's own input.
    pub needs: Option<Need>,
    /// Names of effects that are hard to tell from it.
    pub twins: &'static [&'static str],
    /// Whether it counts everything from the session's start: nothing may move before it.
    pub counts_session: bool,
    /// Whether its input cannot be told from its output (play in the reference).
    pub hides_input: bool,
    /// Whether it asks for steps shorter than a sample where a measured input drives its stage.
    pub needs_fine_steps: bool,
    /// Points to look for it at; values of forms at their end may be left out and are then the usual ones. Without any,
    /// a small and a large value of each strength with three of each shape are taken.
    pub starts: Option<Starts>,
    /// What a gauge alone changes of ranges and starts, in its units.
    pub alone: fn(&Alone, &mut Search),
    /// How its [`Role::Found`] numbers are found in a record; none for all but hum.
    pub find: Option<Find>,
    /// The line that an effect with such numbers leaves where they may not be found; none for all but hum.
    pub line: Option<fn(&[f64]) -> Line>,
    /// Least sample rate, Hz, at which the effect with these values shows as itself; none where any rate will do. Below it
    /// the effect is not looked for.
    pub shown_from_hz: Option<fn(&[f64]) -> f64>,
}

impl Effect {
    /// An effect that does nothing, to be filled in.
    pub const PLAIN: Self = Self {
        name: "",
        words: "",
        stage: Stage::Sensing,
        equation: "",
        parameters: &[],
        action: |_, _| Action::Nothing,
        sketch: None,
        needs: None,
        twins: &[],
        counts_session: false,
        hides_input: false,
        needs_fine_steps: false,
        starts: None,
        alone: |_, _| (),
        find: None,
        line: None,
        shown_from_hz: None,
    };

    /// Least sample rate, Hz, at which the effect with these values shows as itself; 0 where any will do.
    ///
    /// ```
    /// let hum = stretch_sim::effect_named("mains_hum").unwrap();
    /// assert_eq!(hum.least_rate_hz(&[0.02, 60.0]), 90.0);
    /// assert_eq!(stretch_sim::effect_named("leak").unwrap().least_rate_hz(&[1.0]), 0.0);
    /// ```
    pub fn least_rate_hz(&self, values: &[f64]) -> f64 {
        self.shown_from_hz.map_or(0.0, |least| least(values))
    }

    /// Whether these values leave the rig as if the effect were absent: every strength is at its off value.
    pub fn is_off(&self, values: &[f64]) -> bool {
        self.parameters.iter().zip(values).all(|(p, v)| p.off().is_none_or(|off| *v == off))
    }

    /// Parameters that a model has values of: all but what is found in the record.
    pub fn fitted(&self) -> impl Iterator<Item = &'static EffectParameter> {
        self.parameters.iter().filter(|p| !matches!(p.role, Role::Found { .. }))
    }

    /// Values of a model with a guess of what would be found in a record.
    pub fn with_stand_ins(&self, values: &[f64]) -> Vec<f64> {
        let guesses = self.parameters.iter().filter_map(|p| match p.role {
            Role::Found { stand_in } => Some(stand_in),
            _ => None,
        });
        values.iter().copied().chain(guesses).collect()
    }
}

impl Search {
    /// Leaves out the points at which an effect does not show at a sample rate, Hz; says which rate would do where none is left.
    pub fn at_rate(&mut self, effect: &Effect, rate_hz: f64) -> Option<f64> {
        let least = |start: &Vec<f64>| effect.least_rate_hz(start);
        let needed = self.starts.iter().map(least).fold(f64::INFINITY, f64::min);
        // A rate told by rounded stamps may miss its own value by a little.
        self.starts.retain(|start| effect.least_rate_hz(start) <= rate_hz * (1.0 + 1e-6));
        self.starts.is_empty().then_some(needed)
    }
}
