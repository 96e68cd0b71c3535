//! How the output answers to each number of an effect: what a page needs to turn it without a simulator.
//!
//! One parameter at a time takes a few values around the fitted one, D(v) = output(v) - output(fitted). Between two of them the answer is
//! interpolated by a straight line, of several parameters by their sum; what is left on the test trials follows from the products of
//! the answers with each other and with what the best set leaves, x = (r - sum w D)' V^-1 (r - sum w D), and is exact wherever
//! the D are.

/// How a stage answers to the numbers of the effects that act in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Responses {
    /// The stage.
    pub stage: usize,
    /// Every number that was turned, in the order of the effects.
    pub parameters: Vec<Response>,
    /// Products under the metric of the noise, as a mean over the blocks of the test trials: what the best set leaves first, then every
    /// answer in the order of parameters and values; row by row, symmetric. The first is 1 + the excess.
    pub products: Vec<Vec<f64>>,
}

/// How a stage answers to one number of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// The effect.
    pub effect: String,
    /// Parameter of that effect.
    pub name: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Fitted value.
    pub fitted: f64,
    /// Other values, ascending, and what they change.
    pub answers: Vec<Answered>,
}

/// What one value of the parameter changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Answered {
    /// Value of the parameter.
    pub value: f64,
    /// Output less that of the fitted value, in the unit of the stage, all trials end to end.
    pub output: Vec<f64>,
    /// Change of the output in multiples of the noise, slow drift and trial offsets taken out: what the value takes from [`residual_after`](crate::StageEvidence::residual_after).
    pub residual: Vec<f64>,
}
