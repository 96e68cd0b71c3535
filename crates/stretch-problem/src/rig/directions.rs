//! Finds the wrong columns of a recording in which the muscle moves against its valves, by a
//! comparison of possible errors.

use stretch_data::ends;

/// The openings of a trial, and the pressure and the length that followed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion<'a> {
    pub(super) inlet: &'a [f64],
    pub(super) outlet: &'a [f64],
    pub(super) pressure_kpa: Option<&'a [f64]>,
    pub(super) length_mm: &'a [f64],
}

/// Length of the blocks that samples are averaged over, s.
const BLOCK_S: f64 = 0.1;
/// Longest time by which commands may be shifted, s.
const FARTHEST_S: f64 = 10.0;
/// Smallest share of the sum of squares that an error must explain to be named.
const LEAST: f64 = 0.1;

/// Returns the wrong column and a hint, for measurements in which the muscle lengthens while the inlet
/// is open.
///
/// A swapped, negative or inverted length is recognised first. Otherwise the model
/// `dx/dt = a u_in (1 - x) - b u_out x` (`x` from empty to full, `u` the openings) is fitted to the
/// pressure if one was recorded, else to the length: with the valves' columns exchanged, with time
/// reversed, and with the commands shifted. The error whose fit has the smallest sum of
/// squares is reported.
/// Shifts are penalised, because a search over many shifts reduces the sum of squares by chance.
pub(super) fn against(trials: &[Motion<'_>], dt_s: f64) -> (&'static str, String) {
    let (mut with, mut seen) = (0.0, false);
    for trial in trials {
        let Some(pressure) = trial.pressure_kpa else { continue };
        seen = true;
        let valves = trial.inlet.iter().zip(trial.outlet).map(|(i, o)| i - o);
        with += valves.zip(pressure.windows(2)).map(|(u, p)| u * (p[1] - p[0])).sum::<f64>();
    }
    let length = ends(trials.iter().flat_map(|t| t.length_mm));
    let pressure = ends(trials.iter().filter_map(|t| t.pressure_kpa).flatten());
    // A length stays above half of its greatest value, a pressure falls to zero.
    let is_length = |(low, high): (f64, f64)| low > 0.5 * high;
    if seen && is_length(pressure) && !is_length(length) {
        return ("length_mm, pressure_kpa", "they look swapped: exchange the two names".into());
    }
    let is_length_wrong = seen && with > 0.0;
    if length.1 <= 0.0 && (is_length_wrong || !seen) {
        return ("length_mm", "it is below 0 throughout: its sign looks reversed".into());
    }
    if length.0 < 0.25 * length.1 && (is_length_wrong || !seen) {
        let hint = "it looks like a contraction: subtract it from the resting length";
        return ("length_mm", hint.into());
    }
    if is_length_wrong {
        let hint = "it looks upside down, because the pressure follows the valves: check the potentiometer's polarity";
        return ("length_mm", hint.into());
    }
    let unless = if seen { "" } else { ", unless length_mm is upside down" };
    match likeliest(trials, dt_s) {
        Some(Wrong::Exchanged) => {
            ("inlet, outlet", format!("they look swapped: exchange the two names{unless}"))
        }
        Some(Wrong::Reversed) => {
            ("time_s", "the recording looks reversed in time: reverse the rows of each trial".into())
        }
        Some(Wrong::Shifted(late_s)) => {
            let word = if late_s > 0.0 { "late" } else { "early" };
            let hint = format!(
                "they look {:.1} s {word} compared with the other columns: check how the recordings were aligned in time",
                late_s.abs()
            );
            ("inlet, outlet", hint)
        }
        None => (
            "inlet, outlet",
            "exchanged columns, a time shift or reversed time do not explain it: do these columns belong to one recording?"
                .into(),
        ),
    }
}

/// An error in the columns of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Wrong {
    Exchanged,
    Reversed,
    /// The commands are recorded late by this time, s.
    Shifted(f64),
}

/// A trial in blocks: the filling of the chamber, 0 to 1, and the openings.
struct Blocks {
    full: Vec<f64>,
    inlet: Vec<f64>,
    outlet: Vec<f64>,
}

