//! The summary of a diagnosis for the first ten seconds of reading: the change, its probability, the improvement that
//! it brings, and the next step.

use stretch_data::listed;
use stretch_gap::{Answer, Diagnosis, Gross, ParameterShift, VerdictKind, nouns};
use stretch_problem::effect_in_words;

use super::{
    markup::{fixed, multiple, number, percent, shown_unit, with_unit},
    subject::Subject,
};

/// Returns the headline of a page. If the diagnosis names effects, it states that they are missing; their probability
/// and the share of the gap that they close follow below.
pub(crate) fn headline(subject: &Subject<'_>) -> String {
    let d = subject.diagnosis;
    match &d.answer {
        Some(Answer::Missing { effects, .. }) => {
            let [simulator, _] = nouns(d.gauge_alone);
            let lacking = Answer::effects_in_words(effects);
            format!("{}The {simulator} lacks {lacking}.", d.preface())
        }
        // a probability holds only among the candidates, so the text adds this condition
        _ => d.in_sentences(&|p| format!("{} {GIVEN}", percent(p))).replace(" %", "\u{a0}%"),
    }
}

/// The condition of every probability.
pub(crate) const GIVEN: &str = "given this catalogue";

/// The next step, in a sentence.
fn to_do(d: &Diagnosis) -> String {
    let next = d.next_experiment.as_ref().filter(|next| !next.separates.is_empty());
    let experiment = next.map(|next| {
        let seconds = 60.0 * next.minutes;
        let long = if seconds < 120.0 {
            format!("{} s", number(seconds, 2))
        } else {
            format!("{} min", number(next.minutes, 2))
        };
        format!(
            "Measure \u{201c}{}\u{201d} ({long}): it would tell {} apart.",
            next.name.replace('_', " "),
            listed(&next.separates)
        )
    });
    let now = d.next_step();
    match (experiment, d.verdict) {
        (Some(experiment), VerdictKind::Effect | VerdictKind::Partial) if d.tied.is_empty() => {
            format!("{now} {experiment}")
        }
        (Some(experiment), _) => experiment,
        (None, _) => now,
    }
}

