//! The integration tests of stretch-receptor, in one program because linking takes longer than most
//! tests.

mod code;
mod defects;
mod diagnosed;
mod finite;
mod firmware;
mod fixed_observer;
mod intervals;
mod remembering;
mod soak;
mod stream;
