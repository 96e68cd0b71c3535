#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

mod agreement;
mod beta;
mod blocks;
mod error;
mod error_stats;
pub mod fisher_f;
mod lag;
mod paired;
pub mod student_t;
mod sum;

pub use agreement::{Agreement, AgreementSpec, Delta};
pub use blocks::{BlockMeans, PairedBlocks};
pub use error::MetricsError;
pub use error_stats::{ErrorStats, Pair};
pub use lag::{Lag, lag};
pub use paired::{PairedT, TTest};
