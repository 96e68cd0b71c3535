//! Notes about a diagnosis, each with a code: gross errors, implausible noise, oscillating
//! parameters, extrapolated drift, and how strong other effects would have to be for the diagnosis
//! to name them.

use stretch_data::{after_number, in_digits};

use crate::{
    evidence::{
        candidates::multiple,
        detection_limit::DetectionLimit,
        gathered::{Evidence, StageEvidence},
        sanity::Sanity,
    },
    fit::{
        identifiability::{Identified, Knowledge},
        metric::Metric,
        prepared::PreparedProblem,
        starts::Starts,
    },
    problem::{
        noise::Noise,
        record_facts::nouns,
        runs::Runs,
        sample_roles::{Role, SampleRoles},
        simulator::{ModelRuns, Simulator},
        spec::{EffectSpec, StageSpec, TrialSpec},
    },
    verdict::{
        answer::Answer,
        note::{Note, NoteCode},
    },
};

/// Returns notes that complete the answer: that there is no test trial, that most of a channel is
/// not simulated, and the answer before a check overrode it.
pub(crate) fn answer_notes(
    answer: &Answer,
    sanity: &Sanity,
    simulator: &dyn Simulator,
    evidence: &Evidence,
) -> Vec<Note> {
    let held = "there is no test trial: the last quarter of every trial is held back and tested on";
    let held = evidence.roles.borrowed_test.then(|| Note::new(NoteCode::NoTestTrial, held));
    let nouns = nouns(simulator.record().gauge_alone);
    let seen = || Note::new(NoteCode::Overridden, "before that was seen: ");
    let otherwise = match answer {
        Answer::AtBounds { otherwise, .. } => Some(seen().answer((**otherwise).clone(), nouns)),
        _ => None,
    };
    let gross = gross_misfit(sanity, simulator, nouns);
    held.into_iter().chain(gross).chain(otherwise).collect()
}

/// Returns a warning if most of a channel is not simulated, because effects might be named for the
/// wrong rig.
fn gross_misfit(
    sanity: &Sanity,
    simulator: &dyn Simulator,
    [model, rig]: [&str; 2],
) -> Option<Note> {
    let left = sanity.left.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    let (stage, share) = left.filter(|(_, share)| **share > sanity.allowed)?;
    let spec = &simulator.stages()[stage];
    let text = format!(
        "{:.0} % of what {} does is not in the {model}: is it the right {rig}, and is every column what its name says?",
        100.0 * share.min(1.0),
        spec.channel
    );
    Some(Note::new(NoteCode::NotSimulated, text))
}

/// Kinds of effect at the input or the output of a machine that resemble dry friction inside the
/// machine.
const LIKE_FRICTION: [&str; 5] =
    ["backlash", "dead_zone", "hysteresis", "bouc_wen", "play_friction"];

/// Returns a note if a named effect at the input or the output of a user's simulator looks like dry
/// friction inside the machine, and the simulator declares no effect or parameter of friction.
pub(crate) fn friction_note(simulator: &dyn Simulator, named: &[String]) -> Option<Note> {
    let effects = simulator.effects();
    let is_friction = |name: &str| {
        let name = name.to_lowercase();
        ["friction", "coulomb", "stiction", "stribeck"].iter().any(|word| name.contains(word))
    };
    // an effect without a kind is one that the simulator has itself
    let own = effects
        .iter()
        .filter(|e| e.kind.is_none())
        .flat_map(|e| e.parameters.iter().map(|p| p.name.to_string()).chain([e.name.clone()]));
    let declared = simulator.parameters().iter().map(|p| p.name.clone());
    if own.chain(declared).any(|name| is_friction(&name)) {
        return None;
    }
    let looks_alike = |name: &&String| {
        let kind = effects.iter().find(|e| e.name == **name).and_then(|e| e.kind);
        kind.is_some_and(|kind| LIKE_FRICTION.contains(&kind.name))
    };
    let name = named.iter().find(looks_alike)?;
    let text = ": dry friction inside the machine looks alike, and the simulator declares none; to compare the two, declare \
        the friction as an effect of the simulator";
    Some(Note::new(NoteCode::LooksLikeFriction, "").effect(name).text(text))
}

/// Returns a note that lists the parameters that change no simulated output.
pub(crate) fn dead_parameters_note(identifiability: &[Identified]) -> Option<Note> {
    let dead = identifiability.iter().filter(|one| one.knowledge == Knowledge::Dead);
    let names: Vec<&str> = dead.map(|one| one.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        let text = format!(
            "no change of {} changes the simulation: check that the simulator uses what it receives, and that the recordings excite it",
            names.join(" or ")
        );
        Note::new(NoteCode::UnusedParameters, text)
    })
}

