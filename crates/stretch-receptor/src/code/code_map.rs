//! The surface of a branch over integer inputs, and the bounds of its domain.

use stretch_core::DesignError;

use crate::Domain;

/// Number of bits by which a 16-bit sample is shifted left before it is compared with the ends of the domain.
pub(super) const COARSE_BITS: u32 = 15;

/// Integer ends of a domain, and the factor by which values inside the domain are multiplied ("spread") to use as many
/// of 32 bits as possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Span {
    /// The lower end.
    pub min: i32,
    /// Difference of the upper and the lower end.
    pub width: u32,
    /// The factor, a power of two.
    pub factor: i32,
}

impl Span {
    /// Creates the span from `min` to `max` with the largest factor that keeps both ends within 32 bits.
    pub(super) fn new(min: i32, max: i32) -> Self {
        let size = min.unsigned_abs().max(max.unsigned_abs()).max(1);
        // an end of magnitude 2^31 allows only the factor 1
        let factor = 1 << size.leading_zeros().saturating_sub(1).min(30);
        Self { min, width: max.wrapping_sub(min) as u32, factor }
    }

    /// Whether both ends fit 32 bits after multiplication by the factor.
    #[cfg(feature = "serde")]
    fn holds(&self) -> bool {
        let fits = |end: i32| end.checked_mul(self.factor).is_some();
        let max = self.min.checked_add_unsigned(self.width);
        self.factor > 0 && fits(self.min) && max.is_some_and(fits)
    }

    /// Returns the nearest value inside the span, and 1 if the value was outside or 0 if it was inside.
    #[inline(always)]
    fn clamp(&self, x: i32) -> (i32, u8) {
        // one comparison is enough, because below the lower end the difference wraps to a large number
        if x.wrapping_sub(self.min) as u32 <= self.width { (x, 0) } else { self.nearest_end(x) }
    }

    /// Multiplies a value inside the span by the factor.
    #[inline(always)]
    pub(super) fn spread(&self, inside: i32) -> i32 {
        inside.wrapping_mul(self.factor)
    }

    #[cold]
    fn nearest_end(&self, x: i32) -> (i32, u8) {
        (if x < self.min { self.min } else { self.min.wrapping_add_unsigned(self.width) }, 1)
    }
}

/// A surface and the domain of its inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CodeSurface<S> {
    /// Centre of the expansion of the surface: a code of the converter, shifted to 16 bits.
    pub centre: u16,
    /// Range to which the signal is clamped, as a distance from the centre in `2^-15` of a 16-bit step.
    pub signal: Span,
    /// Range to which the integer rate is clamped.
    pub rate: Span,
    /// The surface over signal and rate, each multiplied by the factor of its span.
    pub surface: S,
}

impl<S> CodeSurface<S> {
    /// Whether both domains fit 32 bits after multiplication by their factors.
    #[cfg(feature = "serde")]
    pub(super) fn holds(&self) -> bool {
        self.signal.holds() && self.rate.holds()
    }

    /// Returns signal and rate, clamped to the domain but not yet multiplied by their factors, and which of them was
    /// outside.
    #[inline(always)]
    pub(super) fn inputs(&self, sample: u16, rate: i32) -> (i32, i32, Domain) {
        let (volts, signal_outside) = self.signal.clamp(self.coarse(sample));
        let (rate, rate_outside) = self.rate.clamp(rate);
        (volts, rate, domain(signal_outside | rate_outside << 1))
    }

    /// Returns the clamped signal alone, for a line.
    #[inline(always)]
    pub(super) fn input(&self, sample: u16) -> (i32, Domain) {
        let (volts, outside) = self.signal.clamp(self.coarse(sample));
        (volts, domain(outside))
    }

    #[inline(always)]
    fn coarse(&self, sample: u16) -> i32 {
        // 17 bits shifted up by 15 fit 32 bits
        (i32::from(sample) - i32::from(self.centre)) << COARSE_BITS
    }
}

/// Converts flags (bit 0: signal outside, bit 1: rate outside) to a domain.
#[inline(always)]
fn domain(outside: u8) -> Domain {
    match outside & 3 {
        0 => Domain::Inside,
        1 => Domain::SignalClamped,
        2 => Domain::RateClamped,
        _ => Domain::BothClamped,
    }
}

/// The surfaces of a calibration with their ranges: one line, or a surface for each branch.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum CodeMap<L, P> {
    /// One line for both branches.
    Line(CodeSurface<L>),
    /// A surface each for inflation and deflation.
    Poly13([CodeSurface<P>; 2]),
}

impl<L, P> CodeMap<L, P> {
    pub(super) fn try_map<M, Q>(
        &self,
        line: impl Fn(&L) -> Result<M, DesignError>,
        surface: impl Fn(&P) -> Result<Q, DesignError>,
    ) -> Result<CodeMap<M, Q>, DesignError> {
        fn with<S, T>(ranged: &CodeSurface<S>, surface: T) -> CodeSurface<T> {
            let CodeSurface { centre, signal, rate, .. } = *ranged;
            CodeSurface { centre, signal, rate, surface }
        }
        Ok(match self {
            Self::Line(ranged) => CodeMap::Line(with(ranged, line(&ranged.surface)?)),
            Self::Poly13([up, down]) => CodeMap::Poly13([
                with(up, surface(&up.surface)?),
                with(down, surface(&down.surface)?),
            ]),
        })
    }
}
