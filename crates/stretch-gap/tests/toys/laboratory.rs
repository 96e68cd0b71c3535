//! Experiments that have not been done yet, with a toy of one stage.

use super::{
    Effect, Measured,
    laws::{Plant, unit},
};
use stretch_data::{Channel, Trial};
use stretch_gap::{GapError, Laboratory, Model, Plan};

/// Returns a motion that holds the levels 0, 1/2 and 1 for 0.4 s each, in random order. On these levels, x^3 equals 1.5
/// x^2 - 0.5 x.
pub(crate) fn levels(samples: usize) -> Vec<f64> {
    let mut random = stretch_gap::RandomGenerator::new(5, 0);
    let mut level = 0.0;
    let next = |i: usize| {
        if i.is_multiple_of(40) {
            level = 0.5 * random.below(3) as f64;
        }
        level
    };
    (0..samples).map(next).collect()
}

/// An experiment that drives the first stage by x and needs `prepare_min` minutes of preparation.
fn plan(name: &str, prepare_min: f64, x: Vec<f64>) -> Plan {
    Plan { how: "Move it.".into(), prepare_min, trial: trial(name, x) }
}

fn trial(name: &str, x: Vec<f64>) -> Trial {
    let time_s = (0..x.len()).map(|i| 0.01 * i as f64).collect();
    Trial { name: name.into(), time_s, channels: vec![Channel { name: "x".into(), values: x }] }
}

impl Laboratory for Measured {
    fn experiments(&self) -> Vec<Plan> {
        let sweep: Vec<f64> = (0..3000).map(|i| (0.004 * f64::from(i)).sin()).collect();
        vec![
            plan("three levels", 0.0, levels(3000)),
            plan("rest", 0.0, vec![0.0; 3000]),
            plan("to both sides, prepared", 10.0, sweep.clone()),
            plan("to both sides", 0.0, sweep),
        ]
    }

    fn done(&self) -> Trial {
        trial("done", self.x.clone())
    }

    fn predict(&self, model: &Model, trial: &Trial) -> Result<Vec<Vec<f64>>, GapError> {
        let x = trial.channel("x").expect("a motion");
        let toy = &self.toy;
        let specs = toy.parameters.iter().zip(&model.parameters);
        let parameters: Vec<f64> = specs.map(|(p, x)| x / unit(&p.unit, toy.units)).collect();
        let effects: Vec<(Effect, &[f64])> =
            model.effects.iter().map(|(e, v)| (toy.catalogue[*e].1, v.as_slice())).collect();
        let plant = Plant {
            parameters: &parameters,
            courses: &[],
            effects: &effects,
            dt_s: toy.dt_s,
            step_s: toy.step_s,
            start_s: 0.0,
        };
        let mut out = vec![0.0; x.len()];
        plant.run(toy.laws[0], x, &mut out);
        out.iter_mut().for_each(|y| *y /= toy.noise);
        Ok(vec![out])
    }
}
