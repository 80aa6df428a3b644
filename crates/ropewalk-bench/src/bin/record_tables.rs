//! The tables of docs/performance.md from a record:
//! `cargo run --release -p ropewalk-bench --bin record_tables -- bench/record/latest.csv`.

use anyhow::Context;
use ropewalk_bench::harness::tables;
use std::process::ExitCode;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("record_tables: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> anyhow::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "bench/record/latest.csv".into());
    let csv = std::fs::read_to_string(&path).with_context(|| path.clone())?;
    print!("{}", tables(&csv).with_context(|| path)?);
    Ok(())
}
