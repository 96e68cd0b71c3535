//! Coefficients that vary along a tree of sensors, their wearers, and activities.
//!
//! The coefficients of a node are those of its parent plus a deviation, `w = w_parent + v`, `v ~ N(0, S_level)`. The
//! coefficients of the root have a flat prior. A leaf is a session with rows `y = X w + e`, `e ~ N(0, s^2)`. Each row
//! has the weight 1/`n`, where `n` is the number of rows within which errors are correlated. For given covariances,
//! message passing up and down the tree gives the exact posterior of each node (Pearl 1988, chapter 7). The covariances
//! maximise a posterior whose prior is inverse Wishart, with the diagonal of the estimate itself as scale. They are
//! found by expectation and maximisation (Dempster, Laird and Rubin 1977; Gelman et al., Bayesian Data Analysis, 3rd
//! ed., section 15.4).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::calibrate::linear::{inverse, symmetric};

use super::record::{list, triangle};

/// Weight of the prior of a covariance (its own diagonal), as a number of nodes per term. If there are few nodes per
/// term, the covariance is not determined without this prior.
const SHRINKAGE: f64 = 0.3;
/// Variance of each coefficient at the start, and the smallest variance, in normalised target.
const FIRST: f64 = 0.05;
const LEAST: f64 = 1e-7;
const FIRST_NOISE: f64 = 0.01;
/// Number of steps of expectation and maximisation.
const STEPS: usize = 25;

/// The sums of a session, in which each row has the weight 1/`n` (see the description of this module).
#[derive(Debug, Clone)]
pub(crate) struct Leaf {
    /// `X'X`, `X'y`, `y'y`, count.
    pub(crate) gram: DMatrix<f64>,
    pub(crate) cross: DVector<f64>,
    pub(crate) power: f64,
    pub(crate) count: f64,
}

/// A normal distribution.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Normal {
    pub(crate) mean: DVector<f64>,
    pub(crate) covariance: DMatrix<f64>,
}

/// A known path, and the distribution of its coefficients.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Known {
    pub(crate) path: Vec<String>,
    #[serde(with = "list")]
    pub(crate) mean: DVector<f64>,
    #[serde(with = "triangle")]
    pub(crate) covariance: DMatrix<f64>,
}

/// Message of a node to its parent about the parent's coefficients: `precision` is the inverse of a covariance, and
/// `pull` is the precision times the mean.
#[derive(Debug, Clone)]
struct Message {
    precision: DMatrix<f64>,
    pull: DVector<f64>,
}

impl Message {
    fn none(terms: usize) -> Self {
        Self { precision: DMatrix::zeros(terms, terms), pull: DVector::zeros(terms) }
    }

    fn add(&mut self, other: &Self, sign: f64) {
        self.precision += &other.precision * sign;
        self.pull += &other.pull * sign;
    }

    fn normal(&self) -> Option<Normal> {
        let covariance = inverse(&self.precision)?;
        Some(Normal { mean: &covariance * &self.pull, covariance })
    }
}

/// A node: its level (0 below the root), its parent, and the session of a leaf.
#[derive(Debug, Clone)]
struct Node {
    level: usize,
    parent: Option<usize>,
    leaf: Option<usize>,
    /// Steps of the path down to the node.
    path: Vec<String>,
}

/// Covariances of the levels, and the variance of a row.
#[derive(Debug, Clone)]
pub(crate) struct Spread {
    pub(crate) levels: Vec<DMatrix<f64>>,
    pub(crate) noise: f64,
}

/// The tree of sessions. A parent comes before its children.
pub(crate) struct Tree<'a> {
    nodes: Vec<Node>,
    leaves: &'a [Leaf],
    terms: usize,
}

/// The covariance of a node for a given parent, and the pull of the node's subtree.
type Local = (DMatrix<f64>, DVector<f64>);

/// Result of message passing: for each node the message from below and its posterior.
struct Passed {
    /// For each node: the inverse of the sum of the precisions of its level and of its subtree, and the pull of its
    /// subtree.
    local: Vec<Local>,
    messages: Vec<Message>,
    root: Message,
    posterior: Vec<Normal>,
    root_posterior: Normal,
}

