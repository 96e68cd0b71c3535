//! The nominal parameters: one flat vector, each entry with unit, tolerance and meaning.

use std::ops::{Index, IndexMut};

use stretch_data::Parameter;

use stretch_effects::{Grid, RigStage, Surroundings};

/// Uncertainty of a nominal parameter, as one standard deviation. A diagnosis may re-tune the parameter within three
/// standard deviations; a larger deviation counts as an effect that the model lacks.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Tolerance {
    /// Known exactly: never re-tuned.
    #[default]
    Exact,
    /// A share of the nominal value.
    Relative(f64),
    /// In the unit of the value.
    Absolute(f64),
}

impl Tolerance {
    /// One standard deviation of a parameter whose nominal value is `value`, in its unit; 0 when exact.
    ///
    /// ```
    /// use stretch_sim::Tolerance;
    /// assert_eq!(Tolerance::Relative(0.1).sd(-4.0), 0.4);
    /// assert_eq!(Tolerance::Exact.sd(4.0), 0.0);
    /// ```
    pub fn sd(self, value: f64) -> f64 {
        match self {
            Self::Exact => 0.0,
            Self::Relative(share) => share * value.abs(),
            Self::Absolute(sd) => sd,
        }
    }

    /// Tolerance in a rig file: exact if it is missing or not above zero.
    pub(crate) fn of(parameter: &Parameter) -> Self {
        match (parameter.tolerance_abs, parameter.tolerance) {
            (Some(sd), _) if sd > 0.0 => Self::Absolute(sd),
            (None, Some(share)) if share > 0.0 => Self::Relative(share),
            _ => Self::Exact,
        }
    }

    /// A value with this tolerance as a rig file holds it.
    pub(crate) fn of_value(self, value: f64) -> Parameter {
        let (tolerance, tolerance_abs) = match self {
            Self::Exact => (None, None),
            Self::Relative(share) => (Some(share), None),
            Self::Absolute(sd) => (None, Some(sd)),
        };
        Parameter { value, tolerance, tolerance_abs }
    }
}

/// Description of one nominal parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterInfo {
    /// Key of the parameter.
    pub key: Key,
    /// Name in a rig file.
    pub name: &'static str,
    /// Table of the rig file, the stage that owns it.
    pub stage: RigStage,
    /// Unit, `1` when it has none.
    pub unit: &'static str,
    /// Default value.
    pub nominal: f64,
    /// Default tolerance.
    pub tolerance: Tolerance,
    /// Whether zero is allowed (it is for noise; everything else is strictly positive).
    pub zero_allowed: bool,
    /// Meaning of the parameter.
    pub meaning: &'static str,
}

