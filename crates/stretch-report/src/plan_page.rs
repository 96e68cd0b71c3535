//! The report of a plan: the runs to record, and what they show.

use stretch_problem::{Planned, PlannedRun};

use super::{
    canvas::Ink,
    diagnosis_tables::limit_table,
    figure::Figure,
    page::{Page, Table},
    time_figure::TimePlot,
};

/// The report as a page.
pub fn plan_page(planned: &Planned) -> String {
    let mut page = Page::new(&format!("Plan: {}", planned.name), &planned.sentence());
    for (at, run) in planned.chosen().enumerate() {
        page.section(&format!("{}. {}", at + 1, run.name), &run.how);
        for channel in &run.trial.channels {
            let figure = course(planned, run, (&channel.name, &channel.values));
            page.figure(&figure, &format!("{} over time.", channel.name));
        }
        page.table(&limit_table(&run.shown.limits));
    }
    if planned.chosen.len() > 1 {
        page.section("All these runs together", "");
        page.table(&limit_table(&planned.together.limits));
    }
    page.section("The menu", "What each run alone shows.");
    page.table(&menu_table(planned, true));
    page.finish()
}

/// The order in which runs of the menu are recorded, and what each alone shows: the names of the effects that are
/// confused or not seen, or only their numbers.
pub fn menu_table(planned: &Planned, has_names: bool) -> Table {
    let shown = |names: &[String]| match has_names {
        true => names.join(", "),
        false => names.len().to_string(),
    };
    let row = |(at, run): (usize, &PlannedRun)| {
        let order = planned.chosen.iter().position(|chosen| *chosen == at);
        let confused = run.shown.confused().into_iter();
        let confused: Vec<String> =
            confused.map(|(effect, like)| format!("{effect} ({like})")).collect();
        let hidden: Vec<String> = run.shown.hidden().into_iter().map(str::to_owned).collect();
        vec![
            run.name.clone(),
            order.map_or(String::new(), |order| (order + 1).to_string()),
            run.shown.determined().join(", "),
            run.shown.named().len().to_string(),
            shown(&confused),
            shown(&hidden),
        ]
    };
    let head = ["Run", "Record as", "Determines", "Effects named", "Confused", "Not seen"];
    let rows = planned.runs.iter().enumerate().map(row);
    Table::new("What each run of the menu alone shows", &head, rows)
}

fn course(planned: &Planned, run: &PlannedRun, (name, values): (&str, &[f64])) -> Figure {
    let drawn = 0.0..planned.seconds;
    let plot = TimePlot {
        link: "",
        labels: ["time, s", name],
        unit: "",
        height: 220,
        time: &run.trial.time_s,
        drawn: &drawn,
        view: drawn.clone(),
        is_whole: false,
        lines: vec![(name, Ink::Truth, 1.5, values)],
        keys: Vec::new(),
        moves: None,
    };
    plot.figure(&format!("{name} over time"), "There are no values to draw here.")
}
