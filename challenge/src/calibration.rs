//! Calibrates the posterior: finds the thresholds for which the sealed labels are most likely.
//!
//! A diagnosis lists every hypothesis with its score and the gap that it leaves. Its probabilities
//! for other thresholds can therefore be computed without another diagnosis. The mean of ln
//! P(truth) over labelled cases is maximised one threshold at a time. The kinds of cases (one
//! effect, two effects, a cause outside the catalogue) have equal weights, whatever their numbers
//! of cases. Cases without an effect have three times this weight, because a false alarm is worse
//! than an overlooked cause. The calibrated thresholds separate causes in the catalogue from causes
//! outside it. The temperature and the softness of this border do not change, because they were
//! calibrated on more cases and seeds than one run has. If the softness were fitted to the forms of
//! one generator, the probabilities would be too certain for others.

use std::collections::{BTreeMap, BTreeSet};

use stretch_blind::{COUNTED_EXCESS, CaseKind, Label, are_twins};
use stretch_data::significant;
use stretch_gap::{Candidate, Diagnosis, Thresholds, VerdictKind};

/// Probability of a true hypothesis that is not among the candidates.
const NOT_LISTED: f64 = 1e-3;
/// Weight of cases without an effect, relative to the other kinds.
const NULL: f64 = 3.0;
/// Factors by which a threshold is multiplied or divided, and the number of rounds over all
/// thresholds with each factor.
const FACTORS: [f64; 3] = [2.0, 1.3, 1.1];
const ROUNDS: usize = 8;

/// The thresholds that are calibrated.
const CALIBRATED: [fn(&mut Thresholds) -> &mut f64; 3] =
    [|t| &mut t.unknown_excess, |t| &mut t.unknown_share, |t| &mut t.unknown_odds];

/// A label, and the diagnosis of the case.
pub type Case = (Label, Diagnosis);

/// Calibrates thresholds on diagnosed cases with labels. Thresholds that control the search do not
/// change.
pub fn calibrated(cases: &[&Case]) -> Thresholds {
    let mut kinds: BTreeMap<CaseKind, Vec<(&Diagnosis, Vec<usize>)>> = BTreeMap::new();
    for (label, diagnosis) in cases.iter().filter(|(label, d)| is_counted(label, d)) {
        // An entry that was removed from the catalogue is a cause outside the catalogue.
        let kind = match label.kind {
            CaseKind::Struck => CaseKind::OutOfCatalogue,
            kind => kind,
        };
        kinds.entry(kind).or_default().push((diagnosis, truth(label, diagnosis)));
    }
    let likelihood = |thresholds: &Thresholds| -> f64 {
        let one = |(diagnosis, truth): &(&Diagnosis, Vec<usize>)| {
            let all = diagnosis.probabilities(thresholds);
            truth.iter().map(|&i| all[i]).sum::<f64>().max(NOT_LISTED).ln()
        };
        let mean = |(kind, cases): (&CaseKind, &Vec<_>)| {
            let weight = if *kind == CaseKind::Null { NULL } else { 1.0 };
            weight * cases.iter().map(one).sum::<f64>() / cases.len() as f64
        };
        kinds.iter().map(mean).sum::<f64>() / kinds.len().max(1) as f64
    };
    let mut best = Thresholds::frozen();
    let mut most = likelihood(&best);
    eprintln!("mean ln P(truth) of {} kinds: {most:.4} as they are", kinds.len());
    for factor in FACTORS {
        for _ in 0..ROUNDS {
            for threshold in CALIBRATED {
                for factor in [factor, 1.0 / factor] {
                    let mut other = best;
                    *threshold(&mut other) *= factor;
                    let found = likelihood(&other);
                    if found > most {
                        (best, most) = (other, found);
                    }
                }
            }
        }
    }
    eprintln!("mean ln P(truth): {most:.4} calibrated");
    for threshold in CALIBRATED {
        let value = threshold(&mut best);
        *value = significant(*value, 3);
    }
    best
}

/// Whether a case is used: its cause is visible and is one set of effects, and the diagnosis did
/// not find an error of the recording.
fn is_counted(label: &Label, diagnosis: &Diagnosis) -> bool {
    let shows = label.kind == CaseKind::Null || label.excess >= COUNTED_EXCESS;
    shows && label.kind != CaseKind::Dominant && diagnosis.verdict() != VerdictKind::Record
}

/// Returns the indices of the true candidates; empty if none is listed.
fn truth(label: &Label, diagnosis: &Diagnosis) -> Vec<usize> {
    let named: BTreeSet<&String> = label.effects.iter().collect();
    let is_twin = |c: &Candidate| {
        c.effects.len() == 1 && are_twins(&c.effects[0], &label.effects[0], label.pressure_column)
    };
    let is_true = |c: &Candidate| match label.kind {
        CaseKind::Null => c.effects.is_empty(),
        CaseKind::OutOfCatalogue => c.effects == ["unknown"],
        CaseKind::Struck => c.effects == ["unknown"] || is_twin(c),
        _ => c.effects.iter().collect::<BTreeSet<_>>() == named,
    };
    (0..diagnosis.candidates.len()).filter(|&i| is_true(&diagnosis.candidates[i])).collect()
}