/// Returns a note that lists the effects that were screened and not fitted.
pub(crate) fn not_fitted_note(names: &[String]) -> Option<Note> {
    let because = "not fitted, because a first test of each effect favoured others: ";
    let listed =
        Note::new(NoteCode::NotFitted, because).effects(&names[..names.len().min(LISTED)], ", ");
    let more = names.len().saturating_sub(LISTED);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!names.is_empty()).then(|| listed.text(rest))
}

/// Returns a note for each output with samples that [are isolated](crate::fit::isolated_outliers).
pub(crate) fn gross_error_notes(problem: &PreparedProblem<'_>) -> Vec<Note> {
    let stages = problem.compare.metrics.iter().zip(problem.simulator().stages());
    let note = |(metric, stage): (&Metric, &StageSpec)| {
        let isolated = metric.noise.isolated;
        let counted = metric.noise.sd.iter().filter(|sd| sd.is_finite()).count();
        let (are, do_not) =
            if isolated == 1 { ("is a gross error", "does") } else { ("are gross errors", "do") };
        (isolated > 0).then(|| {
            let text = format!(
                "{isolated} of {} values of {} {are} and {do_not} not count",
                isolated + counted,
                stage.channel
            );
            Note::new(NoteCode::GrossErrors, text)
        })
    };
    stages.filter_map(note).collect()
}

/// Returns a note that says how many models could not be simulated, to which sets of effects they
/// belong, and why the first failed.
pub(crate) fn lost_note(runs: &Runs<'_>) -> Option<Note> {
    let (models, first) = runs.lost_models()?;
    let count: usize = models.values().sum();
    let (s, it) = if count == 1 { ("", "it") } else { ("s", "them") };
    let begin = Note::new(
        NoteCode::FailedRuns,
        format!(
            "{count} model{s} could not be simulated, and the diagnosis went on without {it}: "
        ),
    );
    let one = |note: Note, (i, (set, own)): (usize, (&Vec<String>, &usize))| {
        let note = note.text(if i == 0 { "" } else { ", " });
        match set.is_empty() {
            true => note.text(format!("{own} without effects")),
            false => note.text(format!("{own} with ")).effects(set, " + "),
        }
    };
    Some(models.iter().enumerate().fold(begin, one).text(format!("; the first: {first}")))
}

/// Returns a note for each output whose noise is [implausible](crate::evidence::sanity), because
/// such noise hides gaps.
pub(crate) fn implausible_noise_notes(problem: &PreparedProblem<'_>, sanity: &Sanity) -> Vec<Note> {
    let note = |(stage, share): &(usize, f64)| {
        let spec = &problem.simulator().stages()[*stage];
        let noise = &problem.compare.metrics[*stage].noise;
        let text = format!(
            "the noise of {} is implausible, {:.2e} {} ({}): even without an effect the simulation \
             leaves only {share:.2} of it, so the true noise is smaller, and the assumed noise hides every gap of its size; state the \
             true noise of the stage",
            spec.channel, noise.rms, spec.unit, noise.source
        );
        Note::new(NoteCode::ImplausibleNoise, text)
    };
    sanity.implausible.iter().map(note).collect()
}

/// Returns a note for each output that jumps while the rig is at rest, or to which the recorder
/// seems to add slow noise.
pub(crate) fn recorder_notes(problem: &PreparedProblem<'_>) -> Vec<Note> {
    let stages = problem.compare.metrics.iter().zip(problem.simulator().stages());
    let note = |(metric, spec): (&Metric, &StageSpec)| {
        let channel = &spec.channel;
        if spec.noise.as_ref().is_some_and(Noise::jumps) {
            let text = format!(
                "{channel} jumps at random between levels while nothing is commanded: check for a loose contact"
            );
            return Some(Note::new(NoteCode::Jumps, text));
        }
        let (times, time_s) = metric.recorder_drift()?;
        let text = format!(
            "{channel} has slow noise with a correlation time of {time_s} s and {times:.2} times the standard deviation of its other noise: it is taken \
             for noise of the recorder, so a gap as small and as slow would not be found"
        );
        Some(Note::new(NoteCode::SlowNoise, text))
    };
    stages.filter_map(note).collect()
}

/// Ratio of residuals on test trials, re-tuned to as shipped, from which re-tuning is noted as harmful.
const WORSE: f64 = 1.2;

