//! Figures of a blind check: calibration, time, and truth against answers.

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, VPos},
};
use stretch_blind::{Calibration, Score};

use stretch_report::kit::{
    Area, Axes, Drawn, Figure, FigureSize, Ink, STEPS, TEXT_PX, dot, plot, px, stroke, words,
};

/// Stated probability against how often it came true, with Wilson's interval.
pub(crate) fn reliability_figure(calibration: &Calibration) -> Figure {
    let bins: Vec<_> = calibration.bins.iter().filter(|b| b.right.cases > 0).collect();
    if bins.is_empty() {
        return Figure::missing("No probability was stated.");
    }
    let labels = ["probability stated", "share that came true (below: number of cases)"];
    // below the axis of no case there is room for the counts: none of them lies on a point
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

/// Share of the cases done within a time.
pub(crate) fn time_figure(times: &[f64]) -> Figure {
    let mut times = times.to_vec();
    times.sort_by(f64::total_cmp);
    let Some(&longest) = times.last().filter(|t| **t > 0.0) else {
        return Figure::missing("No time was taken.");
    };
    let steps: Vec<(f64, f64)> = times
        .iter()
        .enumerate()
        .flat_map(|(i, t)| {
            let at = |k: usize| 100.0 * k as f64 / times.len() as f64;
            [(*t, at(i)), (*t, at(i + 1))]
        })
        .collect();
    let labels = ["time of a diagnosis, s", "% of the cases"];
    let axes = Axes::new(0.0..1.05 * longest, 0.0..102.0, labels);
    let draw = |area: &Area<'_>| {
        plot(area, &axes, |chart| {
            let line = std::iter::once((0.0, 0.0)).chain(steps.clone());
            chart.draw_series(LineSeries::new(line, stroke(Ink::Third.color(), 2.0)))?;
            Ok(())
        })
    };
    Figure::new("Share of the cases done within a time")
        .draw(FigureSize { height: 220, ..FigureSize::NARROW }, draw)
        .draw(FigureSize { height: 220, ..FigureSize::WIDE }, draw)
}

/// Truth against the first name given: a matrix if there is room, the wrong answers in words on a
/// phone.
pub(crate) fn confusion_figure(score: &Score) -> Figure {
    let rows: Vec<&String> = score.confusion.keys().collect();
    if rows.is_empty() {
        return Figure::missing("There is no single effect and no null among the cases.");
    }
    let mut columns: Vec<&String> = rows.iter().filter(|r| **r != "null").copied().collect();
    for said in score.confusion.values().flat_map(|row| row.keys()) {
        if !columns.contains(&said) {
            columns.push(said);
        }
    }
    let wrong: Vec<(String, usize)> = score
        .confusion
        .iter()
        .flat_map(|(truth, row)| row.iter().map(move |(said, n)| (truth, said, *n)))
        .filter(|(truth, said, _)| truth != said && !(*truth == "null" && is_quiet(said)))
        .map(|(truth, said, n)| (format!("{truth}: {}", said), n))
        .collect();
    let cell = ((880.0 - 170.0) / columns.len() as f64).min(30.0);
    let row_px = 21.0;
    let height = (rows.len() as f64 * row_px + 160.0) as u32;
    let list = FigureSize { width: 400, height: (wrong.len().max(1) * 21 + 12) as u32 };
    Figure::new("Confusion matrix: what was there against the first name given")
        .draw(list, |area| {
            if wrong.is_empty() {
                let text = Text::new(
                    "no wrong answer",
                    (px(4.0), px(4.0)),
                    words(Ink::Text, HPos::Left, VPos::Top),
                );
                return area.draw(&text);
            }
            for (i, (text, n)) in wrong.iter().enumerate() {
                let y = px(4.0 + 21.0 * i as f64);
                let line = format!("{n} \u{d7} {text}");
                area.draw(&Text::new(line, (px(4.0), y), words(Ink::Text, HPos::Left, VPos::Top)))?;
            }
            Ok(())
        })
        .draw(FigureSize { width: 880, height }, |area| {
            matrix(area, score, &rows, &columns, cell, row_px)
        })
}

fn is_quiet(said: &str) -> bool {
    said == "no_gap" || said == "parameters"
}

fn matrix(
    area: &Area<'_>,
    score: &Score,
    rows: &[&String],
    columns: &[&String],
    cell: f64,
    row_px: f64,
) -> Drawn {
    let left = 165.0;
    let small = |h, v| {
        let mut style = words(Ink::Text, h, v);
        style.font = style.font.resize(f64::from((TEXT_PX - 2) * STEPS));
        style
    };
    for (r, truth) in rows.iter().enumerate() {
        let y = 4.0 + row_px * r as f64;
        let at = (px(left - 8.0), px(y + 0.5 * row_px));
        area.draw(&Text::new((*truth).clone(), at, small(HPos::Right, VPos::Center)))?;
        let counts = &score.confusion[*truth];
        let all: usize = counts.values().sum();
        for (c, said) in columns.iter().enumerate() {
            let x = left + cell * c as f64;
            let frame = [(px(x), px(y)), (px(x + cell - 1.0), px(y + row_px - 1.0))];
            area.draw(&Rectangle::new(frame, dot(Ink::Grid, 0.6)))?;
            if let Some(n) = counts.get(*said) {
                let right = said == truth || (*truth == "null" && is_quiet(said));
                let ink = if right { Ink::Third } else { Ink::Second };
                let share = 0.2 + 0.5 * *n as f64 / all.max(1) as f64;
                area.draw(&Rectangle::new(frame, dot(ink, share)))?;
                let at = (px(x + 0.5 * cell), px(y + 0.5 * row_px));
                area.draw(&Text::new(n.to_string(), at, small(HPos::Center, VPos::Center)))?;
            }
        }
    }
    let below = 4.0 + row_px * rows.len() as f64 + 6.0;
    for (c, said) in columns.iter().enumerate() {
        let x = left + cell * (c as f64 + 0.5);
        let mut style = small(HPos::Right, VPos::Center);
        style.font = style.font.transform(FontTransform::Rotate270);
        area.draw(&Text::new((*said).clone(), (px(x), px(below)), style))?;
    }
    Ok(())
}
