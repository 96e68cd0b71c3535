//! An executor: asks the scheduler for tasks, and computes them.

use std::{path::PathBuf, sync::Arc};

use anyhow::{Context, anyhow, ensure};
use ballista_core::{
    config::TaskSchedulingPolicy,
    registry::BallistaFunctionRegistry,
    serde::{BallistaLogicalExtensionCodec, BallistaPhysicalExtensionCodec},
};
use ballista_executor::executor_process::{ExecutorProcessConfig, start_executor_process};

use super::{
    codec::{Marked, Release},
    ports::{address, address_towards, before_port, chosen, guard},
    state_with_functions,
};
use crate::show::say;

/// Options of an executor.
#[derive(Debug, Clone, clap::Parser)]
#[command(name = "stretch-executor", version, about = "Computes tasks for a scheduler")]
pub struct ExecutorOptions {
    /// The scheduler: host:port.
    #[arg(long, default_value = "127.0.0.1:50050")]
    pub scheduler: String,
    /// Address to listen on; by default, the one under which the scheduler sees this machine.
    #[arg(long)]
    pub bind_host: Option<String>,
    /// Host under which other machines reach this one, if it is not that address.
    #[arg(long)]
    pub external_host: Option<String>,
    /// Allow an address that other machines reach, although there is no authentication.
    #[arg(long)]
    pub insecure: bool,
    /// Port on which others fetch results; 0 chooses a free one.
    #[arg(long, default_value_t = 0)]
    pub port: u16,
    /// Number of simultaneous tasks; 0 means one per core.
    #[arg(long, default_value_t = 0)]
    pub tasks: usize,
    /// Folder for intermediate results of stages; by default, a temporary one.
    #[arg(long)]
    pub work_dir: Option<PathBuf>,
    /// Memory for all tasks, in megabytes; groups that need more are written to the folder. By
    /// default, nine tenths of the machine's memory.
    #[arg(long)]
    pub memory_mb: Option<u64>,
    /// Claims another release than that of this program, to test a cluster's reaction.
    #[arg(long, hide = true)]
    pub claim_release: Option<String>,
}

/// Runs an executor until it is stopped. Waits up to a minute for its scheduler.
///
/// # Errors
/// A scheduler that does not answer, a port in use, an address that other machines reach without
/// [`insecure`](ExecutorOptions::insecure), or one that they do not reach although the scheduler
/// would send them there.
pub async fn run_executor(options: ExecutorOptions) -> anyhow::Result<()> {
    let (host, port) = options
        .scheduler
        .trim_start_matches("df://")
        .rsplit_once(':')
        .with_context(|| format!("--scheduler {}: write host:port", options.scheduler))?;
    let scheduler_port: u16 = port.parse().with_context(|| {
        format!("--scheduler {}: {port} is not a port number", options.scheduler)
    })?;
    let seen_as = address_towards(host, scheduler_port)?;
    let listens_on = options.bind_host.as_deref().map_or(Ok(seen_as), address)?;
    guard("executor", listens_on, options.insecure)?;
    // The announced address must be the one on which the executor listens.
    ensure!(
        options.external_host.is_some() || !listens_on.is_loopback() || seen_as.is_loopback(),
        "--bind-host {listens_on}: other machines cannot reach this address, but the scheduler at {host} would send them there; leave \
         the option out, or add --external-host"
    );
    let own = if listens_on.is_unspecified() { seen_as } else { listens_on };
    let shown = options.external_host.unwrap_or_else(|| before_port(own));
    let port = chosen(listens_on, options.port)?;
    let mut release = Release::own(format!("executor {shown}:{port}"));
    if let Some(version) = options.claim_release {
        release.version = version;
    }
    let functions = BallistaFunctionRegistry::from(&state_with_functions().build());
    // Removed when the executor stops, but not when it is killed.
    let temporary = tempfile::Builder::new().prefix("stretch-executor-").tempdir()?;
    let work_dir = options.work_dir.unwrap_or_else(|| temporary.path().to_owned());
    let config = ExecutorProcessConfig {
        grpc_port: chosen(listens_on, 0)?,
        bind_host: before_port(listens_on),
        external_host: Some(shown),
        port,
        scheduler_host: host.to_owned(),
        scheduler_port,
        scheduler_connect_timeout_seconds: 60,
        vcores: options.tasks,
        task_scheduling_policy: TaskSchedulingPolicy::PullStaged,
        work_dir: Some(work_dir.display().to_string()),
        memory_pool_size: options.memory_mb.map(|mb| mb << 20),
        override_function_registry: Some(Arc::new(functions)),
        override_logical_codec: Some(Marked::<BallistaLogicalExtensionCodec>::new(&release)),
        override_physical_codec: Some(Marked::<BallistaPhysicalExtensionCodec>::new(&release)),
        ..ExecutorProcessConfig::default()
    };
    say(format!("{} {} for df://{host}:{scheduler_port}", release.who, release.version))?;
    start_executor_process(Arc::new(config)).await.map_err(|e| anyhow!("{}: {e}", release.who))
}
