//! The rig: nominal parameters with tolerances, and the static force law. Each case draws its own
//! rig.

use crate::effect::Stage;
use crate::random::RandomGenerator;

/// Atmosphere, Pa.
pub(crate) const P_ATM: f64 = 101_325.0;
/// Specific gas constant of air times temperature, J/kg.
pub(crate) const R_T: f64 = 287.05 * 293.15;
/// Density of the reference state of the flow law, kg/m3.
pub(crate) const RHO_0: f64 = 1.185;
/// Chamber volume, m3.
pub(crate) const V_0: f64 = 25e-6;
/// Resting length, mm.
pub(crate) const L_0: f64 = 180.0;
/// Reference pressure of the force law, Pa.
pub(crate) const P_REF: f64 = 620e3;
/// Standard deviations of the noise: amplified voltage, V; length, mm; pressure, Pa.
pub(crate) const SIGMA_V: f64 = 0.002;
pub(crate) const SIGMA_L: f64 = 0.05;
pub(crate) const SIGMA_P: f64 = 1200.0;
/// Full scale of the voltage converter and its step, V.
pub(crate) const V_FS: f64 = 3.3;
pub(crate) const V_STEP: f64 = V_FS / 4095.0;
/// Step of the length converter, mm.
pub(crate) const L_STEP: f64 = 50.0 / 4095.0;
/// Smallest strain of the sleeve over the stroke.
pub(crate) const LEAST_STRAIN: f64 = 0.004;

/// One uncertain parameter: name, stage, nominal value, standard deviation.
pub(crate) struct Uncertain {
    pub(crate) name: &'static str,
    pub(crate) stage: Stage,
    pub(crate) value: f64,
    pub(crate) sd: f64,
}

const fn relative(name: &'static str, stage: Stage, value: f64, share: f64) -> Uncertain {
    Uncertain { name, stage, value, sd: value * share }
}

/// All parameters that are not exact, in the order of [`Rig::values`].
pub(crate) const UNCERTAIN: [Uncertain; 16] = [
    relative("P_s", Stage::Pneumatics, 620e3, 0.01),
    relative("C_in", Stage::Pneumatics, 1e-9, 0.3),
    relative("C_out", Stage::Pneumatics, 1e-9, 0.3),
    relative("b", Stage::Pneumatics, 0.35, 0.1),
    relative("u_min", Stage::Pneumatics, 0.02, 0.2),
    relative("k_max", Stage::Muscle, 0.162, 0.1),
    relative("a0", Stage::Muscle, 0.5822, 0.05),
    relative("a1", Stage::Muscle, 4.142, 0.05),
    relative("a3", Stage::Muscle, 0.5368, 0.05),
    relative("tau_m", Stage::Muscle, 0.03, 0.5),
    relative("e0", Stage::Sensing, 0.22, 0.1),
    relative("R0", Stage::Sensing, 4.0, 0.1),
    relative("beta", Stage::Sensing, 1.0, 0.01),
    relative("V_exc", Stage::Sensing, 1.2, 0.01),
    relative("G", Stage::Sensing, 10.0, 0.01),
    Uncertain { name: "V_ref", stage: Stage::Sensing, value: 1.24, sd: 0.02 },
];

/// Values of the uncertain parameters, and the inverse of the force law with these values.
#[derive(Debug, Clone)]
pub(crate) struct Rig {
    /// Values in the order of [`UNCERTAIN`].
    pub(crate) values: [f64; UNCERTAIN.len()],
    contraction: Vec<f64>,
}

/// Number of intervals of the table of the inverse, and the largest pressure ratio in the table.
const KNOTS: usize = 4096;
const RATIO_MAX: f64 = 1.7;

macro_rules! named {
    ($($name:ident = $index:literal),* $(,)?) => {
        $(pub(crate) fn $name(&self) -> f64 { self.values[$index] })*
    };
}

impl Rig {
    named!(p_s = 0, c_in = 1, c_out = 2, b = 3, u_min = 4, k_max = 5, tau_m = 9);
    named!(e0 = 10, r0 = 11, beta = 12, v_exc = 13, gain = 14, v_ref = 15);

    /// Creates the rig with these values, and the table of its static contraction.
    pub(crate) fn new(values: [f64; UNCERTAIN.len()]) -> Self {
        let (a0, a1, a3) = (values[6], values[7], values[8]);
        let mut contraction = Vec::with_capacity(KNOTS + 1);
        let mut x = 0.0_f64;
        for knot in 0..=KNOTS {
            let ratio = RATIO_MAX * knot as f64 / KNOTS as f64;
            // Newton's method starts at the previous knot. It converges because the law is smooth
            // and strictly rising.
            for _ in 0..6 {
                let (decay, growth) = ((-a1 * x).exp(), (a3 * x * x).exp());
                let law = a0 * (1.0 - decay) * growth;
                let slope = a0 * growth * (a1 * decay + 2.0 * a3 * x * (1.0 - decay));
                x -= (law - ratio) / slope;
            }
            contraction.push(x * values[5]);
        }
        Self { values, contraction }
    }

