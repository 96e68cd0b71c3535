//! The integration tests of stretch-blind, in one program because linking takes longer than most
//! tests.

mod cases;
mod frozen;
mod open;
mod score;