impl<'a> Tree<'a> {
    /// Creates the tree of sessions from their paths, which all have the same depth.
    pub(crate) fn new(paths: &[Vec<String>], leaves: &'a [Leaf]) -> Self {
        let terms = leaves.first().map_or(0, |leaf| leaf.cross.len());
        let mut nodes: Vec<Node> = Vec::new();
        for (index, path) in paths.iter().enumerate() {
            let mut parent = None;
            for level in 0..path.len() {
                let own = &path[..=level];
                let found = nodes.iter().position(|n| n.leaf.is_none() && n.path == own);
                parent = Some(found.unwrap_or_else(|| {
                    nodes.push(Node { level, parent, leaf: None, path: own.to_vec() });
                    nodes.len() - 1
                }));
            }
            nodes.push(Node { level: path.len(), parent, leaf: Some(index), path: path.clone() });
        }
        Self { nodes, leaves, terms }
    }

    fn depth(&self) -> usize {
        self.nodes.iter().map(|node| node.level + 1).max().unwrap_or(1)
    }

    /// Learns the covariances.
    pub(crate) fn learn(&self) -> Option<Spread> {
        let first = DMatrix::from_diagonal_element(self.terms, self.terms, FIRST);
        let mut spread = Spread { levels: vec![first; self.depth()], noise: FIRST_NOISE };
        for _ in 0..STEPS {
            let passed = self.pass(&spread)?;
            spread = self.maximise(&spread, &passed)?;
        }
        Some(spread)
    }

    /// Passes messages up the tree, and computes the posteriors down the tree.
    fn pass(&self, spread: &Spread) -> Option<Passed> {
        let inverses: Option<Vec<_>> = spread.levels.iter().map(inverse).collect();
        let inverses = inverses?;
        let count = self.nodes.len();
        let mut below = vec![Message::none(self.terms); count];
        let mut local = vec![(DMatrix::zeros(0, 0), DVector::zeros(0)); count];
        let mut messages = vec![Message::none(0); count];
        let mut root = Message::none(self.terms);
        // Nodes of a level do not depend on one another, so each level is computed in parallel.
        for level in (0..self.depth()).rev() {
            let own: Vec<usize> = (0..count).filter(|&n| self.nodes[n].level == level).collect();
            let made: Option<Vec<_>> = own
                .par_iter()
                .map(|&n| self.message(n, &below[n], &inverses[level], spread.noise))
                .collect();
            for (&n, (inner, message)) in own.iter().zip(made?) {
                match self.nodes[n].parent {
                    Some(parent) => below[parent].add(&message, 1.0),
                    None => root.add(&message, 1.0),
                }
                local[n] = inner;
                messages[n] = message;
            }
        }
        let root_posterior = root.normal()?;
        let mut posterior: Vec<Normal> = Vec::with_capacity(count);
        for n in 0..count {
            let parent = self.nodes[n].parent.map_or(&root_posterior, |p| &posterior[p]);
            let (inner, pull) = &local[n];
            let pass_on = inner * &inverses[self.nodes[n].level];
            let mean = inner * pull + &pass_on * &parent.mean;
            let covariance = inner + &pass_on * &parent.covariance * pass_on.transpose();
            posterior.push(Normal { mean, covariance });
        }
        Some(Passed { local, messages, root, posterior, root_posterior })
    }

    /// Returns the local values of a node, and its message to its parent.
    fn message(
        &self,
        node: usize,
        below: &Message,
        inverse_level: &DMatrix<f64>,
        noise: f64,
    ) -> Option<(Local, Message)> {
        let (precision, pull) = match self.nodes[node].leaf {
            Some(leaf) => (&self.leaves[leaf].gram / noise, &self.leaves[leaf].cross / noise),
            None => (below.precision.clone(), below.pull.clone()),
        };
        let inner = inverse(&(precision + inverse_level))?;
        let pass_on = inverse_level * &inner;
        let precision = inverse_level - &pass_on * inverse_level;
        let message = Message { precision: symmetric(precision), pull: &pass_on * &pull };
        Some(((inner, pull), message))
    }

