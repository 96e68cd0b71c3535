//! The report of a diagnosis: the correction of the simulator, its probability, and its gain.

use stretch_gap::{Diagnosis, nouns};
use stretch_problem::{effect_in_words, in_words, notation};
use stretch_sim::Language;

use super::{
    bar_figure::{Bar, Row, Scale, bar_figure, picking},
    canvas::Ink,
    diagnosis_tables::{
        candidate_numbers_table, candidate_table, difference_table, effects, limit_table,
        parameter_table, probable, run_table, slice_table, stage_table, transfer_in_words,
        transfer_table,
    },
    figure::Figure,
    gap_figures::{
        AFTER, Against, BEFORE, after_name, has_after, left_figure, shown, trace_figures,
    },
    live::Pick,
    markup::{multiple, percent},
    output_table::output_table,
    page::Page,
    subject::Subject,
    turn_figure::turn_figure,
};

/// The report as one HTML file.
pub fn diagnosis_page(subject: &Subject<'_>) -> String {
    let worded = in_words(subject.diagnosis);
    let subject = &Subject { diagnosis: &worded, ..*subject };
    let mut page = Page::new(&diagnosis_title(subject), &headline(subject));
    diagnosis_sections(&mut page, subject);
    page.finish()
}

/// Returns the headline of the report.
pub(crate) fn headline(subject: &Subject<'_>) -> String {
    unbroken(&subject.diagnosis.title())
}

/// Returns a text in which percentages are not broken across lines.
fn unbroken(text: &str) -> String {
    text.replace(" %", "\u{a0}%")
}

/// Returns a sentence for every named effect. The numbers of an effect are in the section with its code.
fn causes(subject: &Subject<'_>) -> Vec<String> {
    let d = subject.diagnosis;
    let one = |name: String| {
        let mut all = subject.implementations.iter();
        let own = all.find(|own| effect_in_words(&own.name, d) == name);
        own.map(|own| format!("{name}: {}.", own.words))
    };
    d.named().into_iter().filter_map(one).collect()
}

/// Title of the report.
pub(crate) fn diagnosis_title(subject: &Subject<'_>) -> String {
    let [simulator, rig] = nouns(subject.diagnosis.gauge_alone);
    format!("{}: {simulator} against {rig}", subject.name)
}

/// Adds the sections of the report to a page, which may have other parts.
pub(crate) fn diagnosis_sections(page: &mut Page, subject: &Subject<'_>) {
    let diagnosis = subject.diagnosis;
    left_over(page, subject);
    page.facts(&diagnosis.facts().map(|(question, answer)| (question, unbroken(&answer))));
    page.list(&causes(subject));
    if let Some(proposed) = diagnosis.proposed_in_words() {
        page.text(&proposed);
    }
    seen(page, subject);
    located(page, subject);
    named(page, subject);
    implemented(page, subject);
    gained(page, subject);
    agreeing(page, subject);
    next(page, diagnosis);
    detectable(page, diagnosis);
    numbers(page, diagnosis);
}

/// Caption of the figure in which a reader can vary the parameters of an effect.
const TURNED: &str = "The root mean square residual on the test trials when one parameter of the effect is changed and all others \
    keep their fitted values; the dot is the fit. The corners of the line are the values that were simulated. If several parameters are \
    changed at once, their changes are added.";

/// Adds the first picture, which shows the evidence for the headline.
fn left_over(page: &mut Page, subject: &Subject<'_>) {
    let stage = subject.diagnosis.location.worst().unwrap_or(0);
    let Some(shown) = shown(subject, stage) else { return };
    let channel = &subject.simulator.stages()[stage].channel;
    page.figure(
        // a plot of the residual shows more than a plot of two curves that nearly coincide
        &trace_figures(subject, stage, &shown).1,
        &format!(
            "What is left of {channel} in {}, the part with the largest gap: within two multiples of the noise it is noise.",
            shown.name
        ),
    );
}

/// Adds the comparison of the runs, if it was requested.
fn agreeing(page: &mut Page, subject: &Subject<'_>) {
    let Some(by_trial) = subject.by_trial else { return };
    page.section(
        "Do the runs agree?",
        "Every run is fitted by itself, with the named effects. If a value differs between runs by more than its intervals, the hardware or the load was another one, or an effect is missing.",
    );
    page.list(&by_trial.sentences());
    page.table(&difference_table(by_trial));
    page.folded("Every value of every run", |page| {
        page.table(&run_table(by_trial));
    });
}

