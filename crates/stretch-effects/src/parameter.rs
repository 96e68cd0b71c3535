//! Parameters of an effect and their roles.

use alloc::{borrow::Cow, borrow::ToOwned, vec, vec::Vec};
use core::ops::RangeInclusive;

/// Spacing with which a parameter's range is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Log,
}

/// The role of a parameter in an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Role {
    /// Strength of the effect.
    Strength {
        /// Value at which the effect does nothing.
        off: f64,
    },
    /// A scale or a time constant, which describes the effect at any strength.
    Shape,
    /// A detail of form that varies between real rigs (a knee's width, a spread of time constants). A simulation uses
    /// the neutral value, [`EffectParameter::typical`], which gives the plain effect. A diagnosis fits the form around
    /// its usual value and does not count it as a parameter of the effect.
    Form {
        /// Value of a usual rig. The diagnosis starts there and penalises deviations from it.
        usual: f64,
    },
    /// One of a few values (50 or 60 Hz). The diagnosis tries the values in the starting points of the search and none
    /// between them.
    Choice,
    /// A number that is estimated from each recording (the phase of a hum). It is not part of the result of a diagnosis.
    Found {
        /// Value that is used if there is no recording.
        stand_in: f64,
    },
}

impl Role {
    /// Returns the name in listings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strength { .. } => "strength",
            Self::Shape => "shape",
            Self::Form { .. } => "form",
            Self::Choice => "choice",
            Self::Found { .. } => "found",
        }
    }
}

/// A parameter of an effect.
///
/// `strength`, `shape` and `form` make a parameter in a `static`. [`sized`](Self::sized), [`shaped`](Self::shaped) and
/// [`formed`](Self::formed) make one from names and units that are known only at run time.
///
/// ```
/// use stretch_effects::{Form, EffectParameter, Role};
/// const TAIL: EffectParameter =
///     EffectParameter::form("tail", "1", 0.05, 2.5, Form { neutral: 0.0, usual: 0.3 }).log();
/// assert_eq!((TAIL.typical, TAIL.role), (0.0, Role::Form { usual: 0.3 }));
/// assert_eq!(TAIL.allowed(), 0.0..=2.5); // it is looked for from 0.05 on, and neutral at 0
/// let w = EffectParameter::sized("w", "mm", 0.0..=2.0);
/// assert_eq!((w.off(), w.points()), (Some(0.0), vec![0.04, 0.4]));
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct EffectParameter {
    /// Name in files, in reports and on the command line.
    pub name: Cow<'static, str>,
    /// Unit; `1` if it has none. In the rig's catalogue, quantities in `strain`, `mm` and `V` scale with the stroke.
    pub unit: Cow<'static, str>,
    /// Smallest plausible value: the lower end of the search.
    pub min: f64,
    /// Greatest plausible value: the upper end of the search.
    pub max: f64,
    /// Default value. A form made by `form` has its neutral value here, a form made by `formed` has its usual value.
    pub typical: f64,
    /// Role of the parameter.
    pub role: Role,
    /// Spacing with which its range is searched.
    pub scale: Scale,
}

