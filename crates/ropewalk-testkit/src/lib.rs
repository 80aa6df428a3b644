//! Part of the ropewalk workspace; see its README.
