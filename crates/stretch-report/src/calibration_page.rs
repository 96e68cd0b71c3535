//! The report of a calibration: its errors and its parts.

use stretch_calibrate::{
    CalibrateError, Calibrated, Candidate, Evaluation, MODELS_IN_WORDS, MethodErrors, ModelChoice,
    ModelKind, Options, TrialErrors, evaluate,
};
use stretch_data::{Trial, are_row_numbers, listed};
use stretch_problem::in_words;

use super::{
    branch::BranchView,
    calibration_tables::{
        RAW, best, coefficient_table, comparison_table, method_names, method_table, order_table,
        signal_table,
    },
    canvas::Ink,
    diagnosis_page::{diagnosis_sections, diagnosis_title, headline},
    error_figure::{Against, error_figure},
    estimate_figure::{closest_look, estimate_figure},
    markup::{fixed, number, with_unit},
    memory_figure::{loop_figure, step_figure},
    page::Page,
    signal_figure::{AT_REST, signal_figure},
    subject::Subject,
    surface_figure::{slice_figure, surface_figure},
};

/// Largest number of trials whose curves are drawn; the tables hold all trials.
const DRAWN: usize = 4;

/// The texts of a report: names and sentences.
#[derive(Debug, Clone, Default)]
pub struct Context {
    /// Heading of the page.
    pub title: String,
    /// Trials of the fit, as files or sessions.
    pub calibrated_on: Vec<String>,
    /// Trials of the evaluation.
    pub tested_on: Vec<String>,
    /// Signals among which the calibrated one was chosen, best first; empty
    /// when the user named it.
    pub signal_choice: Vec<Candidate>,
    /// Sentences about the data: their source, and changes that were made to them.
    pub notes: Vec<String>,
    /// Errors on the trials of each kind, with the name of the kind; empty if there is only one
    /// kind.
    pub kinds: Vec<(String, Vec<MethodErrors>)>,
}

/// Calibrations and their evaluation.
#[derive(Debug, Clone, Copy)]
pub struct Judged<'a> {
    /// The calibrations with their names in `evaluation`.
    pub calibrated: &'a [(&'a str, &'a Calibrated)],
    /// Errors of the calibrations.
    pub evaluation: &'a Evaluation,
    /// Names and sentences, in addition to the numbers.
    pub context: &'a Context,
}

/// The report of a calibration next to a straight line, the baseline of every surface; and the errors of the raw signal and of
/// the calibration. They are judged on the test trials, or on the fitted trials if there are none.
///
/// # Errors
/// As [`evaluate`].
///
/// ```
/// use stretch_calibrate::{Options, calibrate};
/// use stretch_data::{Channel, Trial};
///
/// let angle: Vec<f64> = (0..2000).map(|i| 45.0 - 45.0 * (0.015 * f64::from(i)).cos()).collect();
/// let volts = angle.iter().zip(0..).map(|(a, i)| 0.01 * a + 1e-3 * (0.7 * f64::from(i)).sin()).collect();
/// let channel = |name: &str, values| Channel { name: name.to_owned(), values };
/// let trial = Trial {
///     name: "knee".into(),
///     time_s: (0..2000).map(|i| 0.01 * f64::from(i)).collect(),
///     channels: vec![channel("bridge_v", volts), channel("angle_deg", angle)],
/// };
/// let options = Options { reference: "angle_deg".into(), model: "linear".parse()?, ..Options::default() };
/// let line = calibrate(&[trial.clone()], &options)?;
/// let (page, evaluation) =
///     stretch_report::calibration_report([&line, &line], [&[trial], &[]], (&[], None), &options)?;
/// assert!(page.contains("Calibration of angle_deg on bridge_v"));
/// assert_eq!(evaluation.pooled.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn calibration_report(
    [linear, calibrated]: [&Calibrated; 2],
    [trials, test]: [&[Trial]; 2],
    (ranking, choice): (&[Candidate], Option<&ModelChoice>),
    options: &Options,
) -> Result<(String, Evaluation), CalibrateError> {
    let judged = if test.is_empty() { trials } else { test };
    let name = options.model.to_string();
    let mut shown = vec![("linear", linear)];
    if options.model != ModelKind::Linear {
        shown.push((name.as_str(), calibrated));
    }
    let named: Vec<_> = shown.iter().map(|(name, c)| (*name, &c.calibration)).collect();
    let mut evaluation = evaluate(&named, judged)?;
    let names = |trials: &[Trial]| trials.iter().map(|trial| trial.name.clone()).collect();
    let context = Context {
        title: format!("Calibration of {} on {}", options.reference, options.signal),
        calibrated_on: names(trials),
        tested_on: names(test),
        signal_choice: ranking.to_vec(),
        notes: choice
            .map(|choice| format!("{}; {MODELS_IN_WORDS}", choice.why))
            .into_iter()
            .chain(remarks(calibrated).cloned())
            .collect(),
        kinds: Vec::new(),
    };
    let judged = Judged { calibrated: &shown, evaluation: &evaluation, context: &context };
    let page = calibration_page(&judged);
    let own = evaluation.pooled.len() - 1;
    evaluation.pooled.drain(1..own);
    Ok((page, evaluation))
}

