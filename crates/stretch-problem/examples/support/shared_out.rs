//! Jobs shared out among threads.

use std::{
    error::Error,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

/// Fallible, from a worker.
pub(crate) type Answer<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// The results of `count` jobs, in order, by so many threads. Not rayon's: a diagnosis has a pool of its own, and a worker that waits for
/// one would begin the next job meanwhile, one inside the other.
pub(crate) fn shared_out<T: Send>(
    workers: usize,
    count: usize,
    job: impl Fn(usize) -> Answer<T> + Sync,
) -> Answer<Vec<T>> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(count)));
    thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    if at >= count {
                        break;
                    }
                    let result = job(at);
                    done.lock().unwrap_or_else(|e| e.into_inner()).push((at, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(|e| e.into_inner());
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, result)| result).collect()
}