    /// Returns the rig with the nominal values.
    #[cfg(test)]
    pub(crate) fn nominal() -> Self {
        Self::new(std::array::from_fn(|i| UNCERTAIN[i].value))
    }

    /// Draws a rig within the tolerances. The parameters are Gaussian, limited to 2.5 standard
    /// deviations and to at least 0.2 of the nominal value. The rig is drawn again until the sleeve
    /// stays stretched over the static stroke.
    pub(crate) fn draw(random: &mut RandomGenerator) -> Self {
        loop {
            let rig = Self::new(std::array::from_fn(|i| {
                let Uncertain { value, sd, .. } = UNCERTAIN[i];
                loop {
                    let z = random.gauss();
                    let drawn = value + z * sd;
                    if z.abs() <= 2.5 && drawn >= 0.2 * value {
                        break drawn;
                    }
                }
            }));
            if rig.strain(rig.static_contraction(rig.p_s() * 1.01 + P_ATM)) > LEAST_STRAIN {
                return rig;
            }
        }
    }

    /// Returns the same rig with parameter `index` changed by `step`.
    pub(crate) fn moved(&self, index: usize, step: f64) -> Self {
        let mut values = self.values;
        values[index] += step;
        Self::new(values)
    }

    /// Returns the contraction at rest, without load, at an absolute pressure in Pa.
    pub(crate) fn static_contraction(&self, p: f64) -> f64 {
        let at = ((p - P_ATM) / P_REF).clamp(0.0, RATIO_MAX) * (KNOTS as f64 / RATIO_MAX);
        let knot = (at as usize).min(KNOTS - 1);
        let (low, high) = (self.contraction[knot], self.contraction[knot + 1]);
        low + (high - low) * (at - knot as f64)
    }

    /// Returns the gauge strain at the contraction `k`.
    pub(crate) fn strain(&self, k: f64) -> f64 {
        (1.0 + self.e0()) * (1.0 - k) - 1.0
    }

    /// Returns the amplified bridge voltage at a gauge resistance in ohm and an excitation in V.
    pub(crate) fn bridge(&self, ohm: f64, excitation: f64) -> f64 {
        let arm = self.beta() * self.r0() * (1.0 + self.e0()).powi(2);
        self.v_ref() + self.gain() * excitation * (0.5 - ohm / (ohm + arm))
    }

    /// Returns the voltage at a contraction, without effects, noise and converter.
    pub(crate) fn volts(&self, k: f64) -> f64 {
        self.bridge(self.r0() * (1.0 + self.strain(k)).powi(2), self.v_exc())
    }

    /// Returns the flow from `p1` to `p2` through the conductance `c` by ISO 6358, kg/s. It is 0 if
    /// `p2` is larger.
    pub(crate) fn flow(&self, c: f64, p1: f64, p2: f64) -> f64 {
        let r = p2 / p1;
        let b = self.b();
        let psi = if r <= b {
            1.0
        } else if r < 1.0 {
            (1.0 - ((r - b) / (1.0 - b)).powi(2)).sqrt()
        } else {
            0.0
        };
        c * RHO_0 * p1 * psi
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_abs_diff_eq};
    use testkit::tolerance::{BLIND_LAW_TABLE, K_MAX_DIGITS};

    #[test]
    fn force_law_is_inverted() {
        let rig = Rig::nominal();
        // The law reaches x = 1.0176 at the reference pressure.
        let x = rig.static_contraction(P_REF + P_ATM) / rig.k_max();
        assert_abs_diff_eq!(x, 1.0176, epsilon = K_MAX_DIGITS);
        for ratio in [0.05, 0.31, 0.77, 1.2] {
            let x = rig.static_contraction(ratio * P_REF + P_ATM) / 0.162;
            let law = 0.5822 * (1.0 - (-4.142 * x).exp()) * (0.5368 * x * x).exp();
            assert!(abs_diff_eq!(law, ratio, epsilon = BLIND_LAW_TABLE), "{ratio}: {law}");
        }
    }

    #[test]
    fn drawn_rigs_stay_within_their_tolerances() {
        let mut random = RandomGenerator::new(3, 0);
        for _ in 0..200 {
            let rig = Rig::draw(&mut random);
            for (value, p) in rig.values.iter().zip(&UNCERTAIN) {
                assert!((value - p.value).abs() <= 2.5 * p.sd * (1.0 + 1e-12), "{}", p.name);
                assert!(*value >= 0.2 * p.value, "{}", p.name);
            }
            assert!(rig.strain(rig.static_contraction(rig.p_s() + P_ATM)) > LEAST_STRAIN);
        }
    }
}
