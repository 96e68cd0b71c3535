//! Counts how often slack and saturation are distinguished, with and without one trial at 0.7 of
//! the excitation.
//!
//! There are twenty simulated sessions, ten with each effect, in the forms of the catalogue. Each
//! is diagnosed unchanged, without its pressure, and with the additional trial.
//!
//! `cargo run --release -p stretch-challenge --example excitation`

#[path = "attainable/simulated.rs"]
mod simulated;

use std::num::NonZeroUsize;

use anyhow::Context;
use simulated::{Protocol, Source};
use stretch_gap::Options;
use stretch_sim::{EffectParameter, effect_named};

/// Largest number of effects that are named together.
const TWO: NonZeroUsize = NonZeroUsize::MIN.saturating_add(1);
/// Number of sessions with each effect.
const EACH: u64 = 10;

/// Returns a session with one effect, given one of its parameters; its other parameters have their
/// usual values.
fn source(name: &str, parameter: &str, value: f64, seed: u64) -> anyhow::Result<Source> {
    let effect = effect_named(name).context("an effect of the catalogue")?;
    let one = |p: &EffectParameter| match p.name == parameter {
        true => value,
        false => p.off().unwrap_or_else(|| p.usual()),
    };
    let fitted: Vec<f64> = effect.fitted().map(one).collect();
    Ok(Source { seed, effect: Some((effect, effect.with_stand_ins(&fitted))) })
}

fn main() -> anyhow::Result<()> {
    // counts of: named alone; named or tied; wrong
    let mut counts = [[0_usize; 3]; Protocol::ALL.len()];
    for case in 0..2 * EACH {
        let strength = 0.3 + 0.07 * (case / 2) as f64;
        let (name, parameter, value) = match case % 2 {
            0 => ("sleeve_slack", "e_s", 0.03 + 0.07 * strength),
            _ => ("amplifier_saturation", "v_hi", 2.33 - 0.3 * strength),
        };
        let source = source(name, parameter, value, 20 + case)?;
        for (count, protocol) in counts.iter_mut().zip(Protocol::ALL) {
            let options = Options { depth: TWO, ..Options::default() };
            let found = source.diagnosed(protocol, options)?;
            let is = |names: &[String]| names.iter().any(|n| n == name);
            let kind = match (
                is(&found.named()),
                is(&found.answer.tied()),
                found.answer.tied().is_empty(),
            ) {
                (true, _, true) => 0,
                (true, ..) | (_, true, _) => 1,
                _ => 2,
            };
            count[kind] += 1;
            let (named, tied, protocol) = (&found.named(), &found.answer.tied(), protocol.name());
            println!("{name} {strength:.2}, {protocol}: {named:?} tied {tied:?}");
        }
    }
    println!("| trials | right | tied | wrong |\n|---|---|---|---|");
    for (protocol, [right, tied, wrong]) in Protocol::ALL.iter().zip(counts) {
        println!("| {} | {right} | {tied} | {wrong} |", protocol.name());
    }
    Ok(())
}
