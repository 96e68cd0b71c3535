//! The arithmetic that evaluates a surface: [`Fixed`](super::Fixed) point, or a float.

use stretch_core::DesignError;

use super::{
    code_map::{CodeMap, Span},
    fold::Folded,
};

pub(super) mod sealed {
    use super::*;

    /// Lines and surfaces over spread integers.
    pub trait Arithmetic: Sized + Copy + core::fmt::Debug + PartialEq {
        type Line: Copy + core::fmt::Debug + PartialEq;
        type Surface: Copy + core::fmt::Debug + PartialEq;
        type Estimate: Copy + core::fmt::Debug + PartialEq;

        fn round(folded: &Folded) -> Result<CodeMap<Self::Line, Self::Surface>, DesignError>;
        /// The largest error in thousandths; `None` for the rounding of a float.
        fn worst_case(
            surfaces: &CodeMap<Self::Line, Self::Surface>,
            rate_rounding: f64,
        ) -> Option<f64>;
        /// The line that the step evaluates: a float takes the factor of the span into its coefficients.
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
