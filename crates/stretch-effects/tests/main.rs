//! The tests of stretch-effects from outside, one program: linking takes longer than most of them.

mod catalogue;
mod inverses;
mod limits;
mod linear;
mod loops;
mod names;
mod ranges;
mod session;
mod support;
