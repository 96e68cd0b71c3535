//! Draws one case of a plant: parameters, effects with strengths and forms, inputs and noise.

use super::{
    label::{FormFamily, Level, OpenLabel},
    plant::{Act, Candidate, Drive, Grid, PlantSpec},
};
use crate::random::RandomGenerator;

/// Number of trials of a case, and of those for fitting. The last two trials are for testing.
pub(super) const TRIALS: usize = 6;
pub(super) const FIT_TRIALS: usize = 4;

/// Both outputs of a trial.
type Outputs = [Vec<f64>; 2];

/// A case: its trials as recorded, and its label.
#[derive(Debug)]
pub(super) struct Drawn {
    pub(super) drives: Vec<Drive>,
    /// Both outputs of every trial.
    pub(super) outputs: Vec<Outputs>,
    pub(super) label: OpenLabel,
}

/// Draws a case. Its level and effects alternate with its number.
pub(super) fn draw(
    plant: &'static PlantSpec,
    seed: u64,
    number: usize,
    families: &[FormFamily],
) -> Drawn {
    let mut random = RandomGenerator::new(seed, 1000 + number as u64);
    let level = Level::ALL[number % Level::ALL.len()];
    let turn = RandomGenerator::new(seed, 2).below(100) + number / Level::ALL.len();
    let family = &families[random.below(families.len())];
    let drives = drives(plant, &mut random);
    let p = parameters(plant, level, &mut random);
    let chosen = chosen(plant, level, turn, &mut random);
    let mut acts: Vec<Act> = Vec::new();
    for candidate in chosen {
        let (least, most): (f64, f64) =
            if level == Level::Faint { (0.1, 1.0) } else { (3.0, 100.0) };
        let form =
            if level == Level::Foreign { Default::default() } else { family.form(&mut random) };
        let target = random.log_between(least, most);
        let act = Act { candidate, strength: 0.0, form };
        acts.push(at_excess(plant, &p, act, &drives, target));
    }
    let colour = random.between(family.colour.0, family.colour.1);
    let clean: Vec<Outputs> = drives
        .iter()
        .map(|drive| {
            let first = plant.stage(0, &p, &acts, drive);
            let second = Drive { input: first.clone(), grid: drive.grid };
            let second = plant.stage(1, &p, &acts, &second);
            [first, second]
        })
        .collect();
    let mut outputs = clean.clone();
    for trial in &mut outputs {
        for (stage, out) in trial.iter_mut().enumerate() {
            add_noise(out, plant.stages[stage].noise, colour, &mut random);
        }
    }
    let label = label(plant, level, family, &p, &acts, &drives, (&clean, &outputs));
    Drawn { drives, outputs, label }
}

fn label(
    plant: &PlantSpec,
    level: Level,
    family: &FormFamily,
    p: &[f64],
    acts: &[Act],
    drives: &[Drive],
    (clean, outputs): (&[Outputs], &[Outputs]),
) -> OpenLabel {
    let excess = excess(plant, p, acts, &drives[..FIT_TRIALS]);
    let (mut square, mut samples) = (0.0, 0);
    for (trial, truth) in outputs.iter().zip(clean).skip(FIT_TRIALS) {
        for stage in 0..2 {
            let noise = plant.stages[stage].noise;
            let pairs = trial[stage].iter().zip(&truth[stage]);
            square += pairs.map(|(a, b)| ((a - b) / noise).powi(2)).sum::<f64>();
            samples += trial[stage].len();
        }
    }
    let rest = (2.0 * (square / samples as f64 - 1.0)).max(0.0);
    let names = |f: fn(&Candidate) -> String| acts.iter().map(|a| f(a.candidate)).collect();
    OpenLabel {
        level,
        effects: names(|c| c.name.to_owned()),
        places: acts.iter().map(|a| plant.stages[a.candidate.stage].name.to_owned()).collect(),
        excess,
        oracle_closed: if excess > 0.0 { (1.0 - rest / excess).max(0.0) } else { 0.0 },
        family: family.name.clone(),
        strengths: acts.iter().map(|a| a.strength).collect(),
        forms: acts.iter().map(|a| a.form).collect(),
        parameters: plant
            .parameters
            .iter()
            .map(|q| q.name.to_owned())
            .zip(p.iter().copied())
            .collect(),
    }
}

