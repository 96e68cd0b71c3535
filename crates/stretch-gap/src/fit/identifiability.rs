//! Determines which nominal parameters the data determine.
//!
//! A fit of the nominal parameters, in units of their tolerances, has the normal matrix N = D + I,
//! where D is the information of the data and I that of the prior. Then
//!
//! ```text
//! sd_i = sqrt((N^-1)_ii),     alone_i = 1/sqrt(D_ii + 1),     like_ij = D_ij/sqrt(D_ii D_jj)
//! ```
//!
//! sd_i is the posterior standard deviation of parameter i. alone_i is its standard deviation if
//! all other parameters were known. like_ij tells how alike parameters i and j act: 1 or -1 if they
//! change the outputs in proportion. Without data, sd_i is 1. A parameter with D_ii = 0 has no
//! effect on the outputs. The terms are those of Raue et al. (2009, doi
//! 10.1093/bioinformatics/btp358).

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    numerics::linear::Cholesky,
    problem::{simulator::Model, spec::ParameterSpec},
};

/// A parameter is determined if its standard deviation is at most the share [`DETERMINED`] of its
/// tolerance, and weakly determined if it is at most the share [`WEAKLY`].
const DETERMINED: f64 = 1.0 / 3.0;
const WEAKLY: f64 = 0.9;
/// Information D_ii below which a parameter has no visible effect.
const DEAD: f64 = 1e-6;
/// Two parameters act alike if the absolute value of like_ij exceeds [`ALIKE`]. A parameter is
/// blurred by others if `sd` is more than [`BLURRED`] times `sd_alone`.
const ALIKE: f64 = 0.98;
const BLURRED: f64 = 2.0;
/// A parameter is at a bound if it has gone this share of the way from its nominal value to the
/// bound.
const AT_BOUND: f64 = 0.995;

/// How well a parameter is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Knowledge {
    /// The standard deviation of the parameter is at most a third of its tolerance.
    Determined,
    /// The standard deviation of the parameter is at most 0.9 of its tolerance.
    Weakly,
    /// The standard deviation of the parameter is larger: the data add almost nothing to its
    /// tolerance.
    Not,
    /// The parameter does not change any measured output.
    Dead,
}

/// Information of the data about one nominal parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identified {
    /// Name of the parameter.
    pub name: String,
    /// Unit of the parameter.
    pub unit: String,
    /// How well the data determine the parameter.
    pub knowledge: Knowledge,
    /// Tolerance of the parameter, one standard deviation.
    pub tolerance: f64,
    /// Standard deviation of the parameter given the data, re-tuned without effects.
    pub sd: f64,
    /// Standard deviation that the parameter would have if all others were known.
    pub sd_alone: f64,
    /// Parameters that change the outputs in the same proportion as this one; the data determine
    /// only a combination of them.
    pub like: Vec<String>,
    /// Whether the re-tuned value is at the end of its tolerances or of its range.
    pub at_bound: bool,
}

impl Identified {
    /// One sentence; `None` for a parameter that is determined and within its bounds.
    ///
    /// ```
    /// use stretch_gap::{Identified, Knowledge};
    /// let gear = Identified {
    ///     name: "gear".into(),
    ///     unit: "1".into(),
    ///     knowledge: Knowledge::Dead,
    ///     tolerance: 0.1,
    ///     sd: 0.1,
    ///     sd_alone: 0.1,
    ///     like: vec![],
    ///     at_bound: false,
    /// };
    /// assert_eq!(gear.sentence().unwrap(), "gear has no influence in these data: the simulation ignores it, or nothing excites it");
    /// ```
    pub fn sentence(&self) -> Option<String> {
        let name = &self.name;
        let sd = 100.0 * self.sd / self.tolerance;
        let mut said = match self.knowledge {
            Knowledge::Dead => {
                return Some(format!(
                    "{name} has no influence in these data: the simulation ignores it, or nothing excites it"
                ));
            }
            _ if !self.like.is_empty() => {
                format!(
                    "{name} cannot be distinguished from {}: they have the same influence",
                    self.like.join(", ")
                )
            }
            Knowledge::Not => {
                format!("{name} is not determined: its uncertainty is {sd:.0} % of its tolerance")
            }
            Knowledge::Weakly => {
                format!(
                    "{name} is weakly determined: its uncertainty is {sd:.0} % of its tolerance"
                )
            }
            Knowledge::Determined if !self.at_bound => return None,
            Knowledge::Determined => String::new(),
        };
        if self.at_bound {
            let at = "at the limit of what its tolerance allows";
            said = match said.is_empty() {
                true => format!("{name} is {at}"),
                false => format!("{said}; it is {at}"),
            };
        }
        Some(said)
    }
}

