//! Jobs shared out among threads.

use std::{
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering::Relaxed},
    },
    thread,
};

/// The results of `count` jobs, in order, by so many threads. These are not rayon's threads,
/// because a diagnosis has its own pool, and a waiting rayon worker would begin the next job inside
/// the first.
///
/// # Errors
/// The error of the first failed job, in order; no job begins after one has failed.
///
/// ```
/// let squares = stretch_challenge::shared_out(2, 4, |i| Ok(i * i))?;
/// assert_eq!(squares, [0, 1, 4, 9]);
/// # Ok::<(), anyhow::Error>(())
/// ```
pub fn shared_out<T: Send>(
    workers: usize,
    count: usize,
    job: impl Fn(usize) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(count)));
    thread::scope(|scope| {
        for _ in 0..workers.clamp(1, count.max(1)) {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Relaxed);
                    if at >= count {
                        break;
                    }
                    let result = job(at);
                    if result.is_err() {
                        next.store(count, Relaxed);
                    }
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((at, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, result)| result).collect()
}

/// As many as the machine has cores.
pub(crate) fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
