//! Gross errors: values that no motion can produce, such as a logger's placeholder for a missing value.

use stretch_core::Interval;
use stretch_data::{Channel, Trial};

use super::series::extent;

/// Greatest share of the rows that can be gross errors. With a larger share, two true levels of a channel (a muscle
/// held at two lengths) could be mistaken for values and outliers. The decile mean, a simple robust estimate of
/// location, tolerates the same share.
const MOST_SHARE: f64 = 0.1;

/// Removes the rows in which one of `columns` has a gross error. Also returns a sentence for each column with such
/// values.
///
/// A channel that was sampled during motion has no gap between its sorted values. Gross errors are values beyond a gap
/// that is wider than the whole range of the other values, in at most a tenth of the rows: `-999` among lengths, or a
/// spike to the supply voltage. Outliers inside that range are treated by the robust fit.
///
/// ```
/// use stretch_calibrate::without_gross_errors;
/// use stretch_data::{Channel, Trial};
///
/// let values = (0..100).map(|n| if n == 40 { -999.0 } else { 150.0 + f64::from(n % 30) });
/// let length = Channel { name: "length_mm".into(), values: values.collect() };
/// let time_s = (0..100).map(|n| 0.01 * f64::from(n)).collect();
/// let trial = Trial { name: "ramp.csv".into(), time_s, channels: vec![length] };
/// let (kept, sentences) = without_gross_errors(vec![trial], &["length_mm"]);
/// assert_eq!(kept[0].len(), 99);
/// assert!(sentences[0].contains("1 of 100 values of length_mm are gross errors (-999"), "{}", sentences[0]);
/// ```
pub fn without_gross_errors(trials: Vec<Trial>, columns: &[&str]) -> (Vec<Trial>, Vec<String>) {
    let mut sentences = Vec::new();
    let mut kept = trials;
    for column in columns {
        let values: Vec<f64> =
            kept.iter().filter_map(|trial| trial.channel(column)).flatten().copied().collect();
        let Some((low, high)) = span(&values) else { continue };
        let is_gross = |x: f64| x < low || x > high;
        let gross: Vec<f64> = values.iter().copied().filter(|&x| is_gross(x)).collect();
        let Interval { min: least, max: most } = extent(gross.iter().copied());
        let counts = (gross.len() as u64, values.len() as u64);
        sentences.push(sentence(column, counts, (least, most), (low, high)));
        for trial in &mut kept {
            // A trial with columns of unequal length stays as it is, because the fit refuses it.
            let own = trial.channel(column).filter(|_| trial.check_lengths().is_ok());
            let Some(own) = own else { continue };
            let stays: Vec<bool> = own.iter().map(|&x| !is_gross(x)).collect();
            *trial = rows(trial, &stays);
        }
    }
    kept.retain(|trial| !trial.is_empty());
    (kept, sentences)
}

/// Returns a sentence about the gross errors of a column: their number, the number of all values, and the least and the
/// greatest gross error.
fn sentence(
    column: &str,
    (gross, of): (u64, u64),
    (least, most): (f64, f64),
    (low, high): (f64, f64),
) -> String {
    let shown = if least == most { format!("{least}") } else { format!("{least} .. {most}") };
    format!(
        "{gross} of {of} values of {column} are gross errors ({shown}, all others {low} .. {high}); their rows are left out: \
         check what the recorder writes for a missing sample"
    )
}

/// Returns the least and the greatest value that are not gross errors; `None` if there are no gross errors.
fn span(values: &[f64]) -> Option<(f64, f64)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let most = (MOST_SHARE * sorted.len() as f64) as usize;
    let (mut from, mut to) = (0, sorted.len().checked_sub(1)?);
    // Cuts values off the low and the high end alternately, until no gap is wider than the range of the remaining
    // values.
    loop {
        let before = (from, to);
        let left = most - (from + sorted.len() - 1 - to).min(most);
        if let Some(cut) = (from..from + left)
            .rev()
            .find(|&i| i < to && sorted[i + 1] - sorted[i] > sorted[to] - sorted[i + 1])
        {
            from = cut + 1;
        }
        let left = most - (from + sorted.len() - 1 - to).min(most);
        if let Some(cut) = (to.saturating_sub(left) + 1..=to)
            .find(|&i| i > from && sorted[i] - sorted[i - 1] > sorted[i - 1] - sorted[from])
        {
            to = cut - 1;
        }
        if (from, to) == before {
            break;
        }
    }
    let (low, high) = (sorted[from], sorted[to]);
    // If a channel is constant except for a few values, its range is zero, and no gap can be compared with it.
    (low < high && (from > 0 || to + 1 < sorted.len())).then_some((low, high))
}

/// Returns the rows of a trial for which `stays` is true.
pub(crate) fn rows(trial: &Trial, stays: &[bool]) -> Trial {
    let kept = |values: &[f64]| {
        values.iter().zip(stays).filter(|(_, stays)| **stays).map(|(x, _)| *x).collect()
    };
    let channel =
        |channel: &Channel| Channel { name: channel.name.clone(), values: kept(&channel.values) };
    Trial {
        name: trial.name.clone(),
        time_s: kept(&trial.time_s),
        channels: trial.channels.iter().map(channel).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::span;

    #[test]
    fn a_gross_error_is_what_lies_beyond_a_hole_wider_than_the_rest() {
        let usual: Vec<f64> =
            (0..1000).map(|n| 165.0 + 14.0 * (0.1 * f64::from(n)).cos()).collect();
        assert_eq!(span(&usual), None);
        let with = |more: &[f64]| span(&[&usual[..], more].concat());
        let (low, high) = with(&[]).unwrap_or((151.0, 179.0));
        for gross in [&[-999.0][..], &[-999.0; 20], &[-999.0, 9999.0], &[0.0, 1e308], &[1e30; 100]]
        {
            let found = with(gross).unwrap();
            assert!(
                (found.0 - low).abs() < 0.1 && (found.1 - high).abs() < 0.1,
                "{gross:?} {found:?}"
            );
        }
        // These values are outside the range, but no gap separates them from it.
        assert_eq!(with(&[200.0, 140.0]), None);
        // Two levels at which a muscle is held are not gross errors.
        let held: Vec<f64> =
            (0..100).map(|n| if n < 85 { 150.0 } else { 170.0 } + f64::from(n % 5)).collect();
        assert_eq!(span(&held), None);
        assert_eq!(span(&[]), None);
        assert_eq!(span(&[1.0]), None);
    }
}
