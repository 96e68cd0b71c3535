//! Checks whether each of several gauges still agrees with the others.

use stretch_core::{Design, Real};
use stretch_receptor::numbers::rounded;

use crate::{ARRAY_TERMS, ArrayCalibration, ArrayGains};

use super::receptor::{ArrayMemory, ArrayReceptor};

/// Values per second in a block's mean. Movements of a body or a muscle are slower.
const VALUES_A_SECOND: f64 = 10.0;

/// Detector of gauges that deviate more than usual from the prediction of the others.
///
/// A gauge that was put on again, or whose zero has drifted, gives another estimate than the
/// others. Its difference is `d = alone - without`: the estimate from this gauge alone minus the
/// estimate from all others ([`ArrayReceptor::differences`]), taken ten times a second. The
/// deviation of the gauge is the mean of `d` in a block minus the usual mean, in the reference's
/// unit, and `r` is the deviation divided by the limit in the calibration
/// ([`ArrayShifts`](crate::ArrayShifts)).
///
/// If `|r|` of any gauge exceeds 1, a gauge has shifted. It need not be the gauge with the largest `|r|`, because a
/// shift of one gauge changes the differences of all gauges. A shift of gauge `k` changes the vector of all `r` along a
/// unit vector `m_k` that follows from the gains. It leaves `e_k = max |r - (m_k'r) m_k|` unexplained. A gauge may have
/// shifted if its `e` is the smallest, at most 1, or at most twice the smallest. If this holds for several gauges, the
/// data cannot tell which of them has shifted.
///
/// A gauge that deviates from the first sample of a block on is reported at the end of that block. A report therefore
/// takes at most two blocks. The signals alone show neither a shift that all gauges share, nor which of only two gauges
/// has shifted. Cost: for each channel, the products of an estimate, ten times a second.
///
/// ```
/// use stretch_core::{Design, Stage};
/// use stretch_sleeve::{ArrayReceptor, ShiftWatch, example_array};
/// let calibration = example_array();
/// let receptor = ArrayReceptor::<f32, 2>::new(&calibration);
/// let watch = ShiftWatch::<f32, 2>::new(&calibration).expect("the record says what is usual");
/// let (mut memory, mut blocks) = (receptor.memory(), watch.memory());
/// let mut last = None;
/// for n in 0..1000 {
///     // both follow 1.5 V; the first was put on again 0.2 V higher, which is 18 degrees
///     let volts = 1.5 + 0.1 * ((n % 100) as f32 / 50.0 - 1.0);
///     let _ = receptor.step(&mut memory, [volts + 0.2, volts]);
///     last = watch.step(&mut blocks, &receptor, &memory).or(last);
/// }
/// let shifts = last.expect("two blocks of 5 s have ended");
/// assert!(shifts.may_have_shifted(0) && (shifts.off[0] - 18.0).abs() < 1.0);
/// // it is the first or the second
/// assert!(shifts.may_have_shifted(1));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShiftWatch<T, const N: usize> {
    /// Number of gauges.
    pub channels: usize,
    /// Number of samples between two values.
    pub samples_a_value: u32,
    /// Number of values in a block.
    pub values_a_block: u32,
    /// The usual mean of each gauge's difference.
    pub usual: [T; N],
    /// Largest deviation of a block's mean from the usual mean.
    pub limits: [T; N],
    /// For each gauge: the unit vector along which a shift of this gauge changes the deviations,
    /// each divided by its limit.
    pub along: [[T; N]; N],
    /// Reciprocal of the number of values in a block.
    pub per_block: T,
}

/// Memory of a [`ShiftWatch`]: the sums of the current block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShiftMemory<T, const N: usize> {
    sums: [T; N],
    values: u32,
    samples: u32,
}

/// Result for every gauge at the end of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Shifts<T, const N: usize> {
    /// Deviation of each gauge from the prediction of the others, in the reference's unit. It is a
    /// lower bound, because states outside their domains are clamped.
    pub off: [T; N],
    /// One bit for each gauge that may have shifted; 0 if no deviation exceeds its limit. The lowest
    /// bit is that of the first gauge.
    pub shifted: u16,
}

impl<T, const N: usize> Shifts<T, N> {
    /// Returns whether a gauge may have shifted. If this is true for one gauge only, that gauge has shifted.
    pub fn may_have_shifted(&self, channel: usize) -> bool {
        channel < 16 && self.shifted & (1 << channel) != 0
    }
}

/// Returns the number of samples between two values of a block, and the number of values in a block
/// of `block_s` seconds.
///
/// ```
/// assert_eq!(stretch_sleeve::block_of(100.0, 5.0), (10, 50));
/// assert_eq!(stretch_sleeve::block_of(4.0, 5.0), (1, 20));
/// ```
pub fn block_of(sample_rate_hz: f64, block_s: f64) -> (u32, u32) {
    // the cast saturates
    let whole = |x: f64| (x + 0.5).max(1.0) as u32;
    let samples = whole(sample_rate_hz / VALUES_A_SECOND);
    (samples, whole(block_s * sample_rate_hz / f64::from(samples)))
}

impl<T: Real, const N: usize> Design for ShiftWatch<T, N> {
    type Memory = ShiftMemory<T, N>;

