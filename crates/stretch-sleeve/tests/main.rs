//! Integration tests of stretch-sleeve, in one program because linking takes longer than most of
//! them.

mod array;
mod firmware;
mod record;
mod shifted;
