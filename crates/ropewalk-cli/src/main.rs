//! The `ropewalk` command. Exit codes: 0, 1 (the input's fault), 2 (usage).

#![forbid(unsafe_code)]

#[macro_use]
mod output;

mod command;
mod controls;
mod engine;
mod interrupt;
mod paper;
mod saved;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Ray casting on surface-area BSP trees with ropes and rope trees.
#[derive(Parser)]
#[command(version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Ray-trace a scene to a picture
    Render(Box<command::render::Args>),
    /// Write a scene of the Standard Procedural Databases as NFF
    Scene(command::scene::Args),
    /// Build a tree and print its figures
    Stats(command::stats::Args),
    /// Check every invariant of a scene's tree, ropes and rope trees
    Validate(command::validate::Args),
    /// Build a scene's tree for the batch kernels and save both
    Build(command::build::Args),
    /// Say what a saved scene, a scene or a mesh holds, and what may be wrong with it
    Info(command::info::Args),
    /// Convert a mesh to another format: positions and faces
    Convert(command::convert::Args),
    /// Measure rays per second of the batch kernels on a scene, saved or not
    Bench(command::bench::Args),
    /// Run the experiment of the 1997 paper and write its report
    Paper(paper::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse(); // exits with 2 on a wrong use
    let result = match cli.command {
        Command::Render(args) => command::render::run(&args),
        Command::Scene(args) => command::scene::run(&args),
        Command::Stats(args) => command::stats::run(&args),
        Command::Validate(args) => command::validate::run(&args),
        Command::Build(args) => command::build::run(&args),
        Command::Info(args) => command::info::run(&args),
        Command::Convert(args) => command::convert::run(&args),
        Command::Bench(args) => command::bench::run(&args),
        Command::Paper(args) => paper::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => output::fail(&error),
    }
}
