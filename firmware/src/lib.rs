//! Code shared by the programs in `src/bin`. See the README of this package.
#![no_std]

pub mod board;
pub mod checksum;
pub mod count;
pub mod gauges;
pub mod measure;
pub mod stack;
pub mod trial;

use semihosting as _; // the panic handler: prints, and leaves the emulator with 101
