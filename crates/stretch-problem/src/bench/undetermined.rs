//! Samples without information: lost samples, and samples that a gap before them leaves undetermined.

/// Greatest number of lost samples in a row that a straight line bridges well.
const SHORT: usize = 3;
/// Number of samples before a longer gap that are smoothed together with samples in the gap.
const BEFORE: usize = 3;

/// Marks lost samples. Around a gap of more than three samples, it also marks the three samples
/// before the gap and as many samples after the gap as were lost, because these depend on values
/// that were not measured. This assumes that the memory of a stage is shorter than the gap.
pub(crate) fn undetermined(is_lost: &[bool]) -> Vec<bool> {
    let mut out = is_lost.to_vec();
    let mut from = 0;
    for stretch in is_lost.chunk_by(|a, b| a == b) {
        let to = from + stretch.len();
        if stretch[0] && stretch.len() > SHORT {
            let end = (to + stretch.len()).min(out.len());
            out[from.saturating_sub(BEFORE)..end].fill(true);
        }
        from = to;
    }
    out
}

/// Time for which a part of a trial that begins during a motion depends on the motion before it, s:
/// a few time constants of a muscle.
const AMID_S: f64 = 1.0;

/// Marks samples as [`undetermined`] does in a part of a trial that follows a gap. It also marks
/// the first second of the part, because the motion during the gap still acts there.
pub(crate) fn undetermined_behind_gap(is_lost: &[bool], dt_s: f64) -> Vec<bool> {
    let mut out = undetermined(is_lost);
    let amid = ((AMID_S / dt_s) as usize).min(out.len());
    out[..amid].fill(true);
    out
}

#[cfg(test)]
mod tests {
    use super::{undetermined, undetermined_behind_gap};

    #[test]
    fn a_part_begins_with_a_second_that_counts_for_nothing() {
        let open: Vec<bool> = undetermined_behind_gap(&[false; 250], 0.01);
        assert!(open[..100].iter().all(|o| *o) && !open[100..].iter().any(|o| *o));
        assert_eq!(undetermined_behind_gap(&[false; 2], 0.01), [true; 2]);
    }

    #[test]
    fn a_long_gap_leaves_as_many_samples_open_behind_it() {
        let mut lost = vec![false; 40];
        lost[5] = true;
        lost[20..25].fill(true);
        let open: Vec<usize> =
            undetermined(&lost).iter().enumerate().filter(|(_, o)| **o).map(|(i, _)| i).collect();
        assert_eq!(open, [[5].as_slice(), &(17..30).collect::<Vec<_>>()].concat());
    }
}