/// Returns four short answers: the change, its certainty, its gain, and the next step.
pub(crate) fn facts(d: &Diagnosis) -> Vec<(&'static str, String)> {
    let best = d.candidates.first();
    let gain = best.map_or_else(String::new, |c| {
        let [low, high] = c.closed_ci.map(percent);
        let interval = if low == high { String::new() } else { format!(" ({low} to {high})") };
        let fitted = match c.fits_worse() {
            true => format!(", {} times on those that were", fixed(c.leaves(), 2)),
            false => String::new(),
        };
        format!(
            "{} of the gap closes on trials that were not fitted{interval}: {} times the noise is left{fitted}.",
            percent(c.closed),
            fixed(multiple(c.gap_after), 2)
        )
    });
    let place = d
        .location
        .stages
        .iter()
        .max_by(|a, b| a.share.total_cmp(&b.share))
        .map_or_else(String::new, |s| format!("{} ({} of the gap)", s.stage, percent(s.share)));
    let fix = match d.verdict {
        VerdictKind::Effect | VerdictKind::Partial => {
            let effects = d.answer.as_ref().map_or(&[][..], Answer::effects);
            format!("Add {}.", Answer::effects_in_words(effects))
        }
        VerdictKind::Parameters => {
            let moved = moved(d);
            if moved.is_empty() {
                "Take the re-tuned parameters below.".to_owned()
            } else {
                format!("Set {}.", listed(&moved))
            }
        }
        VerdictKind::Unknown => {
            format!("No effect of the catalogue explains the gap. Look at {place}.")
        }
        VerdictKind::NoGap => "Nothing.".to_owned(),
        VerdictKind::Record => {
            let what: Vec<&str> = d.gross.iter().map(|g| g.hint.as_str()).take(1).collect();
            format!(
                "Nothing yet. The recording and the parameters have to be right first: {}.",
                what.concat()
            )
        }
    };
    let sure = match (d.verdict, best) {
        (VerdictKind::Effect | VerdictKind::Partial, Some(c)) => {
            let rivals: Vec<String> =
                d.ambiguous.iter().filter(|n| !d.named.contains(n)).cloned().collect();
            let rest = if !d.tied.is_empty() {
                "that is the probability of all alternatives together".to_owned()
            } else if rivals.is_empty()
                && d.answer.as_ref().is_some_and(Answer::leaves_more_than_noise)
            {
                "nothing else that was tried explains as much, and more than noise is left"
                    .to_owned()
            } else if rivals.is_empty() {
                "nothing else explains these data as well".to_owned()
            } else {
                format!("these data cannot rule out {}", listed(&rivals))
            };
            let p = d.answer.as_ref().and_then(Answer::probability).unwrap_or(c.probability);
            format!("Probability {} {GIVEN}: {rest}.", percent(p))
        }
        (VerdictKind::Record, Some(c)) if !d.gross.iter().any(Gross::is_plain) => {
            format!(
                "Probability {} compared with every set of effects, {GIVEN}.",
                percent(c.probability)
            )
        }
        (VerdictKind::Record, _) => {
            "The columns alone show this, whatever was simulated.".to_owned()
        }
        (VerdictKind::Unknown, _) => {
            "There is certainly a gap; the effects of the catalogue explain at most a part of it."
                .to_owned()
        }
        _ if d.is_faint() => {
            "More is left than the stated noise explains, but too little to name a cause."
                .to_owned()
        }
        _ => "What is left is within the noise on trials that were not fitted.".to_owned(),
    };
    let gain = match d.verdict {
        VerdictKind::Effect | VerdictKind::Partial => format!("{gain}{}", cheaper(d)),
        VerdictKind::Unknown => format!("The best that the catalogue offers: {gain}"),
        VerdictKind::Record if d.gross.iter().any(Gross::is_plain) => {
            "A usable recording.".to_owned()
        }
        VerdictKind::Record => format!("{gain} After that, effects can be seen."),
        VerdictKind::Parameters if d.is_faint() => {
            format!(
                "With re-tuned parameters {} times the noise is left.",
                number(multiple(d.gap.retuned), 4)
            )
        }
        VerdictKind::Parameters => "The whole gap closes by re-tuning.".to_owned(),
        VerdictKind::NoGap => format!("The {} can be used as it is.", nouns(d.gauge_alone)[0]),
    };
    vec![
        ("What to change", fix),
        ("How sure", sure),
        ("What it gains", gain),
        ("What to do next", to_do(d)),
    ]
}

/// Returns a sentence on the improvement of a calibration if its error falls by more than a tenth, otherwise nothing.
fn cheaper(d: &Diagnosis) -> String {
    let poly13 = d.transfer.as_ref().map(|t| t.poly13);
    match poly13.filter(|e| e.sim_with_effect < 0.9 * e.sim) {
        Some(e) => format!(
            " A non-linear calibration trained on simulated trials then has an error of {} instead of {} of full scale.",
            percent(0.01 * e.sim_with_effect),
            percent(0.01 * e.sim)
        ),
        None => String::new(),
    }
}

/// Returns the parameters that re-tuning moved by more than a tolerance, as "NAME to VALUE".
fn moved(d: &Diagnosis) -> Vec<String> {
    let far = d.parameters.iter().filter(|p| p.is_evidence && p.sigmas.abs() > 1.0);
    let fitted = |p: &ParameterShift| with_unit(&number(p.fitted, 3), shown_unit(&p.unit));
    far.map(|p| format!("{} to {}", p.name, fitted(p))).collect()
}

/// Returns a sentence for every named effect. The numbers of an effect are in the section with its code.
pub(crate) fn causes(subject: &Subject<'_>) -> Vec<String> {
    let d = subject.diagnosis;
    let one = |name: &String| {
        let own = subject.implementations.iter().find(|own| effect_in_words(&own.name, d) == *name);
        own.map(|own| format!("{name}: {}.", own.words))
    };
    d.named.iter().filter_map(one).collect()
}
