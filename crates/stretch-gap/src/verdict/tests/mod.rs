//! What is named, and how it is put into words.

mod naming;
mod sentence;
