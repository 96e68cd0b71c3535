//! Where queries run: here, or on a cluster.

use std::sync::Arc;

use datafusion::{
    arrow::array::RecordBatch,
    execution::runtime_env::RuntimeEnvBuilder,
    prelude::{SessionConfig, SessionContext},
};
use stretch_fleet_cluster::connect;

/// Size of the cached listing of a lake: about a hundred bytes per file.
const LISTING_BYTES: usize = 256 << 20;

/// A session with the functions of the library.
///
/// # Errors
/// A URL that names no scheduler. A scheduler that does not answer is an error of the first query.
pub(crate) async fn session(
    cluster: Option<&str>,
    threads: Option<usize>,
) -> anyhow::Result<SessionContext> {
    // Statistics of a file ignore NaN: a column of one number and NaN would be read as that number
    // throughout.
    let mut config =
        SessionConfig::new().with_information_schema(true).with_collect_statistics(false);
    if let Some(threads) = threads {
        config = config.with_target_partitions(threads.max(1));
    }
    let runtime = RuntimeEnvBuilder::new().with_object_list_cache_limit(LISTING_BYTES).build()?;
    if let Some(url) = cluster {
        return Ok(connect(url, config, Arc::new(runtime)).await?);
    }
    let session = SessionContext::new_with_config_rt(config, Arc::new(runtime));
    stretch_fleet::register(&session);
    Ok(session)
}

/// Answers of several questions, one behind the other.
///
/// Each query is answered by one thread, which takes files and rows in their order, and all queries
/// run at once. Therefore sums have the same bits in every run, however many queries there are.
pub(crate) async fn in_order(
    session: &SessionContext,
    questions: Vec<String>,
) -> anyhow::Result<Vec<RecordBatch>> {
    let mut state = session.state();
    state.config_mut().options_mut().execution.target_partitions = 1;
    let alone = SessionContext::new_with_state(state);
    let tasks = questions.into_iter().map(|question| {
        let alone = alone.clone();
        tokio::spawn(async move { alone.sql(&question).await?.collect().await })
    });
    let mut batches = Vec::new();
    for task in tasks.collect::<Vec<_>>() {
        batches.extend(task.await??);
    }
    Ok(batches)
}
