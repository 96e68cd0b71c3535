//! The integration tests of stretch-core, in one program because linking takes longer than most of
//! the tests.

mod fixed;
mod properties;
mod records;
