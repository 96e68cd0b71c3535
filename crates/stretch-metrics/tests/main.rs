//! The integration tests of stretch-metrics, in one program because linking takes longer than most
//! of the tests.

mod limits;
mod properties;
mod reference;
