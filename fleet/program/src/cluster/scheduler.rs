//! The scheduler: takes queries from clients and gives tasks to executors that ask for them.

use std::{net::SocketAddr, sync::Arc};

use anyhow::anyhow;
use ballista_core::{
    config::TaskSchedulingPolicy,
    extension::SessionConfigExt,
    serde::{BallistaLogicalExtensionCodec, BallistaPhysicalExtensionCodec},
};
use ballista_scheduler::{
    cluster::BallistaCluster, config::SchedulerConfig, scheduler_process::start_server,
};
use datafusion::prelude::SessionConfig;

use super::{
    codec::{Marked, Release},
    ports::{address, before_port, chosen, guard},
    state_with_functions,
};
use crate::show::say;

/// Options of a scheduler.
#[derive(Debug, Clone, clap::Parser)]
#[command(name = "stretch-scheduler", version, about = "Distributes tasks of queries to executors")]
pub struct SchedulerOptions {
    /// Address to listen on.
    #[arg(long, default_value = "127.0.0.1")]
    pub bind_host: String,
    /// Port to listen on; 0 chooses a free one.
    #[arg(long, default_value_t = 50050)]
    pub port: u16,
    /// Seconds without a message from an executor after which its tasks go to others.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u64).range(2..))]
    pub executor_timeout_s: u64,
    /// Allow an address that other machines reach, although there is no authentication.
    #[arg(long)]
    pub insecure: bool,
}

/// Runs a scheduler until it is stopped. Prints one line when it is about to listen.
///
/// # Errors
/// A port in use, an invalid address, one that other machines reach without
/// [`insecure`](SchedulerOptions::insecure).
pub async fn run_scheduler(options: SchedulerOptions) -> anyhow::Result<()> {
    let host = address(&options.bind_host)?;
    guard("scheduler", host, options.insecure)?;
    let address = SocketAddr::new(host, chosen(host, options.port)?);
    let release = Release::own(format!("scheduler {address}"));
    let timeout = options.executor_timeout_s;
    let config = SchedulerConfig {
        bind_host: before_port(host),
        external_host: before_port(host),
        bind_port: address.port(),
        // Executors ask for work, so the scheduler never waits for a hanging one.
        scheduling_policy: TaskSchedulingPolicy::PullStaged,
        executor_timeout_seconds: timeout,
        expire_dead_executor_interval_seconds: (timeout / 2).max(1),
        no_executors_grace_period_seconds: timeout,
        override_config_producer: Some(Arc::new(SessionConfig::new_with_ballista)),
        override_session_builder: Some(Arc::new(|config| {
            Ok(state_with_functions().with_config(config).build())
        })),
        override_logical_codec: Some(Marked::<BallistaLogicalExtensionCodec>::new(&release)),
        override_physical_codec: Some(Marked::<BallistaPhysicalExtensionCodec>::new(&release)),
        ..SchedulerConfig::default()
    };
    say(format!("scheduler {} at df://{address}", release.version))?;
    let cluster = BallistaCluster::new_from_config(&config).await.map_err(|e| anyhow!("{e}"))?;
    start_server(cluster, address, Arc::new(config)).await.map_err(|e| anyhow!("{address}: {e}"))
}
