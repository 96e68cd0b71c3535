//! The figures of a blind check, from the opened labels and the verdicts.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::effect::Family;
use crate::error::BlindError;
use crate::rate::{Calibration, Rate};
use crate::truth::{CaseKind, Label, Truth, are_twins};
use crate::verdict::Verdict;

/// Smallest excess from which a single effect counts.
pub const COUNTED_EXCESS: f64 = 0.1;
/// A candidate that closes this share of the gap replaces the removed effect.
pub const STAND_IN: f64 = 0.85;

/// Answers to single effects with at least [`COUNTED_EXCESS`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Singles {
    /// First name right; a declared tie that holds the truth counts as right.
    pub top1: Rate,
    /// The same for an excess above 10, 1 .. 10, 0.1 .. 1.
    pub top1_above_10: Rate,
    /// From 1 to 10.
    pub top1_1_to_10: Rate,
    /// From 0.1 to 1.
    pub top1_below_1: Rate,
    /// First name right or its known twin.
    pub top1_twins: Rate,
    /// First name right, whatever ties were declared.
    #[serde(default)]
    pub first_name: Rate,
    /// Exactly the one effect named; a declared tie that holds the truth counts as right.
    pub exact: Rate,
    /// Called a part of the gap, by a `partial`.
    #[serde(default)]
    pub partial: Rate,
    /// A tie was declared.
    #[serde(default)]
    pub tied: Rate,
    /// Mean number of names in a tie declared, the one named included.
    #[serde(default)]
    pub tie_size: Option<f64>,
    /// Called an error of the recording or the rig file.
    #[serde(default)]
    pub false_record: Rate,
    /// Stage right.
    pub stage: Rate,
    /// The effect is in the 95 % set (of cases whose set is not empty).
    pub set_covers: Rate,
    /// The effect is in the 95 % set; an empty set counts as a miss.
    pub set_covers_all: Rate,
    /// Mean number of effects in the sets that are not empty.
    pub set_size: Option<f64>,
    /// Sets of one effect: how many of them right.
    pub singletons_right: Rate,
    /// Called unknown.
    pub false_unknown: Rate,
    /// Called no gap or parameters.
    pub overlooked: Rate,
    /// Fainter than [`COUNTED_EXCESS`], but named nevertheless, and right.
    pub faint_named: Rate,
}

/// Numbers of effects that are named and present, named and absent, present and not named, over a
/// kind of cases.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Several {
    /// Every effect named.
    pub all_named: Rate,
    /// At least one of them named.
    pub one_named: Rate,
    /// The strongest named.
    pub strongest_named: Rate,
    /// Effects named that are there.
    pub precision: Rate,
    /// Effects there that are named.
    pub recall: Rate,
}

/// Cases in which the effect's entry was removed from the catalogue (excess at least
/// [`COUNTED_EXCESS`]).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Struck {
    /// Answered `unknown`, or with a known twin.
    pub unknown_or_twin: Rate,
    /// Answered `unknown`, of effects without a known twin.
    pub unknown_no_twin: Rate,
    /// Answered `unknown`, of cases whose first candidate does not close [`STAND_IN`] of the gap.
    pub unknown_no_stand_in: Rate,
    /// A catalogued effect named that is no twin.
    pub wrong_name: Rate,
}

/// A simpler method on the same cases.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Baseline {
    /// Its name right, singles with at least [`COUNTED_EXCESS`].
    pub top1: Rate,
    /// The same for an excess above 10.
    pub top1_above_10: Rate,
    /// Nulls on which it named an effect.
    pub false_names: Rate,
}

impl Baseline {
    fn add(&mut self, label: &Label, named: Option<&String>) {
        match label.kind {
            CaseKind::Null => self.false_names.add(named.is_some()),
            CaseKind::Single if label.excess >= COUNTED_EXCESS => {
                let right = named.is_some() && named == label.effects.first();
                self.top1.add(right);
                if label.excess > 10.0 {
                    self.top1_above_10.add(right);
                }
            }
            _ => {}
        }
    }
}

