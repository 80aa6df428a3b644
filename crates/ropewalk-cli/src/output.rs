//! What the command says: one JSON object on standard output, errors on standard error.

use anyhow::Context;
use ropewalk::build::BuildReport;
use ropewalk::traverse::Counts;
use ropewalk_render::RayCounts;
use serde::Serialize;
use std::process::ExitCode;

/// A mistake in the use of the command, as opposed to the input: exit code 2.
#[derive(Debug)]
pub struct UsageError(pub String);

impl std::fmt::Display for UsageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// A usage error as an `anyhow` error.
pub fn usage(message: impl Into<String>) -> anyhow::Error {
    UsageError(message.into()).into()
}

/// Prints the error in one sentence and gives its exit code.
pub fn fail(error: &anyhow::Error) -> ExitCode {
    eprintln!("ropewalk: {}", sentence(error));
    ExitCode::from(if error.is::<UsageError>() { 2 } else { 1 })
}

/// An error with its causes, less those that it names itself.
fn sentence(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |said, cause| {
        let cause = cause.to_string();
        match said.as_str() {
            "" => cause,
            said if said.ends_with(&cause) => said.to_owned(),
            said => format!("{said}: {cause}"),
        }
    })
}

/// Prints text to standard output; a reader that closes it has seen enough.
pub fn print_text(text: &str) -> anyhow::Result<()> {
    write_out(format_args!("{text}")).context("cannot write to standard output")
}

/// Prints one JSON object to standard output.
pub fn print_json(value: &impl Serialize) -> anyhow::Result<()> {
    print_text(&(serde_json::to_string_pretty(value)? + "\n"))
}

fn write_out(text: std::fmt::Arguments<'_>) -> std::io::Result<()> {
    use std::io::{ErrorKind, Write};
    match std::io::stdout().lock().write_fmt(text) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// What `say!` does; ends the program with exit code 1 if standard output cannot be written.
pub fn print_part(text: std::fmt::Arguments<'_>) {
    if let Err(error) = write_out(text) {
        eprintln!("ropewalk: cannot write to standard output: {error}");
        std::process::exit(1);
    }
}

/// A line on standard output. Unlike `println!` it does not panic where a pipe is closed (`ropewalk ... | head -1`).
macro_rules! say {
    ($($part:tt)*) => {{
        $crate::output::print_part(format_args!($($part)*));
        $crate::output::print_part(format_args!("\n"));
    }};
}

/// `say!` without the end of the line.
macro_rules! say_part {
    ($($part:tt)*) => { $crate::output::print_part(format_args!($($part)*)) };
}

/// How many rays of each kind were cast.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Rays {
    pub primary: u64,
    pub primary_hits: u64,
    pub reflection: u64,
    pub refraction: u64,
    pub shadow: u64,
    pub shadow_hits: u64,
    pub secondary_hits: u64,
}

impl From<&RayCounts> for Rays {
    fn from(c: &RayCounts) -> Self {
        Rays {
            primary: c.primary,
            primary_hits: c.primary_hits,
            reflection: c.reflection,
            refraction: c.refraction,
            shadow: c.shadow,
            shadow_hits: c.shadow_hits,
            secondary_hits: c.secondary_hits(),
        }
    }
}

impl Rays {
    pub fn total(&self) -> u64 {
        self.primary + self.reflection + self.refraction + self.shadow
    }
}

/// Static figures of a tree; all zero where there is none.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Tree {
    pub inner_nodes: u64,
    pub leaves: u64,
    pub empty_leaves: u64,
    pub references: u64,
    pub depth: u64,
    pub bytes: u64,
    pub build_seconds: f64,
}

impl Tree {
    /// From a build report; `bytes` counts the nodes, references and ropes.
    pub fn new(report: &BuildReport, bytes: u64) -> Self {
        let s = &report.tree;
        Tree {
            inner_nodes: s.inner_nodes as u64,
            leaves: s.leaves as u64,
            empty_leaves: s.empty_leaves as u64,
            references: s.references as u64,
            depth: s.max_depth as u64,
            bytes,
            build_seconds: report.seconds,
        }
    }

    /// The paper's size: interior nodes and references.
    pub fn size(&self) -> u64 {
        self.inner_nodes + self.references
    }
}

/// Counted events per ray, over all rays.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PerRay {
    pub intersection_tests: f64,
    pub traversal_steps: f64,
    pub leaf_visits: f64,
    pub empty_leaf_visits: f64,
    pub rope_crossings: f64,
    pub rope_tree_steps: f64,
    pub restarts: f64,
}

impl PerRay {
    pub fn new(c: &Counts, rays: u64) -> Self {
        let per = |x: u64| x as f64 / rays.max(1) as f64;
        PerRay {
            intersection_tests: per(c.intersection_tests),
            traversal_steps: per(c.traversal_steps),
            leaf_visits: per(c.leaf_visits),
            empty_leaf_visits: per(c.empty_leaf_visits),
            rope_crossings: per(c.rope_crossings),
            rope_tree_steps: per(c.rope_tree_steps),
            restarts: per(c.restarts),
        }
    }

    /// Intersection tests and traversal steps, weights 1:1.
    pub fn operations(&self) -> f64 {
        self.intersection_tests + self.traversal_steps
    }
}

/// Wall-clock seconds of each stage.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    pub read: f64,
    pub build: f64,
    pub trace: f64,
}

/// A count with thousands separated, for people.
pub fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() * 4 / 3);
    for (i, d) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(d);
    }
    out
}
