#![doc = include_str!("../README.md")]

mod client;
mod codec;
mod executor;
mod ports;
mod scheduler;

pub use client::connect;
pub use codec::Release;
pub use executor::{ExecutorOptions, run_executor};
pub use scheduler::{SchedulerOptions, run_scheduler};
