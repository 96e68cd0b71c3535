//! The tests of stretch-filter from outside, one program: linking takes longer than most of them.

mod fixed;
mod logs;
mod properties;
mod references;
