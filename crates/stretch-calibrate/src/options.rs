//! Options of a calibration, and their spellings.

use std::{fmt, str::FromStr};

use stretch_core::{Degree, DesignError, Interval, Normalisation, RateEstimator, RateSource};

/// The model that is fitted.
///
/// ```
/// use stretch_calibrate::ModelKind;
/// use stretch_core::Degree;
/// assert_eq!("poly13".parse(), Ok(ModelKind::Surface(Degree::POLY13)));
/// assert_eq!(ModelKind::Linear.to_string(), "linear");
/// assert!("poly16".parse::<ModelKind>().unwrap_err().to_string().contains("poly55"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// One straight line for both directions.
    Linear,
    /// One polynomial of the signal, whose degree cross-validation chooses.
    Curve,
    /// A polynomial surface for each branch.
    Surface(Degree),
    /// A model with a memory of the signal.
    Remembering {
        /// The form of the memory.
        kind: Memory,
        /// Whether a drifting baseline of the resting signal is tracked.
        rest: bool,
    },
}

/// The form of a model's memory. The history model chooses time constants, radii and ridge by cross-validation. The
/// other models fit their numbers to the trials.
///
/// ```
/// use stretch_calibrate::{Memory, ModelKind};
/// let kind = ModelKind::Remembering { kind: Memory::History, rest: true };
/// assert_eq!("history+rest".parse(), Ok(kind));
/// assert_eq!(kind.to_string(), "history+rest");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Memory {
    /// A polynomial of the signal, of relaxation states and of plays: the inverse of lag, lead and hysteresis.
    History,
    /// The gauge's forward model, inverted by a Kalman filter.
    Observer,
    /// The gauge's forward model, built from the effects that a diagnosis named: [`Options::causes`].
    Diagnosed,
}

impl Memory {
    /// All forms, simplest first.
    pub const ALL: [Self; 3] = [Self::History, Self::Observer, Self::Diagnosed];
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::History => "history",
            Self::Observer => "observer",
            Self::Diagnosed => "diagnosed",
        })
    }
}

/// Column of the pressure, which some causes need.
pub const PRESSURE: &str = "pressure_kpa";

/// Robust weighting of the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Robust {
    /// Least squares.
    #[default]
    Off,
    /// Bisquare weights: gross outliers have no weight.
    Bisquare,
    /// Least absolute residuals.
    Lar,
}

/// Assignment of samples to the two branches (directions of motion).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SplitBy {
    /// Sample by sample, by the sign of the rate outside the dead band, as in the live receptor.
    #[default]
    Rate,
    /// Trial by trial, by the net change of the target: the paper's six
    /// inflations and six deflations.
    Trial,
}

/// An unknown spelling, with the spellings that are accepted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{given}\" is not understood; use {use_instead}")]
pub struct SpellingError {
    given: String,
    use_instead: &'static str,
}

impl SpellingError {
    /// An error with the given spelling and the accepted spellings.
    pub fn new(given: &str, use_instead: &'static str) -> Self {
        Self { given: given.to_owned(), use_instead }
    }
}

impl ModelKind {
    /// Returns the names that `--model` accepts for trials with time stamps, simplest first. poly13 represents all
    /// surfaces.
    ///
    /// ```
    /// use stretch_calibrate::ModelKind;
    /// assert!(ModelKind::named().iter().all(|kind| kind.to_string().parse() == Ok(*kind)));
    /// ```
    pub fn named() -> Vec<Self> {
        let mut kinds = vec![Self::Linear, Self::Surface(Degree::POLY13)];
        for rest in [false, true] {
            kinds.extend(Memory::ALL.map(|kind| Self::Remembering { kind, rest }));
        }
        kinds
    }
}

const MODELS: &str = "linear, curve, poly13, polyIJ with degrees up to poly55, history, observer or \
                      diagnosed, the last three also with +rest";

impl FromStr for ModelKind {
    type Err = SpellingError;

