//! Candidates on measured sessions: calibrated on one session, tested on another session of the
//! same sleeve (github.com/e-Body-Lab/graphene-based-knitted-sensing-sleeve, commit 47369abac95f,
//! MIT).

use std::path::Path;

use stretch_calibrate::{Options, calibrate, choose_model, rank_signals};
use stretch_data::Trial;
use stretch_recording::{ReadOptions, Recording};

use crate::{
    ResultTable,
    score::{Blocks, number},
    simulated::{MODELS, fitted},
};

const SESSIONS: [[&str; 2]; 3] = [
    ["heel_curl_90_1", "heel_curl_90_2"],
    ["heel_curl_45_1", "heel_curl_45_2"],
    ["lift_up_1", "lift_up_2"],
];

/// A session to fit, a session to test on, and the signal chosen on the first.
pub(crate) struct Pair {
    pub(crate) fit: Trial,
    pub(crate) test: Trial,
    pub(crate) options: Options,
}

/// Returns all pairs of sessions of a sleeve. Empty if the data do not exist.
pub(crate) fn pairs(data: &Path) -> anyhow::Result<Vec<Pair>> {
    let mut pairs = Vec::new();
    let Some(sleeve) = testkit::measured::folder_in(data, "knit_sleeve") else { return Ok(pairs) };
    for [first, second] in SESSIONS {
        for (fit, test) in [(first, second), (second, first)] {
            let read = |name: &str| {
                Recording::read(sleeve.join(format!("{name}.csv")), &ReadOptions::new())
            };
            let (fit, test) = (read(fit)?.trial, read(test)?.trial);
            let base = Options { reference: "angle_deg".into(), ..Options::default() };
            let signals = ["s1", "s2", "s3", "s4", "s5"].map(String::from);
            let ranking = rank_signals(std::slice::from_ref(&fit), &signals, &base)?;
            let options = Options { signal: ranking[0].signal.clone(), ..base };
            pairs.push(Pair { fit, test, options });
        }
    }
    Ok(pairs)
}

pub(crate) fn tables(data: &Path) -> anyhow::Result<Vec<ResultTable>> {
    let pairs = pairs(data)?;
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let mut header = vec!["calibrated on", "tested on", "signal", "raw"];
    header.extend(MODELS);
    header.extend(["auto chose", "auto"]);
    let title =
        "Measured sessions: RMSE in degrees, calibrated on one session and tested on another";
    let mut table = ResultTable::new("measured.csv", title, &header);
    let mut logs = vec![0.0; MODELS.len() + 1];
    for pair in pairs {
        let fit = std::slice::from_ref(&pair.fit);
        let test = std::slice::from_ref(&pair.test);
        let mut errors = Vec::new();
        let mut raw = f64::NAN;
        for model in MODELS {
            let calibration = fitted(model, fit, &pair.options)?.calibration;
            raw = Blocks::raw(&calibration, test)?.rmse();
            errors.push(Blocks::of(&calibration, test)?.rmse());
        }
        let choice = choose_model(fit, &pair.options)?;
        let options = Options { model: choice.model, ..pair.options.clone() };
        errors.push(Blocks::of(&calibrate(fit, &options)?.calibration, test)?.rmse());
        let bar = errors[0].min(errors[1]);
        logs.iter_mut().zip(&errors).for_each(|(sum, e)| *sum += (e / bar).ln());
        let stem = |trial: &Trial| trial.name.trim_end_matches(".csv").to_owned();
        let mut row =
            vec![stem(&pair.fit), stem(&pair.test), pair.options.signal.clone(), number(raw)];
        row.extend(errors[..MODELS.len()].iter().map(|e| number(*e)));
        row.extend([choice.model.to_string(), number(errors[MODELS.len()])]);
        table.push(row);
    }
    let mean = |log: &f64| format!("{:.2}", (log / 6.0).exp());
    let mut row = vec![
        "geometric mean".to_owned(),
        "of the better of linear and poly13".into(),
        "-".into(),
        "-".into(),
    ];
    row.extend(logs[..MODELS.len()].iter().map(mean));
    row.extend(["-".to_owned(), mean(&logs[MODELS.len()])]);
    table.push(row);
    Ok(vec![table])
}
