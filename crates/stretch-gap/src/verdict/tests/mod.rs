//! Tests of which effects are named, and of the description in words.

mod judge;
mod naming;
mod sentence;

use crate::{
    evidence::gathered::Evidence,
    toys::{Effect, Law, Measured, Toy},
    verdict::diagnosis::Diagnosis,
};

/// Returns a simulator of a line followed by a lag, with its diagnosis and evidence. Most of the
/// gap is in the lag.
fn line_and_lag() -> (Measured, Diagnosis, Evidence) {
    let toy = Toy { trials: vec![(600, false), (400, true)], ..Toy::of(&[Law::Line, Law::Lag]) };
    let measured = toy.may_lack(&[Effect::Quadratic]).measured(1);
    let (diagnosis, mut evidence) = measured.diagnosed();
    for (stage, excess) in evidence.stages.iter_mut().zip([0.5, 7.0]) {
        (stage.excess_retuned, stage.excess_after) = (excess, excess);
    }
    (measured, diagnosis, evidence)
}
