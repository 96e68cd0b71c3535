//! The program `stretch-fleet`, for lakes of trials: folders of Parquet files, one per trial.

use std::process::ExitCode;

fn main() -> ExitCode {
    stretch_fleet_program::run(std::env::args_os())
}
