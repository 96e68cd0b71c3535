//! Evaluates priors and half a minute of reference on published recordings of sleeves that are put on again or worn by
//! another person.
//!
//! ```sh
//! cargo run --release -p stretch-sleeve --features calibrate --example sleeve -- --sleeves FOLDER --knees FOLDER --ankles FOLDER \
//!     [--auto] [--every N] [--leave sensor] [--faults] [--zero] [--simulated HOURS]
//! ```
//!
//! The first folder is `data/Regression` of github.com/e-Body-Lab/graphene-based-knitted-sensing-sleeve (commit
//! 47369aba, MIT), the others `datasets/Part VIII Knee Dataset/Part VIII Knee Data Preprocessed` and `datasets/Part IX
//! SRS Prototype Validation Dataset/00-PREPROCESSED-DATA` of
//! github.com/msstate-athlete-engineering/soft-sensors-research (commit 5f9b7fd3). The project contains none of these
//! data.
//!
//! Every prior is learnt, with its covariances, without the wearer on which it is judged. For the case "next session",
//! the other sessions of the wearer are then added to the prior. All errors are root mean squares over the samples
//! after the part from which the reference is taken: 60 s for sleeves, 20 s for knees, 10 s for ankles. The session's
//! own calibration is judged by cross-validation.
//!
//! `--auto` also judges the automatic choice of a model. `--leave sensor` judges each sensor with priors from all other
//! sensors. `--faults` judges only lost channels. `--zero` tests whether single gauges detect that they were put on
//! again. `--simulated` counts how often a working gauge is wrongly excluded as faulty in simulated hours.

mod data;
mod faults;
mod judge;
mod simulated;
mod zero;

use std::path::PathBuf;

use judge::{Asked, Judge, Row};

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str| {
        let at = arguments.iter().position(|a| a == name)?;
        arguments.get(at + 1).cloned()
    };
    let leave_sensor = value("--leave").is_some_and(|what| what == "sensor");
    let asked = Asked { auto: arguments.iter().any(|a| a == "--auto"), leave_sensor };
    let faults_alone = arguments.iter().any(|a| a == "--faults");
    let every = value("--every").map_or(Ok(1), |n| n.parse::<usize>())?.max(1);
    if let Some(hours) = value("--simulated") {
        simulated::print(hours.parse()?)?;
    }
    if let Some(folder) = value("--sleeves") {
        let set = data::sleeves(&PathBuf::from(folder))?;
        println!("{} sessions of knitted sleeves", set.worn.len());
        if arguments.iter().any(|a| a == "--zero") {
            return zero::print(&set);
        }
        let judge = Judge::new(set, 60.0, asked);
        if !faults_alone {
            print("sleeves", &judge.rows(every)?);
        }
        if !leave_sensor {
            faults::print(&judge, every)?;
        }
    }
    if let Some(folder) = value("--knees") {
        let set = data::knees(&PathBuf::from(folder))?;
        println!("{} wearers of a knee sensor", set.worn.len());
        let judge = Judge::new(set, 20.0, asked);
        print("knees", &judge.rows(every)?);
    }
    if let Some(folder) = value("--ankles") {
        for (angle, what) in [("FLX", "flexion"), ("IEV", "inversion")] {
            for (feet, sensors) in
                [(vec![vec!["L"], vec!["R"]], "five"), (vec![vec!["L", "R"]; 2], "ten")]
            {
                let mut rows = Vec::new();
                for (foot, feet) in ["L", "R"].into_iter().zip(&feet) {
                    let set = data::ankles(&PathBuf::from(&folder), foot, angle, feet)?;
                    rows.extend(Judge::new(set, 10.0, asked).rows(every)?);
                }
                print(&format!("ankles, {what}, {sensors} sensors"), &rows);
            }
        }
    }
    Ok(())
}

/// Prints geometric means: of the errors, of their ratios to the error of the line, and of their ratios to the error of
/// a calibration that was fitted to the session itself.
fn print(title: &str, rows: &[Row]) {
    let Some(first) = rows.first() else { return };
    println!("\n### {title}: {} sessions\n", rows.len());
    println!(
        "| calibration | sessions | RMSE | ratio to the line's RMSE: mean | largest | sessions with a ratio above 1.05 | ratio to the RMSE of the session's own calibration | share within the 95 % interval |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let mean = |values: &mut dyn Iterator<Item = f64>| {
        let logs: Vec<f64> = values.filter(|x| *x > 0.0 && x.is_finite()).map(f64::ln).collect();
        (logs.iter().sum::<f64>() / logs.len() as f64).exp()
    };
    let line = &first.errors[0].0;
    for (name, _) in &first.errors {
        let of = |row: &Row, name: &str| row.error(name).unwrap_or(f64::NAN);
        let error = mean(&mut rows.iter().map(|row| of(row, name)));
        let ratios: Vec<f64> = rows.iter().map(|row| of(row, name) / of(row, line)).collect();
        let own = if name.contains("all") { judge::OWN_ALL } else { judge::OWN_ONE };
        let to_own = mean(&mut rows.iter().map(|row| of(row, name) / of(row, own)));
        let worst = ratios.iter().copied().fold(0.0, f64::max);
        let above = ratios.iter().filter(|r| **r > 1.05).count();
        let judged = ratios.iter().filter(|r| r.is_finite()).count();
        let inside = rows.iter().flat_map(|row| row.inside.iter().filter(|(own, _)| own == name));
        let inside: Vec<f64> = inside.map(|(_, share)| *share).collect();
        let inside = match inside.len() {
            0 => "-".to_owned(),
            n => format!("{:.3}", inside.iter().sum::<f64>() / n as f64),
        };
        println!(
            "| {name} | {judged} | {error:.2} | {:.3} | {worst:.2} | {above} | {to_own:.3} | {inside} |",
            mean(&mut ratios.iter().copied())
        );
    }
}
