//! Thread CPU time, wall time, and the name of the processor.

use rustix::time::{ClockId, Timespec, clock_gettime};

/// A point in the thread's CPU time and in wall time.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    cpu: Timespec,
    wall: std::time::Instant,
}

impl Clock {
    /// Now.
    pub fn start() -> Self {
        Clock { cpu: clock_gettime(ClockId::ThreadCPUTime), wall: std::time::Instant::now() }
    }

    /// Seconds since the start: CPU time of the calling thread, and wall time.
    pub fn elapsed(&self) -> (f64, f64) {
        let now = clock_gettime(ClockId::ThreadCPUTime);
        let cpu =
            (now.tv_sec - self.cpu.tv_sec) as f64 + (now.tv_nsec - self.cpu.tv_nsec) as f64 * 1e-9;
        (cpu, self.wall.elapsed().as_secs_f64())
    }
}

/// The processor as the kernel names it, with its widest SIMD level.
pub fn cpu_name() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |key: &str| {
        let line = info.lines().find(|l| l.starts_with(key));
        line.and_then(|l| l.split_once(':')).map_or("?", |(_, v)| v.trim())
    };
    let flags = field("flags");
    let has = |flag: &str| flags.split_ascii_whitespace().any(|f| f == flag);
    let level = if has("avx512f") {
        "AVX-512"
    } else if has("avx2") {
        "AVX2"
    } else {
        "SSE"
    };
    let (family, model) = (field("cpu family"), field("model\t"));
    format!("{} family {family} model {model} {level}", field("model name"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cpu_time_passes_while_working_and_not_while_sleeping() {
        let clock = Clock::start();
        std::thread::sleep(std::time::Duration::from_millis(30));
        let (cpu, wall) = clock.elapsed();
        assert!(wall >= 0.03 && cpu < 0.02, "{cpu} {wall}");
        let mut x = 1u64;
        while clock.elapsed().0 < cpu + 0.005 {
            x = std::hint::black_box(x.wrapping_mul(3));
        }
    }
}
