//! Tests of the integer filters against exact integer arithmetic and against the float filters.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use proptest::{collection::vec, prelude::*};
use stretch_core::{Design, Hertz, Runner, SampleRate, Stage};
use stretch_filter::{
    BiquadSpec, FixedBiquad, FixedSample, FixedSgRate, IntegerSgRate, LowPassSpec, SgRate,
};

/// Streams with inputs that could overflow sums: extreme values and long constant runs.
fn stream_16() -> impl Strategy<Value = Vec<u16>> {
    let piece = prop_oneof![
        vec(any::<u16>(), 1..40),
        (prop_oneof![Just(0), Just(u16::MAX), any::<u16>()], 1..80usize)
            .prop_map(|(x, n)| vec![x; n]),
    ];
    vec(piece, 1..12).prop_map(|pieces| pieces.concat())
}

fn stream_32() -> impl Strategy<Value = Vec<i32>> {
    let end = prop_oneof![Just(0), Just(i32::MAX), Just(i32::MIN), any::<i32>()];
    let piece =
        prop_oneof![vec(any::<i32>(), 1..40), (end, 1..80usize).prop_map(|(x, n)| vec![x; n])];
    vec(piece, 1..12).prop_map(|pieces| pieces.concat())
}

/// Returns the taps of a shape, measured as its impulse response.
fn taps<S: FixedSample + From<u8>, const W: usize, const D: usize, const L: usize>() -> [i128; W] {
    let design = FixedSgRate::<S, W, D, L>::new();
    core::array::from_fn(|lag| {
        let mut memory = design.settled_at(S::from(0));
        design.step(&mut memory, S::from(1));
        for _ in 0..lag {
            let _ = design.step(&mut memory, S::from(0));
        }
        design.last(&memory).unwrap().into()
    })
}

/// Checks that after every sample the output equals the convolution, computed exactly in `i128`.
fn is_the_convolution<S, const W: usize, const D: usize, const L: usize>(
    stream: &[S],
    exact: [i128; W],
) -> Result<(), TestCaseError>
where
    S: FixedSample + Into<i64> + PartialEq,
{
    let mut rate = Runner::new(FixedSgRate::<S, W, D, L>::new());
    for (n, &x) in stream.iter().enumerate() {
        let out = rate.step(x);
        prop_assert_eq!(out.is_some(), n + 1 >= W);
        let Some(out) = out else { continue };
        let window = stream[n + 1 - W..=n].iter().rev();
        let sum: i128 = window.zip(exact).map(|(&x, tap)| i128::from(x.into()) * tap).sum();
        let shift = FixedSgRate::<S, W, D, L>::SHIFT;
        let half = (1i128 << shift) >> 1;
        prop_assert_eq!(i128::from(out), (sum + half) >> shift, "sample {}", n);
        prop_assert!(i128::from(out).abs() <= FixedSgRate::<S, W, D, L>::LARGEST.into());
    }
    Ok(())
}

/// Returns the integer taps of a shape, before its shift, computed from the float design.
fn float_taps<S: FixedSample, const W: usize, const D: usize, const L: usize>() -> [i128; W] {
    let unit = FixedSgRate::<S, W, D, L>::PER_SAMPLE;
    let full = (1i128 << FixedSgRate::<S, W, D, L>::SHIFT) as f64;
    let design = SgRate::<f64, W, D, L>::new(SampleRate::new(1.0).unwrap()).unwrap();
    design.taps().map(|tap| (tap / unit * full).round() as i128)
}

#[test]
fn impulses_give_the_exact_taps() {
    assert_eq!(taps::<u16, 11, 2, 0>(), float_taps::<u16, 11, 2, 0>());
    assert_eq!(taps::<u16, 7, 3, 1>(), float_taps::<u16, 7, 3, 1>());
    assert_eq!(taps::<u16, 5, 1, 2>(), float_taps::<u16, 5, 1, 2>());
    assert_eq!(FixedSgRate::<u16, 11, 2>::SHIFT, 0, "nothing is rounded");
}

