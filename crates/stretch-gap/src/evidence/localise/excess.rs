//! Computes the excess (reduced chi-square minus one) of slices, with intervals by block bootstrap
//! and p-values, and corrects for false discoveries.

use super::axes::Axis;
use crate::{
    fit::score::excess, numerics::random::RandomGenerator, problem::sample_roles::SampleRoles,
};

/// False-discovery rate that is allowed among the reported slices.
const FALSE_DISCOVERIES: f64 = 0.05;
/// Number of draws of the bootstrap.
const DRAWS: usize = 200;
/// Smallest number of blocks with samples of a slice for which the slice has a p-value below 1.
const LEAST_BLOCKS: usize = 6;

/// Sums of squares and counts by block and slice.
pub(super) struct Cells {
    slices: usize,
    /// By block, then by slice: sum of squares in multiples of the noise, number of samples.
    cells: Vec<(f64, f64)>,
}

/// Excess (reduced chi-square minus one) of one slice, and its significance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sliced {
    pub(super) share: f64,
    pub(super) excess: f64,
    pub(super) interval: [f64; 2],
    /// One-sided p-value, against the rest of the stage.
    pub(super) p: f64,
}

impl Cells {
    pub(super) fn new(slices: usize, cells: Vec<(f64, f64)>) -> Self {
        Self { slices, cells }
    }

    pub(super) fn of_samples(roles: &SampleRoles, residual: &[f64], axis: &Axis) -> Self {
        let slices = axis.labels.len();
        let mut cells = Vec::new();
        for segment in &roles.segments {
            let end = segment.to.min(residual.len()).min(axis.of.len());
            let mut from = segment.from.min(end);
            while from < end {
                let to = (from + roles.block).min(end);
                let base = cells.len();
                cells.resize(base + slices, (0.0, 0.0));
                for (r, slice) in residual[from..to].iter().zip(&axis.of[from..to]) {
                    if let Some(cell) = cells.get_mut(base + usize::from(*slice))
                        && usize::from(*slice) < slices
                    {
                        cell.0 += r * r;
                        cell.1 += 1.0;
                    }
                }
                from = to;
            }
        }
        Self { slices, cells }
    }

    pub(super) fn sliced(&self, seed: u64, stream: u64) -> Vec<Sliced> {
        if self.slices == 0 || self.cells.is_empty() {
            return Vec::new();
        }
        let blocks = self.cells.len() / self.slices;
        let all = vec![1_u32; blocks];
        let sums = self.sums(&all);
        let whole = sums.iter().fold((0.0, 0.0), |a, s| (a.0 + s.0, a.1 + s.1));
        let gaps: f64 = sums.iter().map(|s| (s.0 - s.1).max(0.0)).sum();
        let mut draws = vec![Vec::with_capacity(DRAWS); self.slices];
        let mut random = RandomGenerator::new(seed, 900 + stream);
        for _ in 0..DRAWS {
            let mut times = vec![0_u32; blocks];
            (0..blocks).for_each(|_| times[random.below(blocks)] += 1);
            for (slice, sum) in self.sums(&times).iter().enumerate() {
                if sum.1 > 0.0 {
                    draws[slice].push(excess(sum.0 / sum.1));
                }
            }
        }
        let one = |(slice, sum): (usize, &(f64, f64))| {
            let mut drawn = std::mem::take(&mut draws[slice]);
            if sum.1 <= 0.0 || drawn.is_empty() {
                return Sliced { share: 0.0, excess: 0.0, interval: [0.0; 2], p: 1.0 };
            }
            drawn.sort_by(f64::total_cmp);
            let at = |q: f64| drawn[((q * drawn.len() as f64) as usize).min(drawn.len() - 1)];
            Sliced {
                share: if gaps > 0.0 { (sum.0 - sum.1).max(0.0) / gaps } else { 0.0 },
                excess: excess(sum.0 / sum.1),
                interval: [at(0.025), at(0.975)],
                p: self.p_value(slice, *sum, whole),
            }
        };
        sums.iter().enumerate().map(one).collect()
    }

