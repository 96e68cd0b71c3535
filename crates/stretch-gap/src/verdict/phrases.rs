//! Phrases of the [sentences](super::sentence): numbers, shares and lists of effects in words.

use crate::verdict::{
    answer::{Closed, MissingEffect},
    family::EffectFamily,
};

/// Size of the residual, in multiples of the noise, above which the text states at most 99 % of the
/// gap as closed and at most 0.99 as a probability.
pub(super) const NOT_ALL: f64 = 1.5;

/// Smallest share that is given as a number, and not as "less than 1 %".
const LEAST_SHARE_IN_WORDS: f64 = 0.01;

/// Largest number of effects that are listed as not examined.
const LISTED: usize = 6;

/// Formats a probability for sentences. One that is not certain is never rounded to 1.
pub(crate) fn two_digits(probability: f64) -> String {
    match (0.995..1.0).contains(&probability) {
        true => "over 0.99".to_owned(),
        false => format!("{probability:.2}"),
    }
}

/// Returns a text with a capital first letter.
pub(super) fn capitalised(text: &str) -> String {
    let (first, rest) = text.split_at(text.len().min(1));
    first.to_uppercase() + rest
}

/// Returns a sentence with a small first letter, to follow a colon.
pub(super) fn decapitalised(sentence: &str) -> String {
    let (first, rest) = sentence.split_at(1);
    first.to_lowercase() + rest
}

/// Lists the first names, and the number of further ones.
pub(super) fn first_of(names: &[String]) -> String {
    let first = names[..names.len().min(LISTED)].join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// Returns the name of a stage in a sentence. `simulator` is the default name of an only stage.
pub(super) fn of_stage(stage: &str, simulator: &str) -> String {
    if stage == simulator { format!("the {stage}") } else { stage.to_owned() }
}

/// Describes the share of the gap that a hypothesis closes, with its interval; at most 99 % if the
/// residual exceeds [`NOT_ALL`].
pub(super) fn closed(closes: &Closed) -> String {
    let most = if closes.left > NOT_ALL { 99.0 } else { 100.0 };
    let percent = |share: f64| (100.0 * share).round().clamp(0.0, most);
    let [low, high] = closes.interval.map(percent);
    let share = match (0.995..1.0).contains(&closes.share) {
        true => "over 99 %".to_owned(),
        false => format!("{:.0} %", percent(closes.share)),
    };
    if low == high { share } else { format!("{share} ({low:.0} to {high:.0} %)") }
}

/// Describes the residual that a hypothesis leaves, and its probability, which is at most 0.99 if
/// the residual exceeds [`NOT_ALL`]. If much more is left on the fitted trials than on the others,
/// the text says that the number refers to the fitted trials; tables give the value on the other
/// trials.
pub(super) fn left_with(closes: &Closed, probability: &dyn Fn(f64) -> String) -> String {
    let most = if closes.left > NOT_ALL { 0.99 } else { 1.0 };
    format!(
        "{:.2} times the noise is left{}; probability {}",
        closes.left,
        if closes.fits_worse { " on those that were" } else { "" },
        probability(closes.probability.min(most))
    )
}

impl MissingEffect {
    pub(super) fn is_tied(&self) -> bool {
        !self.alternatives.is_empty()
    }
}

/// Whether several effects are numbered, because one of them has alternatives.
pub(super) fn is_numbered(effects: &[MissingEffect]) -> bool {
    effects.len() > 1 && effects.iter().any(MissingEffect::is_tied)
}

/// Lists effects in words, numbered or with a separator.
pub(super) fn numbered(
    effects: &[MissingEffect],
    words: impl Fn(&MissingEffect) -> String,
    separator: &str,
) -> String {
    if !is_numbered(effects) {
        return effects.iter().map(words).collect::<Vec<_>>().join(separator);
    }
    let all: Vec<String> =
        (1..).zip(effects).map(|(i, effect)| format!("({i}) {}", words(effect))).collect();
    let count = ["two", "three", "four"].get(effects.len() - 2).map_or("several", |word| *word);
    format!("{count} effects: {}", all.join("; "))
}

/// Formats a share in whole percent, or as "less than 1 %".
pub(super) fn least_percent(share: f64) -> String {
    if share < LEAST_SHARE_IN_WORDS { "less than 1 %".to_owned() } else { percent(share) }
}

/// Formats a share in whole percent, or with one digit below one percent.
pub(super) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent {
        x if (99.5..100.0).contains(&x) => "over 99 %".to_owned(),
        x if x.abs() < 0.95 => format!("{} %", (10.0 * x).round() / 10.0 + 0.0),
        x => format!("{x:.0} %"),
    }
}

/// Lists an effect and its alternatives. Alternatives that do the same are described together.
pub(super) fn alternatives(effect: &MissingEffect) -> String {
    let family = effect.family.as_ref();
    let is_other = |name: &&String| family.is_none_or(|family| !family.names.contains(name));
    let own = family.map_or_else(|| effect.name.clone(), EffectFamily::words);
    let others = effect.alternatives.iter().filter(is_other).cloned();
    let all = std::iter::once(own).chain(others).collect::<Vec<_>>().join(" or ");
    match (effect.is_tied(), family) {
        (true, None) => format!("{all} (these data cannot tell which)"),
        _ => all,
    }
}

/// Lists an effect and its alternatives, with the share of the gap that the effect closes.
pub(super) fn with_share(effect: &MissingEffect) -> String {
    let share = match effect.closes {
        share if share <= 0.0 => "nothing on its own".to_owned(),
        share => least_percent(share),
    };
    let end = if effect.at_bound { ", at the end of its range" } else { "" };
    match effect.is_tied() {
        true => format!("{} with {share}{end}", alternatives(effect)),
        false => format!("{} ({share}{end})", effect.name),
    }
}

/// Lists effects that were found but are too small to matter.
pub(super) fn too_small(small: &[String]) -> String {
    match small.is_empty() {
        true => String::new(),
        false => format!(" Found, and too small to matter: {}.", small.join(", ")),
    }
}

/// Describes parameters at the ends of their tolerances. The cause that pushes them there may also
/// have distorted the values of the effects.
pub(super) fn at_ends(ended: &[(String, f64)]) -> String {
    let all: Vec<String> =
        ended.iter().map(|(name, sigmas)| format!("{name} ({sigmas:+.1} tolerances)")).collect();
    let (are, their) =
        if all.len() == 1 { ("is", "its tolerance") } else { ("are", "their tolerances") };
    match all.is_empty() {
        true => String::new(),
        false => format!(
            " {} {are} at the end of {their}: the values that were found may make up for something else.",
            all.join(" and ")
        ),
    }
}

/// Lists faint effects, for the text after the first sentence.
pub(super) fn also_seen(faint: &[String]) -> String {
    match faint.is_empty() {
        true => String::new(),
        false => format!(" Also seen, faint: {}.", faint.join(", ")),
    }
}
