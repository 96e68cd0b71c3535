//! The answer in words, made from the verdict when nothing can change any more.

use crate::{
    evidence::{
        candidates::Candidate,
        gathered::{Evidence, Excess},
        sanity::Sanity,
        shares::EffectShare,
    },
    problem::simulator::Simulator,
    record::{gross::Gross, sentence::sentence},
    verdict::{
        diagnosis::{Unexplained, VerdictKind},
        judge::{Judged, Overruled},
        naming::Naming,
    },
};

/// Least share of the gap that is reported of an effect that is not named.
const LEAST_PART: f64 = 0.05;

/// Multiple of the noise above which nothing is said to be all of it, or certain.
const NOT_ALL: f64 = 1.5;

/// Share of the gap from which a name is most of it.
const MOST: f64 = 0.5;

/// Least share that is reported as a number.
const LEAST_SHARE_IN_WORDS: f64 = 0.01;

/// What is reported: the answer in one sentence, and what was noticed and assumed.
pub(crate) struct Words {
    pub(crate) sentence: String,
    pub(crate) notes: Vec<String>,
}

/// The verdict, and the numbers that are reported with it.
#[derive(Clone, Copy)]
pub(crate) struct Answer<'a> {
    pub(crate) judged: &'a Judged,
    pub(crate) gap: Excess,
    /// The most probable candidate, its probability beside that of what the catalogue lacks.
    pub(crate) first: Option<&'a Candidate>,
    pub(crate) shares: &'a [EffectShare],
    pub(crate) sanity: &'a Sanity,
    /// What a partial answer leaves.
    pub(crate) unexplained: Option<&'a Unexplained>,
    /// What is wrong with the record or the rig file.
    pub(crate) gross: &'a [Gross],
    /// Gap that noise alone may leave.
    pub(crate) null_band: f64,
}

/// Puts a verdict into words.
pub(crate) fn tell(answer: Answer<'_>, simulator: &dyn Simulator, evidence: &Evidence) -> Words {
    let mut notes = Vec::new();
    if evidence.roles.borrowed_test {
        let held =
            "there is no test trial: the last quarter of every trial is held back and tested on";
        notes.push(held.into());
    }
    notes.extend(gross_misfit(answer.sanity, simulator));
    let seen = seen(answer, simulator, evidence);
    let sentence = match &answer.judged.overruled {
        None => seen,
        Some(overruled) => {
            notes.push(format!("before that was seen: {seen}"));
            wrong(overruled, simulator)
        }
    };
    let proposed = &answer.judged.proposed;
    let proposed = proposed.as_ref().map_or(String::new(), |p| format!(" {}", p.sentence));
    Words { sentence: sentence + &proposed, notes }
}

/// Effects that are listed of those that were not looked at.
const LISTED: usize = 6;

/// Effects that were not looked at, the first of them by name.
pub(crate) fn listed(not_looked_at: &[&str]) -> String {
    let names = not_looked_at[..not_looked_at.len().min(LISTED)].join(", ");
    match not_looked_at.len().saturating_sub(LISTED) {
        0 => names,
        more => format!("{names} and {more} more"),
    }
}

/// Said first where the budget of runs was spent: an answer that stands on part of the catalogue is no answer about the rest.
pub(crate) fn cut_short(not_looked_at: &[&str]) -> String {
    match not_looked_at.is_empty() {
        true => "The budget of runs was spent before the search was over. ".to_owned(),
        false => {
            format!("The budget of runs was spent; not looked at: {}. ", listed(not_looked_at))
        }
    }
}

