//! Isotonic regression: the nearest rising curve.

/// The nearest curve that rises by at least `step` from knot to knot: neighbouring knots that violate this are
/// averaged (Ayer et al. 1955, doi:10.1214/aoms/1177728423).
pub(crate) fn rising(knots: &[f64], step: f64) -> Vec<f64> {
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for (k, knot) in knots.iter().enumerate() {
        pools.push((knot - step * k as f64, 1));
        while let [.., (a, n), (b, m)] = pools[..]
            && a >= b
        {
            pools.truncate(pools.len() - 2);
            let count = n + m;
            pools.push(((a * n as f64 + b * m as f64) / count as f64, count));
        }
    }
    let flat = pools.iter().flat_map(|&(level, count)| std::iter::repeat_n(level, count));
    flat.enumerate().map(|(k, level)| level + step * k as f64).collect()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use testkit::tolerance::F64_ROUNDING;

    use super::rising;

    #[test]
    fn pools_are_averaged_and_rising_curves_kept() {
        assert_eq!(rising(&[0.0, 2.0, 1.0, 3.0], 0.0), [0.0, 1.5, 1.5, 3.0]);
        assert_eq!(rising(&[0.0, 1.0, 2.0], 0.5), [0.0, 1.0, 2.0]);
        let least = rising(&[3.0, 2.0, 1.0], 0.5);
        for pair in least.windows(2) {
            assert_abs_diff_eq!(pair[1] - pair[0], 0.5, epsilon = F64_ROUNDING);
        }
    }
}
