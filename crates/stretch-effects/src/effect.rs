//! Effects of the rig or of any stretch sensor. An effect is a kind at a place, with the starting points of its search
//! and with the map by which a calibration inverts it live.

use alloc::{vec, vec::Vec};

use stretch_core::DiagnosedMap;

use crate::{
    extent::Extent,
    kind::{Find, Kind, Line, Starts},
    parameter::EffectParameter,
    place::{Action, Place, RigStage, Surroundings},
    sketch::Sketch,
};

/// Something that an effect needs in addition to the input of its stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// The pressure inside the muscle.
    Pressure,
    /// An amplifier with rails.
    Amplifier,
}

impl Need {
    /// Returns the need as a noun phrase.
    pub fn words(self) -> &'static str {
        match self {
            Self::Pressure => "a pressure",
            Self::Amplifier => "an amplifier",
        }
    }
}

/// Computes the values of a kind from those of an effect, if the two differ.
pub type Values = fn(&[f64], &Surroundings<'_>) -> Vec<f64>;

/// How an effect acts on the rig.
#[derive(Debug, Clone, Copy)]
pub enum Acts {
    /// As a kind at a place.
    At {
        /// The kind that acts.
        kind: &'static Kind,
        /// The place at which the kind acts.
        place: Place,
        /// Computes the kind's values; `None` if they equal the effect's values.
        values: Option<Values>,
    },
    /// As a separate action that belongs to no kind.
    Own {
        /// Place and operation of the effect, for values that do not turn it off.
        action: fn(&[f64], &Surroundings<'_>) -> Action,
        /// The code that a user can type into a simulator.
        sketch: Option<fn(&[f64], &Surroundings<'_>) -> Sketch>,
    },
}

impl Acts {
    /// A kind at a place, with the effect's own values.
    pub const fn at(kind: &'static Kind, place: Place) -> Self {
        Self::At { kind, place, values: None }
    }

    /// A kind at a place, with values computed from the effect's values.
    pub const fn with(kind: &'static Kind, place: Place, values: Values) -> Self {
        Self::At { kind, place, values: Some(values) }
    }
}

/// An effect that the nominal rig (the rig model without effects) lacks: a [`Kind`] at a place, with its name there and
/// the starting points of its search.
///
/// One `static` serves four purposes: the simulator runs the effect, the diagnosis fits it, reports describe it, and a
/// calibration built on a diagnosis inverts it. The simulator accepts user-defined effects in the same way as those of
/// the catalogue.
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
    /// Name in every file and report.
    pub name: &'static str,
    /// Noun for headlines and tables, with the part to which the effect belongs.
    pub title: &'static str,
    /// Explanation in one line, for readers who do not know the name.
    pub words: &'static str,
    /// Stage in which the effect acts.
    pub stage: RigStage,
    /// Equation, in plain text.
    pub equation: &'static str,
    /// Parameters: the strengths first, then shapes, then forms, then numbers that are found in a recording.
    pub parameters: &'static [EffectParameter],
    /// Where and how the effect acts.
    pub acts: Acts,
    /// A need in addition to the stage's own input.
    pub needs: Option<Need>,
    /// Names of effects that are hard to distinguish from this one.
    pub twins: &'static [&'static str],
    /// Points at which the search starts. Values of forms at the end of a point may be left out; their usual values are
    /// then used. If `None`, the points of [`EffectParameter::starts`] are used.
    pub starts: Option<Starts>,
    /// Changes ranges and starts if only a gauge and its reference were measured. All values are then in the units of
    /// that gauge.
    pub alone: fn(&Alone, &mut Search),
    /// How a calibration built on a diagnosis inverts the effect; `None` if it cannot.
    pub live: Option<Live>,
}

impl Effect {
    /// An effect that does nothing; a base for struct updates.
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

    /// Returns the kind and the place; `None` if the effect belongs to no kind.
    pub fn at(&self) -> Option<(&'static Kind, Place)> {
        match self.acts {
            Acts::At { kind, place, .. } => Some((kind, place)),
            Acts::Own { .. } => None,
        }
    }

    fn is_kind(&self, has: impl Fn(&Kind) -> bool) -> bool {
        self.at().is_some_and(|(kind, _)| has(kind))
    }

    /// Returns the effect's action with these values, which must not turn the effect off.
    pub fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        match self.acts {
            Acts::At { kind, place, values: of } => {
                let own = of.map_or_else(|| values.to_vec(), |of| of(values, around));
                place.action(kind, &own, around)
            }
            Acts::Own { action, .. } => action(values, around),
        }
    }

    /// Returns the code that a user can type into a simulator, with these values; `None` if the kind has no such code.
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

    /// Whether the memory accumulates over the whole session. The gauge must then not have moved before the session
    /// started.
    pub fn counts_session(&self) -> bool {
        self.is_kind(|kind| kind.counts_session)
    }

    /// Whether the effect depends on session time.
    pub fn drifts(&self) -> bool {
        self.is_kind(|kind| kind.drifts)
    }

    /// Whether the true length cannot be computed from the reading of the reference (play in the reference).
    pub fn hides_input(&self) -> bool {
        self.stage == RigStage::Reference && self.is_kind(|kind| kind.hides_input)
    }

    /// Whether the effect needs integration steps shorter than a sample if a measured input drives its stage.
    pub fn needs_fine_steps(&self) -> bool {
        self.is_kind(|kind| kind.needs_fine_steps)
    }

    /// Returns the function that estimates the [`Role::Found`](crate::Role::Found) numbers from a recording.
    pub fn find(&self) -> Option<Find> {
        self.at().and_then(|(kind, _)| kind.find)
    }

    /// Returns the spectral line that remains with these values if its numbers must not be estimated from a recording.
    pub fn line(&self, values: &[f64]) -> Option<Line> {
        self.at().and_then(|(kind, _)| kind.line).map(|line| line(values))
    }

    /// Returns the lowest sample rate, Hz, at which the effect with these values is recognisable; 0 if any rate will
    /// do.
    ///
    /// ```
    /// use stretch_effects::gauge_effect;
    /// assert_eq!(gauge_effect("mains_hum").unwrap().least_rate_hz(&[0.02, 60.0]), 90.0);
    /// assert_eq!(gauge_effect("sleeve_slip").unwrap().least_rate_hz(&[1.0]), 0.0);
    /// ```
    pub fn least_rate_hz(&self, values: &[f64]) -> f64 {
        self.at().map_or(0.0, |(kind, _)| kind.least_rate_hz(values))
    }

    /// Whether every strength is at its off value, so that the effect does nothing.
    pub fn is_off(&self, values: &[f64]) -> bool {
        EffectParameter::are_off(self.parameters, values)
    }

    /// Returns the parameters whose values are part of a model: all except those found in a recording.
    pub fn fitted(&self) -> impl Iterator<Item = &'static EffectParameter> {
        self.parameters.iter().filter(|p| !p.is_found())
    }

    /// Appends to the values of a model a stand-in for each number that would be found in a recording.
    pub fn with_stand_ins(&self, values: &[f64]) -> Vec<f64> {
        let guesses = self.parameters.iter().filter_map(|p| match p.role {
            crate::Role::Found { stand_in } => Some(stand_in),
            _ => None,
        });
        values.iter().copied().chain(guesses).collect()
    }
}