    fn from_str(text: &str) -> Result<Self, SpellingError> {
        let unknown = || SpellingError::new(text, MODELS);
        if text == "linear" {
            return Ok(Self::Linear);
        }
        if text == "curve" {
            return Ok(Self::Curve);
        }
        let (name, rest) = match text.strip_suffix("+rest") {
            Some(name) => (name, true),
            None => (text, false),
        };
        if let Some(kind) = Memory::ALL.into_iter().find(|kind| kind.to_string() == name) {
            return Ok(Self::Remembering { kind, rest });
        }
        // A polynomial of the signal alone.
        let degree =
            ["quadratic", "cubic", "quartic", "quintic"].iter().position(|name| *name == text);
        if let Some(instead) = degree.and_then(|i| ["poly02", "poly03", "poly04", "poly05"].get(i))
        {
            return Err(SpellingError::new(text, instead));
        }
        let digits = text.strip_prefix("poly").ok_or_else(unknown)?;
        let [i, j] = digits.as_bytes() else { return Err(unknown()) };
        if !(i.is_ascii_digit() && j.is_ascii_digit()) {
            return Err(unknown());
        }
        Degree::new(i - b'0', j - b'0').map(Self::Surface).map_err(|_| unknown())
    }
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear => f.pad("linear"),
            Self::Curve => f.pad("curve"),
            Self::Surface(degree) => f.pad(&degree.to_string()),
            Self::Remembering { kind, rest: false } => f.pad(&kind.to_string()),
            Self::Remembering { kind, rest: true } => f.pad(&format!("{kind}+rest")),
        }
    }
}

const RATES: &str = "savgol:WINDOW,DEGREE[,DELAY] in samples, difference:CUTOFF_HZ, \
                     tracker:INDEX, or central (for recordings, not live)";

/// Parses a rate estimator: `savgol:11,2`, `savgol:11,2,5`, `difference:8`, `tracker:0.1`, `central`.
///
/// # Errors
/// [`SpellingError`] with the accepted spellings.
///
/// ```
/// use stretch_calibrate::parse_rate;
/// use stretch_core::RateEstimator;
/// assert_eq!(parse_rate("savgol:11,2"), Ok(RateEstimator::SAVGOL_11_2));
/// assert!(parse_rate("savgol:2,5").is_err()); // a quintic through two points
/// ```
pub fn parse_rate(text: &str) -> Result<RateEstimator, SpellingError> {
    let unknown = || SpellingError::new(text, RATES);
    let number = |text: &str| text.parse::<f64>().map_err(|_| unknown());
    let estimator = match text.split_once(':') {
        None if text == "central" => RateEstimator::CentralDifference,
        Some(("savgol", shape)) => {
            let parts: Vec<&str> = shape.split(',').collect();
            let count =
                |i: usize| parts.get(i).unwrap_or(&"0").parse::<u16>().map_err(|_| unknown());
            if !(2..=3).contains(&parts.len()) {
                return Err(unknown());
            }
            let degree = u8::try_from(count(1)?).map_err(|_| unknown())?;
            RateEstimator::SavitzkyGolay { window: count(0)?, degree, delay: count(2)? }
        }
        Some(("difference", hz)) => RateEstimator::Differentiator { cutoff_hz: number(hz)? },
        Some(("tracker", index)) => RateEstimator::Tracker { tracking_index: number(index)? },
        _ => return Err(unknown()),
    };
    estimator.validate().map_err(|_: DesignError| unknown())
}

/// Options of a calibration. [`Options::default`] is recommended; [`Options::paper`] gives the published method.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Column of the signal.
    pub signal: String,
    /// Column of the reference.
    pub reference: String,
    /// The model that is fitted.
    pub model: ModelKind,
    /// The normalisation of signal, target and rates.
    pub normalisation: Normalisation,
    /// The estimator of the signal's rate in the live receptor.
    pub rate: RateEstimator,
    /// The rate to which the surfaces are fitted.
    pub rate_source: RateSource,
    /// The assignment of samples to the branches.
    pub split: SplitBy,
    /// Robust weighting of the residuals.
    pub robust: Robust,
    /// The signal that [`Normalisation::Range`] maps to zero. If `None`, it is 1.24 V for a `bridge_v` with values near
    /// 1.24 V. For other signals it is the middle of the signal's range, because powers of a signal with a large offset
    /// lose digits by cancellation.
    pub signal_zero: Option<f64>,
    /// Resting length; the target is then the contraction. If `None`, the resting length of a reference whose name
    /// begins with `length` is its greatest value, and any other reference is the target itself.
    pub rest_length: Option<f64>,
    /// Dead band of the branch decision, in signal units per second. If `None`, three standard deviations of the rate's
    /// noise.
    pub dead_band: Option<f64>,
    /// Whether the rows are pairs of weight and reading in any order, without time stamps. Models with a rate or a
    /// memory cannot be fitted to such a table.
    pub is_table: bool,
    /// Date of the calibration, as free text for the calibration file.
    pub date: String,
    /// Time column of the trials for the calibration file, such as `stamp:ms`; empty for a usual one.
    pub time: String,
    /// The effects that a diagnosis named, for [`Memory::Diagnosed`].
    pub causes: Vec<Cause>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            signal: "bridge_v".into(),
            reference: "length_mm".into(),
            model: ModelKind::Surface(Degree::POLY13),
            normalisation: Normalisation::Range,
            rate: RateEstimator::SAVGOL_11_2,
            rate_source: RateSource::Voltage,
            split: SplitBy::Rate,
            robust: Robust::Off,
            signal_zero: None,
            rest_length: None,
            dead_band: None,
            is_table: false,
            date: String::new(),
            time: String::new(),
            causes: Vec::new(),
        }
    }
}

