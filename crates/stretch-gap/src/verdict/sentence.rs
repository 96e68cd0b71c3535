//! The answer of a diagnosis in words.

use crate::{
    problem::record_facts::nouns,
    record::gross::sentence,
    verdict::{
        answer::{Answer, Closed, MissingEffect},
        diagnosis::Diagnosis,
        family::EffectFamily,
    },
};

/// Size of the residual, in multiples of the noise, above which the text states at most 99 % of the
/// gap as closed and at most 0.99 as a probability.
const NOT_ALL: f64 = 1.5;

/// Share of the gap from which effects are said to explain the gap mostly, instead of in part.
const MOST: f64 = 0.5;

/// Smallest share that is given as a number, and not as "less than 1 %".
const LEAST_SHARE_IN_WORDS: f64 = 0.01;

/// Largest number of effects that are listed as not examined.
const LISTED: usize = 6;

impl Diagnosis {
    /// Describes the answer in plain sentences, without the next step; `probability` formats a
    /// probability.
    ///
    /// ```
    /// use stretch_gap::Diagnosis;
    /// fn check(diagnosis: &Diagnosis) {
    ///     let finding = diagnosis.in_sentences(&|p| format!("{p:.2}"));
    ///     assert!(diagnosis.sentence.starts_with(&finding));
    /// }
    /// ```
    pub fn in_sentences(&self, probability: &dyn Fn(f64) -> String) -> String {
        let Some(answer) = &self.answer else { return self.sentence.clone() };
        let proposed = self.proposed.as_ref().map_or(String::new(), |p| format!(" {}", p.sentence));
        let nouns = nouns(self.gauge_alone);
        let finding = match answer {
            Answer::Unknown { stage, left, .. } if self.none_examined => format!(
                "There is a gap in {}: the re-tuned {} leaves {left:.2} times the noise.",
                of_stage(stage, nouns[0]),
                nouns[0]
            ),
            answer => answer.in_sentences(nouns, probability),
        };
        self.preface() + &finding + &proposed
    }

    /// Returns what to do next, in a sentence; empty for a diagnosis without an
    /// [answer](Self::answer).
    ///
    /// ```
    /// use stretch_gap::Diagnosis;
    /// fn check(tied: &Diagnosis) {
    ///     assert_eq!(tied.next_step(), "Run an experiment that tells them apart before you build on one.");
    /// }
    /// ```
    pub fn next_step(&self) -> String {
        let [simulator, _] = nouns(self.gauge_alone);
        let step = match &self.answer {
            None => "",
            Some(Answer::Agrees { .. }) => "Nothing has to change.",
            Some(Answer::Retuned { .. }) => "Set the re-tuned parameters, then diagnose again.",
            Some(Answer::Faint { .. }) => {
                "Check whether the noise is larger than stated. If it is not, something small is missing."
            }
            Some(answer) if answer.effects().iter().any(MissingEffect::is_tied) => {
                if self.next_experiment.as_ref().is_some_and(|next| next.separates.is_empty()) {
                    return "Measure another quantity that tells them apart before you build on one.".into();
                }
                "Run an experiment that tells them apart before you build on one."
            }
            Some(Answer::Missing { effects, .. } | Answer::Partly { effects, .. }) => {
                let them = if effects.len() == 1 { "it" } else { "them" };
                &format!("Add {them} to the {simulator}, then diagnose again.")
            }
            Some(Answer::WrongRecord { .. }) => "Correct this error, then diagnose again.",
            Some(Answer::Unknown { .. }) if self.none_examined => {
                "Diagnose again with a larger budget of runs."
            }
            Some(Answer::Unknown { .. })
                if self.proposed.as_ref().is_some_and(|p| !p.equation.is_empty()) =>
            {
                &format!("Add the proposed term to the {simulator}, then diagnose again.")
            }
            Some(Answer::Unknown { .. } | Answer::AtBounds { .. }) => &format!(
                "Look where most is left, and add to the {simulator} what happens there as an effect of its own."
            ),
            Some(Answer::TooLittle { .. }) => "Record more, then diagnose again.",
        };
        step.to_owned()
    }

    /// Returns the sentences of a diagnosis. The next step is added if the sentences do not already
    /// say what to do.
    pub(crate) fn headline(&self) -> String {
        let finding = self.in_sentences(&two_digits);
        match &self.answer {
            Some(
                Answer::Retuned { .. }
                | Answer::Missing { .. }
                | Answer::Partly { .. }
                | Answer::Unknown { .. },
            ) => format!("{finding} Next: {}", decapitalised(&self.next_step())),
            _ => finding,
        }
    }