macro_rules! parameters {
    ($($key:ident $name:literal $stage:ident $unit:literal $nominal:literal $tolerance:expr, $zero:literal, $meaning:literal;)*) => {
        /// Names a nominal parameter; `key as usize` is its index in the flat vector.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(usize)]
        pub enum Key { $(#[doc = $meaning] $key,)* }

        /// Every nominal parameter, in the order of the flat vector and of a rig file.
        pub static PARAMETERS: [ParameterInfo; Key::COUNT] = [$(ParameterInfo {
            key: Key::$key, name: $name, stage: RigStage::$stage, unit: $unit, nominal: $nominal,
            tolerance: $tolerance, zero_allowed: $zero, meaning: $meaning,
        },)*];

        impl Key {
            /// Number of nominal parameters.
            pub const COUNT: usize = [$(Key::$key),*].len();
        }
    };
}

use Tolerance::{Absolute, Exact, Relative};

parameters! {
    PS "P_s" Pneumatics "Pa gauge" 620e3 Relative(0.01), false, "Supply pressure above the atmosphere.";
    PAtm "P_atm" Pneumatics "Pa" 101_325.0 Exact, false, "Atmospheric pressure.";
    T "T" Pneumatics "K" 293.15 Exact, false, "Temperature of the air.";
    RAir "R_air" Pneumatics "J/(kg K)" 287.05 Exact, false, "Gas constant of air.";
    Rho0 "rho0" Pneumatics "kg/m3" 1.185 Exact, false, "Density of air at reference conditions (ISO 6358).";
    CIn "C_in" Pneumatics "m3/(s Pa)" 1e-9 Relative(0.3), false, "Sonic conductance of the inlet, fully open.";
    COut "C_out" Pneumatics "m3/(s Pa)" 1e-9 Relative(0.3), false, "Sonic conductance of the outlet, fully open.";
    B "b" Pneumatics "1" 0.35 Relative(0.1), false, "Critical pressure ratio of both valves.";
    UMin "u_min" Pneumatics "1" 0.02 Relative(0.2), false, "Share of the conductance of a barely open valve.";
    V0 "V0" Pneumatics "m3" 25e-6 Exact, false, "Volume of the chamber.";
    SigmaP "sigma_p" Pneumatics "Pa" 1200.0 Exact, true, "Noise of the pressure gauge, one standard deviation.";
    L0 "L0" Muscle "mm" 180.0 Exact, false, "Resting length of the muscle.";
    KMax "k_max" Muscle "1" 0.162 Relative(0.1), false, "Scale of contraction.";
    PRef "P_ref" Muscle "Pa" 620e3 Exact, false, "Pressure scale of the static law.";
    A0 "a0" Muscle "1" 0.5822 Relative(0.05), false, "Static law, amplitude.";
    A1 "a1" Muscle "1" 4.142 Relative(0.05), false, "Static law, initial steepness.";
    A3 "a3" Muscle "1" 0.5368 Relative(0.05), false, "Static law, stiffening.";
    TauM "tau_m" Muscle "s" 0.03 Relative(0.5), false, "Lag of the muscle.";
    E0 "e0" Sensing "1" 0.22 Relative(0.1), false, "Pre-stretch of the sleeve.";
    R0 "R0" Sensing "ohm" 4.0 Relative(0.1), false, "Resistance of the gauge, unstretched.";
    Beta "beta" Sensing "1" 1.0 Relative(0.01), false, "Trim balance of the bridge: R_b / R at rest.";
    VExc "V_exc" Sensing "V" 1.2 Relative(0.01), false, "Excitation of the bridge.";
    G "G" Sensing "1" 10.0 Relative(0.01), false, "Gain of the amplifier.";
    VRef "V_ref" Sensing "V" 1.24 Absolute(0.02), false, "Reference voltage of the amplifier.";
    SigmaV "sigma_v" Sensing "V" 0.002 Exact, true, "Noise of the bridge voltage, one standard deviation.";
    VFs "V_fs" Sensing "V" 3.3 Exact, false, "Full scale of the converter.";
    Bits "bits" Sensing "1" 12.0 Exact, false, "Bits of both converters.";
    SigmaL "sigma_L" Reference "mm" 0.05 Exact, true, "Noise of the reference, one standard deviation.";
    Travel "travel" Reference "mm" 50.0 Exact, false, "Travel of the reference over its converter's full scale.";
}

impl Key {
    /// Description of the parameter.
    pub fn info(self) -> &'static ParameterInfo {
        &PARAMETERS[self as usize]
    }

    /// The parameter called `name`, if there is one.
    ///
    /// ```
    /// use stretch_sim::Key;
    /// assert_eq!(Key::named("e0"), Some(Key::E0));
    /// assert_eq!(Key::named("E0"), None);
    /// ```
    pub fn named(name: &str) -> Option<Self> {
        PARAMETERS.iter().find(|p| p.name == name).map(|p| p.key)
    }
}

/// Values of all nominal parameters: a flat vector, read by [`Key`] or by index.
///
/// ```
/// use stretch_sim::{Key, RigParams};
/// let mut params = RigParams::default();
/// params[Key::TauM] *= 1.5;
/// assert_eq!(params.values()[Key::TauM as usize], 0.045);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigParams([f64; Key::COUNT]);

impl Default for RigParams {
    /// The stock rig.
    fn default() -> Self {
        Self(std::array::from_fn(|i| PARAMETERS[i].nominal))
    }
}

impl RigParams {
    /// All values in the order of [`PARAMETERS`].
    pub fn values(&self) -> &[f64; Key::COUNT] {
        &self.0
    }
    /// The surroundings of an effect in a rig with these values.
    pub fn surroundings<'a>(&self, grid: &'a Grid) -> Surroundings<'a> {
        let (stretch, k_max) = (1.0 + self[Key::E0], self[Key::KMax]);
        Surroundings {
            grid,
            strain_scale: self[Key::E0],
            strain_stroke: stretch * k_max,
            contraction_stroke: k_max,
            resistance_zero: self[Key::R0],
            length_zero: self[Key::L0],
            length_span: -self[Key::L0] * k_max,
            pressure_scale_kpa: 1e-3 * self[Key::PRef],
            strain_unit: 1.0,
            least_opening: self[Key::UMin],
        }
    }
}

impl Index<Key> for RigParams {
    type Output = f64;
    fn index(&self, key: Key) -> &f64 {
        &self.0[key as usize]
    }
}

impl IndexMut<Key> for RigParams {
    fn index_mut(&mut self, key: Key) -> &mut f64 {
        &mut self.0[key as usize]
    }
}
