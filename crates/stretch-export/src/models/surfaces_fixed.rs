//! `linear` and `poly13` in integers.

use stretch_core::{Poly13, fixed::FixedPoly13};
use stretch_receptor::code::{CodeMap, CodeSurface, FixedNumbers, Scaled, Span};

use crate::{
    constants::{Constants, Literal},
    part::Part,
};

/// What stands before and after the surface.
const RATE: &str = include_str!("../c/surfaces_fixed.h");
const STEP: &str = include_str!("../c/surfaces_fixed_step.h");

/// The constants and the step of a converted calibration.
pub(crate) fn surfaces_fixed(numbers: &FixedNumbers) -> Part {
    let FixedNumbers { adc_bits, falling, dead_band, surfaces, rate } = numbers;
    let adc_bits = u32::from((*adc_bits).min(16));
    let (factor, shift) = (rate.change_factor, rate.change_shift);
    let mut constants = Constants::default();
    constants
        .define("CODES", 1u32 << adc_bits, "the first number that is no code")
        .define("ALIGN", 1u32 << (16 - adc_bits), "moves a code to the upper end of 16 bits")
        .define("WINDOW", rate.window as i32, "samples")
        .define("DEGREE", rate.degree as i32, "of the polynomial that gives the rate");
    for k in 0..=rate.degree {
        constants.define(&format!("WEIGHT_{k}"), rate.weights[k], "");
    }
    for k in 1..=rate.degree {
        constants.define(&format!("CHOOSE_{k}"), rate.choose[k] as u32, "");
    }
    let half = if rate.shift == 0 { 0 } else { 1i64 << (rate.shift - 1) };
    constants
        .define("SHIFT", rate.shift as i32, "low bits of the weighted sum that are rounded away")
        .define("HALF", half, "")
        .define("CHANGE", factor, "from a rate to a change a sample")
        .define("CHANGE_SHIFT", shift as i32, "")
        .define("DEAD_BAND", *dead_band as u32, "the largest rate that keeps the branch")
        .define(
            "MIRROR",
            if *falling { u32::MAX } else { 0 },
            "all ones where a rising signal means a falling target",
        );
    let (model, surface) = match surfaces {
        CodeMap::Line(ranged) => {
            let Scaled { of, thousandths } = ranged.surface;
            let (intercept, slope) = <(i32, i32)>::from(of);
            let signal = span(&ranged.signal);
            let line = [thousandths, intercept, slope].map(|n| n.c()).join(", ");
            constants.surfaces(&[format!("{{{}, {signal}, {line}}}", ranged.centre)]);
            ("linear", include_str!("../c/line_fixed.h"))
        }
        CodeMap::Poly13([inflation, deflation]) => {
            constants.surfaces(&[poly13(inflation), poly13(deflation)]);
            ("poly13", include_str!("../c/poly13_fixed.h"))
        }
    };
    Part {
        model: model.into(),
        constants: constants.into_text(),
        step: vec![include_str!("../c/fixed.h"), RATE, surface, STEP],
        has: Vec::new(),
    }
}

fn span(span: &Span) -> String {
    format!("{{{}, {}, {}}}", span.min.c(), span.width.c(), span.factor.c())
}

/// The surface of one branch with its ranges.
fn poly13(ranged: &CodeSurface<Scaled<FixedPoly13>>) -> String {
    let Scaled { of, thousandths } = ranged.surface;
    // all of them integers of 32 bits: nothing is lost
    let Poly13 { p00, p10, p01, p11, p02, p12, p03 } = of.coefficients();
    let ordered = [p11, p12, p10, p00, p02, p03, p01].map(|p| p as i32);
    let ordered = ordered.map(|p| p.c()).join(", ");
    let (signal, rate) = (span(&ranged.signal), span(&ranged.rate));
    let domain = format!("{}, {signal}, {rate}, {}", ranged.centre, thousandths.c());
    format!("{{{domain}, \\\n         {{{ordered}}}}}")
}
