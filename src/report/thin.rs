//! From a hundred thousand samples to what a figure can show.

use std::ops::Range;

/// Least and greatest finite value, or nothing.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<Range<f64>> {
    let ends = values
        .into_iter()
        .filter(|x| x.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    (ends.0 <= ends.1).then_some(ends.0..ends.1)
}

/// The span widened by a share of itself on both sides.
pub fn padded(span: &Range<f64>, share: f64) -> Range<f64> {
    let pad = share * (span.end - span.start);
    span.start - pad..span.end + pad
}

/// The finite values in order.
pub fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.into_iter().filter(|x| x.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted
}

/// The value below which a share `q` of sorted values lies; NaN without any.
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((q * last).round() as usize).copied().unwrap_or(f64::NAN)
}

/// A curve inside a window of time, cut where a value is missing or the time
/// leaps, as least and greatest value of each of `bins` slots: at most
/// `2 bins` points, and no peak is lost.
pub fn curve(
    time: &[f64],
    values: &[f64],
    window: &Range<f64>,
    bins: usize,
) -> Vec<Vec<(f64, f64)>> {
    let span = window.end - window.start;
    let inside = |t: f64| t >= window.start && t <= window.end;
    let usual = match (time.first(), time.last()) {
        (Some(first), Some(last)) if time.len() > 1 => (last - first) / (time.len() - 1) as f64,
        _ => 0.0,
    };
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    let mut slot: Option<(usize, (f64, f64), (f64, f64))> = None;
    let mut before = f64::NAN;
    for (&t, &y) in time.iter().zip(values).filter(|(t, _)| inside(**t)) {
        if !y.is_finite() || t - before > 10.0 * usual {
            close(&mut pieces, slot.take());
            pieces.push(Vec::new());
        }
        before = t;
        if !y.is_finite() {
            continue;
        }
        let index = ((t - window.start) / span * bins as f64) as usize;
        match &mut slot {
            Some((at, low, high)) if *at == index => {
                if y < low.1 {
                    *low = (t, y);
                }
                if y > high.1 {
                    *high = (t, y);
                }
            }
            _ => {
                close(&mut pieces, slot.take());
                slot = Some((index, (t, y), (t, y)));
            }
        }
    }
    close(&mut pieces, slot);
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

type Slot = (usize, (f64, f64), (f64, f64));

/// Writes a slot's extremes to the last piece, in the order of time.
fn close(pieces: &mut [Vec<(f64, f64)>], slot: Option<Slot>) {
    let (Some((_, low, high)), Some(piece)) = (slot, pieces.last_mut()) else { return };
    let (first, second) = if low.0 <= high.0 { (low, high) } else { (high, low) };
    piece.push(first);
    if second.0 > first.0 {
        piece.push(second);
    }
}

/// At most `most` of the items, spread evenly but not in step with a periodic motion.
pub fn sample<T: Copy>(items: &[T], most: usize) -> Vec<T> {
    if items.len() <= most {
        return items.to_vec();
    }
    // steps of the golden ratio fall evenly and never repeat
    let place = |k: usize| (k as f64 * 0.618_033_988_749_894_9).fract() * items.len() as f64;
    (0..most).filter_map(|k| items.get(place(k) as usize).copied()).collect()
}

/// One slot of a [`binned`] relation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Middle of the slot.
    pub x: f64,
    /// A tenth of the values lie below.
    pub low: f64,
    /// Half of them.
    pub median: f64,
    /// Nine tenths.
    pub high: f64,
}

/// Median and spread of `y` in slots of `x`; slots with fewer than 20 values are left out.
pub fn binned(points: &[(f64, f64)], span: &Range<f64>, bins: usize) -> Vec<Bin> {
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
