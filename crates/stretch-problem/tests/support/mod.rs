//! Helpers that the tests share: seeded noise, sets of effects given by name, a rig whose parameters
//! are not nominal but within their tolerances, removal of rows, and small simulated sessions.

pub(crate) mod effects;
pub(crate) mod rigs;
pub(crate) mod rows;
pub(crate) mod session;

/// Uniform numbers from a congruential generator, and sums of twelve of them as noise.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(crate) fn gauss(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}
