//! Consecutive values: their mean, their variance, and the number of independent values that they
//! count as.

/// Number of independent values that correlated ones count as, and the standard deviation of one,
/// from their variance about their mean.
///
/// Consecutive values are alike if their correlation `r` is above zero: `n` of them count as `n (1 -
/// r)/(1 + r)` (Bayley and Hammersley, J. Roy. Stat. Soc. Suppl. 8 (1946) 184, for a process of
/// first order). Their mean is as accurate as that of so many independent values, and so is their
/// variance.
pub(crate) fn independent(count: f64, variance: f64, alike: f64) -> (f64, f64) {
    let independent = count * (1.0 - alike) / (1.0 + alike);
    (independent, (variance * independent / (independent - 1.0)).sqrt())
}

/// Consecutive values in stretches.
pub(crate) struct Levels {
    pub(crate) mean: f64,
    /// About the mean, over their count.
    pub(crate) variance: f64,
    /// Correlation of neighbours.
    pub(crate) alike: f64,
    pub(crate) count: f64,
}

/// Mean, variance and correlation of values in stretches; `None` without values.
pub(crate) fn levels(stretches: &[Vec<f64>]) -> Option<Levels> {
    let all: Vec<f64> = stretches.iter().flatten().copied().collect();
    let count = all.len() as f64;
    let mean = all.iter().sum::<f64>() / count;
    let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    let products: f64 = stretches
        .iter()
        .flat_map(|own| own.windows(2))
        .map(|pair| (pair[0] - mean) * (pair[1] - mean))
        .sum();
    let pairs: usize = stretches.iter().map(|own| own.len().saturating_sub(1)).sum();
    let alike = match pairs {
        0 => 0.0,
        pairs => products / pairs as f64 / variance,
    };
    (count > 0.0).then_some(Levels { mean, variance, alike, count })
}
