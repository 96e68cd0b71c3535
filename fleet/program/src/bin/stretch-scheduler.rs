//! The program `stretch-scheduler`. See `stretch_fleet_program::cluster`.

use clap::Parser;
use stretch_fleet_program::cluster::{SchedulerOptions, run_scheduler};

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    run_scheduler(SchedulerOptions::parse()).await
}
