//! A prepared problem, re-tuned from other places: see [`crate::fit::starts`].

use crate::{
    fit::{
        comparison::Comparison,
        hypothesis::Hypothesis,
        prepared::{PreparedProblem, linearise},
        starts::{Places, Starts, better_start},
    },
    problem::{error::GapError, simulator::Model},
};

impl PreparedProblem<'_> {
    /// The problem re-tuned from several places, where a gap of more than `least_gap` is left: see [`crate::fit::starts`].
    pub(crate) fn begun_anew(self, least_gap: f64, seed: u64) -> Result<Self, GapError> {
        if self.gap(&self.nominal) <= least_gap {
            return Ok(self);
        }
        let (better, starts) = self.better(least_gap, &Places::Tolerances(seed))?;
        Ok(match better {
            Some(model) => self.at_model(&model, seed)?.with_starts(starts),
            None => self.with_starts(starts),
        })
    }

    /// The problem re-tuned from the parameters of a set, where that ends lower: what they do without its effects is none of the effects'.
    pub(crate) fn begun_from(
        &self,
        set: &Hypothesis,
        least_gap: f64,
        seed: u64,
    ) -> Result<Option<Self>, GapError> {
        let (better, starts) = self.better(least_gap, &Places::At(&set.model))?;
        let Some(model) = better else { return Ok(None) };
        let starts = Starts { tried: self.starts.tried + 1, ..starts };
        Ok(Some(self.at_model(&model, seed)?.with_starts(starts)))
    }

    fn better(
        &self,
        least_gap: f64,
        places: &Places<'_>,
    ) -> Result<(Option<Model>, Starts), GapError> {
        let counts = |stage| self.gap_in(&self.nominal, stage) > least_gap;
        let found = better_start(&self.compare, &self.nominal.model, counts, places)?;
        if found.0.is_none() {
            linearise(&self.compare, &self.nominal.model)?;
        }
        Ok(found)
    }

    /// The same problem around a model.
    fn at_model(&self, model: &Model, seed: u64) -> Result<Self, GapError> {
        let (runs, roles) = (self.compare.runs.clone(), self.compare.roles.clone());
        let like = Some(self.compare.metrics.as_slice());
        let compare = Comparison::around(runs, roles, model, like, seed)?;
        Self::of(compare, self.shipped.clone(), model)
    }
}
