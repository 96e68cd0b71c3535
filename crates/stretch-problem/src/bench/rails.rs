//! Channels that are saturated at an end of the recorder's range.

use stretch_data::{after_number, ends, unit_of};
use stretch_filter::log::{noise_of_differences, second_differences};

use super::columns::Columns;

/// Share of the samples at one value above which chance does not explain the repeated value.
const SHARE: f64 = 0.002;
/// Smallest noise of a recording that is judged, as a share of the stated noise. A channel with less noise repeats its
/// value at rest.
const NOISY: f64 = 0.3;

/// A sentence for every end of a column that holds more samples than noise explains; `noise` is that of its recorder.
pub(crate) fn rails(columns: &Columns, name: &str, noise: f64) -> Vec<String> {
    let values = columns.all(name);
    let (low, high) = ends(values);
    let rail = |(end, which): (f64, &str)| {
        let count = values.iter().filter(|v| **v == end).count();
        let share = count as f64 / values.len().max(1) as f64;
        (share > SHARE && noise_off(values, end) > NOISY * noise).then(|| {
            format!(
                "{name} is at {end}{}, its {which} value, in {:.1} % of the samples: the recorder is probably saturated, and all \
                 values beyond are lost; lower the gain, widen the range or move the zero, and record again",
                after_number(&unit_of(name)),
                100.0 * share
            )
        })
    };
    [(low, "least"), (high, "greatest")].into_iter().filter_map(rail).collect()
}

/// Noise of a channel from its median second difference, without the samples at one value.
fn noise_off(values: &[f64], end: f64) -> f64 {
    let away = values.windows(3).filter(|w| w.iter().all(|v| *v != end));
    let mut bends: Vec<f64> = away.flat_map(second_differences).collect();
    noise_of_differences(&mut bends).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use stretch_data::{Channel, SessionTrial, Trial};
    use stretch_sim::{Key, RigParams};

    use super::*;
    use crate::RigSession;

    #[test]
    fn an_end_is_told_from_a_rest() {
        let noise = |i: usize| ((i * i * 31 + i * 7919) % 1009) as f64 / 1009.0 - 0.5;
        let at = |clip: f64, size: f64| -> Vec<f64> {
            (0..3000).map(|i| ((0.01 * i as f64).sin() + size * noise(i)).min(clip)).collect()
        };
        let length: Vec<f64> =
            (0..3000).map(|i| 170.0 - 0.001 * i as f64 + 0.1 * noise(i)).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let said = |bridge_v| {
            let trial = Trial {
                name: "a".into(),
                time_s: (0..3000).map(|i| 0.01 * f64::from(i)).collect(),
                channels: vec![
                    channel("inlet", vec![0.5; 3000]),
                    channel("outlet", vec![0.0; 3000]),
                    channel("length_mm", length.clone()),
                    channel("bridge_v", bridge_v),
                ],
            };
            let session = RigSession::new(&[SessionTrial::new(trial)]).expect("a session");
            rails(&session.columns, "bridge_v", RigParams::default()[Key::SigmaV])
        };
        assert!(said(at(9.0, 0.01)).is_empty());
        let clipped = said(at(0.5, 0.01));
        assert!(clipped.len() == 1 && clipped[0].contains("bridge_v is at 0.5 V, its greatest"));
        // A simulation without noise gives no note.
        assert!(said(at(0.5, 0.0)).is_empty());
    }
}
