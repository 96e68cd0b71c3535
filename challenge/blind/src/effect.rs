//! Causes of a gap that a rig may have: their names, the hand-written forms of each, and the families of forms.

use std::fmt;

use crate::random::RandomGenerator;

/// Defines an enumeration in which each member has one word, by which it is serialised, printed and
/// parsed.
macro_rules! worded {
    ($(#[$own:meta])* $name:ident { $($(#[$doc:meta])* $member:ident $word:literal),* $(,)? }) => {
        $(#[$own])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[derive(serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$doc])* #[serde(rename = $word)] $member),* }

        impl $name {
            /// All members, in the order of reports.
            pub const ALL: [Self; [$($word),*].len()] = [$(Self::$member),*];

            /// Name in labels, reports and options.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$member => $word),* }
            }
        }

        impl std::str::FromStr for $name {
            type Err = String;

            fn from_str(name: &str) -> Result<Self, String> {
                let found = Self::ALL.into_iter().find(|one| one.name() == name);
                found.ok_or_else(|| format!("there are {}", Self::ALL.map(Self::name).join(", ")))
            }
        }
    };
}
pub(crate) use worded;

worded! {
    /// Source of the functional form of every effect of a case.
    ///
    /// The drawn families are different types of functions, not only different numbers. A threshold
    /// that was calibrated on some families can therefore be tested on a family that was left out.
    ///
    /// ```
    /// use stretch_blind::Family;
    /// assert_eq!("rate_laws".parse(), Ok(Family::RateLaws));
    /// assert!("all".parse::<Family>().is_err());
    /// ```
    #[derive(Default)]
    Family {
        /// A few forms of each effect, written by hand.
        #[default]
        Written "written",
        /// Smooth random functions: the logarithm of the slope or of the density is a random
        /// spline.
        Splines "splines",
        /// Sums of several elements (time constants, radii, thresholds, delays, harmonics) with
        /// weights that are random or follow a power law.
        Spectra "spectra",
        /// Formulas and differential equations with random exponents: rates that depend on the state,
        /// and friction of Dahl, of Bouc and Wen, or with a Stribeck velocity.
        RateLaws "rate_laws",
        /// Forms that differ between directions, sides or halves of the range: up and down, opening
        /// and closing, kinks.
        Asymmetric "asymmetric",
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

worded! {
    /// Part of the rig in which a cause acts.
    Stage {
        /// Openings to pressure.
        Pneumatics "pneumatics",
        /// Pressure to length.
        Muscle "muscle",
        /// Length to bridge voltage.
        Sensing "sensing",
        /// True length to measured length.
        Reference "reference",
    }
}

/// A cause: its name, stage, forms, smallest and largest strength, and the meaning of a negative
/// sign.
#[derive(Debug)]
pub(crate) struct Spec {
    pub(crate) name: &'static str,
    pub(crate) stage: Stage,
    pub(crate) forms: &'static [&'static str],
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// Largest strength with a negative sign, as a share of `most`; 0 if the sign is always
    /// positive.
    pub(crate) negative: f64,
}

macro_rules! causes {
    ($($id:ident $name:literal $stage:ident [$($form:literal),+] $least:literal .. $most:literal, $negative:literal;)*) => {
        /// Every cause that can be simulated; the first 23 are in the catalogue of effects.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub(crate) enum Kind { $($id),* }
        /// Properties of the causes, in the order of [`Kind`].
        pub(crate) static SPECS: &[Spec] = &[$(Spec {
            name: $name, stage: Stage::$stage, forms: &[$($form),+],
            least: $least, most: $most, negative: $negative,
        }),*];
        /// All kinds, in the order of [`Kind`].
        pub(crate) static KINDS: &[Kind] = &[$(Kind::$id),*];
    };
}

causes! {
    SupplySag "supply_sag" Pneumatics ["regulator_orifice", "progressive"] 1e4 .. 4e8, 0.0;
    ValveDelay "valve_delay" Pneumatics ["dead_time_and_lag", "opening_and_closing_differ", "valves_differ"] 1e-4 .. 0.12, 0.0;
    ValveDeadband "valve_deadband" Pneumatics ["shifted", "gradual"] 1e-4 .. 0.11, 0.0;
    Leak "leak" Pneumatics ["iso_orifice", "laminar_gap"] 1e-14 .. 2e-10, 0.0;
    ChamberVolume "chamber_volume" Pneumatics ["quadratic", "sine"] 1e-3 .. 3.0, 0.0;
    MuscleHysteresis "muscle_hysteresis" Muscle ["dahl", "bouc_wen", "maxwell_slip"] 2e-4 .. 0.6, 0.0;
    MuscleCreep "muscle_creep" Muscle ["two_time_constants", "power_law"] 1e-4 .. 0.3, 0.0;
    CrossbeamInertia "crossbeam_inertia" Muscle ["quadratic_damping", "direction_damping"] 2e-3 .. 0.08, 0.0;
    SleeveSlack "sleeve_slack" Sensing ["hard", "wide_knee"] 2e-4 .. 0.12, 0.0;
    SleeveSlip "sleeve_slip" Sensing ["dahl", "bouc_wen", "maxwell_slip"] 1e-5 .. 0.03, 0.0;
    PressureCrosstalk "pressure_crosstalk" Sensing ["saturating", "progressive"] 1e-5 .. 0.05, 1.0;
    GaugeHysteresis "gauge_hysteresis" Sensing ["dahl", "bouc_wen", "maxwell_slip"] 2e-4 .. 0.6, 0.0;
    GaugeRelaxation "gauge_relaxation" Sensing ["two_time_constants", "power_law"] 1e-4 .. 0.6, 0.5;
    GaugeSoftening "gauge_softening" Sensing ["power_law", "hyperbolic"] 1e-4 .. 0.3, 0.0;
    GaugeNonlinearity "gauge_nonlinearity" Sensing ["sine", "skewed_cubic"] 1e-5 .. 0.1, 1.0;
    ThermalDrift "thermal_drift" Sensing ["settling", "power_law"] 1e-8 .. 4e-4, 1.0;
    SelfHeating "self_heating" Sensing ["two_time_constants", "square_root"] 1e-5 .. 0.05, 1.0;
    AmplifierSaturation "amplifier_saturation" Sensing ["hard_top", "smooth_top", "hard_bottom"] 1e-4 .. 0.8, 0.0;
    AmplifierLowpass "amplifier_lowpass" Sensing ["two_poles", "pole_and_dead_time"] 1e-4 .. 0.4, 0.0;
    MainsHum "mains_hum" Sensing ["wandering_50", "wandering_60"] 1e-4 .. 0.1, 0.0;
    ChannelSkew "channel_skew" Sensing ["clock_rate", "wandering"] 1e-4 .. 0.2, 0.5;
    PotNonlinearity "pot_nonlinearity" Reference ["sine", "skewed_cubic"] 1e-3 .. 3.0, 1.0;
    PotBacklash "pot_backlash" Reference ["dahl", "bouc_wen"] 1e-3 .. 2.0, 0.0;
    ValveSticking "valve_sticking" Pneumatics ["late_opening", "slow_closing"] 1e-3 .. 0.3, 0.0;
    AdiabaticGas "adiabatic_gas" Pneumatics ["polytropic"] 1e-3 .. 0.6, 0.0;
    SupplyOscillation "supply_oscillation" Pneumatics ["sine"] 1e-4 .. 0.12, 0.0;
    OutletCrossflow "outlet_crossflow" Pneumatics ["share_of_inlet"] 1e-4 .. 0.3, 0.0;
    AsymmetricLag "asymmetric_lag" Muscle ["slower_extension", "slower_contraction"] 1e-2 .. 4.0, 0.0;
    SnapThrough "snap_through" Muscle ["bistable"] 1e-5 .. 0.03, 0.0;
    MuscleFatigue "muscle_fatigue" Muscle ["recovering"] 1e-4 .. 0.15, 0.0;
    CapacitivePickup "capacitive_pickup" Sensing ["command_edges"] 1e-3 .. 0.6, 0.0;
    AmplifierSlew "amplifier_slew" Sensing ["rate_limit"] 0.1 .. 30.0, 0.0;
    MissingCodes "missing_codes" Sensing ["sticky_bit"] 0.05 .. 64.0, 0.0;
    CoilDroop "coil_droop" Sensing ["coil_current"] 1e-5 .. 0.1, 0.0;
    IntermittentContact "intermittent_contact" Sensing ["telegraph"] 1e-5 .. 0.1, 0.0;
    FrozenSamples "frozen_samples" Sensing ["runs"] 1e-3 .. 0.6, 0.0;
    PotStiction "pot_stiction" Reference ["stick_and_jump"] 1e-3 .. 3.0, 0.0;
}

/// Number of kinds in the list above that are in the catalogue of effects.
pub(crate) const CATALOGUED: usize = 23;

impl Kind {
    pub(crate) fn spec(self) -> &'static Spec {
        &SPECS[self as usize]
    }

    /// Returns the kinds that the catalogue contains.
    pub(crate) fn catalogued() -> &'static [Kind] {
        &KINDS[..CATALOGUED]
    }

    /// Returns the kinds that the catalogue lacks.
    pub(crate) fn foreign() -> &'static [Kind] {
        &KINDS[CATALOGUED..]
    }

    /// Whether the catalogue of effects contains the kind.
    pub(crate) fn is_catalogued(self) -> bool {
        (self as usize) < CATALOGUED
    }

    /// Returns the kind of this name.
    pub(crate) fn named(name: &str) -> Option<Kind> {
        KINDS.iter().copied().find(|k| k.spec().name == name)
    }
}