/// The report as one HTML file.
pub fn calibration_page(judged: &Judged<'_>) -> String {
    let mut page = Page::new(&judged.context.title, &calibration_verdict(judged));
    calibration_sections(&mut page, judged);
    page.finish()
}

/// Adds the sections of the report to a page, which may have other parts.
pub(crate) fn calibration_sections(page: &mut Page, subject: &Judged<'_>) {
    let Judged { calibrated, evaluation, context } = *subject;
    let names = method_names(calibrated, evaluation);
    // pictures come first, because they show what the numbers below mean
    let trials = &evaluation.trials;
    let is_table = !trials.is_empty() && trials.iter().all(|trial| are_row_numbers(&trial.time_s));
    let liveliest = with_most_motion(&evaluation.trials);
    // The rows of a table are not a function of time, so nothing is drawn over time.
    if !is_table {
        over_time(page, evaluation, liveliest, &names);
    }
    loops(page, calibrated, evaluation, liveliest, &names, is_table);
    judged(page, evaluation, &names, context, is_table);
    errors(page, evaluation, &names, is_table);
    shapes(page, calibrated, &evaluation.unit);
    fits(page, calibrated, context);
}

/// A picture of some seconds of the first trial for a README, as an SVG file in light colours with its legend inside.
/// The text is empty when there is nothing to draw.
pub fn readme_picture(calibrated: &[(&str, &Calibrated)], evaluation: &Evaluation) -> String {
    let names = method_names(calibrated, evaluation);
    let first = evaluation.trials.first();
    first.map_or_else(String::new, |trial| closest_look(evaluation, trial, &names).standalone())
}

/// Returns one sentence that states the error of the chosen calibration, the last of the list.
pub fn calibration_verdict(judged: &Judged<'_>) -> String {
    let Judged { calibrated, evaluation, context } = *judged;
    let names = method_names(calibrated, evaluation);
    let methods = &evaluation.pooled;
    let called = |i: usize| match (methods[i].method.as_str(), names.get(i)) {
        (method, Some(name)) if method.parse::<ModelKind>().is_err() => {
            // the table names the model
            format!("the {} calibration", name.split(" (").next().unwrap_or(name))
        }
        (method, _) => method.to_owned(),
    };
    // The verdict is about the chosen calibration, even if another one is by chance better on these
    // recordings.
    let last =
        calibrated.last().and_then(|(name, _)| methods.iter().position(|m| m.method == *name));
    let chosen = last.or_else(|| best(methods)).and_then(|at| {
        let raw = methods.iter().filter(|m| m.method == RAW);
        let two: Vec<MethodErrors> = raw.chain([&methods[at]]).cloned().collect();
        errors_in_words(&two, &evaluation.unit, |_| called(at))
    });
    let Some(errors) = chosen else {
        return NOT_COMPARED.to_owned();
    };
    format!("{}, {errors}", judged_on(evaluation, context))
}

/// The sentence of a report without errors.
const NOT_COMPARED: &str = "No estimate could be compared with a reference.";

/// Says on which recordings the errors were measured.
fn judged_on(evaluation: &Evaluation, context: &Context) -> &'static str {
    let judged = &evaluation.trials;
    let seen = judged.iter().filter(|t| context.calibrated_on.contains(&t.trial)).count();
    match (seen, judged.len()) {
        (0, 1) => "On a recording that was not used for the fit",
        (0, _) => "On recordings that were not used for the fit",
        (seen, all) if seen == all => "On the same recordings as the fit",
        _ => "On recordings of which some were used for the fit",
    }
}