proptest! {
    #[test]
    fn sixteen_bits_slide_without_error(stream in stream_16()) {
        is_the_convolution::<u16, 11, 2, 0>(&stream, float_taps::<u16, 11, 2, 0>())?;
        is_the_convolution::<u16, 7, 3, 1>(&stream, float_taps::<u16, 7, 3, 1>())?;
        is_the_convolution::<u16, 25, 2, 0>(&stream, float_taps::<u16, 25, 2, 0>())?;
        is_the_convolution::<u16, 31, 1, 15>(&stream, float_taps::<u16, 31, 1, 15>())?;
    }

    #[test]
    fn thirty_two_bits_slide_without_error(stream in stream_32()) {
        is_the_convolution::<i32, 11, 2, 0>(&stream, float_taps::<i32, 11, 2, 0>())?;
        is_the_convolution::<i32, 9, 3, 4>(&stream, float_taps::<i32, 9, 3, 4>())?;
        is_the_convolution::<i32, 25, 2, 0>(&stream, float_taps::<i32, 25, 2, 0>())?;
    }

    #[test]
    fn a_biquad_is_exact_and_saturates(
        stream in stream_32(), shape in 0..4usize, b in prop::array::uniform3(-2.0..2.0f64),
        a1 in -1.9..1.9f64, a2 in -0.99..0.99f64,
    ) {
        let low_pass = |cutoff| {
            let sample_rate = SampleRate::new(100.0).unwrap();
            let spec = LowPassSpec { cutoff: Hertz(cutoff), sample_rate };
            spec.design::<f64, 2>().unwrap().sections()[0].spec()
        };
        let spec = match shape {
            0 => low_pass(0.5),
            1 => low_pass(20.0),
            _ => BiquadSpec { b0: b[0], b1: b[1], b2: b[2], a1, a2 },
        };
        let Ok(design) = FixedBiquad::new(spec) else {
            prop_assert!(a1.abs() >= 1.0 + a2 - 1e-9, "refused {spec:?}");
            return Ok(());
        };
        // the same recursion in 128 bits, with the rounded coefficients
        let bits = (16..=30).rev().find(|&bits| {
            let one = 2f64.powi(bits);
            [spec.b0, spec.b1, spec.b2, spec.a1, spec.a2].iter().map(|c| c.abs()).sum::<f64>() * one
                < 4294967290.0
                && [spec.b0, spec.b1, spec.b2, spec.a1].iter().all(|c| c.abs() * one < 2147483647.0)
        }).unwrap();
        let run = design.spec();
        let c = [run.b0, run.b1, run.b2, -run.a1, -run.a2].map(|c| (c * 2f64.powi(bits)) as i128);
        let mut memory = design.memory();
        let (mut x1, mut x2, mut y1, mut y2, mut rest) = (0i128, 0, 0, 0, 1i128 << (bits - 1));
        for &x in &stream {
            let sum = rest + c[0] * i128::from(x) + c[1] * x1 + c[2] * x2 + c[3] * y1 + c[4] * y2;
            rest = sum & ((1 << bits) - 1);
            (x2, x1, y2) = (x1, x.into(), y1);
            y1 = (sum >> bits).clamp(i32::MIN.into(), i32::MAX.into());
            prop_assert_eq!(i128::from(design.step(&mut memory, x)), y1);
        }
    }

    #[test]
    fn an_integer_rate_is_the_float_rate(
        start in -3.0..3.0f32, steps in vec(-0.05..0.05f32, 60), hz in 1.0..1e4f64,
    ) {
        let sample_rate = SampleRate::new(hz).unwrap();
        let mut integer = Runner::new(IntegerSgRate::<11, 2>::new(sample_rate, 8.0).unwrap());
        let mut float = Runner::new(SgRate::<f64, 11, 2>::new(sample_rate).unwrap());
        let mut x = start;
        for step in steps {
            x = (x + step).clamp(-8.0, 8.0);
            let (Some(rate), exact) = (integer.step(x), float.step(x.into())) else { continue };
            // half a step of 2^-28 at each tap (their magnitudes sum to about 1), and of the
            // output, which is 16 times the sum; then two roundings in f32
            let bound = hz * 16.0 * 2f64.powi(-28) + exact.unwrap().abs() * 2f64.powi(-22);
            assert_abs_diff_eq!(f64::from(rate), exact.unwrap(), epsilon = bound);
        }
    }

    #[test]
    fn any_float_is_a_sample_or_none(bits in vec(any::<u32>(), 1..60)) {
        let mut rate = Runner::new(IntegerSgRate::<5, 2>::new(SampleRate::new(100.0).unwrap(), 3.3).unwrap());
        let mut seen = 0;
        for x in bits.into_iter().map(f32::from_bits) {
            let out = rate.step(x);
            seen += usize::from(x.abs() <= 1e18);
            prop_assert_eq!(out.is_some(), seen >= 5 && x.abs() <= 1e18);
            prop_assert!(out.is_none_or(f32::is_finite));
        }
    }
}

#[test]
fn a_constant_passes_a_low_pass_unchanged() {
    let sample_rate = SampleRate::new(100.0).unwrap();
    for cutoff in [0.1, 1.0, 10.0, 40.0] {
        let spec = LowPassSpec { cutoff: Hertz(cutoff), sample_rate };
        let section = spec.design::<f64, 2>().unwrap().sections()[0].spec();
        let design = FixedBiquad::new(section).unwrap();
        for x in [0, 1, -12345, 1 << 28] {
            let mut memory = design.settled_at(x);
            let exact = design.dc_gain() * f64::from(x);
            let errors: Vec<f64> =
                (0..4000).map(|_| f64::from(design.step(&mut memory, x)) - exact).collect();
            // the remainder of a shift, below one bit, is filtered by (1 - 1/z)/A(z), whose impulse
            // response has magnitudes that sum to at most 4 for these sections
            assert!(errors.iter().all(|error| error.abs() < 4.0), "{cutoff} Hz, {x}");
            let mean = errors.iter().sum::<f64>() / 4000.0;
            // the steady state starts at the nearest integer, at most half a bit away
            assert!(abs_diff_eq!(mean, 0.0, epsilon = 0.55), "{cutoff} Hz, {x}: {mean}");
        }
    }
}

#[test]
fn shapes_that_cannot_run_are_refused() {
    let fine = BiquadSpec { b0: 1.0, b1: 0.0, b2: 0.0, a1: 0.0, a2: 0.0 };
    assert!(FixedBiquad::new(fine).is_ok());
    assert!(FixedBiquad::new(BiquadSpec { a2: 1.0, ..fine }).is_err());
    assert!(FixedBiquad::new(BiquadSpec { a1: -2.0, a2: 1.0, ..fine }).is_err());
    assert!(FixedBiquad::new(BiquadSpec { b1: f64::NAN, ..fine }).is_err());
    assert!(FixedBiquad::new(BiquadSpec { b0: 1e6, ..fine }).is_err());
    let hz = SampleRate::new(100.0).unwrap();
    assert!(IntegerSgRate::<11, 2>::new(hz, 0.0).is_err());
    assert!(IntegerSgRate::<11, 2>::new(hz, f64::INFINITY).is_err());
}
