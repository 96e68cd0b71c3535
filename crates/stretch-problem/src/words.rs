//! Effects of a diagnosis by what they are, in place of the names by which files and options call them.

use std::collections::BTreeMap;

use stretch_effects::kind_named;
use stretch_gap::Diagnosis;
use stretch_sim::{CATALOGUE, RigStage, effect_named};

/// What an effect is, as a noun: `the gauge's hysteresis` for `gauge_hysteresis`, `backlash at the output` for `output.backlash`. A name that no
/// catalogue has, such as an effect of one's own simulator, stands for itself.
pub fn effect_in_words(name: &str, diagnosis: &Diagnosis) -> String {
    let Some((place, kind)) = name.rsplit_once('.') else {
        let is_ours = |stage: &str| RigStage::ALL.iter().any(|own| own.name() == stage);
        // a simulator of somebody's own may call something else by the same name
        let is_ours = diagnosis.location.stages.iter().all(|s| is_ours(&s.stage));
        let own = effect_named(name).filter(|_| is_ours);
        return own.map_or(name, |effect| effect.title).to_owned();
    };
    let (kind, from) = match kind.trim_end_matches(')').split_once('(') {
        Some((kind, other)) => (kind, format!(" from {other}")),
        None => (kind, String::new()),
    };
    let Some(kind) = kind_named(kind) else { return name.to_owned() };
    let side = |side: &str| match side {
        "input" | "output" => format!("the {side}"),
        column => column.to_owned(),
    };
    let place = match place.rsplit_once('.') {
        Some((stage, place)) => format!("{} of {stage}", side(place)),
        None => side(place),
    };
    format!("{}{from} at {place}", kind.title)
}

/// A diagnosis whose effects are called by what they are, to be shown: what is computed with, and what is stored, keeps the names.
pub fn in_words(diagnosis: &Diagnosis) -> Diagnosis {
    let mut out = diagnosis.clone();
    let words = Words::of(diagnosis);
    let lists = [&mut out.named, &mut out.tied, &mut out.faint, &mut out.ambiguous];
    lists.into_iter().flatten().for_each(|name| *name = words.name(name));
    for candidate in &mut out.candidates {
        candidate.effects.iter_mut().for_each(|name| *name = words.name(name));
        candidate.parameters.iter_mut().for_each(|p| p.effect = words.name(&p.effect));
    }
    out.shares.iter_mut().for_each(|s| s.effect = words.name(&s.effect));
    out.stabilities.iter_mut().for_each(|s| s.effect = words.name(&s.effect));
    out.detection_limits.iter_mut().for_each(|l| l.effect = words.name(&l.effect));
    if let Some(said) = &mut out.baselines {
        let all = [&mut said.largest_drop, &mut said.signature, &mut said.bic];
        all.into_iter().flatten().for_each(|name| *name = words.name(name));
    }
    if let Some(next) = &mut out.next_experiment {
        next.separates.iter_mut().for_each(|name| *name = words.name(name));
        next.why = words.text(&next.why);
    }
    out.sentence = words.text(&out.sentence);
    out.notes.iter_mut().for_each(|note| *note = words.text(note));
    out
}

/// What each name stands for.
struct Words(BTreeMap<String, String>);

impl Words {
    fn of(diagnosis: &Diagnosis) -> Self {
        let d = diagnosis;
        let sets = d.candidates.iter().flat_map(|c| &c.effects);
        let names = [&d.named, &d.tied, &d.faint, &d.ambiguous].into_iter().flatten().chain(sets);
        let names = names
            .chain(d.shares.iter().map(|s| &s.effect))
            .chain(d.stabilities.iter().map(|s| &s.effect))
            .chain(d.detection_limits.iter().map(|l| &l.effect))
            .chain(
                d.baselines.iter().flat_map(|b| [&b.largest_drop, &b.signature, &b.bic]).flatten(),
            )
            .chain(d.next_experiment.iter().flat_map(|next| &next.separates));
        // a note may speak of an effect that the answer does not; a name without an underscore may be a word of its own there
        let others = CATALOGUE.iter().map(|effect| effect.name.to_owned());
        let others = others.filter(|name| name.contains('_'));
        let all = names.cloned().chain(others);
        Self(all.map(|name| (name.clone(), effect_in_words(&name, d))).collect())
    }

    fn name(&self, name: &str) -> String {
        self.0.get(name).cloned().unwrap_or_else(|| name.to_owned())
    }

    /// A sentence with every name in words, the longest that fits first.
    fn text(&self, text: &str) -> String {
        let (mut out, mut rest, mut before) = (String::with_capacity(text.len()), text, ' ');
        while let Some(first) = rest.chars().next() {
            let is_whole = |name: &str| {
                let mut after = rest[name.len()..].chars();
                match after.next() {
                    Some('.') => !after.next().is_some_and(|c| c.is_alphanumeric()),
                    Some(c) => !(c.is_alphanumeric() || c == '_'),
                    None => true,
                }
            };
            let begins = !(before.is_alphanumeric() || before == '_' || before == '.');
            let found = self
                .0
                .iter()
                .rev()
                .find(|(name, _)| begins && rest.starts_with(name.as_str()) && is_whole(name));
            let taken = match found {
                Some((name, words)) => {
                    out += words;
                    name.len()
                }
                None => {
                    out.push(first);
                    first.len_utf8()
                }
            };
            before = rest[..taken].chars().next_back().unwrap_or(' ');
            rest = &rest[taken..];
        }
        out
    }
}

/// A sentence to stand below equations: what `mean_rev`, `play` and braces mean. `None` where no equation has one of them.
///
/// ```
/// use stretch_problem::notation;
/// assert_eq!(notation(["y = x + offset"]), None);
/// let words = notation(["y = x + offset", "y = mean_rev(x, tau_s)"]).expect("words");
/// assert!(words.contains("tau dy/dt = x - y"));
/// ```
pub fn notation<'a>(equations: impl IntoIterator<Item = &'a str>) -> Option<&'static str> {
    let needs = |equation: &str| equation.contains("play(") || equation.contains("mean_rev(");
    equations.into_iter().any(needs).then_some(
        "In equations y = mean_rev(x, tau) follows x with a time constant, tau dy/dt = x - y; y = play(x, w) stays until x is farther \
         off than w, then follows at that distance; with {a, b, c} there are three of them, whose mean is taken.",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_a_sentence_are_whole_words() {
        let words =
            [("leak", "the chamber's leak"), ("input.lag", "a lag at the input"), ("b", "B")];
        let words = Words(words.map(|(name, said)| (name.to_owned(), said.to_owned())).into());
        let text = |text: &str| words.text(text);
        assert_eq!(
            text("lacks leak or input.lag."),
            "lacks the chamber's leak or a lag at the input."
        );
        for same in ["leaks", "a_leak", "leak_2", "input.lag.x", "drum.leak", "µ", ""] {
            assert_eq!(text(same), same);
        }
        assert_eq!(text("(leak, b)"), "(the chamber's leak, B)");
    }
}
