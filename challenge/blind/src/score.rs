//! Computes the statistics of a blind check from the opened labels and the verdicts.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::effect::Family;
use crate::error::BlindError;
use crate::rate::{Calibration, Rate};
use crate::truth::{CaseKind, Label, Truth, are_twins};
use crate::verdict::Verdict;

/// Smallest excess of a single effect that counts in the statistics.
pub const COUNTED_EXCESS: f64 = 0.1;

/// Answers to single effects with at least [`COUNTED_EXCESS`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Singles {
    /// The first named effect is right. A declared tie that contains the true effect counts as
    /// right.
    pub top1: Rate,
    /// The same, for cases with an excess above 10.
    pub top1_above_10: Rate,
    /// Only one effect is named, and it is right. A declared tie that contains the true effect
    /// counts as right.
    pub exact: Rate,
    /// The stage is right.
    pub stage: Rate,
    /// The effect is in the 95 % set; cases with an empty set do not count.
    pub set_covers: Rate,
    /// Mean number of effects in the sets that are not empty.
    pub set_size: Option<f64>,
    /// The verdict is `unknown`.
    pub false_unknown: Rate,
}

/// Answers to two effects.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Compounds {
    /// All effects are named.
    pub all_named: Rate,
    /// At least one of the effects is named.
    pub one_named: Rate,
}

/// A case answered wrongly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Miss {
    /// Name of the case.
    pub case: String,
    /// Its kind.
    pub kind: CaseKind,
    /// True effects.
    pub truth: Vec<String>,
    /// Verdict of the diagnosis.
    pub verdict: String,
    /// Effects that the diagnosis names.
    pub named: Vec<String>,
    /// Whether the 95 % set contains all true effects.
    pub in_set: bool,
    /// Excess of the label.
    pub excess: f64,
    /// Whether the pressure was recorded.
    pub pressure_column: bool,
}

/// All statistics of a blind check.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Score {
    /// Number of cases that were scored.
    pub cases: usize,
    /// Cases that have a label but no verdict.
    pub unanswered: Vec<String>,
    /// Single effects.
    pub singles: Singles,
    /// Cases without an effect in which an effect was named, or the verdict is `unknown` or
    /// `record`.
    pub false_alarms: Rate,
    /// Cases without an effect in which an effect was named.
    pub false_names: Rate,
    /// Probability of the first candidate compared with the truth, over the single effects that
    /// count.
    pub calibration: Calibration,
    /// Two effects.
    pub compounds: Compounds,
    /// Cases of one strong and three weak effects in which the strong effect is named.
    pub dominant_named: Rate,
    /// Effects outside the catalogue, with an excess of at least [`COUNTED_EXCESS`], that were
    /// answered by `unknown`.
    pub foreign_caught: Rate,
    /// Effects outside the catalogue in place of which another effect was named.
    pub foreign_named: Rate,
    /// Effects whose entry was removed from the catalogue and that have no known twin, with an
    /// excess of at least [`COUNTED_EXCESS`], that were answered by `unknown`.
    pub struck_unknown: Rate,
    /// Rate at which the first named effect is right, by effect, over the single effects that
    /// count.
    pub by_effect: BTreeMap<String, Rate>,
    /// Rate at which exactly the right effect is named, by family of its form, over the single
    /// effects that count.
    pub by_family: BTreeMap<Family, Rate>,
    /// Every wrong answer.
    pub misses: Vec<Miss>,
    /// Median, 95th percentile and greatest time of a diagnosis, s.
    pub runtime_s: Option<(f64, f64, f64)>,
}

impl Score {
    /// Scores verdicts against the labels.
    ///
    /// # Errors
    /// [`BlindError::Field`] for a case that the labels do not have, or that has two verdicts.
    pub fn of(truth: &Truth, verdicts: &[Verdict]) -> Result<Self, BlindError> {
        let mut tally = Tally::default();
        let mut seen = BTreeSet::new();
        for verdict in verdicts {
            let case = &verdict.case;
            let label = truth
                .cases
                .get(case)
                .ok_or_else(|| BlindError::field(case, "it is not among the sealed cases"))?;
            if !seen.insert(case) {
                return Err(BlindError::field(case, "it is answered twice"));
            }
            tally.add(label, verdict);
        }
        let missing = truth.cases.keys().filter(|case| !seen.contains(case));
        tally.score.unanswered = missing.cloned().collect();
        Ok(tally.finish())
    }
}

/// A score that is being computed.
#[derive(Debug, Default)]
struct Tally {
    score: Score,
    outcomes: Vec<(f64, bool)>,
    set_sizes: Vec<f64>,
    times: Vec<f64>,
}

impl Tally {
    fn add(&mut self, label: &Label, verdict: &Verdict) {
        self.score.cases += 1;
        self.times.push(verdict.runtime_s);
        let right = match label.kind {
            CaseKind::Single => self.single(label, verdict),
            CaseKind::Null => self.null(verdict),
            CaseKind::Compound | CaseKind::Dominant => self.several(label, verdict),
            CaseKind::OutOfCatalogue => self.foreign(label, verdict),
            CaseKind::Struck => self.struck(label, verdict),
        };
        if !right {
            self.score.misses.push(Miss {
                case: verdict.case.clone(),
                kind: label.kind,
                truth: label.effects.clone(),
                verdict: verdict.verdict.clone(),
                named: verdict.named.clone(),
                in_set: label.effects.iter().all(|e| verdict.ambiguous.contains(e)),
                excess: label.excess,
                pressure_column: label.pressure_column,
            });
        }
    }

