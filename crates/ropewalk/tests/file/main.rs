//! Saved scenes: what is opened answers as what was saved, and nothing else is let in.

mod altered;
mod double;
#[path = "../../../../fuzz/properties/file.rs"]
mod property;
mod refused;
mod round_trip;
mod scenes;