/// Information of a fit about the nominal parameters that it moved: the indices of these
/// parameters, and N of the module documentation.
pub(crate) type Information = (Vec<usize>, DMatrix<f64>);

/// Returns how well some fits determine every parameter with a tolerance, in the order of the
/// simulator.
pub(crate) fn identified(
    specs: &[ParameterSpec],
    retuned: &Model,
    fits: &[Information],
) -> Vec<Identified> {
    let mut all: Vec<(usize, Identified)> = Vec::new();
    for (indices, normal) in fits {
        let n = indices.len();
        let covariance = Cholesky::of(normal.clone()).inverse();
        let data = |i: usize, j: usize| normal[(i, j)] - f64::from(u8::from(i == j));
        for (i, &p) in indices.iter().enumerate() {
            let spec = &specs[p];
            let own = data(i, i).max(0.0);
            let (sd, alone) = (covariance[(i, i)].max(0.0).sqrt(), 1.0 / (own + 1.0).sqrt());
            let is_like = |j: &usize| {
                let size = (own * data(*j, *j).max(0.0)).sqrt();
                *j != i && size > DEAD && (data(i, *j) / size).abs() > ALIKE
            };
            let is_blurred = sd > BLURRED * alone;
            let like = (0..n).filter(|_| is_blurred).filter(is_like);
            let like = like.map(|j| specs[indices[j]].name.clone()).collect();
            let knowledge = match sd {
                _ if own < DEAD => Knowledge::Dead,
                sd if sd <= DETERMINED => Knowledge::Determined,
                sd if sd <= WEAKLY => Knowledge::Weakly,
                _ => Knowledge::Not,
            };
            all.push((
                p,
                Identified {
                    name: spec.name.clone(),
                    unit: spec.unit.clone(),
                    knowledge,
                    tolerance: spec.sd,
                    sd: sd * spec.sd,
                    sd_alone: alone * spec.sd,
                    like,
                    at_bound: is_at_bound(spec, retuned.parameters[p]),
                },
            ));
        }
    }
    all.sort_by_key(|(p, _)| *p);
    all.into_iter().map(|(_, one)| one).collect()
}

fn is_at_bound(spec: &ParameterSpec, value: f64) -> bool {
    let [low, high] = spec.reach();
    // A parameter whose nominal value is one of its bounds (for example no friction) may stay there
    // without being reported as at a bound.
    let near =
        |end: f64| end != spec.nominal && (value - spec.nominal) / (end - spec.nominal) > AT_BOUND;
    near(low) || near(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dead_one_and_two_that_do_the_same_are_told() {
        let spec = |name: &str| ParameterSpec::new(name, "1", 1.0).within(0.1);
        let specs = [spec("a"), spec("b"), spec("c"), spec("d")];
        // Parameters a and b act alike, c does nothing, d is known well.
        let data =
            [[400.0, 399.9, 0.0, 0.0], [399.9, 400.0, 0.0, 0.0], [0.0; 4], [0.0, 0.0, 0.0, 1e4]];
        let normal = DMatrix::from_fn(4, 4, |i, j| data[i][j] + f64::from(u8::from(i == j)));
        let at = Model { parameters: vec![1.0, 1.0, 1.0, 1.3], effects: vec![] };
        let all = identified(&specs, &at, &[(vec![0, 1, 2, 3], normal)]);
        assert_eq!(
            (all[0].like.as_slice(), all[1].like.as_slice()),
            (&["b".to_owned()][..], &["a".to_owned()][..])
        );
        assert_eq!(all[2].knowledge, Knowledge::Dead);
        assert_eq!(all[3].knowledge, Knowledge::Determined);
        assert!(all[3].at_bound && !all[0].at_bound);
        assert!((all[3].sd - 0.1 / 10001.0_f64.sqrt()).abs() < 1e-9);
    }
}
