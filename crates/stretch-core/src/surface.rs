//! Polynomial surfaces over voltage rate and voltage.

use crate::{Degree, DesignError, MAX_TERMS, Real};

const ROWS: usize = crate::MAX_DEGREE + 1;

/// A polynomial surface of any [`Degree`], `sum p_ij rate^i volts^j`.
///
/// The degree is a run-time value, so that a calibration file can hold any surface. [`Poly13`] is the surface of the
/// published method ("the paper"), with a degree known at compile time. The surface is evaluated by Horner's rule in
/// the voltage inside Horner's rule in the rate.
///
/// ```
/// use stretch_core::{Degree, Surface};
/// // 1 + 2 r + 3 v + 4 r v
/// let surface = Surface::new(Degree::new(1, 2)?, &[1.0, 2.0, 3.0, 4.0, 0.0])?;
/// assert_eq!(surface.eval(2.0, 5.0), 1.0 + 4.0 + 15.0 + 40.0);
/// assert_eq!(surface.d_rate(2.0, 5.0), 2.0 + 20.0);
/// assert_eq!(surface.d_volts(2.0, 5.0), 3.0 + 8.0);
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface<T = f64> {
    degree: Degree,
    /// `rows[i][j]` is the coefficient of `rate^i volts^j`; zero outside the term set.
    rows: [[T; ROWS]; ROWS],
}

impl<T: Real> Surface<T> {
    /// Creates a surface from its coefficients in the order of [`Degree::exponents`].
    ///
    /// # Errors
    /// [`DesignError::TooLarge`] unless there is one coefficient per term, [`DesignError::OutOfRange`] if a
    /// coefficient is not finite.
    pub fn new(degree: Degree, coefficients: &[T]) -> Result<Self, DesignError> {
        if coefficients.len() != degree.terms() {
            return Err(DesignError::TooLarge {
                field: "surface.coefficients",
                asked: coefficients.len(),
                most: degree.terms(),
            });
        }
        let mut rows = [[T::zero(); ROWS]; ROWS];
        for ((i, j), &c) in degree.exponents().zip(coefficients) {
            DesignError::check("surface.coefficients", c.as_f64(), true)?;
            rows[usize::from(i)][usize::from(j)] = c;
        }
        Ok(Self { degree, rows })
    }

    /// Returns the degree in rate and voltage.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// Returns the coefficient of `rate^i volts^j`; zero for a term that is not in the term set.
    pub fn coefficient(&self, i: u8, j: u8) -> T {
        let row = self.rows.get(usize::from(i));
        row.and_then(|row| row.get(usize::from(j))).copied().unwrap_or(T::zero())
    }

    /// Returns the coefficients in the order of [`Degree::exponents`], followed by zeros after the first
    /// [`Degree::terms`] places.
    pub fn coefficients(&self) -> [T; MAX_TERMS] {
        let mut all = [T::zero(); MAX_TERMS];
        for (place, (i, j)) in all.iter_mut().zip(self.degree.exponents()) {
            *place = self.coefficient(i, j);
        }
        all
    }

    /// Evaluates the surface at a rate and a voltage, both normalised.
    #[inline]
    pub fn eval(&self, rate: T, volts: T) -> T {
        self.horner(rate, |i| self.row(i, volts))
    }

    /// Returns the partial derivative with respect to the rate.
    pub fn d_rate(&self, rate: T, volts: T) -> T {
        let mut sum = T::zero();
        for i in (1..=self.degree.rate()).rev() {
            sum = sum * rate + T::from_f64(f64::from(i)) * self.row(i, volts);
        }
        sum
    }

    /// Returns the partial derivative with respect to the voltage.
    pub fn d_volts(&self, rate: T, volts: T) -> T {
        self.horner(rate, |i| {
            let mut sum = T::zero();
            for j in (1..=self.degree.volts_beside(i)).rev() {
                let c = self.rows[usize::from(i)][usize::from(j)];
                sum = sum * volts + T::from_f64(f64::from(j)) * c;
            }
            sum
        })
    }

    #[inline]
    fn horner(&self, rate: T, row: impl Fn(u8) -> T) -> T {
        let mut sum = T::zero();
        for i in (0..=self.degree.rate()).rev() {
            sum = sum * rate + row(i);
        }
        sum
    }

