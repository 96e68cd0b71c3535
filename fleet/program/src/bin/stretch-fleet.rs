//! The program `stretch-fleet`, for lakes of trials.

use std::process::ExitCode;

fn main() -> ExitCode {
    stretch_fleet_program::run(std::env::args_os())
}
