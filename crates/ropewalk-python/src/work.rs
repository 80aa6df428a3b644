//! Long work without the GIL: shared out over threads, stopped by Ctrl-C.

use crate::error;
use pyo3::prelude::*;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use ropewalk::build::Monitor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often signals are looked at.
const POLL: Duration = Duration::from_millis(50);

/// Pools that are kept between calls, one for each number of threads.
const KEPT_POOLS: usize = 4;

/// How many threads 0 means: `RAYON_NUM_THREADS`, or as many as this process may run on.
pub fn default_threads() -> usize {
    let set = std::env::var("RAYON_NUM_THREADS").ok().and_then(|s| s.parse().ok());
    set.filter(|&n| n > 0)
        .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, |n| n.get()))
}

/// The pool of so many threads, started where there is none yet.
///
/// A fork has none of its parent's threads, so pools belong to a process. The lock is held by threads
/// that are attached to the interpreter, as those are that fork: a child never finds it taken.
fn pool(_py: Python<'_>, threads: usize) -> PyResult<Arc<ThreadPool>> {
    struct Kept {
        process: u32,
        threads: usize,
        pool: Arc<ThreadPool>,
    }
    static POOLS: Mutex<Vec<Kept>> = Mutex::new(Vec::new());
    let process = std::process::id();
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    // Dropping a pool wakes its threads, which a child does not have.
    pools.extract_if(.., |kept| kept.process != process).for_each(std::mem::forget);
    if let Some(at) = pools.iter().position(|kept| kept.threads == threads) {
        let kept = pools.remove(at);
        let pool = kept.pool.clone();
        pools.push(kept);
        return Ok(pool);
    }
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("ropewalk-{i}"))
        .build()
        .map_err(|e| error::other(format!("cannot start {threads} threads: {e}")))?;
    let pool = Arc::new(pool);
    if pools.len() == KEPT_POOLS {
        pools.remove(0);
    }
    pools.push(Kept { process, threads, pool: pool.clone() });
    Ok(pool)
}

/// Runs `job` on a pool, without the GIL, while this thread looks at signals and calls `poll`. An
/// exception from either sets `stop`, on which the job should end soon.
///
/// # Errors
/// The exception, or what [`error::panic`] makes of a panic.
pub fn watch<R: Send>(
    py: Python<'_>,
    threads: usize,
    stop: &AtomicBool,
    poll: impl Fn(Python<'_>) -> PyResult<()> + Send + Sync,
    job: impl FnOnce() -> R + Send,
) -> PyResult<R> {
    let pool = pool(py, threads)?;
    let (result, raised) = py.detach(|| {
        let (sender, receiver) = channel();
        pool.in_place_scope(|scope| {
            scope.spawn(|_| {
                let _ = sender.send(catch_unwind(AssertUnwindSafe(job)));
            });
            let mut raised = None;
            loop {
                match receiver.recv_timeout(POLL) {
                    Ok(result) => return (Some(result), raised),
                    Err(RecvTimeoutError::Disconnected) => return (None, raised),
                    Err(RecvTimeoutError::Timeout) if raised.is_none() => {
                        let polled =
                            Python::attach(|py| py.check_signals().and_then(|()| poll(py)));
                        stop.store(polled.is_err(), Ordering::Relaxed);
                        raised = polled.err();
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                }
            }
        })
    });
    match (raised, result) {
        (Some(raised), _) => Err(raised),
        (None, Some(result)) => result.map_err(error::panic),
        (None, None) => Err(error::other("a worker thread has gone".into())),
    }
}

/// Tells work of the core that it is to stop.
pub struct Stop<'a>(&'a AtomicBool);

impl Monitor for Stop<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// What `work` returns, on a thread of its own, so that this one can hear signals.
///
/// # Errors
/// The exception of a signal, once the work has stopped, or what [`error::panic`] makes of a panic.
pub fn alone<R: Send>(py: Python<'_>, work: impl FnOnce(&Stop<'_>) -> R + Send) -> PyResult<R> {
    let stop = AtomicBool::new(false);
    watch(py, 1, &stop, |_| Ok(()), || work(&Stop(&stop)))
}

/// The same on this thread, for short work: signals are heard when it is done.
///
/// # Errors
/// What [`error::panic`] makes of a panic.
pub fn here<R: Send>(py: Python<'_>, work: impl FnOnce(&Stop<'_>) -> R + Send) -> PyResult<R> {
    let stop = AtomicBool::new(false);
    py.detach(|| catch_unwind(AssertUnwindSafe(|| work(&Stop(&stop)))).map_err(error::panic))
}

/// What `work` makes of each task, in order: on this thread (1) or on a pool of so many.
///
/// # Errors
/// The exception of a signal, after the tasks under way, or what [`error::panic`] makes of a panic.
pub fn for_each<T: Send, R: Send>(
    py: Python<'_>,
    threads: usize,
    tasks: Vec<T>,
    work: impl Fn(T) -> R + Sync,
) -> PyResult<Vec<R>> {
    if threads == 1 || tasks.len() <= 1 {
        return in_turn(py, tasks, &work);
    }
    let stop = AtomicBool::new(false);
    let done = watch(
        py,
        threads,
        &stop,
        |_| Ok(()),
        || {
            let run = |task| (!stop.load(Ordering::Relaxed)).then(|| work(task));
            tasks.into_par_iter().with_max_len(1).map(run).collect::<Option<Vec<R>>>()
        },
    )?;
    done.ok_or_else(|| error::other("the query was stopped".into()))
}

fn in_turn<T: Send, R: Send>(
    py: Python<'_>,
    tasks: Vec<T>,
    work: &(impl Fn(T) -> R + Sync),
) -> PyResult<Vec<R>> {
    py.detach(|| {
        let (mut done, mut looked) = (Vec::with_capacity(tasks.len()), Instant::now());
        for task in tasks {
            done.push(catch_unwind(AssertUnwindSafe(|| work(task))).map_err(error::panic)?);
            if looked.elapsed() > POLL {
                Python::attach(|py| py.check_signals())?;
                looked = Instant::now();
            }
        }
        Ok(done)
    })
}
