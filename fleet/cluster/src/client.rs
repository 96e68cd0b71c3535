//! A session whose queries run on a cluster.

use ballista::prelude::{SessionConfigExt, SessionContextExt};
use ballista_core::serde::{BallistaLogicalExtensionCodec, BallistaPhysicalExtensionCodec};
use datafusion::{
    common::{Result, config_datafusion_err},
    execution::{SessionStateBuilder, runtime_env::RuntimeEnv},
    prelude::{SessionConfig, SessionContext},
};
use std::sync::Arc;

use crate::codec::{Marked, Release};

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
        config_datafusion_err!("{url:?} names no scheduler: write df://host:port")
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
    let state = SessionStateBuilder::new()
        .with_default_features()
        .with_config(config)
        .with_runtime_env(runtime)
        .build();
    let session = SessionContext::remote_with_state(&format!("df://{address}"), state).await?;
    stretch_fleet::register(&session);
    Ok(session)
}
