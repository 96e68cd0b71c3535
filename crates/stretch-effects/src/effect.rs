//! An effect of the rig or of any stretch sensor: a kind at a place, where it is searched, and how it is inverted live.

use alloc::{vec, vec::Vec};

use stretch_core::DiagnosedMap;

use crate::{
    extent::Extent,
    kind::{Find, Kind, Line, Starts},
    parameter::EffectParameter,
    place::{Action, Place, RigStage, Surroundings},
    sketch::Sketch,
};

/// What an effect needs in addition to the input of its stage.
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

/// The values of a kind from those of an effect, where they are not the same.
pub type Values = fn(&[f64], &Surroundings<'_>) -> Vec<f64>;

/// How an effect acts.
#[derive(Debug, Clone, Copy)]
pub enum Acts {
    /// As a kind at a place.
    At {
        /// What acts.
        kind: &'static Kind,
        /// Where.
        place: Place,
        /// The kind's values; `None` if they are the effect's.
        values: Option<Values>,
    },
    /// A separate term, which belongs to no kind.
    Own {
        /// Where the effect acts and how, for values other than those that turn it off.
        action: fn(&[f64], &Surroundings<'_>) -> Action,
        /// How a user would type it.
        sketch: Option<fn(&[f64], &Surroundings<'_>) -> Sketch>,
    },
}

impl Acts {
    /// A kind at a place, with the effect's own values.
    pub const fn at(kind: &'static Kind, place: Place) -> Self {
        Self::At { kind, place, values: None }
    }

    /// A kind at a place, with values that are made from the effect's.
    pub const fn with(kind: &'static Kind, place: Place, values: Values) -> Self {
        Self::At { kind, place, values: Some(values) }
    }
}

/// An effect that the nominal rig leaves out: a [`Kind`] at a place, what it is called there, and how it is looked for.
///
/// One `static` holds all of it: the simulator runs it, the diagnosis fits it, reports speak of it, a diagnosed calibration inverts it.
/// The simulator takes an effect of one's own as it takes those of the catalogue.
///
/// ```
/// use stretch_effects::{Acts, Effect, EffectParameter, Place, kinds::BACKLASH};
/// static CLAMP_PLAY: Effect = Effect {
///     name: "clamp_play",
///     title: "the clamp's play",
///     words: "the clamp of the sleeve has play",
///     equation: "e -> play(e, w)",
///     parameters: &[EffectParameter::strength("w", "strain", 0.0, 0.02, 0.005)],
///     acts: Acts::with(&BACKLASH, Place::Strain, |values, _| vec![values[0], 0.0]),
///     ..Effect::PLAIN
/// };
/// assert!(CLAMP_PLAY.is_off(&[0.0]) && !CLAMP_PLAY.is_off(&[0.004]));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    /// Name: the vocabulary of every file and report.
    pub name: &'static str,
    /// What it is called in headlines and tables: a noun with its owner.
    pub title: &'static str,
    /// What it is, for someone who does not know its name, in one line.
    pub words: &'static str,
    /// Stage it acts in.
    pub stage: RigStage,
    /// Its equation, in plain text.
    pub equation: &'static str,
    /// Its parameters: the strengths first, then shapes, then forms; what is found in the record last.
    pub parameters: &'static [EffectParameter],
    /// Where and how it acts.
    pub acts: Acts,
    /// What it needs in addition to the stage's own input.
    pub needs: Option<Need>,
    /// Names of effects that are hard to tell from it.
    pub twins: &'static [&'static str],
    /// Points to look for it at; values of forms at their end may be left out and are then the usual ones. Without any,
    /// those of [`EffectParameter::starts`] are taken.
    pub starts: Option<Starts>,
    /// What a gauge alone changes of ranges and starts, in its units.
    pub alone: fn(&Alone, &mut Search),
    /// How a diagnosed calibration inverts it; `None` if it cannot.
    pub live: Option<Live>,
}

impl Effect {
    /// An effect that does nothing, to be filled in.
    pub const PLAIN: Self = Self {
        name: "",
        title: "",
        words: "",
        stage: RigStage::Sensing,
        equation: "",
        parameters: &[],
        acts: Acts::Own { action: |_, _| Action::Nothing, sketch: None },
        needs: None,
        twins: &[],
        starts: None,
        alone: |_, _| (),
        live: None,
    };

    /// Its kind and place; `None` if it is a separate term.
    pub fn at(&self) -> Option<(&'static Kind, Place)> {
        match self.acts {
            Acts::At { kind, place, .. } => Some((kind, place)),
            Acts::Own { .. } => None,
        }
    }

    fn is_kind(&self, has: impl Fn(&Kind) -> bool) -> bool {
        self.at().is_some_and(|(kind, _)| has(kind))
    }

    /// How it acts with these values, which are not off.
    pub fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        match self.acts {
            Acts::At { kind, place, values: of } => {
                let own = of.map_or_else(|| values.to_vec(), |of| of(values, around));
                place.action(kind, &own, around)
            }
            Acts::Own { action, .. } => action(values, around),
        }
    }

    /// How a user would type it with these values; `None` if the kind has no such text.
    pub fn sketch(&self, values: &[f64], around: &Surroundings<'_>) -> Option<Sketch> {
        match self.acts {
            Acts::At { kind, place, values: of } => {
                let own = of.map_or_else(|| values.to_vec(), |of| of(values, around));
                let signals = place.signals(around);
                kind.sketch.map(|sketch| sketch(&own, &place.extent(around), &signals))
            }
            Acts::Own { sketch, .. } => sketch.map(|sketch| sketch(values, around)),
        }
    }

    /// Whether it counts everything from the session's start: nothing may move before it.
    pub fn counts_session(&self) -> bool {
        self.is_kind(|kind| kind.counts_session)
    }

    /// Whether it is a law of session time.
    pub fn drifts(&self) -> bool {
        self.is_kind(|kind| kind.drifts)
    }

    /// Whether the true length does not follow from what the reference shows (play in the reference).
    pub fn hides_input(&self) -> bool {
        self.stage == RigStage::Reference && self.is_kind(|kind| kind.hides_input)
    }

    /// Whether it asks for steps shorter than a sample where a measured input drives its stage.
    pub fn needs_fine_steps(&self) -> bool {
        self.is_kind(|kind| kind.needs_fine_steps)
    }

    /// How its [`Role::Found`](crate::Role::Found) numbers are found in a record.
    pub fn find(&self) -> Option<Find> {
        self.at().and_then(|(kind, _)| kind.find)
    }

    /// The line that it leaves with these values where its numbers may not be found in a record.
    pub fn line(&self, values: &[f64]) -> Option<Line> {
        self.at().and_then(|(kind, _)| kind.line).map(|line| line(values))
    }

    /// Least sample rate, Hz, at which the effect with these values shows as itself; 0 where any will do.
    ///
    /// ```
    /// use stretch_effects::gauge_effect;
    /// assert_eq!(gauge_effect("mains_hum").unwrap().least_rate_hz(&[0.02, 60.0]), 90.0);
    /// assert_eq!(gauge_effect("sleeve_slip").unwrap().least_rate_hz(&[1.0]), 0.0);
    /// ```
    pub fn least_rate_hz(&self, values: &[f64]) -> f64 {
        self.at().map_or(0.0, |(kind, _)| kind.least_rate_hz(values))
    }

    /// Whether these values leave the rig as if the effect were absent: every strength is at its off value.
    pub fn is_off(&self, values: &[f64]) -> bool {
        EffectParameter::are_off(self.parameters, values)
    }

    /// Parameters that a model has values of: all but what is found in the record.
    pub fn fitted(&self) -> impl Iterator<Item = &'static EffectParameter> {
        self.parameters.iter().filter(|p| !p.is_found())
    }

    /// Values of a model with a guess of what would be found in a record.
    pub fn with_stand_ins(&self, values: &[f64]) -> Vec<f64> {
        let guesses = self.parameters.iter().filter_map(|p| match p.role {
            crate::Role::Found { stand_in } => Some(stand_in),
            _ => None,
        });
        values.iter().copied().chain(guesses).collect()
    }
}

