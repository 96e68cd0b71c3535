//! What simpler methods say of the same data: what is gained by the longer way shows beside them.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::{
    altered::Altered,
    diagnosis::Baselines,
    error::GapError,
    fit::{Bench, COARSE, Misfit},
    floor::Floor,
    frame::{Metric, Role},
    screen::Ground,
    select::{Solution, possible},
    simulator::{Model, Simulator},
    spec::ParameterSpec,
};

/// Single effects that an information criterion is asked about: the best of the screen.
const KEPT: usize = 8;
/// A correlation that noise alone hardly ever reaches, in its standard deviations, samples counted as independent.
const FAR: f64 = 4.0;
/// Starts that are fitted.
const STARTS: usize = 2;

/// Three methods that leave out one step each.
pub(crate) fn baselines(
    bench: &Bench<'_>,
    floors: &[Floor],
    nominal: &Solution,
    tried: &BTreeMap<Vec<usize>, Solution>,
    null_excess: f64,
) -> Result<Baselines, GapError> {
    let name = |effect: Option<usize>| effect.map(|e| bench.simulator.effects()[e].name.clone());
    let ground = Ground::around(bench, nominal.model.clone())?;
    Ok(Baselines {
        largest_drop: name(largest_drop(bench, floors, null_excess)?),
        signature: name(signature(bench, &ground)?),
        bic: name(criterion(bench, &ground, nominal, tried)?),
    })
}

/// The effect whose own parameters, fitted alone, take most from the mean square error in floors, all parameters of the
/// simulator left as shipped; none where that is less than what counts as a gap.
fn largest_drop(
    bench: &Bench<'_>,
    floors: &[Floor],
    null_excess: f64,
) -> Result<Option<usize>, GapError> {
    // Nothing is re-tuned, nothing wanders.
    let frozen = Altered::of(bench.simulator, |_, p| ParameterSpec {
        sd: 0.0,
        wander: None,
        per_trial_sd: None,
        ..p.clone()
    });
    let shipped = Model::nominal(&frozen);
    let all = frozen.trials().len();
    let metrics: Result<Vec<Metric>, GapError> = floors
        .iter()
        .enumerate()
        .map(|(s, floor)| Metric::of(&frozen, &bench.frame, s, floor, &shipped, all))
        .collect();
    let rigid = bench.beside(&frozen, metrics?);
    let ground = Ground::around(&rigid, shipped)?;
    let before: Vec<Misfit> =
        ground.residuals.iter().enumerate().map(|(s, r)| rigid.misfit(s, r)).collect();
    let drops = each_effect(&rigid, |effect| {
        let mut most = 0.0_f64;
        for misfits in rigid.fits(&ground, effect)? {
            let drop = |m: &Misfit| rigid.mean_square(&before[m.stage]) - rigid.mean_square(m);
            most = most.max(misfits.iter().map(drop).sum());
        }
        Ok(most)
    })?;
    Ok(best(drops).filter(|(_, drop)| *drop > null_excess).map(|(effect, _)| effect))
}

/// The effect whose change, taken once, correlates best with what the re-tuned simulator leaves, all that its
/// parameters can do taken out of both; none where noise could do as well.
fn signature(bench: &Bench<'_>, ground: &Ground) -> Result<Option<usize>, GapError> {
    let likeness = each_effect(bench, |effect| {
        let spec = &bench.simulator.effects()[effect];
        let mut most = 0.0_f64;
        for values in &spec.starts {
            if let Some((own, mixed)) = bench.change(ground, effect, values)? {
                most = most.max(mixed.abs() / own.sqrt());
            }
        }
        Ok(most)
    })?;
    let stages = ground.residuals.iter().enumerate();
    let (squares, count) = stages.fold((0.0, 0.0), |(squares, count), (s, residual)| {
        let own = bench.metrics[s].product(&bench.frame, residual, residual, Role::Fit);
        (squares + own, count + bench.frame.count(Role::Fit) as f64)
    });
    // Correlation r = product / sqrt(own squares); its standard deviation without a likeness is 1 / sqrt(count).
    let least = FAR * (squares / f64::max(count, 1.0)).sqrt();
    Ok(best(likeness).filter(|(_, product)| *product > least).map(|(effect, _)| effect))
}

/// The single effect, fitted together with all parameters, with the lowest BIC = n ln(mean square) + k ln(n), every
/// sample counted as independent; none where no effect has the lowest (Schwarz 1978, doi 10.1214/aos/1176344136).
fn criterion(
    bench: &Bench<'_>,
    ground: &Ground,
    nominal: &Solution,
    tried: &BTreeMap<Vec<usize>, Solution>,
) -> Result<Option<usize>, GapError> {
    let gains = each_effect(bench, |effect| Ok(bench.screen(ground, effect)?.gain()))?;
    let mut order: Vec<usize> = (0..gains.len()).collect();
    order.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
    let samples = bench.frame.count(Role::Fit) as f64;
    let falls = each_effect(bench, |effect| {
        if !order[..KEPT.min(order.len())].contains(&effect) {
            return Ok(0.0);
        }
        let spec = &bench.simulator.effects()[effect];
        let free = spec.parameters.iter().filter(|p| p.is_fitted && p.form.is_none()).count();
        let all = samples * nominal.misfits.len() as f64;
        let fall = |misfits: &[Misfit]| {
            let gain = |m: &Misfit| samples * (nominal.misfits[m.stage].fit / m.fit).ln();
            misfits.iter().map(gain).sum::<f64>() - free as f64 * all.ln()
        };
        let known = tried.get(&vec![effect]).map(|solution| vec![solution.misfits.clone()]);
        let fitted = match known {
            Some(known) => known,
            None => bench.fits(ground, effect)?,
        };
        Ok(fitted.iter().map(|m| fall(m)).fold(0.0, f64::max))
    })?;
    Ok(best(falls).map(|(effect, _)| effect))
}

/// A number for every effect.
fn each_effect(
    bench: &Bench<'_>,
    of: impl Fn(usize) -> Result<f64, GapError> + Sync + Send,
) -> Result<Vec<f64>, GapError> {
    (0..bench.simulator.effects().len()).into_par_iter().map(of).collect()
}

/// The effect with the greatest number above 0.
fn best(numbers: Vec<f64>) -> Option<(usize, f64)> {
    let above = numbers.into_iter().enumerate().filter(|(_, x)| *x > 0.0);
    above.max_by(|a, b| a.1.total_cmp(&b.1))
}

impl Bench<'_> {
    /// What is left in the stages that an effect touches when it is fitted on top of a ground, from its best starts.
    fn fits(&self, ground: &Ground, effect: usize) -> Result<Vec<Vec<Misfit>>, GapError> {
        let mut starts = self.screen(ground, effect)?.starts;
        starts.truncate(STARTS);
        possible(starts.into_par_iter().map(|(values, _)| {
            let mut model = ground.model.clone();
            model.effects.push((effect, values));
            let touched = &self.simulator.effects()[effect].touches;
            Ok(self.fit(touched, model, &ground.known, COARSE)?.misfits)
        }))
    }
}