fn likeliest(trials: &[Motion<'_>], dt_s: f64) -> Option<Wrong> {
    let trials = blocks(trials, dt_s);
    let steps: Vec<f64> =
        trials.iter().flat_map(|t| t.full.windows(2)).map(|x| x[1] - x[0]).collect();
    let all: f64 = steps.iter().map(|y| y * y).sum();
    let most = (FARTHEST_S / BLOCK_S) as isize;
    let shifts =
        (-most..=most).filter(|k| *k != 0).map(|k| (Wrong::Shifted(k as f64 * BLOCK_S), k));
    let ways = [(Wrong::Exchanged, 0), (Wrong::Reversed, 0)].into_iter().chain(shifts);
    let weighed = ways.map(|(wrong, shift)| {
        let left = squares(&trials, wrong, shift);
        let price = if shift == 0 { 0.0 } else { 2.0 * (2.0 * most as f64).ln() };
        (steps.len() as f64 * left.max(f64::MIN_POSITIVE).ln() + price, left, wrong)
    });
    let (_, left, wrong) = weighed.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (left < (1.0 - LEAST) * all).then_some(wrong)
}

fn blocks(trials: &[Motion<'_>], dt_s: f64) -> Vec<Blocks> {
    let length = ((BLOCK_S / dt_s).round() as usize).max(1);
    let witness = |t: &Motion<'_>| -> Vec<f64> {
        match t.pressure_kpa {
            Some(pressure) => pressure.to_vec(),
            None => t.length_mm.iter().map(|l| -l).collect(),
        }
    };
    let all: Vec<Vec<f64>> = trials.iter().map(witness).collect();
    let (low, high) = ends(all.iter().flatten());
    let mean = |values: &[f64]| -> Vec<f64> {
        values.chunks(length).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect()
    };
    let one = |(t, full): (&Motion<'_>, &Vec<f64>)| Blocks {
        full: mean(full).iter().map(|x| (x - low) / (high - low).max(f64::MIN_POSITIVE)).collect(),
        inlet: mean(t.inlet),
        outlet: mean(t.outlet),
    };
    trials.iter().zip(&all).map(one).collect()
}

/// Residual sum of squares of the steps of the filling for one error, with the best factors a and
/// b.
fn squares(trials: &[Blocks], wrong: Wrong, shift: isize) -> f64 {
    // These are the normal equations of y = a p + b q; the two unknowns have similar sizes.
    let (mut pp, mut pq, mut qq, mut py, mut qy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for trial in trials {
        let last = trial.full.len().saturating_sub(1) as isize;
        let at = |values: &[f64], j: usize| values[(j as isize + shift).clamp(0, last) as usize];
        for j in 1..trial.full.len() {
            let full = 0.5 * (trial.full[j - 1] + trial.full[j]);
            let open = |values: &[f64]| 0.5 * (at(values, j - 1) + at(values, j));
            let (mut inlet, mut outlet) = (open(&trial.inlet), open(&trial.outlet));
            let mut y = trial.full[j] - trial.full[j - 1];
            match wrong {
                Wrong::Exchanged => std::mem::swap(&mut inlet, &mut outlet),
                Wrong::Reversed => y = -y,
                Wrong::Shifted(_) => {}
            }
            let (p, q) = (inlet * (1.0 - full), -outlet * full);
            pp += p * p;
            pq += p * q;
            qq += q * q;
            py += p * y;
            qy += q * y;
            yy += y * y;
        }
    }
    let determinant = pp * qq - pq * pq;
    let (a, b) = ((py * qq - qy * pq) / determinant, (qy * pp - py * pq) / determinant);
    // Air does not flow backwards: a negative factor is taken as 0.
    let one = |py: f64, pp: f64| if py > 0.0 && pp > 0.0 { yy - py * py / pp } else { yy };
    match determinant > 0.0 && a >= 0.0 && b >= 0.0 {
        true => yy - a * py - b * qy,
        false => one(py, pp).min(one(qy, qq)),
    }
}
