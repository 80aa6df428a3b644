//! Ctrl-C, SIGTERM and progress bars.

use indicatif::{ProgressBar, ProgressStyle};
use ropewalk::build::Monitor;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// The flag that Ctrl-C and SIGTERM set; the handlers are installed on first use. A second one ends the
/// process at once. SIGHUP is left as it is: `nohup` has it ignored.
pub fn flag() -> Arc<AtomicBool> {
    static FLAG: OnceLock<Arc<AtomicBool>> = OnceLock::new();
    FLAG.get_or_init(|| {
        let flag = Arc::new(AtomicBool::new(false));
        let seen = Arc::clone(&flag);
        // Without a handler Ctrl-C still ends the process; files are written whole or not at all.
        let _ = ctrlc::set_handler(move || {
            if seen.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
        });
        #[cfg(unix)]
        {
            use signal_hook::{consts::SIGTERM, flag as signal};
            // In this order: the first signal finds the flag not set.
            let _ = signal::register_conditional_shutdown(SIGTERM, 143, Arc::clone(&flag));
            let _ = signal::register(SIGTERM, Arc::clone(&flag));
        }
        flag
    })
    .clone()
}

/// The error after Ctrl-C.
pub fn interrupted() -> anyhow::Error {
    anyhow::anyhow!("interrupted; nothing was written")
}

/// Passes Ctrl-C on to readers.
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    pub fn new() -> Cancel {
        Cancel(flag())
    }

    /// True once it was pressed.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Monitor for Cancel {
    fn is_cancelled(&self) -> bool {
        self.is_set()
    }
}

/// A sign on standard error that work goes on; hidden where that is not a terminal.
pub fn spinner(what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message(what);
    bar.enable_steady_tick(std::time::Duration::from_millis(100));
    bar
}

/// A bar on standard error with `total` units; hidden where that is not a terminal.
pub fn bar(total: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:>9} {wide_bar} {percent:>3} % {eta:>4}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(total).with_style(style).with_message(what)
}
