//! The arithmetic that evaluates a surface: [`Fixed`](super::Fixed) point, or a float.

use stretch_core::DesignError;

use super::{
    code_map::{CodeMap, Span},
    fold::Folded,
};

pub(super) mod sealed {
    use super::*;

    /// Operations on lines and surfaces whose inputs are spread integers: integers scaled by a power of two so that
    /// they fill 32 bits.
    pub trait Arithmetic: Sized + Copy + core::fmt::Debug + PartialEq {
        type Line: Copy + core::fmt::Debug + PartialEq;
        type Surface: Copy + core::fmt::Debug + PartialEq;
        type Estimate: Copy + core::fmt::Debug + PartialEq;

        fn round(folded: &Folded) -> Result<CodeMap<Self::Line, Self::Surface>, DesignError>;
        /// Returns the largest rounding error in thousandths of the reference's unit; `None` for floats.
        fn worst_case(
            surfaces: &CodeMap<Self::Line, Self::Surface>,
            rate_rounding: f64,
        ) -> Option<f64>;
        /// Returns the line in the form that a step evaluates. Floating-point arithmetic multiplies the factor of the
        /// span into the coefficients.
        fn line_over(line: Self::Line, signal: &Span) -> Self::Line;
        fn surface_over(surface: Self::Surface, signal: &Span, rate: &Span) -> Self::Surface;
        /// Evaluates a line at a signal inside its span.
        fn line(line: &Self::Line, signal: &Span, volts: i32) -> Self::Estimate;
        /// Evaluates a surface at a rate and a signal inside their spans.
        fn surface(
            surface: &Self::Surface,
            volts: (&Span, i32),
            rate: (&Span, i32),
        ) -> Self::Estimate;
        fn valid_line(line: &Self::Line) -> Result<(), DesignError>;
        fn valid_surface(surface: &Self::Surface) -> Result<(), DesignError>;
    }
}

/// The arithmetic in which a [`CodeReceptor`](super::CodeReceptor) evaluates its surface:
/// [`Fixed`](crate::code::Fixed), `f32` or `f64`.
pub trait CodeArithmetic: sealed::Arithmetic {}