    fn sums(&self, times: &[u32]) -> Vec<(f64, f64)> {
        let mut sums = vec![(0.0, 0.0); self.slices];
        for (block, &times) in self.cells.chunks_exact(self.slices).zip(times) {
            if times > 0 {
                for (sum, cell) in sums.iter_mut().zip(block) {
                    sum.0 += f64::from(times) * cell.0;
                    sum.1 += f64::from(times) * cell.1;
                }
            }
        }
        sums
    }

    /// Returns the p-value of a slice: the probability that its mean square exceeds that of the
    /// rest of the stage by as much, if both have the same expectation. The variance is that of a
    /// linearised ratio of block sums.
    fn p_value(&self, slice: usize, own: (f64, f64), whole: (f64, f64)) -> f64 {
        let rest = (whole.0 - own.0, whole.1 - own.1);
        if rest.1 <= 0.0 {
            return 1.0;
        }
        let (mean, other) = (own.0 / own.1, rest.0 / rest.1);
        let (mut variance, mut seen) = (0.0, 0);
        for block in self.cells.chunks_exact(self.slices) {
            let cell = block[slice];
            let (square, count) = block.iter().fold((0.0, 0.0), |a, c| (a.0 + c.0, a.1 + c.1));
            let one = (cell.0 - mean * cell.1) / own.1;
            let two = (square - cell.0 - other * (count - cell.1)) / rest.1;
            variance += (one - two) * (one - two);
            seen += usize::from(cell.1 > 0.0);
        }
        if seen < LEAST_BLOCKS || variance <= 0.0 {
            return 1.0;
        }
        0.5 * libm::erfc((mean - other) / (2.0 * variance).sqrt())
    }
}