fn seen(page: &mut Page, subject: &Subject<'_>) {
    let stage = subject.diagnosis.location.worst().unwrap_or(0);
    let spec = &subject.simulator.stages()[stage];
    page.section(
        "Measured against simulated",
        "The stage with the largest gap, driven by its measured input, on the test trial where it is farthest \
         off. The noise is what no model could remove.",
    );
    if let Some(shown) = shown(subject, stage) {
        let (top, _) = trace_figures(subject, stage, &shown);
        let caption = format!(
            "{}: {} in {}, the part with the largest gap.",
            spec.name, spec.channel, shown.name
        );
        page.figure(&top, &caption);
        if let Some(turned) = turn_figure(subject, stage, &shown) {
            page.text(
                "The numbers of an effect can be moved here. They are the numbers of its equation:",
            );
            page.list(&equations(subject, &spec.name));
            if let Some(words) = notation(formulas(subject)) {
                page.text(words);
            }
            page.figures(&[(turned, TURNED.to_owned())]);
        }
    } else {
        page.figure(&Figure::missing("There is no test trial to draw."), "");
    }
    let level = (
        left_figure(subject, stage, Against::Level),
        "Over the level of the motion, all trials: this shows errors of the shape of a curve."
            .to_owned(),
    );
    let rate = (
        left_figure(subject, stage, Against::Rate),
        "Over the rate of the motion: this shows errors by a delay or a lag, and errors that depend on the direction.".to_owned(),
    );
    page.figures(&[level, rate]);
    page.text(
        "Dots are samples, the strong line is their median, the band holds four fifths of them.",
    );
}

/// The equations of the named effects, written with the names of their parameters.
fn formulas<'a>(subject: &'a Subject<'_>) -> impl Iterator<Item = &'a str> {
    subject.implementations.iter().map(|one| one.formula.as_str())
}

/// The named effects of a stage with their equations.
fn equations(subject: &Subject<'_>, stage: &str) -> Vec<String> {
    let own = subject.implementations.iter().filter(|one| one.stage == stage);
    let words = |name: &str| effect_in_words(name, subject.diagnosis);
    own.map(|one| format!("{}: {}", words(&one.name), one.formula)).collect()
}

fn located(page: &mut Page, subject: &Subject<'_>) {
    let d = subject.diagnosis;
    page.section(
        "Where the gap sits",
        "Every stage is run on its measured input, so that the error of one stage does not count for another. The scale is the root mean \
         square of what is left on the test trials, in multiples of the noise: at 1 only noise is left.",
    );
    let rms = |excess: f64| multiple(excess).max(1.0);
    let after = has_after(subject);
    let rows: Vec<Row> = d
        .location
        .stages
        .iter()
        .map(|s| {
            let mut bars = vec![Bar::new(Ink::First, rms(s.raw)), Bar::new(BEFORE, rms(s.excess))];
            if after {
                bars.push(Bar::new(AFTER, rms(s.after)));
            }
            Row { label: format!("{} ({})", s.stage, s.channel), bars }
        })
        .collect();
    let mut legend =
        vec![(Ink::First, "as shipped".to_owned()), (BEFORE, "parameters re-tuned".to_owned())];
    if after {
        legend.push((AFTER, after_name(d)));
    }
    let figure =
        bar_figure("What is left, by stage", &rows, Scale::NoiseMultiples, "\u{d7} the noise")
            .legend(legend);
    page.figure(&figure, "What is left, stage by stage.");
    if !d.location.end_to_end.is_empty() {
        let share = |s: &stretch_gap::StageShare| Row {
            label: s.stage.clone(),
            bars: vec![Bar { text: percent(s.share), ..Bar::new(BEFORE, s.share) }],
        };
        let rows: Vec<Row> = d.location.end_to_end.iter().map(share).collect();
        let figure = bar_figure("Share of every stage", &rows, Scale::Percent, "%");
        page.figure(
            &figure,
            "Which stage causes the gap of the last output when the stages are simulated in series, from the commands alone (Shapley value).",
        );
    }
    slices(page, subject);
}

