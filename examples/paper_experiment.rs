//! The paper's experiment end to end on the simulated rig: simulate the ramps,
//! fit both calibrations, apply them to arbitrary actuation and to pulses, and
//! print the tables beside the published ones.
//!
//! `stretch demo --paper` does the same with more words and a report.
//!
//! Run with: `cargo run --release --example paper_experiment`

use stretch_paper::{Experiment, PUBLISHED, PublishedErrors};
use stretch_sim::paper_preset;

const SEED: u64 = 3;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let experiment = Experiment::run(&paper_preset()?, SEED)?;
    println!("seed {SEED}");

    let line = &experiment.published.linear.fits[0];
    println!("linear fit:     R^2 {:.4} (paper {:.4})", line.r_squared, PUBLISHED.linear.r_squared);
    let fits = experiment.published.non_linear.fits.iter();
    for (fit, paper) in fits.zip([PUBLISHED.inflation[1], PUBLISHED.deflation[1]]) {
        println!(
            "{} poly13: R^2 {:.4} (paper {:.4}), RMSE {:.2} % (paper {:.2} %)",
            fit.name,
            fit.r_squared,
            paper.r_squared,
            100.0 * fit.rmse,
            paper.rmse_percent.unwrap_or(f64::NAN)
        );
    }

    let tables: [(&str, _, _, &[PublishedErrors; 3]); 2] = [
        (
            "arbitrary",
            &experiment.published.arbitrary,
            &experiment.ours.arbitrary,
            &PUBLISHED.arbitrary,
        ),
        ("pulses", &experiment.published.pulses, &experiment.ours.pulses, &PUBLISHED.pulses),
    ];
    for (kind, published, ours, paper) in tables {
        println!("\n{kind}: RMSE in mm       published way   paper    ours");
        for ((a, b), paper) in published.pooled.iter().zip(&ours.pooled).zip(paper) {
            println!("{:<22} {:>10.3} {:>10.3} {:>8.3}", a.method, a.rmse, paper.rmse_mm, b.rmse);
        }
    }

    // what the paper found, and what matched rates and frozen ranges change
    let pulses = &experiment.published.pulses.pooled;
    assert!(pulses[2].rmse < pulses[1].rmse, "the surfaces beat the line on pulses");
    let arbitrary =
        (&experiment.published.arbitrary.pooled[2], &experiment.ours.arbitrary.pooled[2]);
    assert!(arbitrary.1.rmse < arbitrary.0.rmse, "matched rates beat the published way");
    Ok(())
}
