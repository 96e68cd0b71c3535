//! The degree of a bivariate polynomial and its term set.

use crate::DesignError;

/// The highest degree in either variable.
pub const MAX_DEGREE: usize = 5;

/// Terms of the largest surface, poly55.
pub const MAX_TERMS: usize = 21;

/// The degrees of a polyIJ: `I` in the rate, `J` in the voltage.
///
/// The term set is that of MATLAB's curve fitter: every `rate^i volts^j` with
/// `i <= I`, `j <= J` and `i + j <= max(I, J)`, ordered by total degree and
/// then by falling power of the rate: p00 p10 p01 p20 p11 p02 ...
///
/// ```
/// use stretch_core::Degree;
/// let terms: Vec<_> = Degree::POLY13.exponents().collect();
/// assert_eq!(terms, [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2), (0, 3)]);
/// assert_eq!(Degree::new(5, 5)?.terms(), 21);
/// assert!(Degree::new(6, 1).is_err());
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "(u8, u8)", into = "(u8, u8)"))]
pub struct Degree {
    rate: u8,
    volts: u8,
}

impl Degree {
    /// A line over the voltage: `p00 + p01 volts`.
    pub const LINE: Self = Self { rate: 0, volts: 1 };

    /// The surface of the published method ("the paper"): degree 1 in rate, 3 in voltage.
    pub const POLY13: Self = Self { rate: 1, volts: 3 };

    /// Creates the degree `rate` in the rate and `volts` in the voltage.
    ///
    /// # Errors
    /// [`DesignError::TooLarge`] if either is above [`MAX_DEGREE`].
    pub const fn new(rate: u8, volts: u8) -> Result<Self, DesignError> {
        let asked = if rate > volts { rate } else { volts } as usize;
        if asked > MAX_DEGREE {
            return Err(DesignError::TooLarge { field: "degree", asked, most: MAX_DEGREE });
        }
        Ok(Self { rate, volts })
    }

    /// Degree in the rate.
    pub const fn rate(self) -> u8 {
        self.rate
    }

    /// Degree in the voltage.
    pub const fn volts(self) -> u8 {
        self.volts
    }

    /// The highest total degree of a term.
    pub const fn total(self) -> u8 {
        if self.rate > self.volts { self.rate } else { self.volts }
    }

    /// Returns the highest power of the voltage among the terms with `rate^i`.
    pub const fn volts_beside(self, i: u8) -> u8 {
        let left = self.total().saturating_sub(i);
        if left < self.volts { left } else { self.volts }
    }

    /// Returns the number of terms of the surface, at most [`MAX_TERMS`].
    pub const fn terms(self) -> usize {
        let mut count = 0;
        let mut i = 0;
        while i <= self.rate {
            count += self.volts_beside(i) as usize + 1;
            i += 1;
        }
        count
    }

    /// Returns the powers `(of rate, of volts)` of each term, in the order that the type describes.
    pub fn exponents(self) -> impl Iterator<Item = (u8, u8)> + Clone {
        (0..=self.total()).flat_map(move |total| {
            (0..=total)
                .rev()
                .map(move |i| (i, total - i))
                .filter(move |&(i, j)| i <= self.rate && j <= self.volts)
        })
    }
}

impl core::fmt::Display for Degree {
    /// Writes the name that MATLAB uses, such as `poly13`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "poly{}{}", self.rate, self.volts)
    }
}

impl TryFrom<(u8, u8)> for Degree {
    type Error = DesignError;
    fn try_from((rate, volts): (u8, u8)) -> Result<Self, DesignError> {
        Self::new(rate, volts)
    }
}

impl From<Degree> for (u8, u8) {
    fn from(degree: Degree) -> Self {
        (degree.rate, degree.volts)
    }
}
