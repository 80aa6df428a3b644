//! One file a section; each makes the section's body, empty where there is nothing to show.

mod estimator;
mod headline;
mod ingredients;
mod predicted;
mod protocol;
mod published;
mod ropes;
mod scaling;
mod scenes;
mod sensitivity;

pub use estimator::estimator;
pub use headline::headline;
pub use ingredients::ingredients;
pub use predicted::predicted;
pub use protocol::protocol;
pub use published::published;
pub use ropes::ropes;
pub use scaling::scaling;
pub use scenes::scenes;
pub use sensitivity::sensitivity;