/// Figures of the cases of one family; as in [`Score`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FamilyRow {
    /// Cases scored.
    pub cases: usize,
    /// Exactly the one effect named, a declared tie counted right.
    pub exact: Rate,
    /// First name right, a declared tie counted right.
    pub top1: Rate,
    /// Stage right.
    pub stage: Rate,
    /// The effect is in the 95 % set, an empty set counting as a miss.
    pub set_covers_all: Rate,
    /// Single effects called unknown.
    pub false_unknown: Rate,
    /// Two effects: both named.
    pub both_named: Rate,
    /// Two effects: one of them named.
    pub one_named: Rate,
    /// One strong effect and three weak ones: the strong one named.
    pub strongest_named: Rate,
    /// Nulls on which an effect was named, the gap was called unknown, or the recording wrong.
    pub false_alarms: Rate,
    /// Causes outside the catalogue answered `unknown`: they are written in every family.
    pub foreign_caught: Rate,
    /// Cases whose entry was removed from the catalogue: answered `unknown` or with a known twin.
    pub struck: Rate,
    /// Expected calibration error.
    pub ece: Option<f64>,
}

/// A case answered wrongly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Miss {
    /// Name of the case.
    pub case: String,
    /// Its kind.
    pub kind: CaseKind,
    /// Effects there.
    pub truth: Vec<String>,
    /// Verdict given.
    pub verdict: String,
    /// Effects named.
    pub named: Vec<String>,
    /// Whether each effect there is in the 95 % set.
    pub in_set: bool,
    /// Excess of the label.
    pub excess: f64,
    /// Whether the pressure was recorded.
    pub pressure_column: bool,
}

/// Every figure of a blind check.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Score {
    /// Cases scored.
    pub cases: usize,
    /// Cases with a label and no verdict.
    pub unanswered: Vec<String>,
    /// Single effects.
    pub singles: Singles,
    /// Nulls on which an effect was named, the gap was called unknown, or the recording wrong.
    pub false_alarms: Rate,
    /// Nulls on which an effect was named.
    pub false_names: Rate,
    /// Probability of the first candidate against truth, over the singles counted.
    pub calibration: Calibration,
    /// Probability of `unknown` against truth, over every case where one was stated and the excess
    /// counts.
    #[serde(default)]
    pub calibration_unknown: Calibration,
    /// Two effects.
    pub compounds: Several,
    /// One strong effect and three weak ones.
    pub dominants: Several,
    /// Effects out of the catalogue answered `unknown`, excess at least [`COUNTED_EXCESS`].
    pub foreign_caught: Rate,
    /// An effect named for one out of the catalogue.
    #[serde(default)]
    pub foreign_named: Rate,
    /// Caught, by effect.
    pub foreign_by_effect: BTreeMap<String, Rate>,
    /// Effects out of the catalogue placed in their stage.
    pub foreign_stage: Rate,
    /// Cases with a removed entry.
    pub struck: Struck,
    /// Median closed-gap fraction of singles counted and named rightly.
    pub closed: Option<f64>,
    /// Median closed-gap fraction over all counted singles, whatever was named.
    pub closed_all: Option<f64>,
    /// Median of the fit that knows the label, over the cases of `closed_all` that have one.
    pub closed_oracle: Option<f64>,
    /// Median of `closed` over those same cases.
    pub closed_beside_oracle: Option<f64>,
    /// Truth to first name (or verdict, when none) of every single and null: how often.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Accuracy of the first name by effect, singles counted.
    pub by_effect: BTreeMap<String, Rate>,
    /// Simpler methods, by name.
    #[serde(default)]
    pub baselines: BTreeMap<String, Baseline>,
    /// Figures by family of forms, if there is more than one.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub families: BTreeMap<Family, FamilyRow>,
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
        let mut families: BTreeMap<Family, Tally> = BTreeMap::new();
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
            families.entry(label.family).or_default().add(label, verdict);
        }
        let missing = truth.cases.keys().filter(|case| !seen.contains(case));
        tally.score.unanswered = missing.cloned().collect();
        let mut score = tally.finish();
        if families.len() > 1 {
            let row = |(family, tally): (Family, Tally)| (family, tally.finish().row());
            score.families = families.into_iter().map(row).collect();
        }
        Ok(score)
    }

    /// What a table by family shows of it.
    fn row(&self) -> FamilyRow {
        let singles = &self.singles;
        FamilyRow {
            cases: self.cases,
            exact: singles.exact,
            top1: singles.top1,
            stage: singles.stage,
            set_covers_all: singles.set_covers_all,
            false_unknown: singles.false_unknown,
            both_named: self.compounds.all_named,
            one_named: self.compounds.one_named,
            strongest_named: self.dominants.strongest_named,
            false_alarms: self.false_alarms,
            foreign_caught: self.foreign_caught,
            struck: self.struck.unknown_or_twin,
            ece: self.calibration.ece,
        }
    }
}