/// Returns the selection of a slice's samples, from the name of the slice; `None` for a slice that a plot of one trial
/// cannot show.
fn pick(by: &str, slice: &str, [falling, rising]: &[&str; 2]) -> Option<Pick> {
    let sides = |from: f64, to: f64| Some(Pick { by: "rate", from, to, size: false });
    let most = 1e300;
    if by == "regime" {
        return match slice {
            s if s == *falling => sides(-most, -0.0),
            s if s == *rising => sides(0.0, most),
            _ => None,
        };
    }
    let by = ["level", "rate", "time"].into_iter().find(|known| *known == by)?;
    let numbers: Vec<f64> = slice.split(' ').filter_map(|word| word.parse().ok()).collect();
    let [from, to] = match (numbers[..].as_ref(), slice.split(' ').next()) {
        ([from, to], _) => [*from, *to],
        ([to], Some("first")) => [0.0, *to],
        ([from], Some("after")) => [*from, most],
        _ => return None,
    };
    Some(Pick { by, from, to, size: by == "rate" })
}

fn slices(page: &mut Page, subject: &Subject<'_>) {
    let d = subject.diagnosis;
    let motion = subject.simulator.motion();
    let words = [motion.falling, motion.rising];
    let stages = &d.location.stages;
    let stage = d.location.worst().map_or("", |i| stages[i].stage.as_str());
    let of = |by: &str| -> Option<(Figure, String)> {
        let slices: Vec<_> =
            d.location.slices.iter().filter(|s| s.by == by && s.stage == stage).collect();
        let rms = |excess: f64| multiple(excess).max(1.0);
        let rows: Vec<Row> = slices
            .iter()
            .map(|s| Row {
                label: s.slice.clone(),
                bars: vec![Bar {
                    interval: Some(s.excess_ci.map(rms)),
                    ..Bar::new(if s.stands_out { BEFORE } else { Ink::First }, rms(s.excess))
                }],
            })
            .collect();
        let title = match by {
            "regime" => "By regime",
            "level" => "By level",
            "rate" => "By the size of the rate",
            "frequency" => "By frequency",
            "time" => "By time in the trial",
            "session" => "By time in the session",
            "travel" => "By distance travelled",
            _ => "By trial",
        };
        (!rows.is_empty()).then(|| {
            let picks: Vec<Option<Pick>> =
                slices.iter().map(|s| pick(by, &s.slice, &words)).collect();
            let unit = "\u{d7} the noise";
            let figure = bar_figure(title, &rows, Scale::NoiseMultiples, unit).narrowest();
            let figure = picking(figure, &rows, &picks, unit);
            (figure, format!("{title}."))
        })
    };
    page.text(&format!(
        "The gap of {stage} before the effect, sliced over all trials. Coloured bars stand out from the rest of the \
         stage (5 % false discoveries); whiskers are 95 % intervals."
    ));
    let main: Vec<_> =
        ["regime", "rate", "level", "frequency"].into_iter().filter_map(of).collect();
    page.figures(&main);
    let clocks: Vec<_> =
        ["time", "session", "travel", "trial"].into_iter().filter_map(of).collect();
    page.folded("By time, travel and trial", |page| {
        page.figures(&clocks);
    });
}

fn named(page: &mut Page, subject: &Subject<'_>) {
    let d = subject.diagnosis;
    page.section("Which effect", "");
    let (tried, _) = probable(&d.candidates);
    if tried.is_empty() {
        page.text(
            "No effect of the catalogue explains more than noise would: none was fitted to the end.",
        );
        return;
    }
    page.text(
        "Every candidate is fitted together with all nominal parameters, so that none wins only because a nominal parameter is wrong.",
    );
    let label = |c: &&stretch_gap::Candidate| effects(c);
    let odds: Vec<Row> = tried
        .iter()
        .map(|c| Row {
            label: label(c),
            bars: vec![Bar { text: percent(c.probability), ..Bar::new(AFTER, c.probability) }],
        })
        .collect();
    let closed: Vec<Row> = tried
        .iter()
        .filter(|c| !c.parameters.is_empty())
        .map(|c| Row {
            label: label(c),
            bars: vec![Bar {
                interval: Some(c.closed_ci),
                text: percent(c.closed),
                ..Bar::new(AFTER, c.closed)
            }],
        })
        .collect();
    page.figures(&[
        (
            bar_figure("Probability of every candidate", &odds, Scale::Percent, "%").narrowest(),
            "Probability among the candidates, given this catalogue.".to_owned(),
        ),
        (
            bar_figure("Closed gap of every candidate", &closed, Scale::Percent, "%").narrowest(),
            "Share of the gap that closes on the test trials, with its 95 % interval.".to_owned(),
        ),
    ]);
    // effects of one set are reported together, so only an effect outside the named set is an alternative
    if let Some(rivals) = d.rivals_in_words() {
        page.text(&unbroken(&rivals));
    }
    page.folded("Every candidate and its numbers", |page| {
        page.table(&candidate_table(&d.candidates));
        page.table(&candidate_numbers_table(&d.candidates, &d.stabilities));
    });
}

