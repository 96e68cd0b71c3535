//! Direction of the target's movement.

use core::ops::Neg;

/// Direction of the target's movement, which selects the calibration surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Branch {
    /// The target rises: a pneumatic muscle fills and shortens, or a joint flexes.
    #[default]
    Inflation,
    /// The target falls.
    Deflation,
}

impl Branch {
    /// Returns the branch for a rate of the target, given the previous branch. The branch changes
    /// only if the rate leaves the dead band (`|rate| > dead_band`). If the rate is
    /// NaN, the branch stays. The function works on floats and integers.
    ///
    /// ```
    /// use stretch_core::Branch;
    /// assert_eq!(Branch::Inflation.next(-0.05, 0.1), Branch::Inflation);
    /// assert_eq!(Branch::Inflation.next(-0.2, 0.1), Branch::Deflation);
    /// ```
    #[inline]
    #[must_use]
    pub fn next<T: Copy + PartialOrd + Neg<Output = T>>(self, rate: T, dead_band: T) -> Self {
        if rate > dead_band {
            Self::Inflation
        } else if rate < -dead_band {
            Self::Deflation
        } else {
            self
        }
    }

    /// Returns the other branch.
    ///
    /// ```
    /// use stretch_core::Branch;
    /// assert_eq!(Branch::Inflation.opposite(), Branch::Deflation);
    /// assert_eq!(Branch::Inflation.opposite().opposite(), Branch::Inflation);
    /// ```
    #[inline]
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Inflation => Self::Deflation,
            Self::Deflation => Self::Inflation,
        }
    }
}

impl core::fmt::Display for Branch {
    /// Writes the direction in which the target moves. [`Target::branch_name`](crate::Target::branch_name) returns the
    /// direction in which the reference moves.
    ///
    /// ```
    /// assert_eq!(stretch_core::Branch::Inflation.to_string(), "target_rises");
    /// ```
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Inflation => "target_rises",
            Self::Deflation => "target_falls",
        })
    }
}
