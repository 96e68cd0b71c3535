//! Lakes of trials: `stretch-fleet`.

use std::process::ExitCode;

fn main() -> ExitCode {
    stretch_fleet_program::run(std::env::args_os())
}
