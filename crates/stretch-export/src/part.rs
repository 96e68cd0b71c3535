//! What a model gives to a header.

/// A model in C: its record as constants, and its step over them.
#[derive(Debug)]
pub(crate) struct Part {
    /// As `linear`, `observer+rest`.
    pub(crate) model: String,
    /// The record.
    pub(crate) constants: String,
    /// The step, in the order of the file.
    pub(crate) step: Vec<&'static str>,
}