    fn memory(&self) -> Self::Memory {
        ShiftMemory { sums: [T::zero(); N], values: 0, samples: 0 }
    }
}

impl<T: Real, const N: usize> ShiftWatch<T, N> {
    /// Creates the detector for a calibration; `None` if the calibration does not contain the usual
    /// differences.
    pub fn new(calibration: &ArrayCalibration<N>) -> Option<Self> {
        let of = calibration.spec().shifts.as_ref()?;
        let (samples_a_value, values_a_block) =
            block_of(calibration.spec().sample_rate_hz.hz(), of.block_s);
        Some(Self {
            channels: calibration.spec().channels.len(),
            samples_a_value,
            values_a_block,
            usual: rounded(of.usual.iter().copied()),
            limits: rounded(of.limits.iter().copied()),
            along: along(calibration, &of.limits),
            per_block: T::from_f64(1.0 / f64::from(values_a_block)),
        })
    }

    /// Takes the state of the receptor, and returns a result at the end of a block. Call this after
    /// each step of the receptor. A block restarts if a channel is lost or has no sample.
    pub fn step(
        &self,
        memory: &mut ShiftMemory<T, N>,
        receptor: &ArrayReceptor<T, N>,
        of: &ArrayMemory<T, N>,
    ) -> Option<Shifts<T, N>> {
        memory.samples += 1;
        if memory.samples < self.samples_a_value {
            return None;
        }
        memory.samples = 0;
        let Some(differences) = receptor.differences(of) else {
            *memory = self.memory();
            return None;
        };
        for (sum, d) in memory.sums.iter_mut().zip(differences) {
            *sum = *sum + d;
        }
        memory.values += 1;
        if memory.values < self.values_a_block {
            return None;
        }
        let sums = memory.sums;
        *memory = self.memory();
        Some(self.judged(&sums))
    }

    fn judged(&self, sums: &[T; N]) -> Shifts<T, N> {
        let mut shifts = Shifts { off: [T::zero(); N], shifted: 0 };
        let mut shares = [T::zero(); N];
        let mut exceeds = false;
        for (k, sum) in sums.iter().enumerate().take(self.channels) {
            shifts.off[k] = *sum * self.per_block - self.usual[k];
            shares[k] = shifts.off[k] / self.limits[k];
            exceeds |= shares[k].abs() > T::one();
        }
        if !exceeds {
            return shifts;
        }
        let mut left = [T::zero(); N];
        let mut least = T::zero();
        for k in 0..self.channels {
            left[k] = self.left(k, &shares);
            least = if k == 0 { left[k] } else { least.min(left[k]) };
        }
        let most = (least + least).max(T::one());
        for (k, left) in left.iter().enumerate().take(self.channels) {
            shifts.shifted |= u16::from(*left <= most) << k;
        }
        shifts
    }

    /// Returns the largest deviation, as a share of its limit, that a shift of gauge `k` does not
    /// explain.
    fn left(&self, k: usize, shares: &[T; N]) -> T {
        let along = &self.along[k];
        let mut size = T::zero();
        for j in 0..self.channels {
            size = size + along[j] * shares[j];
        }
        let mut left = T::zero();
        for j in 0..self.channels {
            left = left.max((shares[j] - size * along[j]).abs());
        }
        left
    }
}

/// Returns for each gauge the unit vector along which a shift of this gauge changes the deviations of all gauges, each
/// divided by its limit. The gauge's own deviation changes by the slope of the estimate from this gauge alone. The
/// deviation of another gauge changes by minus the slope of the estimate without that other gauge. A slope is the mean
/// over the domain of the signal.
fn along<T: Real, const N: usize>(
    calibration: &ArrayCalibration<N>,
    limits: &[f64],
) -> [[T; N]; N] {
    let spec = calibration.spec();
    // Marks the terms that are odd powers of the signal, without memory states.
    let mut is_odd = [false; ARRAY_TERMS];
    let mut powers = [0u8; 1 + ARRAY_TERMS];
    let mut term = 0;
    spec.shape().each_product(|parent, state| {
        // A product with a memory state gets the power 0, which is even.
        let power =
            if state == 0 && (parent == 0 || powers[parent] > 0) { 1 + powers[parent] } else { 0 };
        term += 1;
        powers[term] = power;
        is_odd[term - 1] = power % 2 == 1;
    });
    let slope = |gains: &ArrayGains<N>, k: usize| -> f64 {
        let odd = gains.terms[k].iter().zip(is_odd).filter(|(_, is_odd)| *is_odd);
        odd.map(|(gain, _)| gain).sum()
    };
    let mut out = [[T::zero(); N]; N];
    for (k, out) in out.iter_mut().enumerate().take(spec.channels.len()) {
        let mut own = [0.0; N];
        for (j, own) in own.iter_mut().enumerate().take(spec.channels.len()) {
            let moved = if j == k { slope(&spec.alone[k], k) } else { -slope(&spec.without[j], k) };
            *own = moved / limits[j];
        }
        let length = Real::sqrt(own.iter().map(|x| x * x).sum::<f64>()).max(f64::MIN_POSITIVE);
        *out = rounded(own.iter().map(|x| x / length));
    }
    out
}
