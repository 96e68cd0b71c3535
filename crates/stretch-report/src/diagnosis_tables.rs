//! The tables of a diagnosis's report. The *gap* is the difference between simulator and recording.

use stretch_data::listed;
use stretch_gap::{
    Candidate, DetectionLimit, Diagnosis, EffectStability, EffectValue, Identified, Knowledge,
    SliceGap, StageGap, Transfer, TransferError,
};
use stretch_problem::{ByTrial, RunFit};

use super::{
    markup::{NONE, both, fixed, number, percent, shown_unit, times, with_unit},
    page::Table,
};

fn interval([low, high]: [f64; 2], text: impl Fn(f64) -> String) -> String {
    match [text(low), text(high)] {
        // such as > 99 %
        [low, high] if low == high => low,
        [low, high] => format!("{low} .. {high}"),
    }
}

/// A table of the gap of every stage.
pub fn stage_table(stages: &[StageGap], has_after: bool) -> Table {
    let row = |s: &StageGap| {
        vec![
            s.stage.clone(),
            with_unit(&number(s.floor, 3), &s.unit),
            both(s.raw, s.floor, &s.unit),
            both(s.excess, s.floor, &s.unit),
            if has_after { both(s.after, s.floor, &s.unit) } else { NONE.to_owned() },
        ]
    };
    Table::new(
        "Remaining error on the test trials: root mean square, and in multiples (\u{d7}) of the noise",
        &["Stage", "Noise", "As shipped", "Re-tuned", "With the effect"],
        stages.iter().map(row),
    )
}

/// The effects of a candidate: `none` if nothing is missing, `unknown` for a cause outside the catalogue.
pub(crate) fn effects(candidate: &Candidate) -> String {
    match candidate.effects.as_slice() {
        [] => "none".to_owned(),
        effects => effects.join(" + "),
    }
}

/// Whether a candidate is a set of effects, and neither nothing nor a cause outside the catalogue.
fn is_set(candidate: &Candidate) -> bool {
    !candidate.parameters.is_empty()
}

/// Probability below which a set of effects is not listed.
const LEAST_PROBABILITY: f64 = 0.005;

/// Returns the candidates to list, the most probable first, and the number of those that are left out because their
/// probability is below 0.5 %. Nothing and unknown are always listed.
pub(crate) fn probable(candidates: &[Candidate]) -> (Vec<&Candidate>, usize) {
    let is_listed = |c: &&Candidate| !is_set(c) || c.probability >= LEAST_PROBABILITY;
    let mut listed: Vec<&Candidate> = candidates.iter().filter(is_listed).collect();
    listed.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let others = candidates.len() - listed.len();
    (listed, others)
}

/// A table of the candidates with their probabilities and the shares of the gap that they close, the most probable
/// first. Sets of effects below 0.5 % are counted in the caption.
pub fn candidate_table(candidates: &[Candidate]) -> Table {
    let (listed, others) = probable(candidates);
    let row = |c: &&Candidate| {
        vec![
            effects(c),
            fixed(c.probability, 3),
            times(c.gap_before),
            times(c.gap_after),
            percent(c.closed),
            interval(c.closed_ci, percent),
        ]
    };
    let others = match others {
        0 => String::new(),
        1 => "; 1 other is below 0.5 %".to_owned(),
        n => format!("; {n} others are below 0.5 %"),
    };
    let caption = format!(
        "Candidates, the most probable first (none: nothing is missing; unknown: a cause outside the catalogue). Left: the difference \
         as a multiple of the noise. Closes: the share of it that the candidate explains on trials that were not fitted{others}"
    );
    Table::new(
        caption,
        &["Effects", "Probability", "Left before", "Left after", "Closes", "95 % interval"],
        listed.iter().map(row),
    )
    .highlight((!listed.is_empty()).then_some(0))
}

