//! The answer of a diagnosis in sentences. Text, page, files and Python show these.

use stretch_data::{after_number, in_digits, listed};

use crate::{
    evidence::candidates::{ParameterShift, multiple},
    problem::record_facts::nouns,
    record::gross::sentence,
    verdict::{
        answer::{Answer, Closed, MissingEffect},
        diagnosis::{Diagnosis, NextExperiment},
        phrases::{
            NOT_ALL, also_seen, alternatives, at_ends, capitalised, closed, decapitalised,
            first_of, is_numbered, least_percent, left_with, numbered, of_stage, percent,
            too_small, two_digits, with_share,
        },
    },
};

/// Share of the gap from which effects are said to explain the gap mostly, instead of in part.
const MOST: f64 = 0.5;

/// Ratio of the errors of a calibration, with the effects to without them, below which the
/// improvement is reported.
const BETTER: f64 = 0.9;

/// The condition of every probability.
const GIVEN: &str = "given this catalogue";

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
        let proposed = self.proposed.as_ref().map_or(String::new(), |p| format!(" {}", p.sentence));
        let nouns = nouns(self.gauge_alone);
        let finding = match &self.answer {
            Answer::Unknown { stage, left, .. } if self.none_examined => format!(
                "There is a gap in {}: the re-tuned {} leaves {left:.2} times the noise.",
                of_stage(stage, nouns[0]),
                nouns[0]
            ),
            answer => answer.in_sentences(nouns, probability),
        };
        self.preface() + &finding + &proposed
    }

    /// Returns what to do next, in a sentence.
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
            Answer::Agrees { .. } => "Nothing has to change.",
            Answer::Retuned { .. } => "Set the re-tuned parameters, then diagnose again.",
            Answer::Faint { .. } => {
                "Check whether the noise is larger than stated. If it is not, something small is missing."
            }
            answer if answer.effects().iter().any(MissingEffect::is_tied) => {
                if self.next_experiment.as_ref().is_some_and(|next| next.separates.is_empty()) {
                    return "Measure another quantity that tells them apart before you build on one.".into();
                }
                "Run an experiment that tells them apart before you build on one."
            }
            Answer::Missing { effects, .. } => {
                let them = if effects.len() == 1 { "it" } else { "them" };
                &format!("Add {them} to the {simulator}, then diagnose again.")
            }
            Answer::WrongRecord { .. } => "Correct this error, then diagnose again.",
            Answer::Unknown { .. } if self.none_examined => {
                "Diagnose again with a larger budget of runs."
            }
            Answer::Unknown { .. }
                if self.proposed.as_ref().is_some_and(|p| !p.equation.is_empty()) =>
            {
                &format!("Add the proposed term to the {simulator}, then diagnose again.")
            }
            Answer::Unknown { .. } | Answer::AtBounds { .. } => &format!(
                "Look where most is left, and add to the {simulator} what happens there as an effect of its own."
            ),
            Answer::TooLittle { .. } => "Record more, then diagnose again.",
        };
        step.to_owned()
    }

    /// Returns the sentences of a diagnosis. The next step is added if the sentences do not already
    /// say what to do.
    pub(crate) fn headline(&self) -> String {
        let finding = self.in_sentences(&two_digits);
        match &self.answer {
            Answer::Retuned { .. } | Answer::Missing { .. } | Answer::Unknown { .. } => {
                format!("{finding} Next: {}", decapitalised(&self.next_step()))
            }
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
                format!("The budget of runs was spent; not looked at: {}. ", first_of(rest))
            }
        };
        if !self.not_examined.is_empty() {
            out += &format!(
                "Not looked at, because their runs failed: {}. ",
                first_of(&self.not_examined)
            );
        }
        out
    }

    /// Returns the headline of a page. If effects are named, it states only that they are missing,
    /// because [`facts`](Self::facts) follow.
    pub fn title(&self) -> String {
        let [simulator, _] = nouns(self.gauge_alone);
        match &self.answer {
            Answer::Missing { effects, rest: None, .. } => {
                let lacking = Answer::effects_in_words(effects);
                format!("{}The {simulator} lacks {lacking}.", self.preface())
            }
            // a probability holds only among the candidates, so the text adds this condition
            _ => self.in_sentences(&|p| format!("{} {GIVEN}", percent(p))),
        }
    }

    /// Returns four short answers with their questions: the change, its certainty, its gain, and
    /// the next step.
    pub fn facts(&self) -> [(&'static str, String); 4] {
        let [change, certainty, gain] = match &self.answer {
            Answer::Agrees { .. } => ["Nothing.".to_owned(), within_noise(), self.usable()],
            Answer::Retuned { .. } => {
                [self.moved(), within_noise(), "The whole gap closes by re-tuning.".to_owned()]
            }
            Answer::Faint { is_retuned, left, .. } => {
                let too_little =
                    "More is left than the stated noise explains, but too little to name a cause.";
                let [change, gain] = match is_retuned {
                    false => ["Nothing.".to_owned(), self.usable()],
                    true => {
                        let left =
                            format!("With re-tuned parameters {left:.3} times the noise is left.");
                        [self.moved(), left]
                    }
                };
                [change, too_little.to_owned(), gain]
            }
            Answer::Missing { effects, .. } => [
                format!("Add {}.", Answer::effects_in_words(effects)),
                self.certainty(),
                capitalised(&self.gain()) + &self.calibration_gain(),
            ],
            Answer::WrongRecord { errors, corrected } => {
                let hint: String = errors.iter().map(|g| g.hint.as_str()).take(1).collect();
                let change = format!(
                    "Nothing yet. The recording and the parameters have to be right first: {hint}."
                );
                let [certainty, gain] = match corrected {
                    None => [
                        "The columns alone show this, whatever was simulated.".to_owned(),
                        "A usable recording.".to_owned(),
                    ],
                    Some(Closed { probability, .. }) => [
                        format!(
                            "Probability {} compared with every set of effects, {GIVEN}.",
                            percent(*probability)
                        ),
                        capitalised(&self.gain()) + " After that, effects can be seen.",
                    ],
                };
                [change, certainty, gain]
            }
            Answer::Unknown { .. } | Answer::AtBounds { .. } | Answer::TooLittle { .. } => {
                let stages = self.location.stages.iter();
                let place = stages
                    .max_by(|a, b| a.share.total_cmp(&b.share))
                    .map_or_else(String::new, |s| {
                        format!("{} ({} of the gap)", s.stage, percent(s.share))
                    });
                [
                    format!("No effect of the catalogue explains the gap. Look at {place}."),
                    "There is certainly a gap; the effects of the catalogue explain at most a part of it.".to_owned(),
                    format!("The best that the catalogue offers: {}", self.gain()),
                ]
            }
        };
        [
            ("What to change", change),
            ("How sure", certainty),
            ("What it gains", gain),
            ("What to do next", self.to_do()),
        ]
    }

    /// Describes how certain the missing effects are.
    fn certainty(&self) -> String {
        let rivals = self.rivals();
        let rest = if !self.answer.tied().is_empty() {
            "that is the probability of all alternatives together".to_owned()
        } else if !rivals.is_empty() {
            format!("these data cannot rule out {}", listed(&rivals))
        } else if self.answer.leaves_more_than_noise() {
            "nothing else that was tried explains as much, and more than noise is left".to_owned()
        } else {
            "nothing else explains these data as well".to_owned()
        };
        let p = self.answer.probability().unwrap_or(0.0);
        format!("Probability {} {GIVEN}: {rest}.", percent(p))
    }

    /// Describes what the first candidate closes.
    fn gain(&self) -> String {
        let Some(best) = self.candidates.first() else { return String::new() };
        let fitted = match best.fits_worse() {
            true => format!(", {:.2} times on those that were", best.leaves()),
            false => String::new(),
        };
        format!(
            "{} of the gap closes on trials that were not fitted: {:.2} times the noise is left{fitted}.",
            closed(&Closed::of(best, best.probability)),
            multiple(best.gap_after)
        )
    }

    /// Returns a sentence on the improvement of a calibration, if there is one.
    fn calibration_gain(&self) -> String {
        let errors = self.transfer.as_ref().map(|t| t.poly13);
        match errors.filter(|e| e.sim_with_effect < BETTER * e.sim) {
            Some(e) => format!(
                " A non-linear calibration trained on simulated trials then has an error of {} instead of {} of full scale.",
                percent(0.01 * e.sim_with_effect),
                percent(0.01 * e.sim)
            ),
            None => String::new(),
        }
    }

    fn usable(&self) -> String {
        format!("The {} can be used as it is.", nouns(self.gauge_alone)[0])
    }

    /// Lists the parameters that re-tuning moved by more than a tolerance.
    fn moved(&self) -> String {
        let far = self.parameters.iter().filter(|p| p.is_evidence && p.sigmas.abs() > 1.0);
        let one = |p: &ParameterShift| {
            format!("{} to {}{}", p.name, in_digits(p.fitted, 3), after_number(&p.unit))
        };
        let moved: Vec<String> = far.map(one).collect();
        match moved.is_empty() {
            true => "Take the re-tuned parameters below.".to_owned(),
            false => format!("Set {}.", listed(&moved)),
        }
    }

    /// Returns the next step and the next experiment, in sentences.
    fn to_do(&self) -> String {
        let next = self.next_experiment.as_ref().filter(|next| !next.separates.is_empty());
        let Some(next) = next else { return self.next_step() };
        let experiment = format!(
            "Measure \u{201c}{}\u{201d} ({}): it would distinguish {}.",
            next.title(),
            next.duration(),
            listed(&next.separates)
        );
        match !self.answer.effects().is_empty() && self.answer.tied().is_empty() {
            true => format!("{} {experiment}", self.next_step()),
            false => experiment,
        }
    }

    /// Returns a sentence on the effects that the data cannot rule out; `None` if there are none.
    pub fn rivals_in_words(&self) -> Option<String> {
        match (self.named().as_slice(), self.rivals().as_slice()) {
            (_, []) | ([], [_]) => None,
            ([], rivals) => Some(format!(
                "These data cannot distinguish, with 95 % probability: {}.",
                listed(rivals)
            )),
            (named, rivals) => Some(format!(
                "These data cannot tell {} from {} with 95 % probability, {GIVEN}.",
                listed(named),
                listed(rivals)
            )),
        }
    }

    /// Returns the proposed term in words; `None` if there is none.
    pub fn proposed_in_words(&self) -> Option<String> {
        let proposed = self.proposed.as_ref().filter(|p| !p.equation.is_empty())?;
        Some(format!("Proposed effect, on the {}: {}.", proposed.acts, proposed.equation))
    }

    /// Returns a sentence on what a file with the findings contains.
    pub fn fix_in_words(&self) -> String {
        match &self.answer {
            Answer::Agrees { .. } | Answer::Faint { is_retuned: false, .. } => {
                "Nothing is missing: parameters are re-tuned within the noise, and no effect is added.".to_owned()
            }
            Answer::Retuned { .. } | Answer::Faint { .. } => {
                "Parameters are re-tuned; no effect is added.".to_owned()
            }
            Answer::Missing { rest: Some(rest), .. } => {
                format!("{:.0} % of the gap remains: this file does not close it.", 100.0 * rest.share)
            }
            _ => "Parameters are re-tuned with the effects in place.".to_owned(),
        }
    }
}