    /// Returns what was not examined; empty if everything was. A report starts with this text,
    /// because an answer from a part of the catalogue says nothing about the other effects.
    pub fn preface(&self) -> String {
        let mut out = match &self.cut_short {
            None => String::new(),
            Some(_) if self.none_examined => {
                "The budget of runs was spent before any effect could be examined. ".to_owned()
            }
            Some(rest) if rest.is_empty() => {
                "The budget of runs was spent before the search was over. ".to_owned()
            }
            Some(rest) => {
                format!("The budget of runs was spent; not looked at: {}. ", listed(rest))
            }
        };
        if !self.not_examined.is_empty() {
            out += &format!(
                "Not looked at, because their runs failed: {}. ",
                listed(&self.not_examined)
            );
        }
        out
    }
}

/// Formats a probability for sentences. One that is not certain is never rounded to 1.
pub(crate) fn two_digits(probability: f64) -> String {
    match (0.995..1.0).contains(&probability) {
        true => "over 0.99".to_owned(),
        false => format!("{probability:.2}"),
    }
}

/// Returns a sentence with a small first letter, to follow a colon.
fn decapitalised(sentence: &str) -> String {
    let (first, rest) = sentence.split_at(1);
    first.to_lowercase() + rest
}

/// Lists the first names, and the number of further ones.
fn listed(names: &[String]) -> String {
    let first = names[..names.len().min(LISTED)].join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// Returns the name of a stage in a sentence. `simulator` is the default name of an only stage.
fn of_stage(stage: &str, simulator: &str) -> String {
    if stage == simulator { format!("the {stage}") } else { stage.to_owned() }
}

impl Answer {
    /// Whether effects were found, but clearly more than noise is left after they are added.
    pub fn leaves_more_than_noise(&self) -> bool {
        match self {
            Self::Missing { closes, .. } => closes.left > NOT_ALL,
            Self::Partly { .. } => true,
            _ => false,
        }
    }

    /// Lists missing effects with their alternatives. Several effects are numbered if one of them
    /// has alternatives.
    pub fn effects_in_words(effects: &[MissingEffect]) -> String {
        let words = |effect: &MissingEffect| match effect.at_bound {
            true => format!("{} (at the end of its range)", alternatives(effect)),
            false => alternatives(effect),
        };
        numbered(effects, words, " and ")
    }

    /// Describes the answer in plain sentences with the [nouns] for simulator and machine;
    /// `probability` formats a probability.
    pub fn in_sentences(
        &self,
        [simulator, rig]: [&str; 2],
        probability: &dyn Fn(f64) -> String,
    ) -> String {
        match self {
            Self::Agrees { small } => {
                let (first, rest) = simulator.split_at(1);
                let begin = first.to_uppercase() + rest;
                format!("{begin} and {rig} agree within the noise.") + &too_small(small)
            }
            Self::Retuned { shipped, left, small } => {
                format!(
                    "No effect is missing: with its parameters re-tuned within their tolerances the {simulator} agrees with the {rig} (what is left is {shipped:.1} times the noise as shipped, {left:.2} re-tuned)."
                ) + &too_small(small)
            }
            Self::Faint { left, noise, stage, small } => {
                let found = match small.is_empty() {
                    true => "Too faint to name: ".to_owned(),
                    false => format!("Found, and too small to matter: {}; ", small.join(", ")),
                };
                format!(
                    "{found}with its parameters re-tuned the {simulator} leaves {left:.3} times the noise, most of it in {}. Noise as it is described \
                     stays below {noise:.3} in 19 of 20 recordings like this one: it is larger, or something is missing.",
                    of_stage(stage, simulator)
                )
            }
            Self::Missing { effects, closes, faint, ended } => {
                let they = match (is_numbered(effects), effects.len()) {
                    (true, _) => ". Together they close",
                    (false, 1) => ": it closes",
                    (false, _) => ": together they close",
                };
                format!(
                    "The {simulator} lacks {}{they} {} of the gap on trials that were not fitted, and {}.",
                    Self::effects_in_words(effects),
                    closed(closes),
                    left_with(closes, probability)
                ) + &at_ends(ended)
                    + &also_seen(faint)
            }
            Self::Partly {
                effects,
                closes,
                left,
                fits_worse,
                probability: p,
                rest,
                faint,
                ended,
            } => {
                let much = if *closes >= MOST { "Most" } else { "A part" };
                let probable =
                    p.map_or(String::new(), |p| format!(" (probability {})", probability(p)));
                let where_left = if *fits_worse { " on trials that were fitted" } else { "" };
                let rest = rest.as_ref().map_or(String::new(), |rest| {
                    let share = match rest.share < LEAST_SHARE_IN_WORDS {
                        true => "less than 1 %".to_owned(),
                        false => format!("{:.0} %", 100.0 * rest.share.min(1.0)),
                    };
                    let sits = match rest.sits.is_empty() {
                        true => String::new(),
                        false => format!(", most of it at {}", rest.sits.join("; ")),
                    };
                    format!(
                        " Not explained: {share} in {}{sits}; {left:.2} times the noise is left{where_left}.",
                        of_stage(&rest.stage, simulator)
                    )
                });
                let names = numbered(effects, with_share, ", ");
                format!(
                    "{much} of the gap on trials that were not fitted is explained{probable} by {names}.{rest}"
                ) + &at_ends(ended)
                    + &also_seen(faint)
            }
            Self::WrongRecord { errors, corrected: None } => {
                sentence(errors, [simulator, rig])
                    + " Nothing can be said of effects until that is corrected."
            }
            Self::WrongRecord { errors, corrected: Some(closes) } => {
                sentence(errors, [simulator, rig])
                    + &format!(
                        " With that corrected, {} of the gap closes on trials that were not fitted, and {}.",
                        closed(closes),
                        left_with(closes, probability)
                    )
            }
            Self::Unknown { stage, left, best, parts, together } => {
                let with_best = match best {
                    None => "none of the examined effects closes any of that".to_owned(),
                    Some((best, left)) => {
                        format!("{left:.2} times with {best} in it, which closes most")
                    }
                };
                let parts: Vec<String> = parts
                    .iter()
                    .map(|part| {
                        let end = if part.at_bound { " (at the end of its range)" } else { "" };
                        format!("{} {:.0} %{end}", part.effect, 100.0 * part.closes)
                    })
                    .collect();
                let parts = match parts.is_empty() {
                    true => String::new(),
                    false => format!(
                        " Parts of it close: {} ({:.0} % together, on trials that were not fitted).",
                        parts.join(", "),
                        100.0 * together
                    ),
                };
                format!(
                    "There is a gap in {} that the catalogue does not explain: the re-tuned {simulator} leaves {left:.2} times the noise, and {with_best}.{parts}",
                    of_stage(stage, simulator)
                )
            }
            Self::AtBounds { stage, parameters, left, .. } => format!(
                "The parameters of {} do not fit within their tolerances: {} are at the end of them, and the remaining error is still {left:.1} \
                 times the noise. Is it the right {rig}? If its parameters are right, something is missing that is not in the catalogue.",
                of_stage(stage, simulator),
                parameters.join(", ")
            ),
            Self::TooLittle { why } => why.words(),
        }
    }
}

/// Describes the share of the gap that a hypothesis closes, with its interval; at most 99 % if the
/// residual exceeds [`NOT_ALL`].
fn closed(closes: &Closed) -> String {
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
fn left_with(closes: &Closed, probability: &dyn Fn(f64) -> String) -> String {
    let most = if closes.left > NOT_ALL { 0.99 } else { 1.0 };
    format!(
        "{:.2} times the noise is left{}; probability {}",
        closes.left,
        if closes.fits_worse { " on those that were" } else { "" },
        probability(closes.probability.min(most))
    )
}

impl MissingEffect {
    fn is_tied(&self) -> bool {
        !self.alternatives.is_empty()
    }
}

/// Whether several effects are numbered, because one of them has alternatives.
fn is_numbered(effects: &[MissingEffect]) -> bool {
    effects.len() > 1 && effects.iter().any(MissingEffect::is_tied)
}

/// Lists effects in words, numbered or with a separator.
fn numbered(
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

/// Lists an effect and its alternatives. Alternatives that do the same are described together.
fn alternatives(effect: &MissingEffect) -> String {
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
fn with_share(effect: &MissingEffect) -> String {
    let share = match effect.closes {
        share if share <= 0.0 => "nothing on its own".to_owned(),
        share if share < LEAST_SHARE_IN_WORDS => "less than 1 %".to_owned(),
        share if (0.995..1.0).contains(&share) => "over 99 %".to_owned(),
        share => format!("{:.0} %", 100.0 * share),
    };
    let end = if effect.at_bound { ", at the end of its range" } else { "" };
    match effect.is_tied() {
        true => format!("{} with {share}{end}", alternatives(effect)),
        false => format!("{} ({share}{end})", effect.name),
    }
}

/// Lists effects that were found but are too small to matter.
fn too_small(small: &[String]) -> String {
    match small.is_empty() {
        true => String::new(),
        false => format!(" Found, and too small to matter: {}.", small.join(", ")),
    }
}

/// Describes parameters at the ends of their tolerances. The cause that pushes them there may also
/// have distorted the values of the effects.
fn at_ends(ended: &[(String, f64)]) -> String {
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
fn also_seen(faint: &[String]) -> String {
    match faint.is_empty() {
        true => String::new(),
        false => format!(" Also seen, faint: {}.", faint.join(", ")),
    }
}
