//! The program `stretch-executor`. See `stretch_fleet_program::cluster`.

use clap::Parser;
use stretch_fleet_program::cluster::{ExecutorOptions, run_executor};

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    run_executor(ExecutorOptions::parse()).await
}
