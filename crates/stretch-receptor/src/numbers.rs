//! The numbers of the steps, for an implementation of a step in another language.
//!
//! [`Front::model`](crate::Front::model) gives the numbers of a receptor that takes volts,
//! [`ArrayReceptor::numbers`](crate::ArrayReceptor::numbers) those of a receptor of several gauges;
//! those of a receptor that takes codes are in [`code`](mod@crate::code) (`FixedNumbers`, `IntegerObserver`).
//!
//! ```
//! use stretch_receptor::{StretchReceptor, example_calibration, numbers::Map};
//! let receptor = StretchReceptor::<f32>::new(&example_calibration())?;
//! let Map::Poly13([inflation, _]) = receptor.model().map() else { panic!("a surface a branch") };
//! assert_eq!((inflation.signal.min, inflation.signal.max), (1.1, 2.06)); // volts
//! # Ok::<(), stretch_filter::FilterError>(())
//! ```

pub use crate::{
    array::{ArrayAloneNumbers, ArrayChannelNumbers, ArrayGainNumbers, ArrayNumbers},
    curve::Curve,
    defects::{Bound, Played, Relaxing, Wearing},
    diagnosed::{Diagnosed, LEAST_ANSWER, LEAST_RUN, SMOOTH},
    front::Direction,
    map::{Bounds, Line, Map, RangedSurface},
    observer::Observer,
    receptor::Surfaces,
};
