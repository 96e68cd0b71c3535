//! The contribution of a model to a header.

use stretch_core::Calibration;
use stretch_sleeve::{Turns, ZeroWatch};

use crate::constants::Constants;

/// A model in C: its calibration as constants, and the step (the code for one sample) that uses them.
#[derive(Debug)]
pub(crate) struct Part {
    /// Name of the model, such as `linear` or `observer+rest`.
    pub(crate) model: String,
    /// The calibration as constants.
    pub(crate) constants: Constants,
    /// The pieces of the step's text, in order. The beginning and the end are left out, because they are the same for
    /// all steps in the same arithmetic.
    pub(crate) step: Vec<&'static str>,
    /// Words that select code: a block of the step is kept if its `@if` names one of them.
    pub(crate) has: Vec<&'static str>,
}

impl Part {
    /// Appends code in `float` that monitors the gauge's zero to the step.
    pub(crate) fn with_zero(mut self, calibration: &Calibration, turns: &Turns) -> Self {
        let spec = calibration.spec();
        let watch = ZeroWatch::<f32>::new(spec.polarity, spec.sample_rate_hz, turns);
        let ZeroWatch { finder, sign, shares: [low, high], level, limit, most, .. } = watch;
        self.constants
            .define("ZERO_LEVELS", Turns::MEDIAN_OF as i32, "number of levels in a median")
            .define("ZERO_SPAN", finder.least_span, "least signal span of a movement")
            .define("ZERO_SIGN", sign, "-1 if the signal falls as the target rises")
            .define("ZERO_LOW_SHARE", low, "weight of the low end of a movement in its level")
            .define("ZERO_HIGH_SHARE", high, "weight of the high end of a movement in its level")
            .define("ZERO_LEVEL", level, "level in the calibration, times the sign")
            .define("ZERO_LIMIT", limit, "limit for the change of the median across a pause")
            .define("ZERO_PAUSE", watch.pause_samples, "most samples of a movement without a pause")
            .define("ZERO_MOST", most, "largest deviation of a level that counts")
            .define("ZERO_FOLLOW", watch.following(turns).follow, "share of a deviation tracked")
            .define("ZERO_REFERENCE", watch.reference, "estimate per signal, times the sign");
        self.step.push(include_str!("c/zero_float.h"));
        self
    }
}

/// Returns a text without the blocks that do not apply: the lines between `@if this that` and its `@end` are kept if
/// `has` contains one of the words.
pub(crate) fn kept(text: &str, has: &[&str]) -> String {
    // for each open block, whether it is kept
    let mut open: Vec<bool> = Vec::new();
    let mut out = String::new();
    for line in text.split_inclusive('\n') {
        if let Some(any) = line.strip_prefix("@if ") {
            open.push(any.split_whitespace().any(|word| has.contains(&word)));
        } else if line.trim_end() == "@end" {
            open.pop();
        } else if !open.contains(&false) {
            out.push_str(line);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_kept_where_one_of_its_words_is_there() {
        let text = "a\n@if x y\nb\n@if z\nc\n@end\nd\n@end\ne\n";
        assert_eq!(kept(text, &[]), "a\ne\n");
        assert_eq!(kept(text, &["z"]), "a\ne\n");
        assert_eq!(kept(text, &["y"]), "a\nb\nd\ne\n");
        assert_eq!(kept(text, &["x", "z"]), "a\nb\nc\nd\ne\n");
    }
}
