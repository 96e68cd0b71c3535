//! Converts a calibration over volts into a calibration over a converter's integers, in `f64`.

use stretch_core::{BranchSurface, Calibration, DesignError, Interval, LinearMap, Model, Poly13};

use super::{
    adc::Adc,
    code_map::{COARSE_BITS, CodeMap, CodeSurface, Span},
};
use crate::fold::output;

/// Surfaces in reference units over inputs in -1/2..1/2, before an arithmetic rounds them.
pub(super) type Folded = CodeMap<[f64; 2], Poly13>;

/// Units of the integers.
pub(super) struct Units {
    /// Volts at a left-aligned sample of 0, and volts per step of that sample.
    pub zero_v: f64,
    pub step_v: f64,
    /// Volts per second per unit of the integer rate, and the largest magnitude of the integer
    /// rate.
    pub rate_v_per_s: f64,
    pub largest_rate: i32,
}

impl Units {
    pub(super) fn new(
        adc: &Adc,
        samples_per_s: f64,
        per_sample: f64,
        largest_rate: i32,
    ) -> Result<Self, DesignError> {
        let step_v = adc.volts_per_code() / f64::from(adc.align()?);
        let rate_v_per_s = step_v * samples_per_s * per_sample;
        Ok(Self { zero_v: adc.spec().zero_v, step_v, rate_v_per_s, largest_rate })
    }
}

/// Tolerance for the rounding of `f64` at an end of a domain, in integers.
const SLACK: f64 = 1.0 / 1024.0;

/// Returns the span of the integers inside `min ..= max`, limited to the magnitude `most`.
fn span(min: f64, max: f64, most: i32) -> Span {
    let end = |x: f64| x.clamp(-f64::from(most), f64::from(most)) as i32;
    let (min, max) = (end(libm::ceil(min - SLACK)), end(libm::floor(max + SLACK)));
    // an interval that contains no integer, or that is wholly beyond `most`, becomes a single
    // integer
    Span::new(min, max.max(min))
}

pub(super) fn fold(calibration: &Calibration, units: &Units) -> Result<Folded, DesignError> {
    match &calibration.spec().model {
        Model::Linear(line) => Ok(CodeMap::Line(fold_line(calibration, line, units))),
        Model::Surfaces { inflation, deflation } => {
            let ranged = |branch| fold_surface(calibration, branch, units);
            Ok(CodeMap::Poly13([ranged(inflation)?, ranged(deflation)?]))
        }
        other => Err(other.instead_of("linear or surfaces")),
    }
}

/// Returns the centre code, the domain, and the voltage that corresponds to a spread signal of 1 (see `Span`).
fn signal(domain: Interval, units: &Units) -> (u16, Span, f64) {
    let aligned = |volts: f64| (volts - units.zero_v) / units.step_v;
    let (low, high) = (aligned(domain.min), aligned(domain.max));
    let visible = |x: f64| x.clamp(0.0, f64::from(u16::MAX));
    let centre = libm::round(0.5 * (visible(low) + visible(high))) as u16;
    let coarse = |x: f64| (x - f64::from(centre)) * f64::from(1u32 << COARSE_BITS);
    let span = span(coarse(low), coarse(high), i32::from(u16::MAX) << COARSE_BITS);
    let volts = libm::ldexp(units.step_v, 32 - COARSE_BITS as i32) / f64::from(span.factor);
    (centre, span, volts)
}

/// Returns the normalised signal at the centre code, and its change if the spread signal changes by 1.
fn normalised(calibration: &Calibration, centre: u16, volts: f64, units: &Units) -> (f64, f64) {
    let range = calibration.spec().signal_range;
    let centre_v = units.zero_v + f64::from(centre) * units.step_v;
    (range.normalise(centre_v), volts / range.span())
}

fn fold_line(calibration: &Calibration, line: &LinearMap, units: &Units) -> CodeSurface<[f64; 2]> {
    let (gain, zero) = output(calibration);
    let (centre, span, volts) = signal(line.signal_domain, units);
    let (at, per) = normalised(calibration, centre, volts, units);
    let surface = [zero + gain * (line.intercept + line.slope * at), gain * line.slope * per];
    CodeSurface { centre, signal: span, rate: Span::new(0, 0), surface }
}

fn fold_surface(
    calibration: &Calibration,
    branch: &BranchSurface,
    units: &Units,
) -> Result<CodeSurface<Poly13>, DesignError> {
    let degree = branch.surface.degree();
    let Some(p) = branch.surface.as_poly13() else {
        let (field, asked) = ("model.surface.terms", degree.terms());
        return Err(DesignError::TooLarge { field, asked, most: 7 });
    };
    let (gain, zero) = output(calibration);
    let sign = calibration.spec().polarity.sign();
    let (centre, signal, volts) = signal(branch.signal_domain, units);
    let ends =
        [branch.rate_domain.min, branch.rate_domain.max].map(|r| sign * r / units.rate_v_per_s);
    let rate = span(ends[0].min(ends[1]), ends[0].max(ends[1]), units.largest_rate);
    let per_s = libm::ldexp(units.rate_v_per_s, 32) / f64::from(rate.factor);
    // normalised signal = at + per v, normalised rate = still + moving r
    let (at, per) = normalised(calibration, centre, volts, units);
    let (still, moving) =
        (branch.rate_range.normalise(0.0), sign * per_s / branch.rate_range.span());
    // the terms that contain the rate, then the terms without the rate
    let by_rate = shifted([p.p10, p.p11, p.p12, 0.0], at, per);
    let at_rest = shifted([p.p00, p.p01, p.p02, p.p03], at, per);
    let rest = |j: usize| gain * (at_rest[j] + still * by_rate[j]);
    let rise = |j: usize| gain * moving * by_rate[j];
    let surface = Poly13 {
        p00: zero + rest(0),
        p01: rest(1),
        p02: rest(2),
        p03: rest(3),
        p10: rise(0),
        p11: rise(1),
        p12: rise(2),
    };
    Ok(CodeSurface { centre, signal, rate, surface })
}

/// Returns the coefficients of the cubic in x that equals the cubic `c` at the point `at + per x`.
fn shifted(c: [f64; 4], at: f64, per: f64) -> [f64; 4] {
    let [c0, c1, c2, c3] = c;
    [
        ((c3 * at + c2) * at + c1) * at + c0,
        ((3.0 * c3 * at + 2.0 * c2) * at + c1) * per,
        (3.0 * c3 * at + c2) * per * per,
        c3 * per * per * per,
    ]
}