/// The neutral value of a form, and its value in a usual rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// Value that gives the plain effect.
    pub neutral: f64,
    /// Value of a usual rig.
    pub usual: f64,
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
        let role = Role::Strength { off: 0.0 };
        let (name, unit) = (Cow::Borrowed(name), Cow::Borrowed(unit));
        Self { name, unit, min, max, typical, role, scale: Scale::Linear }
    }

    /// A shape (a scale, a time constant), searched on a logarithmic scale.
    pub const fn shape(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        typical: f64,
    ) -> Self {
        Self::strength(name, unit, min, max, typical).with_role(Role::Shape).log()
    }

    /// A form, searched in equal differences from `min` to `max`. Its neutral value may lie outside this range.
    pub const fn form(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        form: Form,
    ) -> Self {
        let role = Role::Form { usual: form.usual };
        Self::strength(name, unit, min, max, form.neutral).with_role(role)
    }

    /// A strength that is off at 0, searched in equal differences. Its typical value is a fifth of its greatest value.
    pub fn sized(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        let (min, max) = range.into_inner();
        let role = Role::Strength { off: 0.0 };
        let (name, unit) = (Cow::Owned(name.to_owned()), Cow::Owned(unit.to_owned()));
        Self { name, unit, min, max, typical: 0.2 * max, role, scale: Scale::Linear }
    }

    /// A shape (a time constant, a spread) above 0, searched in equal ratios. Its typical value is the geometric mean
    /// of the ends.
    pub fn shaped(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        let typical = libm::sqrt(range.start() * range.end());
        Self { typical, ..Self::sized(name, unit, range).with_role(Role::Shape).log() }
    }

    /// A form whose typical value is its usual value, searched in equal differences.
    pub fn formed(name: &str, unit: &str, range: RangeInclusive<f64>, usual: f64) -> Self {
        let role = Role::Form { usual };
        Self { typical: usual, ..Self::sized(name, unit, range).with_role(role) }
    }

    /// Returns the same parameter as a strength that is off at another value.
    pub const fn off_at(self, off: f64) -> Self {
        self.with_role(Role::Strength { off })
    }

    /// Returns the same parameter in another role.
    pub const fn with_role(mut self, role: Role) -> Self {
        self.role = role;
        self
    }

    /// Returns the same parameter, searched in equal ratios.
    pub const fn log(mut self) -> Self {
        self.scale = Scale::Log;
        self
    }

    /// Returns the same parameter, searched in equal differences.
    pub const fn linear(mut self) -> Self {
        self.scale = Scale::Linear;
        self
    }

    /// Returns the same parameter with every value multiplied by `unit`, in the unit of that name.
    pub fn times(&self, unit: f64, name: &str) -> Self {
        let role = match self.role {
            Role::Strength { off } => Role::Strength { off: unit * off },
            Role::Form { usual } => Role::Form { usual: unit * usual },
            role => role,
        };
        let [min, max, typical] = [self.min, self.max, self.typical].map(|x| unit * x);
        Self { unit: Cow::Owned(name.to_owned()), min, max, typical, role, ..self.clone() }
    }

    /// Returns the value at which the effect does nothing; `None` if the parameter is not a strength.
    pub const fn off(&self) -> Option<f64> {
        match self.role {
            Role::Strength { off } => Some(off),
            _ => None,
        }
    }

    /// Returns the usual value of a form (a knee's width, a spread); `None` for other roles.
    pub const fn usual_form(&self) -> Option<f64> {
        match self.role {
            Role::Form { usual } => Some(usual),
            _ => None,
        }
    }

    /// Whether the parameter is a form.
    pub const fn is_form(&self) -> bool {
        matches!(self.role, Role::Form { .. })
    }

    /// Whether the parameter is searched in equal ratios.
    pub const fn is_log(&self) -> bool {
        matches!(self.scale, Scale::Log)
    }

    /// Whether a fit changes the parameter; otherwise it keeps its starting value.
    pub const fn is_fitted(&self) -> bool {
        !matches!(self.role, Role::Choice | Role::Found { .. })
    }

    /// Whether only a recording contains the parameter's value.
    pub const fn is_found(&self) -> bool {
        matches!(self.role, Role::Found { .. })
    }

    /// Returns the value at which a diagnosis begins: the usual value of a form, otherwise the typical value.
    pub const fn usual(&self) -> f64 {
        match self.role {
            Role::Form { usual } => usual,
            _ => self.typical,
        }
    }

    /// Returns the range of valid values: from `min` to `max`, extended to the typical value of a form.
    pub fn allowed(&self) -> RangeInclusive<f64> {
        match self.role {
            Role::Form { .. } => self.min.min(self.typical)..=self.max.max(self.typical),
            _ => self.min..=self.max,
        }
    }

    /// Returns the values to screen at:
    ///
    /// - a strength that is off at 0: 2 % and 20 % of each end of its range that is not 0;
    /// - a strength that is off at another value (a threshold): 5 %, 20 %, 60 % and 90 % of the way from there to each
    ///   end, because a threshold may reach the signal only near the other end;
    /// - a shape, and a positive strength that is searched in equal ratios and is off at 0: 1/6, 1/2 and 5/6 of its
    ///   range;
    /// - a choice or a found number: 1/6, 1/2 and 5/6 of its range;
    /// - a form: its usual value.
    ///
    /// ```
    /// use stretch_effects::EffectParameter;
    /// let leak = EffectParameter::sized("leak", "1/s", 1e-4..=1e2).log();
    /// let points = leak.points();
    /// assert!(points.len() == 3 && points.iter().all(|x| leak.allowed().contains(x)));
    /// assert!((points[1] - 0.1).abs() < 1e-9);
    /// ```
    pub fn points(&self) -> Vec<f64> {
        let between = |k: f64| match self.scale {
            Scale::Linear => self.min + (self.max - self.min) * k / 6.0,
            Scale::Log => self.min * libm::pow(self.max / self.min, k / 6.0),
        };
        let off = match self.role {
            Role::Form { usual } => return vec![usual],
            // A search in equal ratios never reaches 0.
            Role::Strength { off } if off != 0.0 || !self.is_log() || self.min <= 0.0 => off,
            _ => return [1.0, 3.0, 5.0].map(between).into(),
        };
        let shares: &[f64] = if off == 0.0 { &[0.02, 0.2] } else { &[0.05, 0.2, 0.6, 0.9] };
        let ends = [self.min, self.max].into_iter().filter(|end| *end != off);
        ends.flat_map(|end| shares.iter().map(move |s| off + s * (end - off))).collect()
    }

    /// Returns every combination of the parameters' [`points`](Self::points).
    ///
    /// ```
    /// use stretch_effects::EffectParameter;
    /// let c = EffectParameter::sized("c", "1", 0.0..=1.0);
    /// let tau = EffectParameter::shaped("tau", "s", 0.01..=10.0);
    /// let starts = EffectParameter::starts(&[c, tau]);
    /// assert_eq!((starts.len(), starts[0][0]), (2 * 3, 0.02));
    /// ```
    pub fn starts(parameters: &[Self]) -> Vec<Vec<f64>> {
        parameters.iter().fold(vec![Vec::new()], |starts, parameter| {
            let points = parameter.points();
            let with = |start: &Vec<f64>, x: &f64| [start.as_slice(), &[*x]].concat();
            starts.iter().flat_map(|s| points.iter().map(move |x| with(s, x))).collect()
        })
    }

    /// Completes a starting point whose last values were left out: strengths are off, other parameters have their usual
    /// values.
    pub fn complete(parameters: &[Self], mut start: Vec<f64>) -> Vec<f64> {
        let rest = parameters.iter().skip(start.len());
        start.extend(rest.map(|p| p.off().unwrap_or(p.usual())));
        start
    }

    /// Whether every strength is at its off value, so that the effect does nothing.
    pub fn are_off(parameters: &[Self], values: &[f64]) -> bool {
        parameters.iter().zip(values).all(|(p, v)| p.off().is_none_or(|off| *v == off))
    }
}
