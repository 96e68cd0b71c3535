//! Tables of runs that were fitted one by one.

use stretch_gap::{Identified, Knowledge};
use stretch_problem::{ByTrial, RunFit};

use super::{
    markup::{number, percent},
    page::Table,
};

/// Every value of every run with its 95 % interval, and whether the run determines it.
pub fn run_table(by_trial: &ByTrial) -> Table {
    let head = ["value", "run", "fitted", "from", "to", "unit", "determined"];
    let all: Vec<&RunFit> = std::iter::once(&by_trial.all).chain(&by_trial.runs).collect();
    let row = |fit: &RunFit, i: usize| {
        let v = &fit.values[i];
        let numbers = [v.value, v.interval[0], v.interval[1]].map(|x| number(x, 4));
        let texts = [v.identified.name.clone(), fit.run.clone()];
        let behind = [v.identified.unit.clone(), knowledge(&v.identified)];
        texts.into_iter().chain(numbers).chain(behind).collect::<Vec<String>>()
    };
    let values = 0..by_trial.all.values.len();
    let rows = values.flat_map(|i| all.iter().map(move |fit| row(fit, i)));
    Table::new("Every run by itself, with 95 % intervals", &head, rows.collect::<Vec<_>>())
}

fn knowledge(value: &Identified) -> String {
    match value.knowledge {
        Knowledge::Determined => "yes".to_owned(),
        _ if !value.like.is_empty() => format!("only with {}", value.like.join(", ")),
        Knowledge::Weakly => "weakly".to_owned(),
        Knowledge::Not => "no".to_owned(),
        Knowledge::Dead => "no, it does nothing".to_owned(),
    }
}

/// Whether each value is the same in all runs.
pub fn difference_table(by_trial: &ByTrial) -> Table {
    let head = ["value", "runs", "mean", "from", "to", "Q", "beyond intervals", "P", "agrees"];
    let rows = by_trial.values.iter().map(|v| {
        let [low, high] = v.range;
        let numbers = [v.mean, low, high, v.q].map(|x| number(x, 4));
        let agrees = if v.differs { "no" } else { "yes" };
        let p = number(v.p_corrected, 2);
        let behind = [percent(v.i_squared), p, agrees.to_owned()];
        let front = [v.name.clone(), v.runs.to_string()];
        front.into_iter().chain(numbers).chain(behind).collect::<Vec<String>>()
    });
    Table::new("Whether the runs agree", &head, rows.collect::<Vec<_>>())
}
