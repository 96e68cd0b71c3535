#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

mod clock;
mod decoder;
mod frame;
mod text;

pub use clock::TimeLine;
pub use decoder::{Counts, Decoder, Event};
pub use frame::{Answer, Frame};
