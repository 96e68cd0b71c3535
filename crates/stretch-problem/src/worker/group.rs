//! A process and all processes that it starts, which end when this program ends, even if it is
//! killed.
//!
//! On Unix the processes form a group. The group's leader is a shell that waits for the end of a pipe and then kills
//! the group. Only this program holds the pipe open, so the kernel closes it when this program ends, after SIGKILL too.
//! A parent-death signal would reach the first process only, and would need unsafe code between fork and exec.

use std::{
    io,
    process::{Child, Command},
};

/// A process with its group. Processes of the group that still run are killed when this value is
/// dropped.
#[derive(Debug)]
pub(super) struct Group {
    /// The process that was started, which may start others.
    pub(super) child: Child,
    #[cfg(unix)]
    guard: guard::Guard,
}

impl Group {
    /// Starts a command in a separate process group.
    #[cfg(unix)]
    pub(super) fn spawn(command: &mut Command) -> io::Result<Self> {
        use std::os::unix::process::CommandExt as _;
        let guard = guard::Guard::new()?;
        let child = command.process_group(guard.group()).spawn()?;
        Ok(Self { child, guard })
    }

    /// Starts a command; without process groups, the processes that it starts are not killed with
    /// it.
    #[cfg(not(unix))]
    pub(super) fn spawn(command: &mut Command) -> io::Result<Self> {
        Ok(Self { child: command.spawn()? })
    }

    /// Ends every process of the group at once.
    pub(super) fn kill(&mut self) {
        #[cfg(unix)]
        self.guard.close();
        let _ = self.child.kill();
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        self.kill();
        let _ = self.child.wait();
    }
}

#[cfg(unix)]
mod guard {
    use std::{
        io,
        os::unix::process::CommandExt as _,
        process::{Child, Command, Stdio},
    };

    /// Script of the shell. It ignores signals that a worker sends to its own group. `read` waits
    /// until the pipe is closed, because nothing is ever written to it.
    const WAITS: &str = "trap '' HUP INT QUIT TERM; read -r _; kill -KILL 0";

    /// The leader of a group.
    #[derive(Debug)]
    pub(super) struct Guard(Child);

    impl Guard {
        pub(super) fn new() -> io::Result<Self> {
            let mut shell = Command::new("/bin/sh");
            shell.args(["-c", WAITS]).process_group(0);
            shell.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
            shell.spawn().map(Self)
        }

        /// Number of the group.
        pub(super) fn group(&self) -> i32 {
            self.0.id() as i32
        }

        /// Closes the pipe: the shell kills the group, itself included.
        pub(super) fn close(&mut self) {
            drop(self.0.stdin.take());
            let _ = self.0.wait();
        }
    }

    impl Drop for Guard {
        fn drop(&mut self) {
            self.close();
        }
    }
}
