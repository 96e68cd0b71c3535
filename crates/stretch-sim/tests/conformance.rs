//! Compares the rig with test vectors of an independent implementation: the nominal rig, and every effect alone.

use std::{collections::BTreeMap, fs};

use stretch_sim::{
    CATALOGUE, Chain, DEFAULT_STEP_S, EffectSet, Openings, Recorded, RigParams, Start,
};
use testkit::{tolerance::RIG_CONFORMANCE, vectors::columns};

const SCALES: [(&str, f64); 3] = [("pressure_kpa", 620.0), ("length_mm", 50.0), ("bridge_v", 3.3)];

/// Returns the effects with the values of the test vectors.
fn effects() -> BTreeMap<String, EffectSet> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../reference/rig/effects.csv");
    let mut values: BTreeMap<String, Vec<(String, f64)>> = BTreeMap::new();
    for line in fs::read_to_string(path).unwrap().lines().skip(1) {
        let [effect, parameter, value] = line.split(',').collect::<Vec<_>>().try_into().unwrap();
        values.entry(effect.into()).or_default().push((parameter.into(), value.parse().unwrap()));
    }
    let mut sets = BTreeMap::from([("nominal".to_string(), EffectSet::new())]);
    for (name, values) in values {
        let mut set = EffectSet::new();
        let values: Vec<(&str, f64)> = values.iter().map(|(n, v)| (n.as_str(), *v)).collect();
        set.insert(&name, &values).unwrap();
        sets.insert(name, set);
    }
    sets
}

#[test]
fn agrees_with_the_reference() {
    let sets = effects();
    assert_eq!(sets.len(), CATALOGUE.len() + 1, "a vector for every effect");
    let commands = columns("rig/commands.csv");
    let mut report = String::new();
    let mut worst = 0.0f64;
    for trial in ["inflation", "deflation", "arbitrary"] {
        let reference = columns(&format!("rig/{trial}.csv"));
        let samples = 2001;
        let [mut inlet, mut outlet] = [vec![0.0; samples], vec![0.0; samples]];
        for i in 0..samples {
            let t = i as f64 * 0.01;
            match trial {
                "inflation" if i >= 100 => inlet[i] = 0.25,
                "deflation" if i >= 100 => outlet[i] = 0.5,
                "arbitrary" => {
                    let row = commands["start_s"].iter().rposition(|s| *s <= t + 1e-9).unwrap();
                    (inlet[i], outlet[i]) = (commands["inlet"][row], commands["outlet"][row]);
                }
                _ => {}
            }
        }
        let initial = if trial == "deflation" { 620.0 } else { 0.0 };
        for (name, set) in &sets {
            let rig = Chain::new(&RigParams::default(), set, 0.01, DEFAULT_STEP_S).unwrap();
            let [mut p, mut l, mut v] = [(); 3].map(|()| vec![0.0; samples]);
            let recorded = Recorded { pressure_kpa: &mut p, length_mm: &mut l, bridge_v: &mut v };
            let openings = Openings { inlet: &inlet, outlet: &outlet };
            rig.run(&mut rig.memory(), Start::Settled, 0.0, openings, initial, recorded).unwrap();
            for ((channel, scale), ours) in SCALES.into_iter().zip([&p, &l, &v]) {
                let theirs = reference
                    .get(&format!("{name}.{channel}"))
                    .unwrap_or_else(|| &reference[&format!("nominal.{channel}")]);
                let (row, error) = theirs
                    .iter()
                    .enumerate()
                    .map(|(row, x)| (row, (x - ours[5 * row]).abs() / scale))
                    .fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
                worst = worst.max(error);
                report += &format!(
                    "{name:22} {trial:10} {channel:13} {error:.1e} at {:.2} s\n",
                    0.05 * row as f64
                );
            }
        }
    }
    println!("{report}worst {worst:.1e}");
    let beyond: Vec<&str> = report
        .lines()
        .filter(|l| l.split_whitespace().nth(3).unwrap().parse::<f64>().unwrap() > RIG_CONFORMANCE)
        .collect();
    assert!(beyond.is_empty(), "{beyond:#?}");
}
