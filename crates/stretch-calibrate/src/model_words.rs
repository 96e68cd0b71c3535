//! The models' names in words.

/// What the models of a choice are, in one sentence, for whoever sees their names for the first time.
///
/// ```
/// use stretch_calibrate::{MODELS_IN_WORDS, Memory};
/// for kind in Memory::ALL.into_iter().filter(|kind| *kind != Memory::Diagnosed) {
///     assert!(MODELS_IN_WORDS.contains(&kind.to_string()), "{kind}");
/// }
/// ```
pub const MODELS_IN_WORDS: &str = "linear is a line, poly13 the published surfaces over signal and rate, blended the same without a jump at \
    a reversal; hysteresis, relaxation, both, history and observer remember what the signal did before, and with +rest follow a baseline \
    that drifts";
