//! Tests of which effects are named, and of the description in words.

mod naming;
mod sentence;