impl Options {
    /// The method as published (paper section 2.5). It uses central differences of the strain for the fit and of the
    /// voltage afterwards, a surface for the inflation trials and one for the deflation trials, and no dead band.
    pub fn paper() -> Self {
        Self {
            rate: RateEstimator::CentralDifference,
            rate_source: RateSource::Strain,
            split: SplitBy::Trial,
            dead_band: Some(0.0),
            ..Self::default()
        }
    }

    /// Returns the options with the full names of their columns in the trials, such as `voltage_v` for `Voltage`.
    pub fn named_as(&self, trials: &[stretch_data::Trial]) -> Self {
        let full = |name: &str| stretch_data::full_name(trials.first(), name);
        Self { signal: full(&self.signal), reference: full(&self.reference), ..self.clone() }
    }

    pub(crate) fn needs_pressure(&self) -> bool {
        self.causes.iter().any(|cause| cause.effect == "pressure_crosstalk")
    }

    /// Returns the zero of a signal with the range `seen`.
    pub(crate) fn zero(&self, seen: Interval) -> f64 {
        let span = seen.max - seen.min;
        // A zero is near if its distance from the range is at most the width of the range.
        let is_near = (seen.min - span..=seen.max + span).contains(&BRIDGE_ZERO_V);
        let usual = match self.signal == "bridge_v" && is_near {
            true => BRIDGE_ZERO_V,
            false => seen.min + 0.5 * span,
        };
        self.signal_zero.unwrap_or(usual)
    }
}

/// Voltage of the published bridge at rest (paper section 2.5).
const BRIDGE_ZERO_V: f64 = 1.24;

/// An effect of the gauge or of its reference, with the parameter values that a diagnosis found.
///
/// Names are those of the catalogue (`stretch effects`). Strains, lengths and voltages are shares of the reference's
/// range over the calibrated trials; times are in seconds. A fit starts at these values.
///
/// ```
/// use stretch_calibrate::Cause;
/// let cause = Cause::new("gauge_relaxation", &[("c", 0.2), ("tau", 0.4)]);
/// assert_eq!((cause.value("tau"), cause.value("spread")), (Some(0.4), None));
/// ```
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cause {
    /// The effect.
    pub effect: String,
    /// Parameters of the effect, by name.
    pub values: Vec<(String, f64)>,
}

impl Cause {
    /// An effect from its name and the values of its parameters.
    pub fn new(effect: &str, values: &[(&str, f64)]) -> Self {
        let values = values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        Self { effect: effect.to_owned(), values }
    }

    /// Returns the value of a parameter, if it was found.
    pub fn value(&self, parameter: &str) -> Option<f64> {
        self.values.iter().find(|(name, _)| name == parameter).map(|(_, value)| *value)
    }
}

/// One sentence that explains the candidate models to new users.
///
/// ```
/// use stretch_calibrate::{MODELS_IN_WORDS, Memory};
/// for kind in Memory::ALL.into_iter().filter(|kind| *kind != Memory::Diagnosed) {
///     assert!(MODELS_IN_WORDS.contains(&kind.to_string()), "{kind}");
/// }
/// ```
pub const MODELS_IN_WORDS: &str = "linear is a line; curve is a polynomial of the signal; poly13 is a polynomial of the signal \
    and its rate for each direction of motion; history and observer also use earlier samples; with +rest they follow a drifting baseline";
