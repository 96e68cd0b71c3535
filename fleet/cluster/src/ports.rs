//! Where a process of the cluster listens, chosen and told.

use std::{
    fmt,
    io::{self, Write},
    net::TcpListener,
};

use anyhow::Context;

/// The port itself, or a free one for 0: what is announced to others must be known before it is bound.
pub(crate) fn chosen(host: &str, port: u16) -> anyhow::Result<u16> {
    if port != 0 {
        return Ok(port);
    }
    let listener =
        TcpListener::bind((host, 0)).with_context(|| format!("no free port at {host}"))?;
    Ok(listener.local_addr()?.port())
}

/// Tells where it is; whoever has closed standard output does not want to know.
pub(crate) fn say(line: fmt::Arguments<'_>) {
    let _ = writeln!(io::stdout().lock(), "{line}");
}