fn seen(answer: Answer<'_>, simulator: &dyn Simulator, evidence: &Evidence) -> String {
    let Answer { judged, gap, .. } = answer;
    let naming = &judged.seen_naming;
    match (judged.seen, answer.first) {
        (VerdictKind::Record, Some(first)) if !answer.gross.iter().any(Gross::is_plain) => {
            sentence(answer.gross)
                + &format!(
                    " With that corrected, {} of the gap close on trials that were not fitted, and {}.",
                    closed(first, gap.left),
                    left_with(first, gap.left)
                )
        }
        (VerdictKind::Record, _) => {
            sentence(answer.gross) + " Nothing can be said of effects until that is corrected."
        }
        (VerdictKind::Effect, Some(first)) => {
            let names = naming.alternatives();
            format!(
                "The simulator lacks {}: {} {} of the gap on trials that were not fitted, and {}.",
                names.join(" and "),
                if names.len() > 1 { "together they close" } else { "it closes" },
                closed(first, gap.left),
                left_with(first, gap.left)
            ) + &beside(naming)
        }
        (VerdictKind::Partial, Some(_)) => partial(answer) + &beside(naming),
        (VerdictKind::Effect | VerdictKind::Partial | VerdictKind::Unknown, _) => {
            let all = evidence.stages.iter().zip(simulator.stages());
            let worst = all.max_by(|a, b| a.0.excess_after.total_cmp(&b.0.excess_after));
            let best = evidence.best_effect.map(|e| simulator.effects()[e].name.as_str());
            let with_best = best.map_or("no effect closes any of that".to_owned(), |best| {
                format!("{:.2} times with {best} in it, which closes most", multiple(gap.left))
            });
            format!(
                "There is a gap in {} that the catalogue does not explain: the re-tuned simulator leaves {:.2} times the noise, and {with_best}.",
                worst.map_or("", |(_, spec)| spec.name.as_str()),
                multiple(gap.retuned),
            ) + &parts(answer.shares)
        }
        (VerdictKind::Parameters | VerdictKind::NoGap, _) => match answer.null_band {
            band if gap.retuned > band => {
                let left = too_faint(gap, band, evidence, simulator);
                match naming.faint.is_empty() {
                    true => "Too faint to name: ".to_owned() + &left,
                    false => format!(
                        "Found, and too small to matter: {}; {left}",
                        naming.faint.join(", ")
                    ),
                }
            }
            _ if judged.seen == VerdictKind::NoGap => {
                "Simulator and rig agree within the noise.".to_owned() + &too_small(naming)
            }
            _ => {
                format!(
                    "No effect is missing: with its parameters re-tuned within their tolerances the simulator agrees with the rig (what is left is {:.1} times the noise as shipped, {:.2} re-tuned).",
                    multiple(gap.raw),
                    multiple(gap.retuned)
                ) + &too_small(naming)
            }
        },
    }
}

/// More than chance, and nothing that a name could stand on.
fn too_faint(gap: Excess, band: f64, evidence: &Evidence, simulator: &dyn Simulator) -> String {
    let all = evidence.stages.iter().zip(simulator.stages());
    let worst = all.max_by(|a, b| a.0.excess_retuned.total_cmp(&b.0.excess_retuned));
    format!(
        "with its parameters re-tuned the simulator leaves {:.3} times the noise, most of it in {}. Noise as it is described \
         stays below {:.3} in 19 of 20 records like this one: it is larger, or something is missing.",
        multiple(gap.retuned),
        worst.map_or("", |(_, spec)| spec.name.as_str()),
        multiple(band)
    )
}

/// Share of the gap that a candidate closes, with its interval: never all of it where more than noise is left.
fn closed(candidate: &Candidate, left: f64) -> String {
    let most = if multiple(left) > NOT_ALL { 99.0 } else { 100.0 };
    let percent = |share: f64| (100.0 * share).round().clamp(0.0, most);
    let [low, high] = candidate.closed_ci.map(percent);
    format!("{:.0} % ({low:.0} to {high:.0} %)", percent(candidate.closed))
}

/// What is left with a candidate, and how probable it is: never certain where more than noise is left. Where most of it is left on trials that
/// were fitted, that is said: tables tell what is left on the others.
fn left_with(candidate: &Candidate, left: f64) -> String {
    let most = if multiple(left) > NOT_ALL { 0.99 } else { 1.0 };
    format!(
        "{:.2} times the noise is left{}; probability {:.2}",
        multiple(left),
        if candidate.fits_worse() { " on those that were" } else { "" },
        candidate.probability.min(most)
    )
}

/// What was found, and is too small to matter.
fn too_small(naming: &Naming) -> String {
    match naming.faint.is_empty() {
        true => String::new(),
        false => format!(" Found, and too small to matter: {}.", naming.faint.join(", ")),
    }
}

