//! What the fitted recordings excited, and where new ones go beyond it.

use std::ops::Range;

use serde::Serialize;
use stretch_data::ends;

use crate::black_box::{Checked, velocity::of_position};

/// How far a range may be left before it counts, as a share of the range.
const MARGIN: f64 = 0.02;
/// By how much the quickest change may be exceeded before it counts.
const FASTER: f64 = 1.05;
/// Parts of a recording that are nearer to one another than this are told as one, s.
const APART_S: f64 = 0.2;

/// In which way a channel goes beyond what was fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    /// Beyond its least or its greatest value.
    Range,
    /// Quicker than its quickest change.
    Rate,
}

/// A channel of a new recording that goes beyond what the fitted recordings excited.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unexcited {
    /// The column.
    pub column: String,
    /// In which way.
    pub outside: Outside,
    /// Least and greatest value (or rate, per second) that was fitted.
    pub fitted: [f64; 2],
    /// Least and greatest value (or rate) of the new recording.
    pub seen: [f64; 2],
    /// Share of the recording that goes beyond.
    pub share: f64,
    /// Where, from and to, s since the recording began.
    pub parts: Vec<[f64; 2]>,
}

impl Unexcited {
    /// In a sentence.
    pub fn sentence(&self) -> String {
        let [low, high] = self.fitted;
        let [least, greatest] = self.seen;
        let what = match self.outside {
            Outside::Range => "goes from",
            Outside::Rate => "changes at",
        };
        let per = if self.outside == Outside::Rate { " per second" } else { "" };
        format!(
            "{} {what} {least:.4} to {greatest:.4}{per}, fitted were {low:.4} to {high:.4}: {:.1} % of the recording lie beyond",
            self.column,
            100.0 * self.share
        )
    }
}

/// A channel over the whole session.
struct Channel<'a> {
    column: &'a str,
    values: &'a [f64],
    rates: Vec<f64>,
    /// Ranges of value and rate in the samples that were fitted.
    fitted: [[f64; 2]; 2],
}

/// Every channel of every stage.
pub(super) struct Excited<'a> {
    channels: Vec<Channel<'a>>,
    dt_s: f64,
}

impl<'a> Excited<'a> {
    pub(super) fn of(checked: &'a Checked) -> Self {
        let mut names: Vec<&str> = Vec::new();
        for stage in &checked.stages {
            for name in stage.inputs.iter().chain([&stage.output]) {
                if !names.contains(&name.as_str()) {
                    names.push(name);
                }
            }
        }
        let (columns, dt_s) = (&checked.columns, checked.session().dt_s);
        let (trials, looked) = (columns.ranges(), columns.looked_at());
        let channel = |column: &'a str| {
            let values = columns.of(column)?;
            let rates = of_position(values, &trials, dt_s);
            let of = |x: &[f64]| ends(looked.iter().flat_map(|r| &x[r.clone()])).into();
            let fitted = [of(values), of(&rates)];
            Some(Channel { column, values, rates, fitted })
        };
        Self { channels: names.into_iter().filter_map(channel).collect(), dt_s }
    }

    /// Where samples of the session go beyond what was fitted.
    pub(super) fn left(&self, samples: &Range<usize>) -> Vec<Unexcited> {
        let both = |c: &Channel<'_>| {
            [(Outside::Range, c.values), (Outside::Rate, c.rates.as_slice())].map(|(outside, x)| {
                let fitted = c.fitted[usize::from(outside == Outside::Rate)];
                self.beyond(c.column, outside, fitted, &x[samples.clone()])
            })
        };
        self.channels.iter().flat_map(both).flatten().collect()
    }

    fn beyond(
        &self,
        column: &str,
        outside: Outside,
        fitted: [f64; 2],
        x: &[f64],
    ) -> Option<Unexcited> {
        let [low, high] = match outside {
            Outside::Range => {
                let margin = MARGIN * (fitted[1] - fitted[0]);
                [fitted[0] - margin, fitted[1] + margin]
            }
            Outside::Rate => {
                let most = FASTER * fitted[0].abs().max(fitted[1].abs());
                [-most, most]
            }
        };
        let is_beyond = |x: &f64| *x < low || *x > high;
        let count = x.iter().filter(|x| is_beyond(x)).count();
        let mut parts: Vec<[f64; 2]> = Vec::new();
        for (i, _) in x.iter().enumerate().filter(|(_, x)| is_beyond(x)) {
            let t = i as f64 * self.dt_s;
            match parts.last_mut().filter(|part| t - part[1] <= APART_S) {
                Some(part) => part[1] = t,
                None => parts.push([t, t]),
            }
        }
        (count > 0).then(|| Unexcited {
            column: column.to_owned(),
            outside,
            fitted,
            seen: ends(x).into(),
            share: count as f64 / x.len() as f64,
            parts,
        })
    }
}
