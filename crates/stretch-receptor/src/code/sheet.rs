//! A branch's surface over integers, and the bounds of its domain.

use stretch_core::DesignError;

use crate::Domain;

/// How many bits a converter's code is shifted up from its 16-bit place for the
/// comparison with the domain's ends.
pub(super) const COARSE_BITS: u32 = 15;

/// Ends of a domain in integers, and the factor that then spreads it over 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Span {
    /// The lower end.
    pub min: i32,
    /// From the lower end to the upper one.
    pub width: u32,
    /// A power of two.
    pub factor: i32,
}

impl Span {
    /// From `min` to `max`, spread as far as both ends allow.
    pub(super) fn new(min: i32, max: i32) -> Self {
        let size = min.unsigned_abs().max(max.unsigned_abs()).max(1);
        // an end of exactly 2^31 has no factor but 1
        let factor = 1 << size.leading_zeros().saturating_sub(1).min(30);
        Self { min, width: max.wrapping_sub(min) as u32, factor }
    }

    /// Whether both ends fit 32 bits when spread.
    #[cfg(feature = "serde")]
    pub(super) fn holds(&self) -> bool {
        let max = i64::from(self.min) + i64::from(self.width);
        let fits = |end: i64| i32::try_from(end * i64::from(self.factor)).is_ok();
        self.factor > 0 && fits(self.min.into()) && fits(max)
    }

    /// The nearest value inside; and 1 for a value that was outside.
    #[inline(always)]
    fn clamp(&self, x: i32) -> (i32, u8) {
        // one comparison: below the lower end the difference wraps to a large number
        if x.wrapping_sub(self.min) as u32 <= self.width { (x, 0) } else { self.nearest_end(x) }
    }

    /// A value inside, spread over 32 bits.
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
pub struct Sheet<S> {
    /// The code, aligned to 16 bits, that the surface is expanded about.
    pub centre: u16,
    /// Where the signal is clamped to: `2^15` of a 16-bit sample, from the centre.
    pub signal: Span,
    /// Where the integer rate is clamped to.
    pub rate: Span,
    /// Over signal and rate, spread.
    pub surface: S,
}

impl<S> Sheet<S> {
    /// Signal and rate inside the domain, not yet spread.
    #[inline(always)]
    pub(super) fn inputs(&self, sample: u16, rate: i32) -> (i32, i32, Domain) {
        let (volts, signal_outside) = self.signal.clamp(self.coarse(sample));
        let (rate, rate_outside) = self.rate.clamp(rate);
        (volts, rate, domain(signal_outside | rate_outside << 1))
    }

    /// The signal alone, for a line.
    #[inline(always)]
    pub(super) fn input(&self, sample: u16) -> (i32, Domain) {
        let (volts, outside) = self.signal.clamp(self.coarse(sample));
        (volts, domain(outside))
    }

    #[inline(always)]
    fn coarse(&self, sample: u16) -> i32 {
        // 17 bits and 15: fits
        (i32::from(sample) - i32::from(self.centre)) << COARSE_BITS
    }
}

/// From a bit for the signal outside and one for the rate.
#[inline(always)]
fn domain(outside: u8) -> Domain {
    match outside & 3 {
        0 => Domain::Inside,
        1 => Domain::SignalClamped,
        2 => Domain::RateClamped,
        _ => Domain::BothClamped,
    }
}

/// A calibration's sheets: one line, or a surface a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sheets<L, P> {
    /// One line for both branches.
    Line(Sheet<L>),
    /// Inflation, deflation.
    Poly13([Sheet<P>; 2]),
}

impl<L, P> Sheets<L, P> {
    pub(super) fn try_map<M, Q>(
        &self,
        line: impl Fn(&L) -> Result<M, DesignError>,
        surface: impl Fn(&P) -> Result<Q, DesignError>,
    ) -> Result<Sheets<M, Q>, DesignError> {
        fn with<S, T>(sheet: &Sheet<S>, surface: T) -> Sheet<T> {
            let Sheet { centre, signal, rate, .. } = *sheet;
            Sheet { centre, signal, rate, surface }
        }
        Ok(match self {
            Self::Line(sheet) => Sheets::Line(with(sheet, line(&sheet.surface)?)),
            Self::Poly13([up, down]) => Sheets::Poly13([
                with(up, surface(&up.surface)?),
                with(down, surface(&down.surface)?),
            ]),
        })
    }
}
