//! Which of many tests to believe.

/// The q-value of each P: the smallest false-discovery rate at which it would be reported
/// (Benjamini and Hochberg 1995, doi 10.1111/j.2517-6161.1995.tb02031.x). Of those with q up to
/// 0.05 one in twenty is expected to be a false alarm, whether the tests are independent or
/// positively correlated.
pub(crate) fn q_values(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[b].total_cmp(&p[a]));
    let mut q = vec![1.0; p.len()];
    let mut least = 1.0_f64;
    for (behind, &i) in order.iter().enumerate() {
        let rank = p.len() - behind;
        least = least.min(p[i] * p.len() as f64 / rank as f64);
        q[i] = least;
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As R's p.adjust(c(0.01, 0.02, 0.03, 0.04, 0.05), "BH") and of unordered ones with ties.
    #[test]
    fn q_values_are_those_of_the_textbook() {
        let q = q_values(&[0.01, 0.02, 0.03, 0.04, 0.05]);
        assert!(q.iter().all(|q| (q - 0.05).abs() < 1e-15), "{q:?}");
        let q = q_values(&[0.9, 0.001, 0.04, 0.001]);
        for (q, expected) in q.iter().zip([0.9, 0.002, 0.16 / 3.0, 0.002]) {
            assert!((q - expected).abs() < 1e-15, "{q} {expected}");
        }
        assert!(q_values(&[]).is_empty());
    }
}