/// Returns, for each p-value, whether it is a discovery at the allowed false-discovery rate.
pub(super) fn discoveries(p: &[f64]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let last = order
        .iter()
        .enumerate()
        .rev()
        .find(|(rank, i)| p[**i] <= FALSE_DISCOVERIES * (rank + 1) as f64 / p.len() as f64);
    let limit = last.map_or(f64::NEG_INFINITY, |(_, i)| p[*i]);
    p.iter().map(|p| *p <= limit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::tolerance::SLICE_EXCESS;

    #[test]
    fn benjamini_and_hochberg_as_in_their_paper() {
        // The fifteen p-values of section 3.2 of Benjamini and Hochberg (1995), with four
        // rejections at 0.05.
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
            0.5719, 0.6528, 0.7590, 1.0,
        ];
        assert_eq!(discoveries(&p).iter().filter(|d| **d).count(), 4);
        assert!(discoveries(&[]).is_empty());
        assert_eq!(discoveries(&[0.2, 0.9]), [false, false]);
    }

    #[test]
    fn a_loud_slice_has_the_gap_and_stands_out() {
        let mut random = RandomGenerator::new(5, 0);
        let mut cells = Vec::new();
        for _ in 0..100 {
            for size in [1.0, 3.0] {
                let sum = (0..25).map(|_| (size * random.gauss()).powi(2)).sum::<f64>();
                cells.push((sum, 25.0));
            }
        }
        let cells = Cells::new(2, cells);
        let sliced = cells.sliced(1, 0);
        assert!(sliced[1].share > 0.95 && sliced[1].p < 1e-6 && sliced[0].p > 0.99);
        approx::assert_abs_diff_eq!(sliced[1].excess, 8.0, epsilon = SLICE_EXCESS);
        assert!(sliced[1].interval[0] < 8.3 && sliced[1].interval[1] > 7.7);
        assert!(sliced[0].interval[0] < 0.1 && sliced[0].interval[1] > -0.1);
        assert_eq!(cells.sliced(1, 0), sliced);
    }

    /// Returns random cells: `blocks` blocks with 25 samples of each slice. `sds` holds the
    /// standard deviation of each slice.
    fn drawn(sds: &[f64], blocks: usize, random: &mut RandomGenerator) -> Cells {
        let mut cells = Vec::new();
        for _ in 0..blocks {
            for sd in sds {
                cells.push(((0..25).map(|_| (sd * random.gauss()).powi(2)).sum::<f64>(), 25.0));
            }
        }
        Cells::new(sds.len(), cells)
    }

    #[test]
    fn shares_sum_to_the_whole_and_quiet_slices_have_none() {
        let sliced = drawn(&[1.5, 0.5, 3.0], 60, &mut RandomGenerator::new(1, 0)).sliced(1, 0);
        let sum: f64 = sliced.iter().map(|s| s.share).sum();
        approx::assert_relative_eq!(sum, 1.0, max_relative = testkit::tolerance::F64_ROUNDING);
        assert_eq!((sliced[1].share, sliced[1].excess < 0.0), (0.0, true));
        // The gaps are 1.25 and 8. Sums of 1500 squares are known to 4 % and their ratio to 6 %;
        // the tolerance is three times that.
        approx::assert_relative_eq!(sliced[0].share, 1.25 / 9.25, max_relative = 0.2);
        for s in &sliced {
            assert!(s.interval[0] <= s.excess && s.excess <= s.interval[1], "{s:?}");
        }
    }

    /// If there are two slices, each is the rest for the other. The differences of both from the
    /// rest are equal with opposite signs, and have the same variance. Therefore the p-values add
    /// up to 1.
    #[test]
    fn of_two_slices_one_p_value_is_the_others_complement() {
        let mut random = RandomGenerator::new(2, 0);
        for sd in [0.7, 1.0, 1.1] {
            let sliced = drawn(&[1.0, sd], 30, &mut random).sliced(1, 0);
            approx::assert_relative_eq!(sliced[0].p + sliced[1].p, 1.0, max_relative = 1e-12);
        }
    }

    /// Of 400 recordings in which no slice is worse, 5 %, i.e. 20, have a p-value below 0.05. The
    /// standard deviation of this number is 4.4; the tolerance is three times that.
    #[test]
    fn p_values_are_as_rare_as_they_say() {
        let mut random = RandomGenerator::new(3, 0);
        let mut is_rare = |_: &u64| drawn(&[1.0; 4], 60, &mut random).sliced(1, 0)[2].p < 0.05;
        let rare = (0..400).filter(|record| is_rare(record)).count();
        assert!((7..=33).contains(&rare), "{rare} of 400");
    }

    /// Of 300 intervals, 285 should contain the true value. Those of a percentile bootstrap of 60
    /// blocks contain it in about 93 % of the cases, 280 of 300. The lower limit is four standard
    /// deviations (4.4 each) below 280. The upper limit excludes intervals that always contain it.
    #[test]
    fn intervals_of_an_excess_hold_it() {
        let mut random = RandomGenerator::new(4, 0);
        let mut is_held = |record: &u64| {
            let [low, high] = drawn(&[2.0, 1.0], 60, &mut random).sliced(*record, 0)[0].interval;
            low <= 3.0 && 3.0 <= high
        };
        let held = (0..300).filter(|record| is_held(record)).count();
        assert!((262..300).contains(&held), "{held} of 300");
    }

    #[test]
    fn a_handful_of_blocks_is_no_evidence() {
        let mut random = RandomGenerator::new(5, 0);
        let few = drawn(&[1.0, 9.0], LEAST_BLOCKS - 1, &mut random).sliced(1, 0);
        assert!(few.iter().all(|s| s.p == 1.0));
        let enough = drawn(&[1.0, 9.0], LEAST_BLOCKS, &mut random).sliced(1, 0);
        assert!(enough[1].p < 0.01, "{:?}", enough[1]);
    }

    #[test]
    fn nothing_is_said_of_what_has_no_samples() {
        assert!(Cells::new(0, Vec::new()).sliced(1, 0).is_empty());
        let cells = (0..20).flat_map(|_| [(30.0, 25.0), (0.0, 0.0)]).collect();
        let sliced = Cells::new(2, cells).sliced(1, 0);
        assert_eq!(sliced[1], Sliced { share: 0.0, excess: 0.0, interval: [0.0; 2], p: 1.0 });
        // A single slice cannot be compared with a rest.
        assert_eq!((sliced[0].share, sliced[0].p), (1.0, 1.0));
    }

    /// Samples count once, in their block and slice. Samples outside all slices or segments do not
    /// count.
    #[test]
    fn samples_are_summed_by_block_and_slice() {
        use crate::problem::sample_roles::{Role, Segment};
        let segment = |from, to, role| Segment { trial: 0, from, to, role };
        let roles = SampleRoles {
            segments: vec![segment(0, 5, Role::Fit), segment(7, 10, Role::Test)],
            block: 2,
            fit_trials: 1,
            borrowed_test: true,
        };
        let axis = Axis {
            by: "half",
            labels: vec!["low".into(), "high".into()],
            of: vec![0, 1, 1, 0, Axis::NONE, 0, 0, 1, 1, 0],
        };
        let residual: Vec<f64> = (1..=10).map(f64::from).collect();
        let cells = Cells::of_samples(&roles, &residual, &axis);
        // The blocks consist of the samples 1 and 2, 3 and 4, 5, 8 and 9, and 10. Sample 5 is in no
        // slice; samples 6 and 7 are in no segment.
        let expected = [
            [(1.0, 1.0), (4.0, 1.0)],
            [(16.0, 1.0), (9.0, 1.0)],
            [(0.0, 0.0), (0.0, 0.0)],
            [(0.0, 0.0), (64.0 + 81.0, 2.0)],
            [(100.0, 1.0), (0.0, 0.0)],
        ];
        assert_eq!(cells.cells, expected.concat());
    }

    /// Every p-value below Bonferroni's limit is a discovery, and none above 0.05 is. If a p-value
    /// is a discovery, every smaller one is too. The order does not matter.
    #[test]
    fn discoveries_lie_between_bonferroni_and_the_level() {
        let mut random = RandomGenerator::new(6, 0);
        for count in [1_usize, 2, 7, 40] {
            for _ in 0..50 {
                let p: Vec<f64> = (0..count).map(|_| random.unit().powi(3)).collect();
                let found = discoveries(&p);
                for (i, p_i) in p.iter().enumerate() {
                    assert!(found[i] || *p_i > FALSE_DISCOVERIES / count as f64);
                    assert!(!found[i] || *p_i <= FALSE_DISCOVERIES);
                    assert!(p.iter().zip(&found).all(|(p, f)| !found[i] || *p > *p_i || *f));
                }
                let (turned, mut back): (Vec<f64>, _) =
                    (p.iter().rev().copied().collect(), found.clone());
                back.reverse();
                assert_eq!(discoveries(&turned), back);
            }
        }
    }

    /// If no slice is worse, a discovery is made in 5 % of the recordings (theorem of Benjamini and
    /// Hochberg, for independent p-values). Of 2000 recordings these are 100, with a standard
    /// deviation of 9.7; the tolerance is three times that.
    #[test]
    fn false_discoveries_are_as_rare_as_allowed() {
        let mut random = RandomGenerator::new(7, 0);
        let mut any = |_: &u32| {
            let p: Vec<f64> = (0..30).map(|_| random.unit()).collect();
            discoveries(&p).contains(&true)
        };
        let alarms = (0..2000).filter(|record| any(record)).count();
        assert!((71..=129).contains(&alarms), "{alarms} of 2000");
    }

    /// Twenty of forty hypotheses are true effects, so on average a share of 0.05 times 20/40 of
    /// the discoveries is false. This share has a standard deviation of about 0.035 in one
    /// recording and of 0.0016 as a mean over 500; the tolerance is five times that.
    #[test]
    fn among_true_ones_few_are_false() {
        let mut random = RandomGenerator::new(8, 0);
        let (mut false_share, mut true_share) = (0.0, 0.0);
        for _ in 0..500 {
            let p: Vec<f64> = (0..40)
                .map(|i| match i < 20 {
                    true => 0.5 * libm::erfc((4.0 + random.gauss()) / 2_f64.sqrt()),
                    false => random.unit(),
                })
                .collect();
            let found = discoveries(&p);
            let count = |part: &[bool]| part.iter().filter(|f| **f).count() as f64;
            let (right, wrong) = (count(&found[..20]), count(&found[20..]));
            false_share += wrong / f64::max(right + wrong, 1.0) / 500.0;
            true_share += right / 20.0 / 500.0;
        }
        assert!((false_share - 0.025).abs() < 0.008, "{false_share}");
        // An effect of four standard deviations exceeds the limit (p of about 0.025, 1.96 standard
        // deviations) with probability 0.98.
        assert!(true_share > 0.95, "{true_share}");
    }
}