/// Starts of one number each.
pub fn each<const N: usize>(values: [f64; N]) -> Vec<Vec<f64>> {
    values.map(|x| vec![x]).into()
}

/// Starts of the same first number and several second ones.
pub fn pairs<const N: usize>(first: f64, seconds: [f64; N]) -> Vec<Vec<f64>> {
    seconds.map(|x| vec![first, x]).into()
}

/// Where the search for an effect begins when `extent` is that of its channel.
impl Search {
    /// In the catalogue's units.
    ///
    /// ```
    /// use stretch_effects::{Extent, Search, gauge_effect};
    /// let extent = Extent::between(0.02, 0.22);
    /// let search = Search::of(gauge_effect("gauge_relaxation").unwrap(), &extent);
    /// assert_eq!(search.ranges[1], [0.02, 4.0]); // tau, s
    /// assert_eq!(search.starts[0], [0.05, 0.03, 1.6]); // c, tau, and the usual spread
    /// ```
    pub fn of(effect: &Effect, extent: &Extent) -> Self {
        let fitted: Vec<EffectParameter> = effect.fitted().cloned().collect();
        let starts =
            effect.starts.map_or_else(|| EffectParameter::starts(&fitted), |starts| starts(extent));
        Self {
            ranges: fitted.iter().map(|p| [p.min, p.max]).collect(),
            starts: starts.into_iter().map(|s| EffectParameter::complete(&fitted, s)).collect(),
        }
    }
}

