//! Reduction of a hundred thousand samples to the points of a figure.

use std::ops::Range;

/// Returns the smallest and the largest finite value; `None` if there is no finite value.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> Option<Range<f64>> {
    let ends = values
        .into_iter()
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    (ends.0 <= ends.1).then_some(ends.0..ends.1)
}

/// The span widened by a share of itself on both sides.
pub(crate) fn padded(span: &Range<f64>, share: f64) -> Range<f64> {
    let pad = share * (span.end - span.start);
    span.start - pad..span.end + pad
}

/// The finite values in order.
pub(crate) fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.into_iter().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// Returns the value below which a share `q` of sorted values lies; NaN if there are no values.
pub(crate) fn quantile(sorted: &[f64], q: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((q * last).round() as usize).copied().unwrap_or(f64::NAN)
}

/// A curve inside a window of time, as the least and the greatest value of each of `bins` slots. The curve is cut
/// where a value is missing or the time leaps (ten times the mean step). No peak is lost, and each piece keeps its
/// ends.
pub(crate) fn curve(
    time: &[f64],
    values: &[f64],
    window: &Range<f64>,
    bins: usize,
) -> Vec<Vec<(f64, f64)>> {
    let mean_step = match (time.first(), time.last()) {
        (Some(first), Some(last)) if time.len() > 1 => (last - first) / (time.len() - 1) as f64,
        _ => 0.0,
    };
    let all: Vec<(f64, f64)> = time.iter().copied().zip(values.iter().copied()).collect();
    let slot = |t: f64| ((t - window.start) / (window.end - window.start) * bins as f64) as usize;
    all.split(|(t, y)| !(y.is_finite() && *t >= window.start && *t <= window.end))
        .flat_map(|run| run.chunk_by(|a, b| b.0 - a.0 <= 10.0 * mean_step))
        .filter(|run| run.len() > 1)
        .map(|run| peaks(run, slot))
        .collect()
}

/// Returns the two ends of a run and the extremes of each slot, in the order of time.
fn peaks(run: &[(f64, f64)], slot: impl Fn(f64) -> usize) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    let mut push = |point: (f64, f64)| {
        if points.last().is_none_or(|last: &(f64, f64)| last.0 < point.0) {
            points.push(point);
        }
    };
    run.first().copied().into_iter().for_each(&mut push);
    for part in run.chunk_by(|a, b| slot(a.0) == slot(b.0)) {
        let low = part.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        let high = part.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
        if let (Some(low), Some(high)) = (low, high) {
            push(if low.0 < high.0 { low } else { high });
            push(if low.0 < high.0 { high } else { low });
        }
    }
    run.last().copied().into_iter().for_each(&mut push);
    points
}

/// Returns at most `most` of the items. They are spread evenly, but not at equal distances, which
/// could coincide with the period of a motion.
pub(crate) fn sample<T: Copy>(items: &[T], most: usize) -> Vec<T> {
    if items.len() <= most {
        return items.to_vec();
    }
    // multiples of the golden ratio are spread evenly and never repeat
    let place = |k: usize| (k as f64 * 0.618_033_988_749_894_9).fract() * items.len() as f64;
    (0..most).filter_map(|k| items.get(place(k) as usize).copied()).collect()
}

/// One slot of a [`binned`] relation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bin {
    /// Middle of the slot.
    pub(crate) x: f64,
    /// The value below which a tenth of the values lie.
    pub(crate) low: f64,
    /// The value below which half of the values lie.
    pub(crate) median: f64,
    /// The value below which nine tenths of the values lie.
    pub(crate) high: f64,
}

/// Median and spread of `y` in slots of `x`; slots with fewer than 20 values are left out.
pub(crate) fn binned(points: &[(f64, f64)], span: &Range<f64>, bins: usize) -> Vec<Bin> {
    let width = (span.end - span.start) / bins as f64;
    let mut slots = vec![Vec::new(); bins];
    for &(x, y) in points {
        let index = ((x - span.start) / width).floor();
        if index >= 0.0
            && let Some(slot) = slots.get_mut(index as usize)
        {
            slot.push(y);
        }
    }
    let enough = slots.into_iter().enumerate().filter(|(_, slot)| slot.len() >= 20);
    enough
        .map(|(i, slot)| {
            let slot = sorted(slot);
            Bin {
                x: span.start + (i as f64 + 0.5) * width,
                low: quantile(&slot, 0.1),
                median: quantile(&slot, 0.5),
                high: quantile(&slot, 0.9),
            }
        })
        .collect()
}

/// Returns at most about `most` of the items in their order, including both ends.
pub(crate) fn sample_in_order<T: Copy>(items: &[T], most: usize) -> Vec<T> {
    let step = items.len().div_ceil(most.max(1)).max(1);
    items.iter().step_by(step).chain(items.last()).copied().collect()
}