/// The report of several gauges that were calibrated together, as one HTML file: the errors of all gauges together, and
/// a part for each gauge with a separate straight line. Each gauge has its column, its line and the evaluation of
/// that line. The first calibration of `together` is that of all gauges.
pub fn gauges_report(
    together: &Evaluation,
    gauges: &[(&str, &Calibrated, &Evaluation)],
    context: &Context,
) -> String {
    let first = together.pooled.iter().find(|errors| errors.method != RAW);
    let first: Vec<MethodErrors> = first.into_iter().cloned().collect();
    let errors =
        errors_in_words(&first, &together.unit, |_| "the calibration of all gauges".to_owned());
    let verdict = errors.map_or_else(
        || NOT_COMPARED.to_owned(),
        |errors| format!("{}, {errors}", judged_on(together, context)),
    );
    let mut page = Page::new(&context.title, &verdict);
    for (signal, ..) in gauges {
        page.jump(signal, &format!("Go to {signal} alone"));
    }
    calibration_sections(&mut page, &Judged { calibrated: &[], evaluation: together, context });
    // The notes are those of all gauges.
    let context = &Context { notes: Vec::new(), ..context.clone() };
    for (signal, line, evaluation) in gauges {
        let calibrated = &[("linear", *line)];
        let judged = Judged { calibrated, evaluation, context };
        page.part(signal, &format!("{signal} alone"), &calibration_verdict(&judged));
        calibration_sections(&mut page, &judged);
    }
    page.finish()
}

/// States the error of the best method, and that of the raw signal, in one sentence; `None` without a calibration that
/// could be compared. `name` gives the name of a method by its index.
pub fn errors_in_words(
    methods: &[MethodErrors],
    unit: &str,
    name: impl Fn(usize) -> String,
) -> Option<String> {
    let best = best(methods)?;
    let off = |m: &MethodErrors| with_unit(&number(m.rmse, 3), unit);
    let raw = methods.iter().find(|m| m.method == RAW);
    let raw = raw.map_or_else(String::new, |m| {
        format!("; the raw signal, scaled to the reference, by {}", off(m))
    });
    let percent = number(methods[best].rmse_percent, 2);
    let is_off = format!("{} is off by {}", name(best), off(&methods[best]));
    Some(format!("{is_off} (RMSE, {percent}\u{a0}% of the range){raw}."))
}

fn judged(
    page: &mut Page,
    evaluation: &Evaluation,
    names: &[String],
    context: &Context,
    is_table: bool,
) {
    page.section("How good it is", "");
    page.text(&format!(
        "Fitted on {}; compared with {}.",
        recordings(&context.calibrated_on),
        if context.tested_on.is_empty() {
            "the same data, which flatters every method".to_owned()
        } else {
            recordings(&context.tested_on)
        }
    ));
    let caption = match context.tested_on.is_empty() {
        true => "All recordings of the fit together",
        false => "All test recordings together",
    };
    page.table(&method_table(caption, &evaluation.pooled, names, &evaluation.unit));
    if !context.kinds.is_empty() {
        // folded, because each of these tables fills four screens of a phone
        page.folded("By kind of recording", |page| {
            for (kind, methods) in &context.kinds {
                page.table(&method_table(kind, methods, names, &evaluation.unit));
            }
        });
    }
    page.text(
        "Raw is the signal itself, scaled so that its extremes match those of the reference, which are not known in use. Average \
         error is the mean absolute error divided by the range of the estimate. A positive lag means that the estimate is late. Outside \
         domain counts samples whose signal or rate was outside the range of the fit.",
    );
    page.list(&context.notes);
    let others = evaluation.trials.len();
    if others > 1 {
        page.folded(&format!("Each of the {others} recordings"), |page| {
            for trial in &evaluation.trials {
                page.table(&method_table(&trial.trial, &trial.methods, names, &evaluation.unit));
            }
        });
    }
    if !evaluation.comparisons.is_empty() {
        let called = |method: &str| {
            let at = evaluation.pooled.iter().position(|m| m.method == method);
            at.and_then(|i| names.get(i)).cloned().unwrap_or_else(|| method.to_owned())
        };
        page.folded("Are the differences more than chance?", |page| {
            page.table(&comparison_table(&evaluation.comparisons, &evaluation.unit, called));
            if !is_table {
                page.text(ON_BLOCKS);
            }
        });
    }
}

/// Remark on the two columns with P values.
const ON_BLOCKS: &str = "Neighbouring samples have similar errors. Therefore P for means of half-second blocks is more reliable than P for \
                         samples, which is reported because the paper reports it.";

