//! The report of a blind check: the rates of right answers, and every case with a wrong answer.

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, VPos},
};
use stretch_blind::{Calibration, CaseKind, Miss, Rate, Score};
use stretch_report::kit::{
    Axes, Bar, Figure, FigureSize, Ink, Page, Row, Scale, Table, bar_figure, dot, number, percent,
    plot, px, stroke, words,
};

use crate::{goals::Goal, score::Answers};

/// Boundaries of the classes of strength.
const STRENGTHS: [f64; 8] = [0.05, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0];

/// Returns the report as one HTML file: all statistics, the hash of the labels, the wrong answers, and the goals
/// with their results.
pub(crate) fn page(score: &Score, answers: &Answers, reached: &[Goal]) -> String {
    let mut page = Page::new("Blind check of the diagnosis", &sentence(score));
    goals(&mut page, &answers.sha256, reached);
    strength(&mut page, score, answers);
    probabilities(&mut page, score);
    misses(&mut page, score);
    page.finish()
}

fn sentence(score: &Score) -> String {
    let right = score.singles.top1;
    let alarms = score.false_alarms;
    let (Some(share), Some((low, high))) = (right.share(), right.wilson()) else {
        return format!("{} cases were scored; none has a single effect that counts.", score.cases);
    };
    format!(
        "The right cause was named first in {} of {} cases with one missing effect ({}, 95\u{a0}% interval {} to {}); \
         {} of {} simulators without a fault were called faulty.",
        right.hits,
        right.cases,
        percent(share),
        percent(low),
        percent(high),
        alarms.hits,
        alarms.cases
    )
}

fn goals(page: &mut Page, sha256: &str, reached: &[Goal]) {
    page.section(
        "What was reached",
        "The cases come from a second simulator that shares no code with the catalogue and gives every effect another \
         form. Their labels were sealed before the diagnosis ran.",
    );
    page.text(&format!("SHA-256 of the labels: {sha256}"));
    page.table(&Table::new(
        "Goals; an excess of 1 means an error as large as the noise",
        &["Figure", "Goal", "Reached", "Count", "95 % interval", "Met"],
        reached.iter().map(|goal| goal.cells().to_vec()),
    ));
}

fn rate_row(label: &str, rate: &Rate) -> Row {
    let share = rate.share().unwrap_or(0.0);
    let text = match rate.share() {
        Some(share) => format!("{} of {}", percent(share), rate.cases),
        None => "no case".to_owned(),
    };
    let interval = rate.wilson().map(|(a, b)| [a, b]);
    Row {
        label: label.to_owned(),
        bars: vec![Bar { interval, text, ..Bar::new(Ink::Third, share) }],
    }
}

fn strength(page: &mut Page, score: &Score, answers: &Answers) {
    page.section("Accuracy against strength", "");
    let mut rates = vec![Rate::default(); STRENGTHS.len() + 1];
    for verdict in &answers.verdicts {
        let Some(label) = answers.truth.cases.get(&verdict.case) else { continue };
        if label.kind == CaseKind::Single {
            let class = STRENGTHS.iter().filter(|s| label.excess >= **s).count();
            rates[class].cases += 1;
            rates[class].hits += usize::from(verdict.answer().first() == label.effects.first());
        }
    }
    let label = |i: usize| match (i.checked_sub(1).map(|j| STRENGTHS[j]), STRENGTHS.get(i)) {
        (None, Some(to)) => format!("excess below {to}"),
        (Some(from), Some(to)) => format!("excess {from} to {to}"),
        (Some(from), None) => format!("excess above {from}"),
        (None, None) => String::new(),
    };
    let rows: Vec<Row> = rates
        .iter()
        .enumerate()
        .filter(|(_, r)| r.cases > 0)
        .map(|(i, r)| rate_row(&label(i), r))
        .collect();
    page.figure(
        &bar_figure("First name right, by strength", &rows, Scale::Percent, "%"),
        "Share of the simulators with one missing effect in which the effect named first is the missing one, by the excess that the effect causes, with Wilson's 95 % interval.",
    );
    let by_effect = score.by_effect.iter().map(|(name, rate)| rate_row(name, rate));
    let by_effect: Vec<Row> = by_effect.collect();
    let by_family = score.by_family.iter().map(|(name, rate)| rate_row(name.name(), rate));
    let by_family: Vec<Row> = by_family.collect();
    page.folded("By effect and by family of forms", |page| {
        page.figure(
            &bar_figure("First name right, by effect", &by_effect, Scale::Percent, "%"),
            "First name right at an excess of 0.1 or more.",
        );
        page.figure(
            &bar_figure("Exactly the one effect named, by family", &by_family, Scale::Percent, "%"),
            "Exactly the one effect named at an excess of 0.1 or more, by the family of its form.",
        );
    });
}

