//! Runs the queries of `stretch-fleet` on many machines, with Apache Ballista: a scheduler,
//! executors that ask it for work, and a session that sends its queries there. The README of
//! `fleet/` lists the guarantees of a cluster.
//!
//! ```no_run
//! # async fn ask() -> datafusion::error::Result<()> {
//! use datafusion::prelude::{ParquetReadOptions, SessionConfig};
//! let session =
//!     stretch_fleet_program::cluster::connect("df://127.0.0.1:50050", SessionConfig::new(), Default::default()).await?;
//! session.register_parquet("trials", "/srv/lake/trials", ParquetReadOptions::default()).await?;
//! session.sql("select sensor, poly13_fit(rate, bridge_v, contraction) from trials group by sensor").await?.show().await
//! # }
//! ```

mod codec;
mod executor;
mod ports;
mod scheduler;

use std::sync::Arc;

use ballista::prelude::{SessionConfigExt, SessionContextExt};
use ballista_core::serde::{BallistaLogicalExtensionCodec, BallistaPhysicalExtensionCodec};
use codec::Marked;
use datafusion::{
    common::{Result, config_datafusion_err},
    execution::{SessionStateBuilder, runtime_env::RuntimeEnv},
    prelude::{SessionConfig, SessionContext},
};

use codec::Release;
pub use executor::{ExecutorOptions, run_executor};
pub use scheduler::{SchedulerOptions, run_scheduler};

/// A session that sends its queries to the scheduler at `url`, such as `df://10.0.0.1:50050`, with
/// all functions registered. Executors read the paths of tables, so they must see the lake at the
/// same path as this machine.
///
/// # Errors
/// A URL that names no scheduler. A scheduler that does not answer is an error of the first query.
pub async fn connect(
    url: &str,
    config: SessionConfig,
    runtime: Arc<RuntimeEnv>,
) -> Result<SessionContext> {
    let address = url.strip_prefix("df://").filter(|rest| !rest.is_empty()).ok_or_else(|| {
        config_datafusion_err!("{url:?} is not the address of a scheduler: write df://host:port")
    })?;
    let release = Release::own("this program");
    let config = config
        .upgrade_for_ballista()
        .with_ballista_logical_extension_codec(Marked::<BallistaLogicalExtensionCodec>::new(
            &release,
        ))
        .with_ballista_physical_extension_codec(Marked::<BallistaPhysicalExtensionCodec>::new(
            &release,
        ));
    let state = state_with_functions().with_config(config).with_runtime_env(runtime).build();
    let session = SessionContext::remote_with_state(&format!("df://{address}"), state).await?;
    // Ballista replaces the functions of the state, so ours are registered again.
    stretch_fleet::register(&session);
    Ok(session)
}

/// Returns the session state with our functions, for a client, a scheduler or an executor.
fn state_with_functions() -> SessionStateBuilder {
    SessionStateBuilder::new()
        .with_aggregate_functions(stretch_fleet::aggregates())
        .with_scalar_functions(stretch_fleet::scalars())
        .with_default_features()
}