    fn single(&mut self, label: &Label, verdict: &Verdict) -> bool {
        let Some(effect) = label.effects.first() else { return false };
        let answer = verdict.answer();
        let top1 = answer.first() == Some(effect) || verdict.ties().contains(effect);
        if label.excess < COUNTED_EXCESS {
            // If a faint effect is not named, this is no error; if another effect is named, it is.
            return answer.is_empty() || top1;
        }
        let singles = &mut self.score.singles;
        singles.top1.add(top1);
        if label.excess > 10.0 {
            singles.top1_above_10.add(top1);
        }
        let exact = answer.len() == 1 && top1;
        singles.exact.add(exact);
        singles.stage.add(in_stage(label, verdict));
        singles.false_unknown.add(verdict.verdict == "unknown");
        if !verdict.ambiguous.is_empty() {
            singles.set_covers.add(verdict.ambiguous.contains(effect));
            self.set_sizes.push(verdict.ambiguous.len() as f64);
        }
        self.score.by_family.entry(label.family).or_default().add(exact);
        self.score.by_effect.entry(effect.clone()).or_default().add(top1);
        if let Some((names, probability)) = verdict.belief() {
            self.outcomes.push((probability, names.contains(&effect)));
        }
        exact
    }

    fn null(&mut self, verdict: &Verdict) -> bool {
        let quiet = ["no_gap", "parameters"].contains(&verdict.verdict.as_str());
        self.score.false_alarms.add(!quiet);
        self.score.false_names.add(!verdict.answer().is_empty());
        quiet
    }

    fn foreign(&mut self, label: &Label, verdict: &Verdict) -> bool {
        let caught = verdict.verdict == "unknown";
        if label.excess < COUNTED_EXCESS {
            return caught || verdict.answer().is_empty();
        }
        self.score.foreign_caught.add(caught);
        self.score.foreign_named.add(!verdict.answer().is_empty());
        caught
    }

    fn struck(&mut self, label: &Label, verdict: &Verdict) -> bool {
        let Some(effect) = label.struck.as_ref().or(label.effects.first()) else { return false };
        let unknown = verdict.verdict == "unknown";
        let twin = |name: &String| are_twins(name, effect, label.pressure_column);
        let by_twin = verdict.answer().first().is_some_and(twin);
        if label.excess < COUNTED_EXCESS {
            return unknown || by_twin || verdict.answer().is_empty();
        }
        let has_twin = crate::truth::TWINS
            .iter()
            .any(|&(a, b)| (a == effect || b == effect) && are_twins(a, b, label.pressure_column));
        if !has_twin {
            self.score.struck_unknown.add(unknown);
        }
        unknown || by_twin
    }

    /// Scores a case with several effects. A wrong name does not count as an error if the declared
    /// tie contains a true effect that was not named.
    fn several(&mut self, label: &Label, verdict: &Verdict) -> bool {
        let answer = verdict.answer();
        let named = label.effects.iter().filter(|e| answer.contains(e)).count();
        let tied = |e: &&String| !answer.contains(e) && verdict.ties().contains(e);
        let excused = label.effects.iter().filter(tied).count().min(answer.len() - named);
        if label.kind == CaseKind::Dominant {
            let strongest = label.dominant.as_ref().or(label.effects.first());
            let right = strongest
                .is_some_and(|e| answer.contains(e) || (excused > 0 && verdict.ties().contains(e)));
            self.score.dominant_named.add(right);
            return right;
        }
        let found = named + excused;
        let all = found == label.effects.len();
        self.score.compounds.all_named.add(all);
        self.score.compounds.one_named.add(found > 0);
        all && answer.len() == found
    }

    fn finish(mut self) -> Score {
        let score = &mut self.score;
        score.calibration = Calibration::of(self.outcomes);
        let sizes = &self.set_sizes;
        let mean = || sizes.iter().sum::<f64>() / sizes.len() as f64;
        score.singles.set_size = (!sizes.is_empty()).then(mean);
        let times = &mut self.times;
        score.runtime_s = quantile(times, 0.5)
            .zip(quantile(times, 0.95))
            .zip(quantile(times, 1.0))
            .map(|((median, p95), most)| (median, p95, most));
        score.misses.sort_by(|a, b| a.case.cmp(&b.case));
        self.score
    }
}

/// Whether the named stage is that of the first effect; without a pressure column pneumatics and
/// muscle are one stage, `actuation`.
fn in_stage(label: &Label, verdict: &Verdict) -> bool {
    let Some(stage) = label.stages.first() else { return false };
    match verdict.stage.as_deref() {
        Some("actuation") => {
            !label.pressure_column && ["pneumatics", "muscle"].contains(&stage.name())
        }
        Some(name) => {
            name == stage.name() && !["no_gap", "parameters"].contains(&verdict.verdict.as_str())
        }
        None => false,
    }
}

/// Returns a quantile of the finite values by the nearest rank. The median of an even number of
/// values is the mean of the middle two. `None` if there is no finite value.
pub(crate) fn quantile(values: &mut Vec<f64>, q: f64) -> Option<f64> {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return None;
    }
    if q == 0.5 && n.is_multiple_of(2) {
        return Some(0.5 * (values[n / 2 - 1] + values[n / 2]));
    }
    Some(values[((q * n as f64).ceil() as usize).clamp(1, n) - 1])
}