fn chosen(
    plant: &'static PlantSpec,
    level: Level,
    turn: usize,
    random: &mut RandomGenerator,
) -> Vec<&'static Candidate> {
    let all = plant.candidates;
    let first = turn % all.len();
    match level {
        Level::Strong | Level::Faint => vec![&all[first]],
        Level::Two => {
            let other = (first + 1 + random.below(all.len() - 1)) % all.len();
            vec![&all[first.min(other)], &all[first.max(other)]]
        }
        Level::Nothing => Vec::new(),
        Level::Foreign => vec![&plant.foreign[turn % plant.foreign.len()]],
    }
}

/// Draws the parameters within their tolerances. In half of the cases without an effect, they have
/// their nominal values.
fn parameters(plant: &PlantSpec, level: Level, random: &mut RandomGenerator) -> Vec<f64> {
    let moves = level != Level::Nothing || random.below(2) == 1;
    let scale = if moves { 0.7 } else { 0.0 };
    let parameters = plant.parameters.iter();
    parameters
        .map(|p| p.value * (1.0 + scale * p.tolerance * random.gauss().clamp(-2.0, 2.0)))
        .collect()
}

/// Finds by bisection the strength at which the effect alone has the excess `target`; the largest
/// strength if no strength reaches it.
fn at_excess(plant: &PlantSpec, p: &[f64], act: Act, drives: &[Drive], target: f64) -> Act {
    let (off, most) = act.candidate.range;
    let with = |share: f64| Act { strength: off + (most - off) * share, ..act };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..18 {
        let middle = 0.5 * (low + high);
        if excess(plant, p, &[with(middle)], &drives[..FIT_TRIALS]) < target {
            low = middle;
        } else {
            high = middle;
        }
    }
    with(high)
}

/// Draws the inputs of the trials over the span of the input: random steps, a sum of sines, and a triangle. Trials have
/// 70 % to 100 % of the greatest length.
fn drives(plant: &PlantSpec, random: &mut RandomGenerator) -> Vec<Drive> {
    let inputs: Vec<Vec<f64>> = (0..TRIALS).map(|trial| input(plant, trial, random)).collect();
    let total: usize = inputs.iter().map(Vec::len).sum();
    let mut before = 0;
    inputs
        .into_iter()
        .map(|input| {
            let (start, step) = (before as f64 / total as f64, 1.0 / total as f64);
            before += input.len();
            Drive { input, grid: Grid { dt_s: plant.dt_s, start, step } }
        })
        .collect()
}

fn input(plant: &PlantSpec, trial: usize, random: &mut RandomGenerator) -> Vec<f64> {
    let samples = (plant.samples as f64 * random.between(0.7, 1.0)) as usize;
    let (low, high) = plant.span;
    let at = |share: f64| low + (high - low) * share.clamp(0.0, 1.0);
    let share = |random: &mut RandomGenerator| random.unit();
    let tau = std::f64::consts::TAU;
    match trial % 3 {
        0 => {
            let mut level = share(random);
            (0..samples)
                .map(|i| {
                    if i % (samples / 12) == 0 {
                        level = share(random);
                    }
                    at(level)
                })
                .collect()
        }
        1 => {
            let waves: Vec<(f64, f64)> = (1..=4)
                .map(|k| (f64::from(k) * random.between(0.6, 1.4), tau * share(random)))
                .collect();
            let value = |t: f64| waves.iter().map(|(f, o)| (tau * f * t + o).sin()).sum::<f64>();
            (0..samples).map(|i| at(0.5 + 0.22 * value(i as f64 / samples as f64))).collect()
        }
        _ => {
            let turns = 2 + random.below(3);
            let top = random.between(0.7, 1.0);
            let phase = |i: usize| (turns * i) as f64 / samples as f64;
            (0..samples)
                .map(|i| at(0.5 + top * ((phase(i).fract() - 0.5).abs() * 2.0 - 0.5)))
                .collect()
        }
    }
}

