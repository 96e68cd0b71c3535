//! The integration tests of stretch-filter, in one program because linking takes longer than most
//! of the tests.

mod fixed;
mod logs;
mod properties;
mod references;