    fn maximise(&self, spread: &Spread, passed: &Passed) -> Option<Spread> {
        let inverses: Option<Vec<_>> = spread.levels.iter().map(inverse).collect();
        let inverses = inverses?;
        let deviates: Vec<DMatrix<f64>> = (0..self.nodes.len())
            .into_par_iter()
            .map(|n| {
                let node = &self.nodes[n];
                let parent = node.parent.map_or(&passed.root_posterior, |p| &passed.posterior[p]);
                let pass_on = &passed.local[n].0 * &inverses[node.level];
                let shared = pass_on * &parent.covariance;
                let off = &passed.posterior[n].mean - &parent.mean;
                &passed.posterior[n].covariance + &parent.covariance - &shared - shared.transpose()
                    + &off * off.transpose()
            })
            .collect();
        let mut levels = Vec::new();
        for level in 0..self.depth() {
            let mut sum = DMatrix::zeros(self.terms, self.terms);
            let mut count = 0.0;
            for (node, deviate) in self.nodes.iter().zip(&deviates) {
                if node.level == level {
                    sum += deviate;
                    count += 1.0;
                }
            }
            let weight = SHRINKAGE * self.terms as f64;
            let diagonal = DMatrix::from_diagonal(&(sum.diagonal() * (weight / count)));
            let least = DMatrix::from_diagonal_element(self.terms, self.terms, LEAST);
            levels.push(symmetric((sum + diagonal) / (count + weight) + least));
        }
        let (mut squares, mut count) = (0.0, 0.0);
        for (node, normal) in self.nodes.iter().zip(&passed.posterior) {
            let Some(leaf) = node.leaf.map(|leaf| &self.leaves[leaf]) else { continue };
            squares += leaf.squares(normal);
            count += leaf.count;
        }
        Some(Spread { levels, noise: (squares / f64::max(count, 1.0)).max(LEAST) })
    }

    /// Returns the posterior of every inner node with its path. The first is the posterior of the root, whose path is
    /// empty.
    pub(crate) fn known(&self, spread: &Spread) -> Option<Vec<Known>> {
        let passed = self.pass(spread)?;
        let known = |(path, Normal { mean, covariance })| Known { path, mean, covariance };
        let inner = self.nodes.iter().zip(passed.posterior).filter(|(node, _)| node.leaf.is_none());
        let inner = inner.map(|(node, normal)| (node.path.clone(), normal));
        Some([(Vec::new(), passed.root_posterior)].into_iter().chain(inner).map(known).collect())
    }

    /// Returns two predictions for each session. The first leaves out only this session; the second leaves out the
    /// whole branch of the session below the root. A prediction is `None` if no session remains.
    pub(crate) fn left_out(&self, spread: &Spread) -> Option<Vec<[Option<Normal>; 2]>> {
        let passed = self.pass(spread)?;
        let mut answers = vec![[None, None]; self.leaves.len()];
        for (n, node) in self.nodes.iter().enumerate() {
            let Some(leaf) = node.leaf else { continue };
            let mut top = n;
            while let Some(parent) = self.nodes[top].parent {
                top = parent;
            }
            let without = |node: usize, whole: &Message| {
                let mut rest = whole.clone();
                rest.add(&passed.messages[node], -1.0);
                rest.normal().filter(|n| n.covariance.diagonal().iter().all(|v| *v > 0.0))
            };
            let known = match node.parent {
                None => without(n, &passed.root),
                Some(parent) => {
                    let normal = &passed.posterior[parent];
                    let precision = inverse(&normal.covariance)?;
                    let pull = &precision * &normal.mean;
                    without(n, &Message { precision, pull })
                }
            };
            let widen = |normal: Normal, levels: &[DMatrix<f64>]| Normal {
                covariance: levels.iter().fold(normal.covariance, |sum, level| sum + level),
                ..normal
            };
            let last = &spread.levels[self.depth() - 1..];
            answers[leaf] = [
                known.map(|normal| widen(normal, last)),
                without(top, &passed.root).map(|normal| widen(normal, &spread.levels)),
            ];
        }
        Some(answers)
    }
}

