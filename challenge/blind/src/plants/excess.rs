//! Visibility of an effect once the nominal parameters are re-tuned, to first order.

use super::plant::{Act, Drive, PlantSpec};

/// Reduced chi-square minus one that the re-tuned nominal simulator keeps of the noise-free
/// difference, the sum of both stages over all trials: the minimum over q of |d - S q|^2/n +
/// |q|^2/n, where d is the difference in units of the noise and S are its slopes per tolerance.
pub(super) fn excess(plant: &PlantSpec, p: &[f64], acts: &[Act], drives: &[Drive]) -> f64 {
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
            _ => Drive { input: plant.stage(0, p, acts, drive), ..drive.clone() },
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

/// The minimum of |d - S q|^2 + |q|^2, by Gram and Schmidt on the columns of S with the rows of the
/// prior below them.
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
    use super::left;

    #[test]
    fn what_parameters_absorb_is_no_excess() {
        let slope: Vec<f64> = (0..50).map(|i| 10.0 * f64::from(i)).collect();
        let other: Vec<f64> = (0..50).map(|i| f64::from(i % 2)).collect();
        let along: Vec<f64> = slope.iter().map(|s| 0.5 * s).collect();
        // the prior costs half a tolerance squared
        assert!((left(&along, std::slice::from_ref(&slope)) - 0.25).abs() < 1e-3);
        let both: Vec<f64> = along.iter().zip(&other).map(|(a, b)| a + b).collect();
        assert!(left(&both, &[slope]) > 5.0);
    }
}
