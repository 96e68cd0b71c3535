//! Detection limits in words: what an answer without a name rules out.

use crate::{evidence::detection_limit::DetectionLimit, problem::spec::EffectSpec};

/// Most effects that are listed in words.
const LISTED: usize = 6;

/// The effects of which the least share of the range would have been named, with their limits; none where no effect would have been.
pub(crate) fn nothing_above(limits: &[DetectionLimit], effects: &[EffectSpec]) -> Option<String> {
    let share = |limit: &DetectionLimit| {
        let spec = effects.iter().find(|spec| spec.name == limit.effect)?;
        let parameter = spec.parameters.iter().find(|p| *p.name == *limit.parameter)?;
        let distance = (limit.strength? - parameter.off()?).abs();
        Some(distance / (parameter.max - parameter.min))
    };
    let known = limits.iter().filter_map(|limit| Some((share(limit)?, limit)));
    let mut known: Vec<(f64, &DetectionLimit)> = known.collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0));
    let words = |(_, limit): &(f64, &DetectionLimit)| {
        let unit = if limit.unit == "1" { String::new() } else { format!(" {}", limit.unit) };
        format!("{} {}{unit}", limit.effect, in_digits(limit.strength.unwrap_or(0.0)))
    };
    let listed: Vec<String> = known.iter().take(LISTED).map(words).collect();
    let rest = if known.len() > LISTED { ", and more in the table" } else { "" };
    (!listed.is_empty()).then(|| {
        format!(
            "It would have been named if it were stronger than: {}{rest} (with probability 0.9, by linearised draws).",
            listed.join(", ")
        )
    })
}

/// Two digits.
fn in_digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.1e}").parse().unwrap_or(x);
    let is_long = rounded != 0.0 && (rounded.abs() < 1e-3 || rounded.abs() >= 1e5);
    if is_long { format!("{rounded:e}") } else { format!("{rounded}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stretch_effects::EffectParameter;

    #[test]
    fn the_six_that_are_seen_best_stand_in_words() {
        let spec = |i: usize| {
            let parameters = vec![EffectParameter::sized("c", "V", 0.0..=1.0)];
            EffectSpec::new(&format!("e{i}"), (0, "toy"), parameters)
        };
        let limit = |i: usize, strength| DetectionLimit {
            effect: format!("e{i}"),
            parameter: "c".into(),
            strength,
            unit: "V".into(),
            others: Default::default(),
        };
        let effects: Vec<EffectSpec> = (0..9).map(spec).collect();
        let limits: Vec<DetectionLimit> =
            (0..9).map(|i| limit(i, (i > 0).then(|| 0.1 * (10 - i) as f64))).collect();
        let words = nothing_above(&limits, &effects).expect("limits");
        assert!(
            words.starts_with(
                "It would have been named if it were stronger than: e8 0.2 V, e7 0.3 V, "
            ),
            "{words}"
        );
        assert!(words.contains("e3") && !words.contains("e2") && words.contains("in the table"));
        assert_eq!(nothing_above(&limits[..1], &effects), None);
        assert_eq!(in_digits(2.04e-11), "2e-11");
    }
}