/// A table of the fitted numbers, with one row per effect of each candidate, and of the stability of the effect. Sets
/// are numbered in the order of [`candidate_table`].
pub fn candidate_numbers_table(candidates: &[Candidate], stabilities: &[EffectStability]) -> Table {
    let value = |p: &EffectValue| {
        let unit = shown_unit(&p.unit);
        let sd = with_unit(&number(p.sd, 2), unit);
        let end = if p.at_bound { " (at the end of its range)" } else { "" };
        format!("{} = {} \u{b1} {sd}{end}", p.name, number(p.value, 3))
    };
    let stability = |effect: &String| {
        let known = stabilities.iter().find(|s| s.effect == *effect);
        known.map_or_else(|| NONE.to_owned(), |s| fixed(s.stability, 2))
    };
    // the candidates for no effect and for an unknown effect have no numbers
    let own = (1..).zip(probable(candidates).0).filter(|(_, c)| is_set(c));
    let rows = own.flat_map(|(set, c)| {
        c.effects.iter().map(move |effect| {
            let own = c.parameters.iter().filter(|p| p.effect == *effect);
            let values: Vec<String> = own.map(value).collect();
            vec![effect.clone(), format!("{set}"), stability(effect), values.join("; ")]
        })
    });
    Table::new(
        "Values of every candidate, \u{b1} one standard deviation. Stability: the share of resampled recordings in which the most probable \
         candidate contains the effect",
        &["Effect", "Candidate", "Stability", "Values"],
        rows,
    )
}

/// A table of the nominal parameters; `None` when there are none.
pub(crate) fn parameter_table(d: &Diagnosis) -> Option<Table> {
    let row = |p: &stretch_gap::ParameterShift| {
        let unit = shown_unit(&p.unit);
        vec![
            format!("{}{}", p.name, if p.is_evidence { "" } else { " *" }),
            with_unit(&number(p.nominal, 4), unit),
            number(p.fitted, 4),
            fixed(p.sigmas, 1),
            number(p.bent, 4),
        ]
    };
    let head = ["Name", "As shipped", "Final", "Moved, tolerances", "Without the effect"];
    let table = Table::new("Nominal parameters", &head, d.parameters.iter().map(row));
    (!d.parameters.is_empty()).then_some(table)
}

/// A table of the cost of the gap: errors of calibrations that were trained on measured and on simulated trials.
pub fn transfer_table(transfer: &Transfer) -> Table {
    let rows = [(LINE, transfer.linear), (SURFACE, transfer.poly13)].map(|(name, e)| {
        vec![name.to_owned(), number(e.real, 3), number(e.sim, 3), number(e.sim_with_effect, 3)]
    });
    Table::new(
        "Errors of two calibrations on the measured test trials, % of full scale, after a fit to measured or simulated trials",
        &["Calibration", "Measured trials", "Simulated, re-tuned", "Simulated with the effect"],
        rows,
    )
}

/// A table of every slice of a stage; `None` when there are none.
pub(crate) fn slice_table(slices: &[SliceGap], stage: &str) -> Option<Table> {
    let rows: Vec<Vec<String>> = slices
        .iter()
        .filter(|s| s.stage == stage)
        .map(|s| {
            vec![
                format!("{}: {}", s.by, s.slice),
                percent(s.share),
                times(s.excess),
                interval(s.excess_ci, times),
                if s.stands_out { "yes" } else { "" }.to_owned(),
            ]
        })
        .collect();
    let caption =
        format!("{stage}: what is left by slice in multiples of the noise, re-tuned, all trials");
    let head = ["Slice", "Share of the gap", "Left", "95 % interval", "Stands out"];
    (!rows.is_empty()).then(|| Table::new(caption, &head, rows))
}

/// A table of the detection limits: the strengths at which each effect would be seen and named, with the parameter that
/// measures it.
///
/// ```
/// use stretch_gap::DetectionLimit;
/// use stretch_report::limit_table;
/// let limit = r#"{ "effect": "creep", "parameter": "c", "strength": null, "unit": "1", "others": {}, "seen": 0.0123, "like": "relaxation" }"#;
/// let limit: DetectionLimit = serde_json::from_str(limit)?;
/// let row = ["creep", "c", "0.0123", "cannot be told apart from relaxation"];
/// assert_eq!(limit_table(&[limit]).rows[0], row);
/// # Ok::<(), serde_json::Error>(())
/// ```
pub fn limit_table(limits: &[DetectionLimit]) -> Table {
    let row = |limit: &DetectionLimit| {
        let shown = |strength: f64| with_unit(&number(strength, 3), shown_unit(&limit.unit));
        let none = || "none within its range".to_owned();
        let like = || limit.like.as_ref().map(|like| format!("cannot be told apart from {like}"));
        let named = limit.strength.map(shown).or_else(like).unwrap_or_else(none);
        let seen = limit.seen.or(limit.strength).map_or_else(none, shown);
        vec![limit.effect.clone(), limit.parameter.clone(), seen, named]
    };
    Table::new(
        "Detection limits: the strength at which something would be seen on these data, and at which the effect would be \
         named, each with probability 0.9 if nothing else is missing",
        &["Effect", "Parameter", "Seen from", "Named from"],
        limits.iter().map(row),
    )
}