/// An active cause: a kind in one of its forms at one strength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cause {
    pub(crate) kind: Kind,
    /// Family of the form. Causes outside the catalogue always have hand-written forms.
    pub(crate) family: Family,
    /// Index of the hand-written form.
    pub(crate) form: usize,
    /// Main parameter without its sign, in the unit of the catalogue.
    pub(crate) strength: f64,
    pub(crate) sign: f64,
    /// Uniform random numbers for the secondary parameters of the form.
    pub(crate) aux: [f64; 3],
    /// Seed of the random numbers of this cause.
    pub(crate) seed: u64,
}

impl Cause {
    /// Draws form, sign and secondary parameters. The strength is set to its maximum.
    pub(crate) fn draw(kind: Kind, family: Family, random: &mut RandomGenerator) -> Self {
        let form = random.below(kind.spec().forms.len());
        let negative = kind.spec().negative > 0.0 && random.unit() < 0.5;
        let sign = if negative { -1.0 } else { 1.0 };
        let aux = std::array::from_fn(|_| random.unit());
        let seed = random.bits();
        let family = if kind.is_catalogued() { family } else { Family::Written };
        let mut cause = Self { kind, family, form, strength: 0.0, sign, aux, seed };
        cause.strength = cause.most();
        cause
    }

    /// Returns the name of a hand-written form, or else of the family.
    pub(crate) fn form_name(&self) -> &'static str {
        if self.is_drawn() { self.family.name() } else { self.kind.spec().forms[self.form] }
    }

    /// Whether the form is drawn from a function space.
    pub(crate) fn is_drawn(&self) -> bool {
        self.family != Family::Written
    }

    /// Returns the random generator of the form. It does not depend on the strength.
    pub(crate) fn random(&self, purpose: u64) -> RandomGenerator {
        RandomGenerator::new(self.seed, 1000 + purpose)
    }

    /// Returns the greatest strength with the sign of this cause.
    pub(crate) fn most(&self) -> f64 {
        let spec = self.kind.spec();
        if self.sign < 0.0 { spec.most * spec.negative } else { spec.most }
    }

    /// Returns the same cause at another strength.
    pub(crate) fn at(self, strength: f64) -> Self {
        Self { strength, ..self }
    }

    /// Returns the strength with its sign.
    pub(crate) fn signed(&self) -> f64 {
        self.sign * self.strength
    }

    /// Returns a log-uniform secondary parameter, computed from one of the uniform numbers.
    pub(crate) fn log_aux(&self, index: usize, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.aux[index])
    }
}

/// The active causes of a rig.
#[derive(Debug, Clone, Default)]
pub(crate) struct Causes(Vec<Cause>);

impl Causes {
    pub(crate) fn new(causes: &[Cause]) -> Self {
        Self(causes.to_vec())
    }

    pub(crate) fn find(&self, kind: Kind) -> Option<Cause> {
        self.0.iter().copied().find(|c| c.kind == kind)
    }

    pub(crate) fn any_in(&self, stage: Stage) -> bool {
        self.0.iter().any(|c| c.kind.spec().stage == stage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vocabulary_is_consistent() {
        assert_eq!(Kind::catalogued().len(), CATALOGUED);
        assert!(Kind::foreign().len() >= 8);
        assert_eq!(Kind::catalogued().last(), Some(&Kind::PotBacklash));
        for &kind in KINDS {
            let spec = kind.spec();
            assert_eq!(Kind::named(spec.name), Some(kind));
            assert!(spec.least > 0.0 && spec.least < spec.most, "{}", spec.name);
        }
    }
}
