//! Tests of the program `stretch-fleet` as a separate process.

mod bad_input;
mod cluster;
mod commands;
mod ingest;
mod jobs;
mod kills;
mod support;
