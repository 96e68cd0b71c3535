//! Diagnoses a folder of labelled cases, writes each answer into the folder of its case, and scores
//! the answers: `cargo run --release -p stretch-challenge --example dev_score -- FOLDER [case-000
//! ...]`.

use std::{fs, path::Path, time::Instant};

use stretch_blind::{CaseKind, Score, Truth, Verdict};
use stretch_challenge::{ANSWER, diagnosed};
use stretch_gap::Options;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((folder, wanted)) = arguments.split_first() else {
        eprintln!("usage: dev_score FOLDER [case-000 ...]");
        std::process::exit(2);
    };
    let folder = Path::new(folder);
    let truth: Truth = match Truth::open(folder) {
        Ok((truth, _)) => truth,
        Err(_) => serde_json::from_str(&fs::read_to_string(folder.join("truth.json"))?)?,
    };
    let mut verdicts = Vec::new();
    for (name, label) in &truth.cases {
        if !wanted.is_empty() && !wanted.contains(name) {
            continue;
        }
        let struck: Vec<&String> = label.struck.iter().collect();
        let begun = Instant::now();
        let progress = |what: &str| {
            if !wanted.is_empty() {
                eprintln!("{:6.1} s: {what}", begun.elapsed().as_secs_f64());
            }
        };
        let result = diagnosed(&folder.join(name), &struck, &Options::default(), &progress);
        let (diagnosis, evidence) = match result {
            Ok(done) => done,
            Err(error) => {
                println!("{name} {error}");
                continue;
            }
        };
        let json = serde_json::to_value(&diagnosis)?;
        fs::write(folder.join(name).join(ANSWER), json.to_string())?;
        let verdict = Verdict::from_diagnosis(name, &json)?;
        let right = match label.kind {
            CaseKind::Null => verdict.answer().is_empty() && verdict.verdict != "unknown",
            CaseKind::OutOfCatalogue | CaseKind::Struck => verdict.verdict == "unknown",
            _ => label.effects.iter().all(|e| verdict.answer().contains(e)),
        };
        let named = diagnosis.candidates.iter().find(|c| c.effects == diagnosis.named());
        let best = named.or(diagnosis.candidates.first());
        let forms: Vec<String> = label
            .acting
            .iter()
            .map(|a| format!("{}/{}({:.2})", a.name, a.form, a.excess))
            .collect();
        println!(
            "{} {name} {:?} p={} {} x={:.2} -> {} {:?} gap {:.3}->{:.3} {:.1}s",
            if right { "  " } else { "XX" },
            label.kind,
            u8::from(label.pressure_column),
            if forms.is_empty() { label.effects.join("+") } else { forms.join("+") },
            label.excess,
            verdict.verdict,
            verdict.named,
            best.map_or(0.0, |c| c.gap_before),
            best.map_or(0.0, |c| c.gap_after),
            begun.elapsed().as_secs_f64(),
        );
        if !right || wanted.contains(name) {
            for s in &diagnosis.location.stages {
                println!(
                    "        {} raw {:.2} retuned {:.3} after {:.3}",
                    s.stage, s.raw, s.excess, s.after
                );
            }
            for c in diagnosis.candidates.iter().take(5) {
                println!(
                    "        {:?} P={:.3} S={:.1} closed {:.3} [{:.2} {:.2}] {}",
                    c.effects,
                    c.probability,
                    c.score,
                    c.closed,
                    c.closed_ci[0],
                    c.closed_ci[1],
                    c.parameters
                        .iter()
                        .map(|p| format!("{}={:.4}", p.name, p.value))
                        .collect::<Vec<_>>()
                        .join(" ")
                );
            }
        }
        if wanted.contains(name) {
            let roles = &evidence.roles;
            for (s, stage) in evidence.stages.iter().enumerate() {
                print!("        {}:", diagnosis.location.stages[s].stage);
                for segment in &roles.segments {
                    let mean = |r: &[f64]| {
                        let part = &r[segment.from..segment.to];
                        part.iter().map(|x| x * x).sum::<f64>() / part.len() as f64 - 1.0
                    };
                    print!(
                        " {}{:?}={:.2}>{:.2}",
                        segment.trial,
                        segment.role,
                        mean(&stage.residual_retuned),
                        mean(&stage.residual_after)
                    );
                }
                println!();
            }
            for p in &diagnosis.parameters {
                println!(
                    "        {} {:.2} sd bent {:.4} nominal {:.4}",
                    p.name,
                    p.sigmas,
                    p.bent / p.nominal,
                    p.nominal
                );
            }
        }
        verdicts.push(verdict);
    }
    if wanted.is_empty() {
        println!("{}", serde_json::to_string_pretty(&Score::of(&truth, &verdicts)?)?);
    }
    Ok(())
}
