//! The tables of a diagnosis's report.

use stretch_gap::{
    Baselines, Candidate, Diagnosis, EffectStability, EffectValue, SliceGap, StageGap, Transfer,
};

use super::multiple::{both, times};
use super::{
    markup::{NONE, fixed, number, percent, shown_unit, with_unit},
    page::Table,
};
use crate::plain::{LINE, SURFACE, methods};

fn interval([low, high]: [f64; 2], text: impl Fn(f64) -> String) -> String {
    format!("{} .. {}", text(low), text(high))
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
        "What is left on the test trials: root mean square, and in multiples (\u{d7}) of the noise",
        &["Stage", "Noise", "As shipped", "Re-tuned", "With the effect"],
        stages.iter().map(row),
    )
}

/// The effects of a candidate.
fn effects(candidate: &Candidate) -> String {
    match candidate.effects.as_slice() {
        [] => "none".to_owned(),
        effects => effects.join(", "),
    }
}

/// A table of every candidate: how probable it is, and what it closes.
pub fn candidate_table(candidates: &[Candidate]) -> Table {
    let row = |c: &Candidate| {
        vec![
            effects(c),
            fixed(c.probability, 3),
            times(c.gap_before),
            times(c.gap_after),
            percent(c.closed),
            interval(c.closed_ci, percent),
        ]
    };
    Table::new(
        "Candidates, the most probable set first, nothing and unknown behind: probability given this catalogue; what is left before \
         and after in multiples of the noise, all channels with a gap together; the share that closes on trials that were not fitted",
        &["Effects", "Probability", "Left before", "Left after", "Closes", "95 % interval"],
        candidates.iter().map(row),
    )
    .highlight((!candidates.is_empty()).then_some(0))
}

/// A table of the numbers that were fitted, a row for each effect of each candidate, and of how firmly the effect stands. Sets are counted as in
/// [`candidate_table`].
pub fn candidate_numbers_table(candidates: &[Candidate], stabilities: &[EffectStability]) -> Table {
    let value = |p: &EffectValue| {
        let unit = shown_unit(&p.unit);
        let sd = with_unit(&number(p.sd, 2), unit);
        format!("{} = {} \u{b1} {sd}", p.name, number(p.value, 3))
    };
    let stability = |effect: &String| {
        let known = stabilities.iter().find(|s| s.effect == *effect);
        known.map_or_else(|| NONE.to_owned(), |s| fixed(s.stability, 2))
    };
    // nothing and unknown have no numbers
    let own = (1..).zip(candidates).filter(|(_, c)| !c.parameters.is_empty());
    let rows = own.flat_map(|(set, c)| {
        c.effects.iter().map(move |effect| {
            let own = c.parameters.iter().filter(|p| p.effect == *effect);
            let values: Vec<String> = own.map(value).collect();
            vec![effect.clone(), format!("{set}"), stability(effect), values.join("; ")]
        })
    });
    Table::new(
        "Numbers of every set, \u{b1} one standard deviation; stability, the share of resampled records in which the most probable set \
         holds the effect",
        &["Effect", "Set", "Stability", "Numbers"],
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

/// A table of the cost of the gap for a calibration.
pub fn transfer_table(transfer: &Transfer) -> Table {
    let rows = [(LINE, transfer.linear), (SURFACE, transfer.poly13)].map(|(name, e)| {
        vec![name.to_owned(), number(e.real, 3), number(e.sim, 3), number(e.sim_with_effect, 3)]
    });
    Table::new(
        "Error on measured test trials, % of full scale, by where the calibration was trained",
        &["Calibration", "Measured trials", "Simulator, re-tuned", "Simulator with the effect"],
        rows,
    )
}

/// A table of the effects that simpler methods named.
pub fn baseline_table(said: &Baselines) -> Table {
    let row = |(method, name): (&str, Option<&str>)| {
        vec![method.to_owned(), name.unwrap_or("nothing").to_owned()]
    };
    let caption = "Methods that leave one step out, on the same data";
    Table::new(caption, &["Method", "Names"], methods(said).map(row))
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
