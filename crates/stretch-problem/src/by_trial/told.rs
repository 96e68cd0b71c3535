//! The values of a fit in the words of a report.

use serde::Serialize;

use super::{fit::Fit, unknowns::Unknowns};

/// Whether data tell a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// To a third of its tolerance, or an effect's value to half of itself.
    Identified,
    /// It would be, if others were known that act as it does.
    Absorbed,
    /// The data say little more than was known before.
    Free,
}

/// A value with its 95 % interval, and whether the data tell it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FittedValue {
    /// Name: of a nominal parameter, or `effect.parameter`.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// The value.
    pub value: f64,
    /// One standard deviation, errors that are left and their correlation in time taken into account.
    pub sd: f64,
    /// 95 % interval, within the range that was searched.
    pub interval: [f64; 2],
    /// Whether the data tell it.
    pub standing: Standing,
    /// Names of the values that absorb it; empty unless its standing is `absorbed`.
    pub absorbed_by: Vec<String>,
}

/// Share of its tolerance to which a parameter is known where data tell it, and of itself to which an effect's value is.
const KNOWN: [f64; 2] = [1.0 / 3.0, 0.5];
/// By how much others blur a value that they absorb, and how alike the errors of both are.
const BLURRED: f64 = 2.0;
const ALIKE: f64 = 0.5;
/// Most names of what absorbs a value.
const ABSORBERS: usize = 3;

/// Every value of a fit.
pub(super) fn values(unknowns: &Unknowns, fit: &Fit) -> Vec<FittedValue> {
    (0..unknowns.len()).map(|i| value(unknowns, fit, i)).collect()
}

fn value(unknowns: &Unknowns, fit: &Fit, i: usize) -> FittedValue {
    let x_sd = fit.sd(i);
    let (value, sd) = unknowns.at(i, fit.at[i], x_sd);
    let is_known = match unknowns.is_parameter(i) {
        true => x_sd <= KNOWN[0],
        false => sd <= KNOWN[1] * value.abs(),
    };
    let like = like(unknowns, fit, i);
    let standing = match (is_known, like.is_empty()) {
        (true, _) => Standing::Identified,
        (false, false) => Standing::Absorbed,
        (false, true) => Standing::Free,
    };
    FittedValue {
        name: unknowns.name(i).to_owned(),
        unit: unknowns.unit(i).to_owned(),
        value,
        sd,
        interval: [-COVERS, COVERS].map(|k| unknowns.at(i, fit.at[i] + k * x_sd, 0.0).0),
        standing,
        absorbed_by: if standing == Standing::Absorbed { like } else { Vec::new() },
    }
}

/// Names of the values that blur another one, the most alike first.
fn like(unknowns: &Unknowns, fit: &Fit, i: usize) -> Vec<String> {
    if fit.sd(i) < BLURRED * fit.sd_alone(i) {
        return Vec::new();
    }
    let others = (0..unknowns.len()).filter(|j| *j != i);
    let mut others: Vec<(f64, usize)> = others.map(|j| (fit.correlation(i, j).abs(), j)).collect();
    others.retain(|(correlation, _)| *correlation >= ALIKE);
    others.sort_by(|a, b| b.0.total_cmp(&a.0));
    others.iter().take(ABSORBERS).map(|(_, j)| unknowns.name(*j).to_owned()).collect()
}

/// Standard deviations to either side that hold 95 % of a Gaussian.
const COVERS: f64 = 1.96;
