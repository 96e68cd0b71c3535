//! A parameter of an effect, and what it is for.

use std::ops::RangeInclusive;

/// How a parameter's range is best walked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// In equal differences.
    Linear,
    /// In equal ratios.
    Log,
}

/// What a parameter of an effect is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// How strong the effect is.
    Strength {
        /// Value at which it does nothing.
        off: f64,
    },
    /// A scale or a time constant: what the effect is like at any strength.
    Shape,
    /// A freedom of form that measured rigs ask for (a knee's width, a spread of time constants). The simulator takes its
    /// neutral value, [`EffectParameter::typical`], at which the effect is the plain one; the diagnosis fits it.
    Form {
        /// Value of a usual rig: where the diagnosis starts, and what it has to pay for leaving.
        usual: f64,
    },
    /// One of a few values (50 or 60 Hz): the diagnosis tries those of the starts.
    Choice,
    /// What a record alone can tell (the phase of a hum): no part of a diagnosis' answer.
    Found {
        /// Stands in for it where there is no record.
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
/// ```
/// use stretch_sim::{EffectParameter, Form, Role};
/// const TAIL: EffectParameter =
///     EffectParameter::form("tail", "1", 0.05, 2.5, Form { neutral: 0.0, usual: 0.3 }).log();
/// assert_eq!((TAIL.typical, TAIL.role), (0.0, Role::Form { usual: 0.3 }));
/// assert_eq!(TAIL.allowed(), 0.0..=2.5); // it is looked for from 0.05 on, and neutral at 0
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Name in files and on the command line.
    pub name: &'static str,
    /// Unit; `1` when it has none, `strain`, `mm` and `V` for what scales with the stroke.
    pub unit: &'static str,
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
        Self { name, unit, min, max, typical, role: Role::Shape, scale: Scale::Log }
    }

    /// A form, searched in equal differences from `min` to `max`; its neutral value may lie outside, as a limit.
    pub const fn form(
        name: &'static str,
        unit: &'static str,
        min: f64,
        max: f64,
        form: Form,
    ) -> Self {
        let Form { neutral, usual } = form;
        let role = Role::Form { usual };
        Self { name, unit, min, max, typical: neutral, role, scale: Scale::Linear }
    }

    /// The same, off at another value.
    pub const fn off_at(self, off: f64) -> Self {
        Self { role: Role::Strength { off }, ..self }
    }

    /// The same in another role.
    pub const fn with_role(self, role: Role) -> Self {
        Self { role, ..self }
    }

    /// The same, searched in equal ratios.
    pub const fn log(self) -> Self {
        Self { scale: Scale::Log, ..self }
    }

    /// The same, searched in equal differences.
    pub const fn linear(self) -> Self {
        Self { scale: Scale::Linear, ..self }
    }

    /// Value at which it does nothing; none for what only shapes the effect.
    pub const fn off(&self) -> Option<f64> {
        match self.role {
            Role::Strength { off } => Some(off),
            _ => None,
        }
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
}
