//! The values of a channel in bounded memory: clusters, and the widest holes between them.

/// Values from `low` to `high`. The holes between these values are narrower than the holes between clusters.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cluster {
    low: f64,
    high: f64,
    count: u64,
}

/// The values so far, sorted into at most `MOST` clusters. Each gross error takes a cluster, and the widest holes
/// among the usual values separate further clusters. Where there are more than `MOST` clusters the narrowest hole is
/// closed, so that wide holes remain.
#[derive(Debug, Clone)]
pub(crate) struct Clusters<const MOST: usize = 1024> {
    all: Vec<Cluster>,
    count: u64,
}

impl<const MOST: usize> Default for Clusters<MOST> {
    fn default() -> Self {
        Self { all: Vec::new(), count: 0 }
    }
}

impl<const MOST: usize> Clusters<MOST> {
    /// Takes a value in; a value that is not finite is passed over.
    pub(crate) fn take(&mut self, x: f64) {
        if !x.is_finite() {
            return;
        }
        self.count += 1;
        let next = self.all.partition_point(|c| c.low <= x);
        if let Some(own) = next.checked_sub(1).map(|i| &mut self.all[i])
            && x <= own.high
        {
            own.count += 1;
            return;
        }
        self.all.insert(next, Cluster { low: x, high: x, count: 1 });
        if self.all.len() > MOST {
            self.close();
        }
    }

    /// How many values were taken in.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Closes the narrowest hole.
    fn close(&mut self) {
        let hole = |i: &usize| self.all[i + 1].low - self.all[*i].high;
        let narrowest = (0..self.all.len() - 1).min_by(|a, b| hole(a).total_cmp(&hole(b)));
        let Some(i) = narrowest else { return };
        let Cluster { high, count, .. } = self.all.remove(i + 1);
        self.all[i].high = high;
        self.all[i].count += count;
    }

    /// The least and the greatest value between the outermost holes that are wider than the whole range of values
    /// between them, and the number of values beyond these holes, which is at most `most`. The answer is `None` where
    /// no value lies beyond.
    pub(crate) fn span(&self, most: u64) -> Option<(f64, f64, u64)> {
        let all = &self.all;
        let (mut from, mut to) = (0, all.len().checked_sub(1)?);
        let (mut below, mut above) = (0, 0);
        // one end after the other, until nothing changes; where an end has several such holes, the innermost one
        // counts
        loop {
            let before = (from, to);
            let mut seen = below;
            let (first, last) = before;
            for i in first..last {
                seen += all[i].count;
                if seen + above > most {
                    break;
                }
                if all[i + 1].low - all[i].high > all[to].high - all[i + 1].low {
                    (from, below) = (i + 1, seen);
                }
            }
            let mut seen = above;
            let first = from;
            for i in (first + 1..=last).rev() {
                seen += all[i].count;
                if seen + below > most {
                    break;
                }
                if all[i].low - all[i - 1].high > all[i - 1].high - all[from].low {
                    (to, above) = (i - 1, seen);
                }
            }
            if (from, to) == before {
                break;
            }
        }
        let (low, high) = (all[from].low, all[to].high);
        (low < high && below + above > 0).then_some((low, high, below + above))
    }

    /// The least and the greatest value beyond a span.
    pub(crate) fn beyond(&self, low: f64, high: f64) -> (f64, f64) {
        let beyond = self.all.iter().filter(|c| c.high < low || c.low > high);
        beyond.fold((f64::MAX, f64::MIN), |(a, b), c| (a.min(c.low), b.max(c.high)))
    }
}

#[cfg(test)]
mod tests {
    use proptest::{collection::vec, prelude::*};

    use super::*;
    use crate::gross_errors::span;

    const MOST: usize = 64;

    fn clusters(values: &[f64]) -> Clusters<MOST> {
        let mut clusters = Clusters::default();
        values.iter().for_each(|&x| clusters.take(x));
        clusters
    }

    proptest! {
        #[test]
        fn a_gross_error_is_what_all_values_at_once_say(
            usual in vec(-1.0..1.0f64, 20..500),
            gross in vec((-300.0..300.0f64, any::<bool>()), 0..40),
        ) {
            // gross errors anywhere among the usual ones
            let gross: Vec<f64> = gross.iter()
                .map(|(x, is_far)| if *is_far { x.signum() * 10f64.powf(x.abs()) } else { *x }).collect();
            let mut all = usual.clone();
            for (i, x) in gross.iter().enumerate() {
                all.insert(i * 7919 % all.len(), *x);
            }
            let found = clusters(&all).span((0.1 * all.len() as f64) as u64);
            prop_assert_eq!(found.map(|(low, high, _)| (low, high)), span(&all));
            if let Some((low, high, beyond)) = found {
                let counted = all.iter().filter(|x| **x < low || **x > high).count();
                prop_assert_eq!(beyond, counted as u64);
            }
        }
    }

    #[test]
    fn the_memory_is_bounded_and_the_widest_holes_stay() {
        let usual = (0..200_000).map(|n: u32| f64::from(n.wrapping_mul(2_654_435_761)) / 4.3e9);
        let mut all: Vec<f64> = usual.collect();
        all[77_777] = -999.0;
        all[123_456] = 1e300;
        let clusters = clusters(&all);
        assert_eq!(clusters.all.len(), MOST);
        let (low, high, beyond) = clusters.span(20_000).expect("two are gross errors");
        assert!(low >= 0.0 && high <= 1.0);
        assert_eq!(beyond, 2);
        assert_eq!(clusters.beyond(low, high), (-999.0, 1e300));
    }
}
