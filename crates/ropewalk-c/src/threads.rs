//! Pools of threads, one for each number asked for.

use crate::status::{Failure, RopewalkStatus};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// The most threads that may be asked for.
const MOST: u32 = 1024;

static POOLS: Mutex<Option<HashMap<u32, Arc<ThreadPool>>>> = Mutex::new(None);

/// Runs `work` with the number for [`engine::kernel::BatchCaster::with_threads`] in the pool that was asked for: `0` is
/// one thread a processor, `1` the calling thread.
pub fn within<R: Send>(threads: u32, work: impl FnOnce(usize) -> R + Send) -> Result<R, Failure> {
    match threads {
        0 => return Ok(work(0)),
        1 => return Ok(work(1)),
        2..=MOST => {}
        _ => {
            return Err(Failure::argument(format!("threads is {threads}; expected 0 to {MOST}")));
        }
    }
    let pool = {
        let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
        let pools = pools.get_or_insert_default();
        if let Some(pool) = pools.get(&threads) {
            pool.clone()
        } else {
            let pool = ThreadPoolBuilder::new().num_threads(threads as usize).build();
            let pool = Arc::new(pool.map_err(|error| Failure {
                status: RopewalkStatus::OutOfMemory,
                message: format!("cannot start {threads} threads: {error}"),
            })?);
            pools.insert(threads, pool.clone());
            pool
        }
    };
    Ok(pool.install(|| work(0)))
}
