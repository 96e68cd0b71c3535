//! Families of forms: sources of the functions that make up an effect.

use std::fmt;

use crate::words::worded;

worded! {
    /// Source of the functional form of every effect of a case.
    ///
    /// The drawn families differ in kind, not only in numbers, so a threshold that was set on some
    /// of them can be judged on one left out.
    ///
    /// ```
    /// use stretch_blind::Family;
    /// assert_eq!("rate_laws".parse(), Ok(Family::RateLaws));
    /// assert!("all".parse::<Family>().is_err());
    /// ```
    #[derive(Default)]
    Family {
        /// One of a few forms an effect, written by hand.
        #[default]
        Written "written",
        /// Smooth random functions: the logarithm of a slope or of a density is a random spline.
        Splines "splines",
        /// Many elements at once: several time constants, radii, thresholds, delays, harmonics, with
        /// random weights or a power law.
        Spectra "spectra",
        /// Closed-form laws and differential equations with drawn exponents: rates that depend on the
        /// state, friction by Dahl, Bouc and Wen, or with a Stribeck speed.
        RateLaws "rate_laws",
        /// What differs by direction, side or half: up and down, opening and closing, kinks.
        Asymmetric "asymmetric",
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