/// Returns a note for each output that the re-tuned parameters predict worse on test trials than
/// the parameters as shipped.
pub(crate) fn retuning_notes(simulator: &dyn Simulator, evidence: &Evidence) -> Vec<Note> {
    let note = |(spec, traces): (&StageSpec, &StageEvidence)| {
        let (shipped, retuned) = (multiple(traces.excess_raw), multiple(traces.excess_retuned));
        (retuned > WORSE * shipped.max(1.0)).then(|| {
            let text = format!(
                "the re-tuned parameters predict {} on trials that were not fitted worse than those as shipped ({retuned:.2} against {shipped:.2} \
                 times the noise): they make up for something else",
                spec.channel
            );
            Note::new(NoteCode::RetuningHarms, text)
        })
    };
    simulator.stages().iter().zip(&evidence.stages).filter_map(note).collect()
}

/// Part of a trial that counts as its beginning.
const BEGINNING: f64 = 0.1;
/// Share of the gap from which its place at the beginnings of the trials is noted.
const AT_BEGINNING: f64 = 0.5;

/// Returns a note for each output whose gap is at the beginnings of the trials, because the
/// simulator may start from another state than the rig.
pub(crate) fn start_notes(simulator: &dyn Simulator, evidence: &Evidence) -> Vec<Note> {
    let trials = TrialSpec::ranges(simulator.trials());
    let [model, rig] = nouns(simulator.record().gauge_alone);
    let note = |(spec, traces): (&StageSpec, &StageEvidence)| {
        let excess = |samples: &[f64]| -> f64 {
            samples.iter().filter(|r| r.is_finite()).map(|r| r * r - 1.0).sum()
        };
        let residuals = trials.iter().map(|trial| &traces.residual_retuned[trial.clone()]);
        let [early, whole] = residuals.fold([0.0, 0.0], |[early, whole], own| {
            let beginning = (BEGINNING * own.len() as f64) as usize;
            [early + excess(&own[..beginning]), whole + excess(own)]
        });
        let share = early / whole;
        (whole > 0.0 && share > AT_BEGINNING).then(|| {
            let text = format!(
                "{:.0} % of the gap in {} is in the first tenth of the recordings: check that the {model} starts from the state in which \
                 the {rig} was at the first sample",
                100.0 * share.min(1.0),
                spec.channel
            );
            Note::new(NoteCode::InitialState, text)
        })
    };
    simulator.stages().iter().zip(&evidence.stages).filter_map(note).collect()
}

/// Returns a note that the starts of re-tuning disagree; `None` if they agree.
pub(crate) fn starts_note(Starts { tried, agreed }: Starts) -> Option<Note> {
    (agreed < tried).then(|| {
        let text = format!(
            "re-tuning ends at different values: {agreed} of {tried} starts within the tolerances reached the best fit, with which the \
             diagnosis continues; narrow the tolerances of the parameters if you can"
        );
        Note::new(NoteCode::StartsDisagree, text)
    })
}

/// Returns a note if the search was cut short because the budget of runs was spent.
pub(crate) fn budget_note(runs: ModelRuns) -> Option<Note> {
    let budget = runs.budget.filter(|_| runs.is_spent)?;
    let text = format!(
        "the budget of {budget} model runs was spent before the search was over ({} were made): the answer is based on what was fitted \
         until then; allow more runs to continue the search",
        runs.count
    );
    Some(Note::new(NoteCode::BudgetSpent, text))
}

/// Returns a note that lists the effects that were not examined.
pub(crate) fn not_examined_note(names: &[String]) -> Option<Note> {
    let because = "not looked at, because their runs failed: ";
    (!names.is_empty()).then(|| Note::new(NoteCode::NotExamined, because).effects(names, ", "))
}

/// Returns a note that the model without effects keeps earlier parameters.
pub(crate) fn kept_parameters_note(problem: &PreparedProblem<'_>) -> Option<Note> {
    let held = "the re-tuned parameters could not be simulated over all trials, so the model without effects keeps the last parameters that \
        could";
    problem.is_held.then(|| Note::new(NoteCode::KeptParameters, held))
}

/// Share of the fitted time span by which test trials must lie outside this span for a note.
const BEYOND: f64 = 0.1;

