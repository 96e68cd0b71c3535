#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

mod biquad;
mod cadence;
mod cost;
mod differentiator;
mod error;
mod fir;
mod fixed_biquad;
mod fixed_float;
mod fixed_savgol;
mod fixed_taps;
mod gram;
pub mod log;
mod low_pass;
mod named;
mod rate_filter;
mod sample;
mod savgol;
mod sg_filter;
mod tracker;

pub use biquad::{Biquad, BiquadMemory, BiquadSpec};
pub use cadence::{Arrival, Cadence, CadenceMemory};
pub use cost::Cost;
pub use differentiator::{Differentiator, DifferentiatorMemory};
pub use error::FilterError;
pub use fixed_biquad::{FixedBiquad, FixedBiquadMemory};
pub use fixed_float::IntegerSgRate;
pub use fixed_savgol::{FixedSample, FixedSgIntegers, FixedSgMemory, FixedSgRate};
pub use fixed_taps::MAX_FIXED_SG_DEGREE;
pub use gram::MAX_SG_DEGREE;
pub use low_pass::{LowPass, LowPassMemory, LowPassSpec, MAX_ORDER};
pub use named::NamedRate;
pub use rate_filter::{RateFilter, RateMemory};
pub use sample::{LARGEST_SAMPLE, MAX_SAMPLE_RATE_HZ, MIN_SAMPLE_RATE_HZ};
pub use savgol::{SavitzkyGolay, SgMemory, SgRate, SgSmooth};
pub use sg_filter::{SgFilter, SgShape};
pub use tracker::{Track, Tracker, TrackerMemory, TrackerSpec};