/// What the search needs to know of the measurement of a gauge alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alone {
    /// From the first to the last sample, s.
    pub session_s: f64,
    /// Time by which the signal seems to trail the reference, s.
    pub lag_s: f64,
}

/// Ranges and starting points of the search for an effect, one number each of its [fitted](crate::Effect::fitted) parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// Least and greatest value of each parameter.
    pub ranges: Vec<[f64; 2]>,
    /// Points at which it is screened.
    pub starts: Vec<Vec<f64>>,
}

impl Search {
    /// The same in other units, one factor a parameter.
    pub fn times(mut self, units: &[f64]) -> Self {
        for (range, unit) in self.ranges.iter_mut().zip(units) {
            *range = range.map(|x| x * unit);
        }
        for start in &mut self.starts {
            start.iter_mut().zip(units).for_each(|(x, unit)| *x *= unit);
        }
        self
    }

    /// Lets the first strength go as far as `most`, either way.
    pub fn reach(&mut self, most: f64) {
        self.ranges[0] = [-most, most];
    }

    /// Lets the first strength go as far as `most`, either way, and begins at a fifth of it.
    pub fn reach_from(&mut self, most: f64) {
        self.reach(most);
        self.starts.iter_mut().for_each(|start| start[0] = 0.2 * most);
    }

    /// Leaves out the points at which an effect does not show at a sample rate, Hz; says which rate would do where none is left.
    /// `least` tells the rate that it needs with some values.
    pub fn at_rate(&mut self, least: impl Fn(&[f64]) -> f64, rate_hz: f64) -> Option<f64> {
        let needed = self.starts.iter().map(|s| least(s)).fold(f64::INFINITY, f64::min);
        // A rate that was computed from rounded time stamps has a small error.
        self.starts.retain(|start| least(start) <= rate_hz * (1.0 + 1e-6));
        self.starts.is_empty().then_some(needed)
    }
}

/// What the live map of an effect depends on in addition to its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Whether the target falls while the strain rises, as a contraction does.
    pub falls: bool,
    /// Greatest pressure of the trials, in its own unit.
    pub pressure: f64,
}

impl Target {
    /// The target at a strain, both in shares of their range.
    pub fn at(&self, strain: f64) -> f64 {
        if self.falls { 1.0 - strain } else { strain }
    }
}

/// How a diagnosed calibration carries an effect of a gauge or of its reference: the numbers that it fits, and what they are in the map
/// that is inverted live.
///
/// ```
/// use stretch_effects::{GAUGE, Target, gauge_effect};
/// let skew = gauge_effect("channel_skew").unwrap().live.unwrap();
/// assert_eq!(skew.parameters[0].min, -1.0); // s: two recorders may be started by two hands
/// // A mains hum takes no part in the map, and a curved scale is in its curve: they have no numbers.
/// let bent = gauge_effect("pot_nonlinearity").unwrap().live.unwrap();
/// assert!(bent.parameters.is_empty());
/// assert!(GAUGE.iter().all(|effect| effect.live.is_some()));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Live {
    /// Its numbers in shares of the range of target and signal, with ranges; `typical` is where a fit begins when nothing was found. Empty
    /// where the curve of the map carries the effect.
    pub parameters: &'static [EffectParameter],
    /// Writes the effect with these numbers into a map.
    pub set: fn(&[f64], &Target, &mut DiagnosedMap),
    /// Whether it lets the resting signal drift, so that the baseline has to be followed.
    pub drifts: bool,
}

impl Live {
    /// An effect that the curve of the map carries.
    pub const BY_CURVE: Self = Self { parameters: &[], set: |_, _, _| (), drifts: false };
}