/// A score in the making.
#[derive(Debug, Default)]
struct Tally {
    score: Score,
    outcomes: Vec<(f64, bool)>,
    unknowns: Vec<(f64, bool)>,
    tie_sizes: Vec<f64>,
    set_sizes: Vec<f64>,
    closed: Vec<f64>,
    closed_all: Vec<f64>,
    oracle: Vec<(f64, f64)>,
    times: Vec<f64>,
}

impl Tally {
    fn add(&mut self, label: &Label, verdict: &Verdict) {
        self.score.cases += 1;
        self.times.push(verdict.runtime_s);
        for (method, named) in &verdict.baselines {
            let one = self.score.baselines.entry(method.clone()).or_default();
            one.add(label, named.as_ref());
        }
        let lacking = matches!(label.kind, CaseKind::OutOfCatalogue | CaseKind::Struck);
        if label.kind == CaseKind::Null || label.excess >= COUNTED_EXCESS {
            self.unknowns.extend(verdict.unknown().map(|p| (p, lacking)));
        }
        let right = match label.kind {
            CaseKind::Single => self.single(label, verdict),
            CaseKind::Null => self.null(verdict),
            CaseKind::Compound => several(&mut self.score.compounds, label, verdict),
            CaseKind::Dominant => several(&mut self.score.dominants, label, verdict),
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

    fn confuse(&mut self, truth: &str, verdict: &Verdict) {
        let said = verdict.answer().first().unwrap_or(&verdict.verdict).clone();
        let row = self.score.confusion.entry(truth.to_owned()).or_default();
        *row.entry(said).or_default() += 1;
    }

    fn single(&mut self, label: &Label, verdict: &Verdict) -> bool {
        let Some(effect) = label.effects.first() else { return false };
        let answer = verdict.answer();
        let first_name = answer.first() == Some(effect);
        let top1 = first_name || verdict.ties().contains(effect);
        if label.excess < COUNTED_EXCESS {
            if !answer.is_empty() {
                self.score.singles.faint_named.add(top1);
            }
            // A faint effect may be overlooked; a wrong name is a miss.
            return answer.is_empty() || top1;
        }
        self.confuse(effect, verdict);
        self.tie(verdict);
        let singles = &mut self.score.singles;
        singles.top1.add(top1);
        singles.first_name.add(first_name);
        let band = match label.excess {
            x if x > 10.0 => &mut singles.top1_above_10,
            x if x > 1.0 => &mut singles.top1_1_to_10,
            _ => &mut singles.top1_below_1,
        };
        band.add(top1);
        let twin = |name: &String| are_twins(name, effect, label.pressure_column);
        singles.top1_twins.add(top1 || answer.first().is_some_and(twin));
        let exact = answer.len() == 1 && top1;
        singles.exact.add(exact);
        singles.partial.add(verdict.verdict == "partial");
        singles.false_record.add(verdict.verdict == "record");
        singles.stage.add(in_stage(label, verdict));
        singles.false_unknown.add(verdict.verdict == "unknown");
        singles.overlooked.add(["no_gap", "parameters"].contains(&verdict.verdict.as_str()));
        let covered = verdict.ambiguous.contains(effect);
        singles.set_covers_all.add(covered);
        if !verdict.ambiguous.is_empty() {
            singles.set_covers.add(covered);
            self.set_sizes.push(verdict.ambiguous.len() as f64);
        }
        if verdict.ambiguous.len() == 1 {
            singles.singletons_right.add(covered);
        }
        self.score.by_effect.entry(effect.clone()).or_default().add(top1);
        if let Some((names, probability)) = verdict.belief() {
            self.outcomes.push((probability, names.contains(&effect)));
        }
        self.closed_all.push(verdict.closed);
        if top1 {
            self.closed.push(verdict.closed);
        }
        if let Some(oracle) = verdict.closed_oracle {
            self.oracle.push((verdict.closed, oracle));
        }
        exact
    }

    fn tie(&mut self, verdict: &Verdict) {
        let answer = verdict.answer();
        let tied = verdict.ties().iter().filter(|name| !answer.contains(name)).count();
        self.score.singles.tied.add(tied > 0);
        if tied > 0 {
            self.tie_sizes.push(1.0 + tied as f64);
        }
    }

    fn null(&mut self, verdict: &Verdict) -> bool {
        self.confuse("null", verdict);
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
        self.score.foreign_stage.add(in_stage(label, verdict));
        for effect in &label.effects {
            self.score.foreign_by_effect.entry(effect.clone()).or_default().add(caught);
        }
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
        let struck = &mut self.score.struck;
        struck.unknown_or_twin.add(unknown || by_twin);
        let has_twin = crate::truth::TWINS
            .iter()
            .any(|&(a, b)| (a == effect || b == effect) && are_twins(a, b, label.pressure_column));
        if !has_twin {
            struck.unknown_no_twin.add(unknown);
        }
        if verdict.closed < STAND_IN {
            struck.unknown_no_stand_in.add(unknown);
        }
        struck.wrong_name.add(!verdict.answer().is_empty() && !by_twin);
        unknown || by_twin
    }

    fn finish(mut self) -> Score {
        let score = &mut self.score;
        score.calibration = Calibration::of(self.outcomes);
        score.calibration_unknown = Calibration::of(self.unknowns);
        let mean = |x: &[f64]| (!x.is_empty()).then(|| x.iter().sum::<f64>() / x.len() as f64);
        score.singles.set_size = mean(&self.set_sizes);
        score.singles.tie_size = mean(&self.tie_sizes);
        score.closed = quantile(&mut self.closed, 0.5);
        score.closed_all = quantile(&mut self.closed_all, 0.5);
        let (mut beside, mut oracle): (Vec<f64>, Vec<f64>) = self.oracle.into_iter().unzip();
        score.closed_oracle = quantile(&mut oracle, 0.5);
        score.closed_beside_oracle = quantile(&mut beside, 0.5);
        let times = &mut self.times;
        score.runtime_s = quantile(times, 0.5)
            .zip(quantile(times, 0.95))
            .zip(quantile(times, 1.0))
            .map(|((median, p95), most)| (median, p95, most));
        score.misses.sort_by(|a, b| a.case.cmp(&b.case));
        self.score
    }
}

/// A wrong name is excused if a true effect that was not named is in the declared tie.
fn several(several: &mut Several, label: &Label, verdict: &Verdict) -> bool {
    let answer = verdict.answer();
    let named = label.effects.iter().filter(|e| answer.contains(e)).count();
    let tied = |e: &&String| !answer.contains(e) && verdict.ties().contains(e);
    let excused = label.effects.iter().filter(tied).count().min(answer.len() - named);
    let found = named + excused;
    several.all_named.add(found == label.effects.len());
    several.one_named.add(found > 0);
    let strongest = label.dominant.as_ref().or(label.effects.first());
    let strongest = strongest
        .is_some_and(|e| answer.contains(e) || (excused > 0 && verdict.ties().contains(e)));
    several.strongest_named.add(strongest);
    (0..label.effects.len()).for_each(|i| several.recall.add(i < found));
    (0..answer.len()).for_each(|i| several.precision.add(i < found));
    match label.kind {
        CaseKind::Dominant => strongest,
        _ => found == label.effects.len() && answer.len() == found,
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

/// Quantile by the nearest rank of the finite values (the mean of the middle two for an even
/// median); `None` without one.
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
