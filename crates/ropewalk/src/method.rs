//! The methods of the paper by name: a way to build and a way to walk.
