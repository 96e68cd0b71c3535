//! Finds the strength of an effect that causes a given excess.

use anyhow::Context;
use stretch_gap::{Options, Thresholds};
use stretch_sim::{Effect, EffectParameter};

use crate::simulated::{Protocol, Source};

/// Largest number of sessions that are simulated for one excess.
const MOST: usize = 12;
/// Largest accepted ratio between the excess and its target.
const NEAR: f64 = 1.7;
/// Smallest excess that is used for interpolation; smaller values are dominated by chance.
const LEAST: f64 = 1e-3;
/// Largest factor by which one step of the search changes the strength.
const STEP: f64 = 8.0;
/// If the ratio of two strengths is below this factor, the search between them ends, because the
/// excess jumps.
const JUMP: f64 = 1.003;
/// Largest share of the range; an effect at the end of its range would not be named.
const END: f64 = 0.8;
/// Share that is tried first.
const FIRST: f64 = 0.1;

/// A strength, as a share of the distance from the off value to the end of the range, and the
/// excess at this strength.
#[derive(Debug, Clone, Copy)]
struct Point {
    share: f64,
    excess: f64,
}

/// The strengths of an effect that were tried on one rig.
#[derive(Debug)]
pub(crate) struct Strengths {
    effect: &'static Effect,
    seed: u64,
    points: Vec<Point>,
}

impl Strengths {
    pub(crate) fn of(effect: &'static Effect, seed: u64) -> Self {
        Self { effect, seed, points: Vec::new() }
    }

    /// Returns the source whose excess on the trials of the paper is near the target `aim`, and
    /// that excess. If no strength in the range reaches the target, returns the source at the end
    /// of the range. If the excess jumps over the target, returns the source after the jump.
    pub(crate) fn near(&mut self, aim: f64) -> anyhow::Result<(Source, f64)> {
        let off_by = |p: &Point| (p.excess / aim).ln().abs();
        for step in 0..MOST {
            let nearest = self.points.iter().min_by(|a, b| off_by(a).total_cmp(&off_by(b)));
            if nearest.is_some_and(|p| off_by(p) <= NEAR.ln()) {
                break;
            }
            let Some(share) = self.next(aim, step % 2 == 1) else { break };
            let excess = self.excess(share)?;
            self.points.push(Point { share, excess });
        }
        let near = self.points.iter().filter(|p| off_by(p) <= NEAR.ln());
        let near = near.min_by(|a, b| off_by(a).total_cmp(&off_by(b)));
        let point =
            near.or(self.above(aim)).or(self.below(aim)).context("nothing was simulated")?;
        Ok((self.source(point.share), point.excess))
    }

    /// Returns the largest strength whose excess is below the target.
    fn below(&self, aim: f64) -> Option<&Point> {
        let below = self.points.iter().filter(|p| p.excess < aim);
        below.max_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// Returns the smallest strength whose excess reaches the target.
    fn above(&self, aim: f64) -> Option<&Point> {
        let above = self.points.iter().filter(|p| p.excess >= aim);
        above.min_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// Returns the next strength to try; `None` if the search has ended.
    fn next(&self, aim: f64, halves: bool) -> Option<f64> {
        match (self.below(aim), self.above(aim)) {
            (None, None) => Some(FIRST),
            (Some(a), Some(b)) if b.share < JUMP * a.share => None,
            // Bisection and linear interpolation of the logarithms alternate, because a threshold
            // bends the curve.
            (Some(a), Some(b)) if halves => Some((a.share * b.share).sqrt()),
            (Some(a), Some(b)) => {
                let way = (aim / a.excess).ln() / (b.excess / a.excess).ln();
                Some(a.share * (b.share / a.share).powf(way))
            }
            (Some(a), None) if a.share >= END => None,
            // The excess is assumed to be proportional to the square of the strength.
            (one, other) => one.or(other).map(|p| {
                let times = (aim / p.excess).sqrt().clamp(1.0 / STEP, STEP);
                (p.share * times).min(END)
            }),
        }
    }

    fn excess(&self, share: f64) -> anyhow::Result<f64> {
        // The threshold switches the verdict `unknown` off, because only the excess is needed.
        let thresholds = Thresholds { unknown_excess: f64::INFINITY, ..Thresholds::frozen() };
        let options = Options { examines_effects: false, thresholds, ..Options::default() };
        let diagnosis = self.source(share).diagnosed(Protocol::Paper, options)?;
        Ok(diagnosis.gap.retuned.max(LEAST))
    }

    fn source(&self, share: f64) -> Source {
        Source { seed: self.seed, effect: Some((self.effect, values(self.effect, share))) }
    }
}

/// Returns the values of an effect. Its last strength is at the share `share` of the distance from the off value to the
/// farther end of its range. Shapes and forms have the values at which a diagnosis starts.
fn values(effect: &'static Effect, share: f64) -> Vec<f64> {
    let last = effect.parameters.iter().rposition(|p| p.off().is_some());
    let one = |(i, p): (usize, &EffectParameter)| match p.off() {
        Some(off) if Some(i) == last => {
            let end = if p.max - off >= off - p.min { p.max } else { p.min };
            off + share * (end - off)
        }
        Some(off) => off,
        None => p.usual(),
    };
    let fitted: Vec<f64> = effect.fitted().enumerate().map(one).collect();
    effect.with_stand_ins(&fitted)
}
