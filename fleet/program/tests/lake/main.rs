//! The program `stretch-fleet`, run as it is run.

mod bad_input;
mod cluster;
mod commands;
mod ingest;
mod jobs;
mod kills;
mod support;