/// Mean absolute rate of a recording's reference, per second.
fn travel_per_second(trial: &TrialErrors) -> f64 {
    let steps = trial.reference.windows(2).map(|w| (w[1] - w[0]).abs());
    let travel: f64 = steps.filter(|step| step.is_finite()).sum();
    let ends = trial.time_s.first().zip(trial.time_s.last());
    ends.map_or(0.0, |(first, last)| travel / (last - first).max(f64::MIN_POSITIVE))
}

/// The recording with the most motion, because the quality of a model shows where there is motion.
fn with_most_motion(trials: &[TrialErrors]) -> Option<usize> {
    let pace = |i: &usize| travel_per_second(&trials[*i]);
    (0..trials.len()).rev().max_by(|a, b| pace(a).total_cmp(&pace(b)))
}

fn over_time(page: &mut Page, evaluation: &Evaluation, liveliest: Option<usize>, names: &[String]) {
    page.section("Estimate and reference over time", "");
    let caption = |trial: &TrialErrors| format!("{}, the whole recording.", trial.trial);
    let closer = "The eight seconds with the most motion, away from the ends.";
    let mut drawn: Vec<&TrialErrors> = evaluation.trials.iter().collect();
    if let Some(first) = liveliest {
        drawn[..=first].rotate_right(1);
    }
    for (index, trial) in drawn.into_iter().take(DRAWN).enumerate() {
        let both = |page: &mut Page| {
            page.figure(&closest_look(evaluation, trial, names), closer);
            page.figure(&estimate_figure(evaluation, trial, names), &caption(trial));
        };
        if index == 0 {
            both(page);
        } else {
            page.folded(&trial.trial, both);
        }
    }
    if evaluation.trials.is_empty() {
        page.text("There is no recording to draw.");
    }
    let more = evaluation.trials.len().saturating_sub(DRAWN);
    if more > 0 {
        page.text(&format!("{more} more recordings are in the tables only."));
    }
}

/// Draws reference against signal (the loop of the sensor), with the estimates of the best calibration.
fn loops(
    page: &mut Page,
    calibrated: &[(&str, &Calibrated)],
    evaluation: &Evaluation,
    liveliest: Option<usize>,
    names: &[String],
    is_table: bool,
) {
    let (Some((_, first)), Some(best)) = (calibrated.first(), best(&evaluation.pooled)) else {
        return;
    };
    let name = names.get(best).map_or("", String::as_str);
    let shown = liveliest.map(|i| &evaluation.trials[i]);
    page.section(
        "Signal and reference",
        &format!(
            "A sensor without memory gives one curve. Hysteresis gives a loop: the signal at one length differs between rising and \
             falling. Samples at rest (slower than {} % of the fastest) are left out.",
            100.0 * AT_REST
        ),
    );
    page.figure(
        &signal_figure(evaluation, shown, (best, name), first.calibration.spec().signal.as_str()),
        match is_table {
            true => "All rows, and estimates of some of them.",
            false => {
                "All recordings, and the estimates in the eight seconds that are drawn first above."
            }
        },
    );
}

fn errors(page: &mut Page, evaluation: &Evaluation, names: &[String], is_table: bool) {
    let intro = "Error is estimate minus reference. Dots are samples from every part of the axis. \
                 The strong line is the median, and the band contains 80 % of the samples. About \
                 one sample in a hundred lies outside the frame.";
    page.section("Where the errors are", intro);
    let rate = (
        error_figure(evaluation, names, Against::Rate),
        "Error over the rate: it shows the effects of a delay, and of a model without a rate."
            .to_owned(),
    );
    let place = (
        error_figure(evaluation, names, Against::Reference),
        "Error over the reference: it shows the effects of a model with the wrong shape."
            .to_owned(),
    );
    let shown = [rate, place];
    page.figures(&shown[usize::from(is_table)..]);
}

