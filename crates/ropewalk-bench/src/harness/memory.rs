//! Resident memory of this process, where Linux tells it.

/// Bytes resident now.
pub fn resident() -> Option<u64> {
    status("VmRSS:")
}

/// The largest number of bytes resident so far, or since [`reset_peak`].
pub fn peak_resident() -> Option<u64> {
    status("VmHWM:")
}

/// Starts the peak anew; true if the system does so.
pub fn reset_peak() -> bool {
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

fn status(key: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with(key))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}
