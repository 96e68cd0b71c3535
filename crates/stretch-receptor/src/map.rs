//! A calibration folded into as few operations per sample as possible.
//!
//! Normalisation, denormalisation and the target's unit are affine, so their
//! scales are multiplied into the coefficients once. Each sample then costs one subtraction for each input and the
//! polynomial itself.

use stretch_core::{
    Branch, BranchSurface, Calibration, DesignError, Interval, LinearMap, Model, Poly13, Real,
    Surface, arithmetic::power,
};

use crate::{Domain, fold::output};

/// Value and local slope of a calibration at one input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point<T> {
    pub estimate: T,
    /// Change of the estimate per change of the signal.
    pub slope: T,
    pub domain: Domain,
}

/// The ends of an input's domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DomainEnds<T> {
    /// The lower end.
    pub min: T,
    /// The upper end.
    pub max: T,
}

impl<T: Real> DomainEnds<T> {
    fn round(interval: Interval) -> Self {
        Self { min: T::from_f64(interval.min), max: T::from_f64(interval.max) }
    }

    /// Returns the nearest value inside, and whether the value was outside.
    #[inline(always)]
    fn clamp(&self, x: T) -> (T, bool) {
        let low = if x < self.min { self.min } else { x };
        let inside = if low > self.max { self.max } else { low };
        (inside, inside != x)
    }
}

/// A line over `signal - offset`, in physical units: `intercept + slope (signal - offset)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line<T> {
    /// Range to which the signal is clamped.
    pub signal: DomainEnds<T>,
    /// Offset that is subtracted from the signal.
    pub offset: T,
    /// Reference units per signal unit.
    pub slope: T,
    /// The reference at `offset`.
    pub intercept: T,
}

/// A surface over `signal - offset` and `rate - rate_offset`, in physical units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangedSurface<T, S> {
    /// Range to which the signal is clamped.
    pub signal: DomainEnds<T>,
    /// Range to which the rate is clamped.
    pub rate: DomainEnds<T>,
    /// Offset that is subtracted from the signal.
    pub offset: T,
    /// Offset that is subtracted from the rate.
    pub rate_offset: T,
    /// The surface in reference units, over the differences.
    pub surface: S,
}

/// A folded calibration over the signal and the rate of the signal as measured. The sign of the polarity is folded into
/// the coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)] // no allocator to box with; one lives in a program
pub enum Map<T> {
    /// One line for both branches.
    Line(Line<T>),
    /// One poly13 surface each for inflation and deflation.
    Poly13([RangedSurface<T, Poly13<T>>; 2]),
    /// One surface each for inflation and deflation, with terms beyond poly13.
    Surface([RangedSurface<T, Surface<T>>; 2]),
}

impl<T: Real> Map<T> {
    /// The line or the surfaces of a calibration.
    pub(crate) fn of(calibration: &Calibration) -> Result<Self, DesignError> {
        let (inflation, deflation) = match &calibration.spec().model {
            Model::Linear(line) => return Ok(Self::Line(fold_line(calibration, line))),
            Model::Surfaces { inflation, deflation } => (inflation, deflation),
            other => return Err(other.instead_of("linear or surfaces")),
        };
        let up = fold_surface(calibration, inflation)?;
        let down = fold_surface(calibration, deflation)?;
        let surfaces = [round_surface(&up.surface)?, round_surface(&down.surface)?];
        Ok(match surfaces.map(|surface| surface.as_poly13()) {
            [Some(p), Some(q)] => Self::Poly13([up.with(p), down.with(q)]),
            _ => Self::Surface([up.with(surfaces[0]), down.with(surfaces[1])]),
        })
    }

    #[inline(always)]
    pub(crate) fn at(&self, branch: Branch, rate: T, signal: T) -> Point<T> {
        let index = usize::from(branch == Branch::Deflation);
        match self {
            Self::Line(line) => {
                let (x, outside) = line.signal.clamp(signal);
                Point {
                    estimate: line.intercept + line.slope * (x - line.offset),
                    slope: line.slope,
                    domain: Domain::from_flags(outside, false),
                }
            }
            Self::Poly13(surfaces) => {
                surfaces[index].at(rate, signal, |p, r, v| (p.eval(r, v), p.d_volts(r, v)))
            }
            Self::Surface(surfaces) => {
                surfaces[index].at(rate, signal, |s, r, v| (s.eval(r, v), s.d_volts(r, v)))
            }
        }
    }
}

impl<T: Real, S> RangedSurface<T, S> {
    #[inline(always)]
    fn at(&self, rate: T, signal: T, eval: impl Fn(&S, T, T) -> (T, T)) -> Point<T> {
        let (v, signal_outside) = self.signal.clamp(signal);
        let (r, rate_outside) = self.rate.clamp(rate);
        let (estimate, slope) = eval(&self.surface, r - self.rate_offset, v - self.offset);
        Point { estimate, slope, domain: Domain::from_flags(signal_outside, rate_outside) }
    }
}

impl<S> RangedSurface<f64, S> {
    fn with<T: Real, U>(self, surface: U) -> RangedSurface<T, U> {
        let bounds = |b: DomainEnds<f64>| DomainEnds::round(Interval { min: b.min, max: b.max });
        RangedSurface {
            signal: bounds(self.signal),
            rate: bounds(self.rate),
            offset: T::from_f64(self.offset),
            rate_offset: T::from_f64(self.rate_offset),
            surface,
        }
    }
}

fn round_surface<T: Real>(surface: &Surface) -> Result<Surface<T>, DesignError> {
    let terms = surface.degree().terms();
    let coefficients = surface.coefficients().map(T::from_f64);
    Surface::new(surface.degree(), &coefficients[..terms])
}

fn fold_line<T: Real>(calibration: &Calibration, line: &LinearMap) -> Line<T> {
    let (gain, zero) = output(calibration);
    Line {
        signal: DomainEnds::round(line.signal_domain),
        offset: T::from_f64(calibration.spec().signal_range.offset()),
        slope: T::from_f64(line.slope * gain / calibration.spec().signal_range.span()),
        intercept: T::from_f64(zero + gain * line.intercept),
    }
}

fn fold_surface(
    calibration: &Calibration,
    branch: &BranchSurface,
) -> Result<RangedSurface<f64, Surface>, DesignError> {
    let (gain, zero) = output(calibration);
    let sign = calibration.spec().polarity.sign();
    let rate_scale = sign / branch.rate_range.span();
    let signal_scale = calibration.spec().signal_range.span().recip();
    let degree = branch.surface.degree();
    let mut folded = [0.0; stretch_core::MAX_TERMS];
    for (place, (i, j)) in folded.iter_mut().zip(degree.exponents()) {
        let scale = power(rate_scale, i) * power(signal_scale, j);
        *place = branch.surface.coefficient(i, j) * gain * scale;
    }
    folded[0] += zero;
    let [min, max] = [branch.rate_domain.min, branch.rate_domain.max].map(|rate| sign * rate);
    let rate = if sign > 0.0 { DomainEnds { min, max } } else { DomainEnds { min: max, max: min } };
    Ok(RangedSurface {
        signal: DomainEnds::round(branch.signal_domain),
        rate,
        offset: calibration.spec().signal_range.offset(),
        rate_offset: sign * branch.rate_range.offset(),
        surface: Surface::new(degree, &folded[..degree.terms()])?,
    })
}
