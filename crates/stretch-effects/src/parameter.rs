//! A parameter of an effect, and what it is for.

use alloc::{borrow::Cow, borrow::ToOwned, vec, vec::Vec};
use core::ops::RangeInclusive;

/// How a parameter's range is best walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Scale {
    /// In equal differences.
    Linear,
    /// In equal ratios.
    Log,
}

/// What a parameter of an effect is for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Role {
    /// How strong the effect is.
    Strength {
        /// Value at which it does nothing.
        off: f64,
    },
    /// A scale or a time constant: what the effect is like at any strength.
    Shape,
    /// A freedom of form that measured rigs ask for (a knee's width, a spread of time constants). A simulation takes its
    /// neutral value, [`EffectParameter::typical`], at which the effect is the plain one; a diagnosis fits it around its usual value and
    /// does not count it as a parameter of the effect.
    Form {
        /// Value of a usual rig: where the diagnosis starts, and what it has to pay for leaving.
        usual: f64,
    },
    /// One of a few values (50 or 60 Hz): the diagnosis tries those of the starts.
    Choice,
    /// What a record alone can tell (the phase of a hum): no part of a diagnosis' answer.
    Found {
        /// Replaces it if there is no record.
        stand_in: f64,
    },
}

impl Role {
    /// Its name in listings.
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
/// `strength`, `shape` and `form` make one in a `static`; [`sized`](Self::sized), [`shaped`](Self::shaped) and
/// [`formed`](Self::formed) from names and units that are known at run time.
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
    /// Unit; `1` when it has none. In the rig's catalogue `strain`, `mm` and `V` are what scales with the stroke.
    pub unit: Cow<'static, str>,
    /// Least plausible value: where the search ends.
    pub min: f64,
    /// Greatest plausible value.
    pub max: f64,
    /// What it is when it is not given; of a form the neutral value.
    pub typical: f64,
    /// What it is for.
    pub role: Role,
    /// How its range is best walked.
    pub scale: Scale,
}

/// Where a form is neutral, and where a usual rig has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    /// Value at which the effect is the plain one.
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

    /// A shape (a scale, a time constant), searched in equal ratios.
    pub const fn shape(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        typical: f64,
    ) -> Self {
        Self::strength(name, unit, min, max, typical).with_role(Role::Shape).log()
    }

    /// A form, searched in equal differences from `min` to `max`; its neutral value may lie outside, as a limit.
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

    /// A strength that does nothing at 0, searched in equal differences; typically a fifth of its greatest value.
    pub fn sized(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        let (min, max) = range.into_inner();
        let role = Role::Strength { off: 0.0 };
        let (name, unit) = (Cow::Owned(name.to_owned()), Cow::Owned(unit.to_owned()));
        Self { name, unit, min, max, typical: 0.2 * max, role, scale: Scale::Linear }
    }

    /// A shape (a time constant, a spread) above 0, searched in equal ratios; typically in their middle.
    pub fn shaped(name: &str, unit: &str, range: RangeInclusive<f64>) -> Self {
        let typical = libm::sqrt(range.start() * range.end());
        Self { typical, ..Self::sized(name, unit, range).with_role(Role::Shape).log() }
    }

    /// A form around its usual value, searched in equal differences.
    pub fn formed(name: &str, unit: &str, range: RangeInclusive<f64>, usual: f64) -> Self {
        let role = Role::Form { usual };
        Self { typical: usual, ..Self::sized(name, unit, range).with_role(role) }
    }

    /// The same, off at another value.
    pub const fn off_at(self, off: f64) -> Self {
        self.with_role(Role::Strength { off })
    }

    /// The same in another role.
    pub const fn with_role(mut self, role: Role) -> Self {
        self.role = role;
        self
    }

    /// The same, searched in equal ratios.
    pub const fn log(mut self) -> Self {
        self.scale = Scale::Log;
        self
    }

    /// The same, searched in equal differences.
    pub const fn linear(mut self) -> Self {
        self.scale = Scale::Linear;
        self
    }

    /// The same with every value times `unit`, in the unit of that name.
    pub fn times(&self, unit: f64, name: &str) -> Self {
        let role = match self.role {
            Role::Strength { off } => Role::Strength { off: unit * off },
            Role::Form { usual } => Role::Form { usual: unit * usual },
            role => role,
        };
        let [min, max, typical] = [self.min, self.max, self.typical].map(|x| unit * x);
        Self { unit: Cow::Owned(name.to_owned()), min, max, typical, role, ..self.clone() }
    }

    /// Value at which it does nothing; none for what only shapes the effect.
    pub const fn off(&self) -> Option<f64> {
        match self.role {
            Role::Strength { off } => Some(off),
            _ => None,
        }
    }

    /// Usual value of what only gives the effect its form (a knee's width, a spread); none of anything else.
    pub const fn usual_form(&self) -> Option<f64> {
        match self.role {
            Role::Form { usual } => Some(usual),
            _ => None,
        }
    }

    /// Whether it only gives the effect its form.
    pub const fn is_form(&self) -> bool {
        matches!(self.role, Role::Form { .. })
    }

    /// Whether it is searched in equal ratios.
    pub const fn is_log(&self) -> bool {
        matches!(self.scale, Scale::Log)
    }

    /// Whether a fit moves it; otherwise it keeps the value of the start.
    pub const fn is_fitted(&self) -> bool {
        !matches!(self.role, Role::Choice | Role::Found { .. })
    }

    /// Whether only a record tells it.
    pub const fn is_found(&self) -> bool {
        matches!(self.role, Role::Found { .. })
    }

    /// Where a diagnosis begins: the usual value of a form, else the typical one.
    pub const fn usual(&self) -> f64 {
        match self.role {
            Role::Form { usual } => usual,
            _ => self.typical,
        }
    }

    /// Values that make sense: the range, as far as to the neutral value of a form.
    pub fn allowed(&self) -> RangeInclusive<f64> {
        match self.role {
            Role::Form { .. } => self.min.min(self.typical)..=self.max.max(self.typical),
            _ => self.min..=self.max,
        }
    }

    /// Values to screen at:
    ///
    /// - a strength: a fiftieth and a fifth of its range, of both signs if it has both;
    /// - a threshold, which is off elsewhere than at 0: a twentieth, a fifth, three fifths and nine tenths of the way from there, because it
    ///   may reach the signal only near the other end;
    /// - a shape, and a strength that is searched in equal ratios: a sixth, a half and five sixths of its range;
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
            // What is searched in equal ratios never gets to 0.
            Role::Strength { off } if off != 0.0 || !self.is_log() || self.min <= 0.0 => off,
            _ => return [1.0, 3.0, 5.0].map(between).into(),
        };
        let shares: &[f64] = if off == 0.0 { &[0.02, 0.2] } else { &[0.05, 0.2, 0.6, 0.9] };
        let ends = [self.min, self.max].into_iter().filter(|end| *end != off);
        ends.flat_map(|end| shares.iter().map(move |s| off + s * (end - off))).collect()
    }

    /// Every combination of the parameters' [`points`](Self::points).
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

    /// A start whose last values were left out, filled up: forms with their usual value, strengths off.
    pub fn complete(parameters: &[Self], mut start: Vec<f64>) -> Vec<f64> {
        let rest = parameters.iter().skip(start.len());
        start.extend(rest.map(|p| p.off().unwrap_or(p.usual())));
        start
    }

    /// Whether these values do nothing: every strength is at its off value.
    pub fn are_off(parameters: &[Self], values: &[f64]) -> bool {
        parameters.iter().zip(values).all(|(p, v)| p.off().is_none_or(|off| *v == off))
    }
}