impl NextExperiment {
    /// Returns the name without underscores.
    fn title(&self) -> String {
        self.name.replace('_', " ")
    }

    fn duration(&self) -> String {
        match 60.0 * self.minutes {
            seconds if seconds < 120.0 => format!("{} s", in_digits(seconds, 2)),
            _ => format!("{} min", in_digits(self.minutes, 2)),
        }
    }

    /// Describes the experiment in sentences.
    ///
    /// ```
    /// use stretch_gap::NextExperiment;
    /// let next = NextExperiment {
    ///     name: "slow_fast_loops".into(),
    ///     separates: vec!["hysteresis".into(), "slip".into()],
    ///     d: 5.26,
    ///     minutes: 1.5,
    ///     why: "Slip does not depend on the rate.".into(),
    /// };
    /// assert_eq!(
    ///     next.in_words(),
    ///     "slow fast loops (90 s) would distinguish hysteresis and slip: whatever their parameters, their \
    ///      predictions differ by 5.3 times the noise. Slip does not depend on the rate."
    /// );
    /// ```
    pub fn in_words(&self) -> String {
        if self.separates.is_empty() {
            return self.why.clone();
        }
        format!(
            "{} ({}) would distinguish {}: whatever their parameters, their predictions differ by {} times the noise. {}",
            self.title(),
            self.duration(),
            listed(&self.separates),
            in_digits(self.d, 2),
            self.why
        )
    }
}

