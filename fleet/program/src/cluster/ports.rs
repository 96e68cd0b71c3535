//! Chooses and prints the address where a process of the cluster listens.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, TcpListener, ToSocketAddrs, UdpSocket};

use anyhow::{Context, ensure};

use crate::show::warn;

/// Resolves a host name to an address, preferring IPv4.
pub(crate) fn address(host: &str) -> anyhow::Result<IpAddr> {
    let host = host.trim_start_matches('[').trim_end_matches(']');
    let unknown = || format!("the host {host} has no address");
    let found = (host, 0).to_socket_addrs().with_context(unknown)?;
    let found = found.min_by_key(|address| address.is_ipv6());
    Ok(found.with_context(unknown)?.ip())
}

/// Formats an address so that a port can follow it.
pub(crate) fn before_port(address: IpAddr) -> String {
    match address {
        IpAddr::V4(address) => address.to_string(),
        IpAddr::V6(address) => format!("[{address}]"),
    }
}

/// Returns the local address from which another machine would be reached. No packet is sent.
pub(crate) fn address_towards(host: &str, port: u16) -> anyhow::Result<IpAddr> {
    let to = address(host)?;
    let any: IpAddr = match to {
        IpAddr::V4(_) => Ipv4Addr::UNSPECIFIED.into(),
        IpAddr::V6(_) => Ipv6Addr::UNSPECIFIED.into(),
    };
    let told = || format!("{to} cannot be reached from this machine");
    let socket = UdpSocket::bind((any, 0)).with_context(told)?;
    socket.connect((to, port)).with_context(told)?;
    Ok(socket.local_addr().with_context(told)?.ip())
}

/// Refuses to listen on an address that other machines can reach, unless the user requested it. In
/// that case prints a clear warning.
pub(crate) fn guard(who: &str, listens_on: IpAddr, is_insecure: bool) -> anyhow::Result<()> {
    if listens_on.is_loopback() {
        return Ok(());
    }
    ensure!(
        is_insecure,
        "a {who} on {listens_on} obeys everyone who reaches it: nothing is encrypted, no caller is authenticated, and queries \
         read and write files as this user. Listen on 127.0.0.1, or use a separate network for the cluster and add --insecure"
    );
    warn(format!(
        "WARNING: INSECURE: this {who} on {listens_on} obeys everyone who reaches it; keep that network closed"
    ));
    Ok(())
}

/// Returns the given port, or a free one for 0. A free port is chosen in advance, because it is
/// announced to others before it is bound.
pub(crate) fn chosen(host: IpAddr, port: u16) -> anyhow::Result<u16> {
    if port != 0 {
        return Ok(port);
    }
    let listener =
        TcpListener::bind((host, 0)).with_context(|| format!("no free port at {host}"))?;
    Ok(listener.local_addr()?.port())
}