fn shapes(page: &mut Page, calibrated: &[(&str, &Calibrated)], unit: &str) {
    let memories: Vec<_> =
        calibrated.iter().filter(|(_, c)| c.calibration.spec().model.has_memory()).collect();
    for (name, calibrated) in &memories {
        page.section(
            &format!("Memory ({name})"),
            "The estimate of this model depends on earlier samples, which no surface can show. The figures show its estimate after a step \
             of the signal, and while the signal rises and falls at a constant speed through the middle half of its range. Without memory \
             and rate, the loops would lie on one line.",
        );
        page.figures(&[
            (
                step_figure(name, calibrated, unit),
                "The signal steps up after 5 s and down after 10 s.".to_owned(),
            ),
            (
                loop_figure(name, calibrated, unit),
                "Estimate over signal, for several durations of one rise and fall.".to_owned(),
            ),
        ]);
    }
    if memories.is_empty() {
        surfaces(page, calibrated);
    } else if calibrated.iter().any(|(_, c)| !BranchView::all(c).is_empty()) {
        page.folded("The surfaces of the models without memory", |page| surfaces(page, calibrated));
    }
}

fn surfaces(page: &mut Page, calibrated: &[(&str, &Calibrated)]) {
    for (name, calibrated) in calibrated {
        let views = BranchView::all(calibrated);
        if views.is_empty() {
            continue;
        }
        page.heading(&format!("The surfaces ({name})"));
        page.text(
            "One surface is used while the target rises, the other while it falls. A surface is filled where there are samples, drawn as \
             a net where it is extrapolated, and not drawn where it leaves the frame. The 1 % of the samples with the fastest rates is \
             left out.",
        );
        let inks = [Ink::Fourth, Ink::Fifth];
        let solid: Vec<_> = views
            .iter()
            .zip(inks)
            .map(|(view, ink)| {
                let r_squared = fixed(view.fit.r_squared, 4);
                let caption =
                    format!("The {} branch: R\u{b2} of the fit {r_squared}.", view.name());
                (surface_figure(view, ink), caption)
            })
            .collect();
        page.figures(&solid);
        page.text(
            "The same surfaces cut at three rates: samples in motion are divided into thirds from slow to fast, and each line is the \
             surface at the median rate of its third. Samples at \
             less than a twentieth of the fastest rate are left out.",
        );
        let cuts: Vec<_> =
            views.iter().map(|v| (slice_figure(v), format!("The {} branch.", v.name()))).collect();
        page.figures(&cuts);
    }
}

/// Returns the remarks on a calibration, the doubts first.
fn remarks(calibrated: &Calibrated) -> impl Iterator<Item = &String> {
    calibrated.doubts.iter().chain(&calibrated.notes)
}

fn fits(page: &mut Page, calibrated: &[(&str, &Calibrated)], context: &Context) {
    if calibrated.is_empty() && context.signal_choice.is_empty() {
        return;
    }
    page.section("What was fitted", "");
    if !context.signal_choice.is_empty() {
        page.text(
            "The signal was chosen on the data of the fit alone, by the error on parts left out \
             of it.",
        );
        page.table(&signal_table(&context.signal_choice));
    }
    for (name, calibrated) in calibrated {
        let new = remarks(calibrated).filter(|note| !context.notes.contains(note));
        page.list(&new.cloned().collect::<Vec<_>>());
        page.folded(&format!("{name}: coefficients and orders"), |page| {
            for fit in &calibrated.fits {
                page.table(&coefficient_table(fit));
                if !fit.orders.is_empty() {
                    page.table(&order_table(fit));
                }
            }
            page.text(
                "r is the normalised rate and v the normalised signal. The bounds assume independent samples. Samples of a recording \
                 are not independent, so the true bounds are wider.",
            );
        });
    }
}

/// Returns the names of recordings as a part of a sentence.
fn recordings(names: &[String]) -> String {
    match names {
        [] => "data that are not named".to_owned(),
        [first, .., last] if names.len() > 6 => {
            format!("{} recordings, {first} to {last}", names.len())
        }
        _ => listed(names),
    }
}

/// Returns the report of a demonstration as one HTML file: a calibration, and the diagnosis of the difference between
/// simulator and rig. Each part has the content of its separate report.
pub fn demo_page(judged: &Judged<'_>, subject: &Subject<'_>) -> String {
    let worded = in_words(subject.diagnosis);
    let subject = &Subject { diagnosis: &worded, ..*subject };
    // id of the second part
    let diagnosis = "diagnosis";
    let both = format!("{} {}", calibration_verdict(judged), headline(subject));
    let mut page = Page::new(&judged.context.title, &both);
    page.jump(diagnosis, "Go to the diagnosis");
    calibration_sections(&mut page, judged);
    page.part(diagnosis, &diagnosis_title(subject), &headline(subject));
    diagnosis_sections(&mut page, subject);
    page.finish()
}
