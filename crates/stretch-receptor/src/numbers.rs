//! The numbers that a receptor's step computes with, for an implementation of the step in another language.
//!
//! [`Front::model`](crate::Front::model) gives the numbers of a receptor that takes volts (see
//! [`model`](crate::model)). The numbers of a receptor that takes codes are in [`code`](mod@crate::code)
//! (`FixedNumbers`, `IntegerObserver`).
//!
//! ```
//! use stretch_receptor::{StretchReceptor, example_calibration, numbers::Map};
//! let receptor = StretchReceptor::<f32>::new(&example_calibration())?;
//! let Map::Poly13([inflation, _]) = receptor.model().map() else { panic!("a surface a branch") };
//! assert_eq!((inflation.signal.min, inflation.signal.max), (1.1, 2.06)); // volts
//! # Ok::<(), stretch_receptor::ReceptorError>(())
//! ```

pub use crate::{
    curve::Curve,
    defects::{Bound, Played, Relaxing, Wearing},
    diagnosed::{LEAST_ANSWER, LEAST_RUN, SMOOTH},
    fold::{held, rounded},
    front::Direction,
    map::{DomainEnds, Line, Map, RangedSurface},
};
