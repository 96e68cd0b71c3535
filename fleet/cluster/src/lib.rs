//! Runs the queries of `stretch-fleet` on many machines, with Apache Ballista: a scheduler,
//! executors that ask it for work, and a session that sends its queries there. The README of
//! `fleet/` lists the guarantees of a cluster.
//!
//! ```no_run
//! # async fn ask() -> datafusion::error::Result<()> {
//! use datafusion::prelude::{ParquetReadOptions, SessionConfig};
//! let session =
//!     stretch_fleet_cluster::connect("df://127.0.0.1:50050", SessionConfig::new(), Default::default()).await?;
//! session.register_parquet("trials", "/srv/lake/trials", ParquetReadOptions::default()).await?;
//! session.sql("select sensor, poly13_fit(rate, bridge_v, contraction) from trials group by sensor").await?.show().await
//! # }
//! ```

mod client;
mod codec;
mod executor;
mod ports;
mod scheduler;

pub use client::connect;
pub use codec::Release;
pub use executor::{ExecutorOptions, run_executor};
pub use scheduler::{SchedulerOptions, run_scheduler};
