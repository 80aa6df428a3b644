//! Path tracing: against closed forms, against itself, and as files.

mod analytic;
mod common;
mod furnace;
mod golden;
mod looks;
mod strategies;
mod whole;