/// A channel that the simulator has little to do with: a warning, for causes may explain it all the same.
fn gross_misfit(sanity: &Sanity, simulator: &dyn Simulator) -> Option<String> {
    let left = sanity.left.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    let (stage, share) = left.filter(|(_, share)| **share > sanity.allowed)?;
    let spec = &simulator.stages()[stage];
    Some(format!(
        "{:.0} % of what {} does is not in the simulator of {}: is it the right rig, and is every column what its name says?",
        100.0 * share.min(1.0),
        spec.channel,
        spec.name
    ))
}

/// Mostly this, and so much else.
fn partial(answer: Answer<'_>) -> String {
    let naming = &answer.judged.seen_naming;
    let closes =
        |name: &String| answer.shares.iter().find(|s| s.effect == *name).map_or(0.0, |s| s.closes);
    let in_words = |share: f64| match share < LEAST_SHARE_IN_WORDS {
        true => "below 1 %".to_owned(),
        false => format!("{:.0} %", 100.0 * share),
    };
    let is_bound = |name: &String| answer.shares.iter().any(|s| s.effect == *name && s.at_bound);
    let pairs = naming.named.iter().zip(naming.alternatives());
    let mut names: Vec<(f64, String)> = pairs
        .map(|(name, words)| {
            let share = closes(name);
            let end = if is_bound(name) { ", at the end of its range" } else { "" };
            (share, format!("{words} ({}{end})", in_words(share)))
        })
        .collect();
    names.sort_by(|a, b| b.0.total_cmp(&a.0));
    let names: Vec<String> = names.into_iter().map(|(_, words)| words).collect();
    let closed = answer.first.map_or(0.0, |first| first.closed);
    let much = if closed >= MOST { "Mostly" } else { "In part" };
    let times = multiple(answer.gap.left);
    let rest = answer.unexplained.map_or(String::new(), |u| {
        let sits = match u.sits.is_empty() {
            true => String::new(),
            false => format!(", most of it at {}", u.sits.join("; ")),
        };
        let share = match u.share < LEAST_SHARE_IN_WORDS {
            true => "Less than 1 % is".to_owned(),
            false => format!("{:.0} % are", 100.0 * u.share.min(1.0)),
        };
        format!(
            "{share} not explained, {times:.2} times the noise: that sits in {}{sits}.",
            u.stage
        )
    });
    format!("{much} {} of the gap on trials that were not fitted. {rest}", names.join(", "))
}

/// Ties and what is faint, behind the headline.
fn beside(naming: &Naming) -> String {
    let mut out = String::new();
    if !naming.ties.is_empty() {
        out += " These data cannot tell which with 95 % probability.";
    }
    if !naming.faint.is_empty() {
        out += &format!(" Also seen, faint: {}.", naming.faint.join(", "));
    }
    out
}

/// Root mean square of what is left, in multiples of the noise, from an excess (mean square over the noise's, minus 1).
fn multiple(excess: f64) -> f64 {
    (1.0 + excess).max(0.0).sqrt()
}

/// Which effects close parts of a gap that no set of them explains.
fn parts(shares: &[EffectShare]) -> String {
    let parts = shares.iter().filter(|s| s.closes >= LEAST_PART).map(|s| {
        let end = if s.at_bound { " (at the end of its range)" } else { "" };
        format!("{} {:.0} %{end}", s.effect, 100.0 * s.closes)
    });
    let parts: Vec<String> = parts.collect();
    let all: f64 = shares.iter().map(|s| s.closes).sum();
    match parts.is_empty() {
        true => String::new(),
        false => format!(
            " Parts of it close: {} ({:.0} % together, on trials that were not fitted).",
            parts.join(", "),
            100.0 * all
        ),
    }
}

/// Why it may not be the right simulator.
fn wrong(overruled: &Overruled, simulator: &dyn Simulator) -> String {
    match overruled {
        Overruled::TooLittle(why) => why.words(),
        Overruled::AtBounds(found) => {
            let names = found.ended.iter().map(|&p| simulator.parameters()[p].name.as_str());
            format!(
                "The parameters of {} do not fit within their tolerances: {} stand at the end of them, and {:.1} times the noise is left \
                 all the same. Is it the right rig? If its parameters are right, something is missing that is not in the catalogue.",
                simulator.stages()[found.stage].name,
                names.collect::<Vec<_>>().join(", "),
                multiple(found.left)
            )
        }
    }
}
