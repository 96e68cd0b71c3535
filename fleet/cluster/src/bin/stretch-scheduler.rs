//! The program `stretch-scheduler`. See the crate's documentation.

use clap::Parser;
use stretch_fleet_cluster::{SchedulerOptions, run_scheduler};

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    run_scheduler(SchedulerOptions::parse()).await
}
