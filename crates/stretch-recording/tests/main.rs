//! Integration tests of stretch-recording, in one program because linking takes longer than most of them.

mod bad_input;
mod bad_rows;
mod bare;
mod clocks;
mod corpus;
mod data_sets;
mod dialects;
mod found;
mod headers;
mod memory;
mod recordings;
mod round_trips;