/// Every value of every run with its 95 % interval, and whether the run determines it.
pub fn run_table(by_trial: &ByTrial) -> Table {
    let head = ["value", "run", "fitted", "from", "to", "unit", "determined"];
    let all: Vec<&RunFit> = std::iter::once(&by_trial.all).chain(&by_trial.runs).collect();
    let row = |fit: &RunFit, i: usize| {
        let v = &fit.values[i];
        let numbers = [v.value, v.interval[0], v.interval[1]].map(|x| number(x, 4));
        let texts = [v.identified.name.clone(), fit.run.clone()];
        let behind = [v.identified.unit.clone(), knowledge(&v.identified)];
        texts.into_iter().chain(numbers).chain(behind).collect::<Vec<String>>()
    };
    let values = 0..by_trial.all.values.len();
    let rows = values.flat_map(|i| all.iter().map(move |fit| row(fit, i)));
    Table::new("Every run by itself, with 95 % intervals", &head, rows.collect::<Vec<_>>())
}

fn knowledge(value: &Identified) -> String {
    match value.knowledge {
        Knowledge::Determined => "yes".to_owned(),
        _ if !value.like.is_empty() => format!("only with {}", value.like.join(", ")),
        Knowledge::Weakly => "weakly".to_owned(),
        Knowledge::Not => "no".to_owned(),
        Knowledge::Dead => "no, it does nothing".to_owned(),
    }
}

/// Whether each value is the same in all runs.
pub fn difference_table(by_trial: &ByTrial) -> Table {
    let head = ["value", "runs", "mean", "from", "to", "Q", "beyond intervals", "P", "agrees"];
    let rows = by_trial.values.iter().map(|v| {
        let [low, high] = v.range;
        let numbers = [v.mean, low, high, v.q].map(|x| number(x, 4));
        let agrees = if v.differs { "no" } else { "yes" };
        let p = number(v.p_corrected, 2);
        let behind = [percent(v.i_squared), p, agrees.to_owned()];
        let front = [v.name.clone(), v.runs.to_string()];
        front.into_iter().chain(numbers).chain(behind).collect::<Vec<String>>()
    });
    Table::new("Whether the runs agree", &head, rows.collect::<Vec<_>>())
}

/// Largest difference of two errors, in percent of full scale, at which the errors count as equal.
const ALIKE: f64 = 0.05;

/// The calibrations that a transfer tries, `linear` and `poly13`.
const LINE: &str = "linear";
const SURFACE: &str = "non-linear";

/// Explains the cost of the effect for a calibration if the table alone does not: either the cost is too small to
/// matter to any calibration, or a calibration has larger errors with the better simulator. `None` if the table needs
/// no explanation.
pub fn transfer_in_words(transfer: &Transfer) -> Option<String> {
    let kinds = [(LINE, &transfer.linear), (SURFACE, &transfer.poly13)];
    let gain = |e: &TransferError| e.sim - e.sim_with_effect;
    if kinds.iter().all(|(_, e)| gain(e).abs() <= ALIKE) {
        let most = kinds.iter().map(|(_, e)| gain(e).abs()).fold(0.0, f64::max);
        return Some(format!(
            "What was found is too small to matter to a calibration: trained with it or without, the errors differ by {most:.2} % \
             of full scale at most."
        ));
    }
    let worse: Vec<String> = kinds
        .iter()
        .filter(|(_, e)| gain(e) < -ALIKE)
        .map(|(name, _)| (*name).to_owned())
        .collect();
    (!worse.is_empty()).then(|| {
        format!(
            "Trained with the effect, the {} calibration does worse here although the simulation is closer to the recording: a \
             calibration without memory cannot hold what the effect does. It learns the mean of it over the training \
             motion, which is not that of the test motion; the wrong parameters that stood in for the effect happened to \
             be nearer.",
            listed(&worse)
        )
    })
}
