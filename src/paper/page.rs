//! The HTML page of the experiment of the published method ("the paper").

use plotters::prelude::*;
use stretch_report::kit::{Area, Axes, Drawn, Figure, FigureSize, Ink, Page, plot, stroke};

use super::{
    experiment::Experiment,
    responses::GapPoint,
    tables::{error_tables, fit_table, verdicts},
};

/// Builds the page: tables with published and own values, and figures of the studies that the paper
/// proposes.
pub(super) fn paper_page(experiment: &Experiment) -> String {
    let arbitrary = |method: usize| experiment.published.arbitrary.pooled[method].rmse;
    let verdict = format!(
        "On a simulated rig the published method is off by {:.2} mm on arbitrary actuation; the raw signal by {:.2} mm. \
         With matched rates and frozen ranges it is off by {:.2} mm, an observer fitted to the same ramps by {:.2} mm.",
        arbitrary(2),
        arbitrary(0),
        experiment.ours.arbitrary.pooled[2].rmse,
        experiment.ours.arbitrary.pooled[3].rmse
    );
    let mut page = Page::new("The paper's experiment, simulated", &verdict);
    page.section("What agrees and what does not", "");
    page.list(&verdicts(experiment));
    page.section("Fits", "Six inflations and six deflations; R^2 and RMSE of normalised strain.");
    page.table(&fit_table(experiment));
    page.section("Applied", "Average error over the range of the estimate, and RMSE.");
    error_tables(experiment).iter().for_each(|table| {
        page.table(table);
    });
    page.section(
        "What the paper asks for next",
        "How the error depends on the gap between two pulses, and how the sensor responds to sines.",
    );
    page.figure(&gap_figure(experiment), "RMSE on trials of pulse pairs with one gap each.");
    page.figures(&[
        (
            gain_figure(experiment),
            "Gain of the bridge voltage over the length, 3 mm about mid-stroke.".to_owned(),
        ),
        (lead_figure(experiment), "Phase by which the voltage leads the contraction.".to_owned()),
    ]);
    page.finish()
}

type Curve = (Ink, Vec<(f64, f64)>);

fn curves_figure(
    description: &str,
    axes: &Axes,
    curves: &[Curve],
    frames: &[FigureSize],
) -> Figure {
    let draw = |area: &Area<'_>| -> Drawn {
        plot(area, axes, |chart| {
            for (ink, points) in curves {
                chart.draw_series(LineSeries::new(
                    points.iter().copied(),
                    stroke(ink.color(), 2.0),
                ))?;
            }
            Ok(())
        })
    };
    frames.iter().fold(Figure::new(description), |figure, &frame| figure.draw(frame, draw))
}

fn top(curves: &[Curve]) -> f64 {
    1.08 * curves.iter().flat_map(|(_, points)| points.iter().map(|p| p.1)).fold(0.0, f64::max)
}

fn gap_figure(experiment: &Experiment) -> Figure {
    let curve = |of: fn(&GapPoint) -> f64| {
        experiment.gaps.iter().map(|point| (point.gap_s, of(point))).collect::<Vec<_>>()
    };
    let curves = [
        (Ink::of(0), curve(|p| p.ours_rmse_mm[0])),
        (Ink::of(1), curve(|p| p.published_rmse_mm[2])),
        (Ink::of(2), curve(|p| p.ours_rmse_mm[2])),
        (Ink::of(3), curve(|p| p.ours_rmse_mm[3])),
    ];
    let labels = ["gap between the pulses, s", "RMSE, mm"];
    let axes = Axes::new(0.0..2.05, 0.0..top(&curves), labels);
    let names = ["raw", "non-linear, as published", "non-linear, ours", "observer"];
    curves_figure(
        "RMSE against the gap between two pulses",
        &axes,
        &curves,
        &[FigureSize::NARROW, FigureSize::WIDE],
    )
    .legend(names.into_iter().enumerate().map(|(i, name)| (Ink::of(i), name.to_owned())))
}

/// Returns axes with a logarithmic frequency axis.
fn frequency_axes(y: std::ops::Range<f64>, y_label: &str) -> Axes {
    Axes { is_log: true, ..Axes::new(-1.75..1.15, y, ["frequency, Hz", y_label]) }
}

fn gain_figure(experiment: &Experiment) -> Figure {
    let points =
        experiment.frequency.iter().map(|p| (p.frequency_hz.log10(), 1e3 * p.gain_v_per_mm));
    let curves = [(Ink::of(2), points.collect())];
    let axes = frequency_axes(0.0..top(&curves), "gain, mV/mm");
    curves_figure("Gain of the sensor against frequency", &axes, &curves, &[FigureSize::NARROW])
}

fn lead_figure(experiment: &Experiment) -> Figure {
    let points = experiment.frequency.iter().map(|p| (p.frequency_hz.log10(), p.lead_deg));
    let curves = [(Ink::of(2), points.collect::<Vec<_>>())];
    let values = || curves[0].1.iter().map(|p| p.1);
    let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
    let axes = frequency_axes(low - 2.0..high + 2.0, "lead, degrees");
    curves_figure(
        "Phase lead of the sensor against frequency",
        &axes,
        &curves,
        &[FigureSize::NARROW],
    )
}