impl Leaf {
    /// Returns the expected sum of squared residuals under a distribution of the coefficients.
    pub(crate) fn squares(&self, normal: &Normal) -> f64 {
        self.squares_at(&normal.mean) + self.variance(normal)
    }

    /// Returns the sum of squared residuals for these coefficients.
    pub(crate) fn squares_at(&self, w: &DVector<f64>) -> f64 {
        (self.power - 2.0 * w.dot(&self.cross) + w.dot(&(&self.gram * w))).max(0.0)
    }

    /// Returns the part of [`Leaf::squares`] that comes from the uncertainty of the coefficients.
    pub(crate) fn variance(&self, normal: &Normal) -> f64 {
        normal.covariance.component_mul(&self.gram).sum()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn deviate(random: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
    }

    /// Simulates wearers with six sessions each. The model is a straight line whose two coefficients vary.
    fn simulated(random: &mut ChaCha8Rng, wearers: usize) -> (Vec<Vec<String>>, Vec<Leaf>) {
        let (mut paths, mut leaves) = (Vec::new(), Vec::new());
        for wearer in 0..wearers {
            let own = [1.0 + 0.3 * deviate(random), -0.5 + 0.1 * deviate(random)];
            for _ in 0..6 {
                let w = [own[0] + 0.05 * deviate(random), own[1] + 0.02 * deviate(random)];
                let mut leaf = Leaf {
                    gram: DMatrix::zeros(2, 2),
                    cross: DVector::zeros(2),
                    power: 0.0,
                    count: 0.0,
                };
                for _ in 0..40 {
                    let row = DVector::from_vec(vec![1.0, 2.0 * random.random::<f64>() - 1.0]);
                    let y = row[0] * w[0] + row[1] * w[1] + 0.1 * deviate(random);
                    leaf.gram += &row * row.transpose();
                    leaf.cross += &row * y;
                    leaf.power += y * y;
                    leaf.count += 1.0;
                }
                paths.push(vec![format!("w{wearer}")]);
                leaves.push(leaf);
            }
        }
        (paths, leaves)
    }

    #[test]
    fn spreads_that_were_drawn_are_found_again() {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let (paths, leaves) = simulated(&mut random, 60);
        let spread = Tree::new(&paths, &leaves).learn().unwrap();
        let near =
            |found: f64, drawn: f64| assert!((found / drawn).ln().abs() < 0.35, "{found} {drawn}");
        near(spread.levels[0][(0, 0)].sqrt(), 0.3);
        near(spread.levels[0][(1, 1)].sqrt(), 0.1);
        near(spread.levels[1][(0, 0)].sqrt(), 0.05);
        near(spread.noise.sqrt(), 0.1);
    }

    /// If the messages from a session are left out, the result must equal that of a tree without the session.
    #[test]
    fn a_session_left_out_of_the_messages_is_one_that_was_never_there() {
        let mut random = ChaCha8Rng::seed_from_u64(12);
        let (paths, leaves) = simulated(&mut random, 5);
        let spread = Tree::new(&paths, &leaves).learn().unwrap();
        let left = Tree::new(&paths, &leaves).left_out(&spread).unwrap();
        let (rest, others) = (&paths[1..], leaves[1..].to_vec());
        let known = Tree::new(rest, &others).known(&spread).unwrap();
        let own = known.iter().find(|known| known.path == paths[0]).unwrap();
        let found = left[0][0].as_ref().unwrap();
        assert!((&found.mean - &own.mean).amax() < 1e-9);
        let wanted = &own.covariance + &spread.levels[1];
        assert!((&found.covariance - wanted).amax() < 1e-9);
        // Leave out the whole wearer.
        let (rest, others) = (&paths[6..], leaves[6..].to_vec());
        let known = Tree::new(rest, &others).known(&spread).unwrap();
        let found = left[0][1].as_ref().unwrap();
        assert!((&found.mean - &known[0].mean).amax() < 1e-9);
    }
}
