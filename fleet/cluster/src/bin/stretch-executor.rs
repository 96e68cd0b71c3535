//! The program `stretch-executor`. See the crate's documentation.

use clap::Parser;
use stretch_fleet_cluster::{ExecutorOptions, run_executor};

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    run_executor(ExecutorOptions::parse()).await
}