fn within_noise() -> String {
    "What is left is within the noise on trials that were not fitted.".to_owned()
}

impl Answer {
    /// Whether effects were found, but clearly more than noise is left after they are added.
    pub fn leaves_more_than_noise(&self) -> bool {
        match self {
            Self::Missing { closes, rest, .. } => rest.is_some() || closes.left > NOT_ALL,
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
                format!("{} and {rig} agree within the noise.", capitalised(simulator))
                    + &too_small(small)
            }
            Self::Retuned { shipped, left, small } => {
                format!(
                    "No effect is missing: with its parameters re-tuned within their tolerances the {simulator} agrees with the {rig} (what is left is {shipped:.1} times the noise as shipped, {left:.2} re-tuned)."
                ) + &too_small(small)
            }
            Self::Faint { left, noise, stage, small, .. } => {
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
            Self::Missing { effects, closes, rest: None, faint, ended } => {
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
            Self::Missing { effects, closes, rest: Some(rest), faint, ended } => {
                let much = if closes.share >= MOST { "Most" } else { "A part" };
                let probable = probability(closes.probability);
                let left = closes.left;
                let where_left = if closes.fits_worse { " on trials that were fitted" } else { "" };
                let share = least_percent(rest.share.min(1.0));
                let sits = match rest.sits.is_empty() {
                    true => String::new(),
                    false => format!(", most of it at {}", rest.sits.join("; ")),
                };
                let rest = of_stage(&rest.stage, simulator);
                let names = numbered(effects, with_share, ", ");
                format!(
                    "{much} of the gap on trials that were not fitted is explained (probability {probable}) by {names}. Not explained: \
                     {share} in {rest}{sits}; {left:.2} times the noise is left{where_left}."
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