/// Returns starting points of one number each.
pub fn each<const N: usize>(values: [f64; N]) -> Vec<Vec<f64>> {
    values.map(|x| vec![x]).into()
}

/// Returns starting points with the same first number and different second numbers.
pub fn pairs<const N: usize>(first: f64, seconds: [f64; N]) -> Vec<Vec<f64>> {
    seconds.map(|x| vec![first, x]).into()
}

/// Creation of the search points from an effect.
impl Search {
    /// Returns the ranges and starts in the catalogue's units, for a channel of this extent.
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

/// Properties of the measurement that the search needs if only a gauge and its reference were measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alone {
    /// From the first to the last sample, s.
    pub session_s: f64,
    /// Estimated delay of the signal behind the reference, s.
    pub lag_s: f64,
}

/// Ranges and starting points of the search for an effect, with one number for each of its
/// [fitted](crate::Effect::fitted) parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// Smallest and largest value of each parameter.
    pub ranges: Vec<[f64; 2]>,
    /// Points at which the effect is screened.
    pub starts: Vec<Vec<f64>>,
}

impl Search {
    /// Converts to other units, with one factor for each parameter.
    pub fn times(mut self, units: &[f64]) -> Self {
        for (range, unit) in self.ranges.iter_mut().zip(units) {
            *range = range.map(|x| x * unit);
        }
        for start in &mut self.starts {
            start.iter_mut().zip(units).for_each(|(x, unit)| *x *= unit);
        }
        self
    }

    /// Sets the range of the first strength to `-most..=most`.
    pub fn reach(&mut self, most: f64) {
        self.ranges[0] = [-most, most];
    }

    /// Sets the range of the first strength to `-most..=most` and its starting values to a fifth of `most`.
    pub fn reach_from(&mut self, most: f64) {
        self.reach(most);
        self.starts.iter_mut().for_each(|start| start[0] = 0.2 * most);
    }

    /// Removes the points at which an effect is not recognisable at a sample rate, Hz. `least` returns the rate that
    /// the effect needs at given values. If no point remains, returns the lowest rate that would be sufficient.
    pub fn at_rate(&mut self, least: impl Fn(&[f64]) -> f64, rate_hz: f64) -> Option<f64> {
        let needed = self.starts.iter().map(|s| least(s)).fold(f64::INFINITY, f64::min);
        // A rate that was computed from rounded time stamps has a small error.
        self.starts.retain(|start| least(start) <= rate_hz * (1.0 + 1e-6));
        self.starts.is_empty().then_some(needed)
    }
}

/// Properties of the target quantity that the map of an effect needs in addition to the effect's numbers. A calibration
/// evaluates this map live.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Whether the target falls while the strain rises, as with a contraction.
    pub falls: bool,
    /// Greatest pressure of the trials, in its unit.
    pub pressure: f64,
}

impl Target {
    /// Returns the target at a strain, both as shares of their ranges.
    pub fn at(&self, strain: f64) -> f64 {
        if self.falls { 1.0 - strain } else { strain }
    }
}

/// How a calibration built on a diagnosis represents an effect of a gauge or of its reference: the numbers that it
/// fits, and their meaning in the map that is inverted live.
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
    /// Fitted numbers with their ranges, as shares of the ranges of target and signal. `typical` is where a fit begins
    /// if nothing was found. Empty if the curve of the map represents the effect.
    pub parameters: &'static [EffectParameter],
    /// Writes the effect with these numbers into a map.
    pub set: fn(&[f64], &Target, &mut DiagnosedMap),
    /// Whether the effect makes the resting signal drift, so that the baseline must be tracked.
    pub drifts: bool,
}

impl Live {
    /// An effect that the curve of the map represents.
    pub const BY_CURVE: Self = Self { parameters: &[], set: |_, _, _| (), drifts: false };
}