    #[inline]
    fn row(&self, i: u8, volts: T) -> T {
        let row = &self.rows[usize::from(i)];
        let mut sum = T::zero();
        for j in (0..=self.degree.volts_beside(i)).rev() {
            sum = sum * volts + row[usize::from(j)];
        }
        sum
    }
}

/// The paper's surface, degree 1 in rate `r` and 3 in voltage `v`:
/// `p00 + p10 r + p01 v + p11 r v + p02 v^2 + p12 r v^2 + p03 v^3`
/// (paper section 3.2; names as in MATLAB).
///
/// ```
/// use stretch_core::Poly13;
/// // the paper's inflation surface at rest and V = 0.5
/// let inflation: Poly13 =
///     Poly13 { p00: 0.058, p10: 0.001, p01: 0.774, p11: -0.121, p02: 2.30, p12: 0.094, p03: -2.26 };
/// approx::assert_abs_diff_eq!(inflation.eval(0.0, 0.5), 0.7375, epsilon = 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[allow(missing_docs)] // the equation above says what each multiplies
pub struct Poly13<T = f64> {
    pub p00: T,
    pub p10: T,
    pub p01: T,
    pub p11: T,
    pub p02: T,
    pub p12: T,
    pub p03: T,
}

impl<T: Real> Poly13<T> {
    /// Evaluates the surface at a rate and a voltage with six multiplications and six additions.
    #[inline]
    pub fn eval(&self, rate: T, volts: T) -> T {
        let at_rest = ((self.p03 * volts + self.p02) * volts + self.p01) * volts + self.p00;
        at_rest + rate * self.d_rate(volts)
    }

    /// Returns the partial derivative with respect to the rate, which does not depend on the rate.
    #[inline]
    pub fn d_rate(&self, volts: T) -> T {
        (self.p12 * volts + self.p11) * volts + self.p10
    }

    /// Returns the partial derivative with respect to the voltage.
    pub fn d_volts(&self, rate: T, volts: T) -> T {
        let (two, three) = (T::from_f64(2.0), T::from_f64(3.0));
        (three * self.p03 * volts + two * (self.p02 + self.p12 * rate)) * volts
            + self.p01
            + self.p11 * rate
    }
}

impl<T: Real> From<Poly13<T>> for Surface<T> {
    fn from(p: Poly13<T>) -> Self {
        let mut rows = [[T::zero(); ROWS]; ROWS];
        rows[0][..4].copy_from_slice(&[p.p00, p.p01, p.p02, p.p03]);
        rows[1][..3].copy_from_slice(&[p.p10, p.p11, p.p12]);
        Self { degree: Degree::POLY13, rows }
    }
}

impl<T: Real> Surface<T> {
    /// Converts the surface to a [`Poly13`]; `None` if its degree has terms that poly13 lacks.
    pub fn as_poly13(&self) -> Option<Poly13<T>> {
        let fits = self.degree.exponents().all(|(i, j)| i <= 1 && i + j <= 3);
        fits.then(|| Poly13 {
            p00: self.coefficient(0, 0),
            p10: self.coefficient(1, 0),
            p01: self.coefficient(0, 1),
            p11: self.coefficient(1, 1),
            p02: self.coefficient(0, 2),
            p12: self.coefficient(1, 2),
            p03: self.coefficient(0, 3),
        })
    }
}

#[cfg(feature = "serde")]
mod record {
    //! Serialised form of a surface: its degree and one coefficient per term.
    use super::{Degree, MAX_TERMS, Real, Surface};
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    #[derive(Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Stored<T> {
        degree: Degree,
        coefficients: heapless::Vec<T, MAX_TERMS>,
    }

    impl<T: Real + Serialize> Serialize for Surface<T> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let coefficients = self.coefficients().into_iter().take(self.degree.terms()).collect();
            Stored { degree: self.degree, coefficients }.serialize(serializer)
        }
    }

    impl<'de, T: Real + Deserialize<'de>> Deserialize<'de> for Surface<T> {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let record = Stored::<T>::deserialize(deserializer)?;
            Self::new(record.degree, &record.coefficients).map_err(D::Error::custom)
        }
    }
}