/// Returns a note for each named effect that depends on session time and was extrapolated to the
/// test trials, with both time spans.
///
/// Within the fitted time span, many functions of time fit equally well; beyond it, these functions
/// differ.
pub(crate) fn extrapolation_notes(
    simulator: &dyn Simulator,
    roles: &SampleRoles,
    named: &[String],
) -> Vec<Note> {
    let drifts = |name: &&String| {
        simulator.effects().iter().any(|effect| effect.name == **name && effect.drifts)
    };
    let fitted = span_s(simulator, roles, |role| role != Role::Test);
    let tested = span_s(simulator, roles, |role| role == Role::Test);
    let least = BEYOND * (fitted[1] - fitted[0]);
    let is_beyond = fitted[0] - tested[0] > least || tested[1] - fitted[1] > least;
    let note = |name: &String| {
        Note::new(NoteCode::ExtrapolatedDrift, "").effect(name).text(format!(
            " is a law of session time: it was fitted from {:.0} to {:.0} s and extrapolated to the test trials, from {:.0} to {:.0} s; \
             if the drift follows another law, the extrapolation is far off",
            fitted[0], fitted[1], tested[0], tested[1]
        ))
    };
    named.iter().filter(drifts).filter(|_| is_beyond).map(note).collect()
}

/// Returns the session time, s, of the first sample and of the end of the last sample in the roles
/// that `is_in` selects.
fn span_s(
    simulator: &dyn Simulator,
    roles: &SampleRoles,
    is_in: impl Fn(Role) -> bool,
) -> [f64; 2] {
    let (trials, dt_s) = (simulator.trials(), simulator.dt_s());
    let own = roles.segments.iter().filter(|s| is_in(s.role));
    own.fold([f64::INFINITY, f64::NEG_INFINITY], |[first, last], s| {
        let before: usize = trials[..s.trial].iter().map(|t| t.samples).sum();
        let at = |sample: usize| trials[s.trial].start_s + (sample - before) as f64 * dt_s;
        [first.min(at(s.from)), last.max(at(s.to))]
    })
}

/// Largest number of effects that are listed.
const LISTED: usize = 6;

/// Returns a note that lists the effects with the smallest detection limits, relative to their
/// ranges; `None` if no limit is known.
pub(crate) fn detection_limit_note(
    limits: &[DetectionLimit],
    effects: &[EffectSpec],
) -> Option<Note> {
    let share = |limit: &DetectionLimit| {
        let spec = effects.iter().find(|spec| spec.name == limit.effect)?;
        let parameter = spec.parameters.iter().find(|p| *p.name == *limit.parameter)?;
        let distance = (limit.strength? - parameter.off()?).abs();
        Some(distance / (parameter.max - parameter.min))
    };
    let known = limits.iter().filter_map(|limit| Some((share(limit)?, limit)));
    let mut known: Vec<(f64, &DetectionLimit)> = known.collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let one = |note: Note, (i, (_, limit)): (usize, &(f64, &DetectionLimit))| {
        let unit = after_number(&limit.unit);
        let note = note.text(if i == 0 { "" } else { ", " }).effect(&limit.effect);
        note.text(format!(" {}{unit}", in_digits(limit.strength.unwrap_or(0.0), 2)))
    };
    let begin = "An effect would have been named if it were stronger than its limit: ";
    let begin = Note::new(NoteCode::DetectionLimits, begin);
    let listed = known.iter().take(LISTED).enumerate().fold(begin, one);
    let rest = if known.len() > LISTED { ", and more in the table" } else { "" };
    let how = format!("{rest} (with probability 0.9).");
    (!known.is_empty()).then(|| listed.text(how))
}

#[cfg(test)]
mod tests {
    use super::*;
    use stretch_effects::EffectParameter;

    #[test]
    fn the_six_that_are_seen_best_stand_in_words() {
        let spec = |i: usize| {
            let parameters = vec![EffectParameter::sized("c", "V", 0.0..=1.0)];
            EffectSpec::new(&format!("e{i}"), (0, "toy"), parameters)
        };
        let limit = |i: usize, strength| DetectionLimit {
            effect: format!("e{i}"),
            parameter: "c".into(),
            strength,
            unit: "V".into(),
            others: Default::default(),
            seen: None,
            like: None,
        };
        let effects: Vec<EffectSpec> = (0..9).map(spec).collect();
        let limits: Vec<DetectionLimit> =
            (0..9).map(|i| limit(i, (i > 0).then(|| 0.1 * (10 - i) as f64))).collect();
        let words = detection_limit_note(&limits, &effects).expect("limits").to_string();
        assert!(
            words.starts_with(
                "An effect would have been named if it were stronger than its limit: e8 0.2 V, e7 0.3 V, "
            ),
            "{words}"
        );
        assert!(words.contains("e3") && !words.contains("e2") && words.contains("in the table"));
        assert_eq!(detection_limit_note(&limits[..1], &effects), None);
    }
}
