//! When commands switch: at the rows of the log, or anywhere between two.
//!
//! A log as fast as the controller shows every switch in the row where it acts. A slower one, or one of which rows were dropped, shows it up
//! to one row late. In the row before, an opening then acts for a share of the sample, and what the valve lets through in it is that of
//! the mean opening:
//!
//! ```text
//! u_i -> u_i + lead (u_(i+1) - u_i),     0 <= lead <= 1
//! ```
//!
//! The mean lead is a parameter, 0 where commands switch at rows. That each switch has its own is a wander of it, free from switch to
//! switch: what it leaves in the chamber dies away, or stays, as any error of the pressure does, and the next switch adds its own. There
//! are two such parameters, for every other switch each: an inlet that opens and shuts equally early lets in what it would have let in, so that
//! what all switches change together is nothing where what each changes is much.

use std::borrow::Cow;

use stretch_gap::ParameterSpec;

/// Mean lead, 1 sd. Of switches anywhere in a sample it is 1/2, of every second row dropped 1/4, of a log as fast as the controller 0;
/// three standard deviations end at a whole sample.
const MEAN: (f64, f64) = (0.25, 0.25);

/// Period of the rig's controller, s, and by how much a log must be slower for a switch to fall between two of its rows.
const CONTROL_S: f64 = 0.01;
const SLOWER: f64 = 1.2;

/// Whether commands may switch between the rows of a log.
pub(super) fn is_slow(dt_s: f64) -> bool {
    dt_s > SLOWER * CONTROL_S
}

/// Leads of every other switch of a trial: the first and the third, the second and the fourth ...
pub(super) type Leads = [f64; 2];
/// Their names.
const NAMES: [&str; 2] = ["command_lead_1", "command_lead_2"];

/// A parameter where commands switch at rows: exactly there.
pub(super) fn at_rows(which: usize) -> ParameterSpec {
    ParameterSpec { least: 0.0, is_evidence: false, ..ParameterSpec::new(NAMES[which], "1", 0.0) }
}

/// The same where they switch anywhere: each uniform in its sample, of variance 1/12.
pub(super) fn anywhere(which: usize) -> ParameterSpec {
    let per_tick_sd = Some((1.0_f64 / 12.0).sqrt());
    ParameterSpec { nominal: MEAN.0, sd: MEAN.1, per_tick_sd, ..at_rows(which) }
}

/// For every sample, which switch of its trial was the last.
pub(super) fn switches(inlet: &[f64], outlet: &[f64]) -> impl Iterator<Item = u32> {
    let mut count = 0;
    (0..inlet.len()).map(move |i| {
        // What happens within the sample before the row shows from the row on.
        count += u32::from(i > 0 && (inlet[i], outlet[i]) != (inlet[i - 1], outlet[i - 1]));
        count
    })
}

/// Inlet and outlet whose switches act ahead of their rows, by shares of a sample.
pub(super) fn ahead<'a>(inlet: &'a [f64], outlet: &'a [f64], leads: Leads) -> [Cow<'a, [f64]>; 2] {
    if leads == [0.0; 2] {
        return [Cow::Borrowed(inlet), Cow::Borrowed(outlet)];
    }
    [inlet, outlet].map(|opening| {
        let mut out = opening.to_vec();
        let next = switches(inlet, outlet).skip(1);
        for ((out, pair), switch) in out.iter_mut().zip(opening.windows(2)).zip(next) {
            let lead = leads[switch as usize % 2];
            *out = (pair[0] + lead * (pair[1] - pair[0])).clamp(0.0, 1.0);
        }
        Cow::Owned(out)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_lead_opens_the_row_before_by_half() {
        let opening = [0.0, 0.0, 1.0, 1.0, 0.5];
        let [inlet, _] = ahead(&opening, &[0.0; 5], [0.5, 0.5]);
        assert_eq!(*inlet, [0.0, 0.5, 1.0, 0.75, 0.5]);
        let [inlet, _] = ahead(&opening, &[0.0; 5], [0.2, 0.0]);
        assert_eq!(*inlet, [0.0, 0.0, 1.0, 0.9, 0.5]);
        assert!(matches!(ahead(&opening, &opening, [0.0; 2]), [Cow::Borrowed(_), _]));
        let last: Vec<u32> = switches(&opening, &[0.0; 5]).collect();
        assert_eq!(last, [0, 0, 1, 1, 2]);
    }
}