fn probabilities(page: &mut Page, score: &Score) {
    page.section("Are the probabilities honest?", "");
    page.figure(
        &reliability_figure(&score.calibration),
        "Probability stated against how often it came true.",
    );
}

/// Draws the reliability diagram: the rate of right answers against the stated probability, with
/// Wilson intervals.
pub(crate) fn reliability_figure(calibration: &Calibration) -> Figure {
    let bins: Vec<_> = calibration.bins.iter().filter(|b| b.right.cases > 0).collect();
    if bins.is_empty() {
        return Figure::missing("No probability was stated.");
    }
    let labels = ["probability stated", "share that came true (below: number of cases)"];
    // the counts are drawn below zero, where they cover no point
    let axes = Axes::new(0.0..1.0, -0.13..1.0, labels);
    Figure::new("Reliability diagram: probability stated against share that came true").draw(
        FigureSize::NARROW,
        |area| {
            plot(area, &axes, |chart| {
                let ideal = [(0.0, 0.0), (1.0, 1.0)];
                chart.draw_series(LineSeries::new(ideal, stroke(Ink::Axis.color(), 1.2)))?;
                for bin in &bins {
                    let share = bin.right.share().unwrap_or(0.0);
                    if let Some((low, high)) = bin.right.wilson() {
                        let line = [(bin.stated, low), (bin.stated, high)];
                        chart
                            .draw_series(LineSeries::new(line, stroke(Ink::Third.color(), 1.6)))?;
                    }
                    let at = (bin.stated, share);
                    chart.draw_series([Circle::new(at, px(3.0), dot(Ink::Third, 1.0))])?;
                    let h = if bin.stated > 0.95 { HPos::Right } else { HPos::Center };
                    let count = Text::new(
                        bin.right.cases.to_string(),
                        (0, 0),
                        words(Ink::Text, h, VPos::Center),
                    );
                    chart.draw_series([EmptyElement::at((bin.stated, -0.07)) + count])?;
                }
                Ok(())
            })
        },
    )
}

fn misses(page: &mut Page, score: &Score) {
    page.section(&format!("Every miss ({} of {})", score.misses.len(), score.cases), "");
    let row = |m: &Miss| {
        let or_none = |names: &[String]| {
            if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
        };
        vec![
            m.case.clone(),
            m.kind.name().replace('_', " "),
            or_none(&m.truth),
            m.verdict.replace('_', " "),
            or_none(&m.named),
            if m.in_set && !m.truth.is_empty() { "yes" } else { "" }.to_owned(),
            number(m.excess, 2),
            if m.pressure_column { "yes" } else { "" }.to_owned(),
        ]
    };
    if score.misses.is_empty() {
        page.text("There is none.");
        return;
    }
    let head = ["Case", "Kind", "There", "Verdict", "Named", "In the set", "Excess", "Pressure"];
    page.table(&Table::new("Wrong answers", &head, score.misses.iter().map(row)));
    if !score.unanswered.is_empty() {
        page.text(&format!("Without an answer: {}.", score.unanswered.join(", ")));
    }
}
