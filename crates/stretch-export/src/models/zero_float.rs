//! The watch of a gauge's zero in `float`.

use stretch_core::Polarity;
use stretch_sleeve::{Turns, ZeroWatch};

use crate::{constants::Constants, part::Part};

/// A part with the watch behind its step.
pub(crate) fn with_zero(mut part: Part, polarity: Polarity, turns: &Turns) -> Part {
    let watch = ZeroWatch::<f32>::new(polarity, turns);
    let ZeroWatch { finder, sign, shares: [low, high], level, limit, most, .. } = watch;
    let mut constants = Constants::default();
    constants
        .define("ZERO_LEVELS", Turns::MEDIAN_OF as i32, "that a median is taken of")
        .define("ZERO_SPAN", finder.least_span, "what the signal goes through in a movement")
        .define("ZERO_SIGN", sign, "-1 where the signal falls as the target rises")
        .define("ZERO_LOW_SHARE", low, "of the low end in a level")
        .define("ZERO_HIGH_SHARE", high, "of the high end")
        .define("ZERO_LEVEL", level, "of the calibration, times the sign")
        .define("ZERO_LIMIT", limit, "how far the median of levels may be off")
        .define("ZERO_MEAN_LIMIT", watch.mean_limit, "how far their running mean may be off")
        .define("ZERO_MEAN_SHARE", watch.mean_share, "weight of the newest level in it")
        .define("ZERO_MOST", most, "what a level counts for at most in a zero that is followed")
        .define("ZERO_FOLLOW", watch.following(turns).follow, "the share by which it moves")
        .define("ZERO_REFERENCE", watch.reference, "the estimate per signal, times the sign");
    part.constants.push_str(&constants.into_text());
    // the last part of a step ends the compiler's rules for floats
    let last = part.step.len() - 1;
    part.step.insert(last, include_str!("../c/zero_float.h"));
    part
}
