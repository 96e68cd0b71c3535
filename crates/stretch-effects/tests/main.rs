//! Tests of the public interface of stretch-effects, in one program because linking takes longer
//! than most tests.

mod catalogue;
mod inverses;
mod limits;
mod linear;
mod loops;
mod names;
mod ranges;
mod session;
mod support;