/// Adds noise of a standard deviation; `colour` is its correlation from sample to sample.
fn add_noise(out: &mut [f64], noise: f64, colour: f64, random: &mut RandomGenerator) {
    let fresh = (1.0 - colour * colour).sqrt();
    let mut e = random.gauss();
    for value in out {
        *value += noise * e;
        e = colour * e + fresh * random.gauss();
    }
}

/// Returns the excess (reduced chi-square minus one) that the re-tuned nominal simulator leaves,
/// summed over both stages. For each stage it is the minimum over q of |d - S q|^2/n + |q|^2/n. d
/// is the noise-free difference of the outputs in multiples of the noise, over all trials. S holds
/// the sensitivities of the output to the parameters, per tolerance.
fn excess(plant: &PlantSpec, p: &[f64], acts: &[Act], drives: &[Drive]) -> f64 {
    (0..2).map(|stage| in_stage(plant, stage, p, acts, drives)).sum()
}

fn in_stage(plant: &PlantSpec, stage: usize, p: &[f64], acts: &[Act], drives: &[Drive]) -> f64 {
    if acts.iter().all(|act| act.candidate.stage != stage) {
        return 0.0;
    }
    let driven: Vec<Drive> = drives
        .iter()
        .map(|drive| match stage {
            0 => drive.clone(),
            _ => Drive { input: plant.stage(0, p, acts, drive), grid: drive.grid },
        })
        .collect();
    let run = |p: &[f64], acts: &[Act]| -> Vec<f64> {
        let noise = plant.stages[stage].noise;
        let outs = driven.iter().flat_map(|drive| plant.stage(stage, p, acts, drive));
        outs.map(|y| y / noise).collect()
    };
    let plain = run(p, &[]);
    let gap: Vec<f64> = run(p, acts).iter().zip(&plain).map(|(a, b)| a - b).collect();
    let mut slopes = Vec::new();
    for (i, parameter) in plant.parameters.iter().enumerate().filter(|(_, p)| p.stage == stage) {
        let mut moved = p.to_vec();
        moved[i] += 0.1 * parameter.tolerance * parameter.value;
        slopes.push(
            run(&moved, &[]).iter().zip(&plain).map(|(a, b)| 10.0 * (a - b)).collect::<Vec<_>>(),
        );
    }
    left(&gap, &slopes) / gap.len() as f64
}

/// Returns the minimum of |d - S q|^2 + |q|^2, by the Gram-Schmidt process on the columns of S,
/// extended by the identity matrix of the prior.
fn left(gap: &[f64], slopes: &[Vec<f64>]) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut rest = gap.to_vec();
    rest.resize(gap.len() + slopes.len(), 0.0);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for (i, slope) in slopes.iter().enumerate() {
        let mut column = slope.clone();
        column.resize(rest.len(), 0.0);
        column[gap.len() + i] = 1.0;
        for other in &basis {
            let along = dot(&column, other);
            column.iter_mut().zip(other).for_each(|(c, o)| *c -= along * o);
        }
        let length = dot(&column, &column).sqrt();
        column.iter_mut().for_each(|c| *c /= length);
        let along = dot(&rest, &column);
        rest.iter_mut().zip(&column).for_each(|(r, c)| *r -= along * c);
        basis.push(column);
    }
    dot(&rest, &rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_parameters_absorb_is_no_excess() {
        let slope: Vec<f64> = (0..50).map(|i| 10.0 * f64::from(i)).collect();
        let other: Vec<f64> = (0..50).map(|i| f64::from(i % 2)).collect();
        let along: Vec<f64> = slope.iter().map(|s| 0.5 * s).collect();
        // the shift of half a tolerance costs 0.5^2
        assert!((left(&along, std::slice::from_ref(&slope)) - 0.25).abs() < 1e-3);
        let both: Vec<f64> = along.iter().zip(&other).map(|(a, b)| a + b).collect();
        assert!(left(&both, &[slope]) > 5.0);
    }
}
