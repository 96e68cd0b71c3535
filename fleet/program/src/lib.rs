//! Lakes of trials: what the program `stretch-fleet` does.

mod calibrate;
mod candidates;
mod command;
mod data_sets;
mod diagnose;
mod drift;
mod false_discovery;
mod flat;
mod from_path;
mod ingest;
mod known;
mod lake;
mod lock;
mod make;
mod month_test;
mod panics;
mod prior;
mod records;
mod session;
mod show;
mod sources;
mod sql;
mod states;

pub use command::run;
