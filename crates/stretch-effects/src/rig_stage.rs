//! The stages of the rig, as names.

use core::fmt;

/// A stage of the rig: what is simulated alone on a measured input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum RigStage {
    /// Openings to pressure.
    Pneumatics,
    /// Pressure to length.
    Muscle,
    /// Openings to length, both of the above as one.
    Actuation,
    /// Length (and pressure, for cross-talk) to bridge voltage.
    Sensing,
    /// True length to measured length.
    Reference,
}

impl RigStage {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Pneumatics, Self::Muscle, Self::Actuation, Self::Sensing, Self::Reference];

    /// Its name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pneumatics => "pneumatics",
            Self::Muscle => "muscle",
            Self::Actuation => "actuation",
            Self::Sensing => "sensing",
            Self::Reference => "reference",
        }
    }

    /// Whether an effect or a parameter of the stage `other` acts in it: `actuation` holds `pneumatics` and `muscle`.
    pub fn holds(self, other: Self) -> bool {
        self == other
            || (self == Self::Actuation && matches!(other, Self::Pneumatics | Self::Muscle))
    }
}

impl fmt::Display for RigStage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