/// Adds the named effects as code for a simulator.
fn implemented(page: &mut Page, subject: &Subject<'_>) {
    if subject.implementations.is_empty() {
        return;
    }
    page.section(
        "To implement",
        "Each named effect with its fitted numbers (and their 95 % intervals), its initial state, and its code: a function that \
         takes a sample and returns it with the effect.",
    );
    for one in subject.implementations {
        let words = effect_in_words(&one.name, subject.diagnosis);
        page.text(&format!("{words} ({}): {}. State: {}.", one.name, one.equation(), one.state()));
        for language in Language::ALL {
            if let Some(code) = one.code(language) {
                let summary = format!("{words} in {}", language.name());
                page.folded(&summary, |page| {
                    page.code(&code);
                });
            }
        }
    }
    if let Some(words) = notation(formulas(subject)) {
        page.text(words);
    }
}

fn gained(page: &mut Page, subject: &Subject<'_>) {
    let d = subject.diagnosis;
    page.section("How far the gap closes", "");
    page.table(&stage_table(&d.location.stages, has_after(subject)));
    page.text(
        "At 1\u{a0}\u{d7} nothing but noise is left; at 2\u{a0}\u{d7} the root mean square is twice that of the noise.",
    );
    let called = |name: &str| effect_in_words(name, d);
    if let Some(table) = output_table(d, subject.simulator, &called) {
        page.table(&table);
    }
    if let Some(transfer) = &d.transfer {
        page.table(&transfer_table(transfer));
        page.text(
            "What the gap costs a user: a calibration trained on simulated trials and applied to measured trials, next to \
             one trained on measured trials.",
        );
        if let Some(words) = transfer_in_words(transfer) {
            page.text(&words);
        }
    }
    if let Some(table) = parameter_table(d) {
        page.table(&table);
        page.text(
            "The last column has the parameters re-tuned without the effect: those that differ between the two columns hid the effect. \
             A star marks parameters that others can replace: their values alone are not evidence.",
        );
    }
}

/// Adds the detection limits: the strength from which each effect would have been named.
fn detectable(page: &mut Page, d: &Diagnosis) {
    if d.detection_limits.is_empty() {
        return;
    }
    page.section(
        "What would have been seen",
        "An effect weaker than its limit may be present without being seen. A stronger effect would have been named nine times in ten. \
         Between the two columns the gap is seen, but a similar effect may be named instead. An effect without a limit cannot be seen \
         in these data.",
    );
    page.table(&limit_table(&d.detection_limits));
}

fn next(page: &mut Page, d: &Diagnosis) {
    let Some(next) = &d.next_experiment else { return };
    page.section("What to measure next", "");
    page.text(&next.in_words());
}

fn numbers(page: &mut Page, d: &Diagnosis) {
    page.section("All numbers", "");
    page.list(&d.notes.iter().map(ToString::to_string).collect::<Vec<_>>());
    for stage in &d.location.stages {
        page.text(&format!("Noise of {}: {}.", stage.stage, stage.floor_source));
        if let Some(table) = slice_table(&d.location.slices, &stage.stage) {
            page.folded(&format!("{}: every slice", stage.stage), |page| {
                page.table(&table);
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slice_knows_its_samples_by_what_it_is_called() {
        let words = ["deflation", "inflation"];
        let ends = |by: &str, slice: &str| pick(by, slice, &words).map(|p| (p.from, p.to, p.size));
        assert_eq!(ends("level", "151 to 157 mm"), Some((151.0, 157.0, false)));
        assert_eq!(ends("rate", "8.96 to 22.6 mm/s"), Some((8.96, 22.6, true)));
        assert_eq!(ends("time", "first 3 s"), Some((0.0, 3.0, false)));
        assert_eq!(ends("time", "after 60 s").map(|e| e.0), Some(60.0));
        assert_eq!(ends("regime", "inflation").map(|e| e.0), Some(0.0));
        assert_eq!(ends("frequency", "0.4 to 0.8 Hz"), None);
    }
}
