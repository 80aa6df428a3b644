//! Ropewalk's own engines, behind the same trait as the peers.
