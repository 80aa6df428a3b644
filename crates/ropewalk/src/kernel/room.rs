//! What a thread keeps between batches, so that none allocates anew.

use super::beam::{self, Answers};
use super::query::Every;
use super::scanlines::Tiles;
use super::slot::Slot;
use super::sorted::Sorter;
use super::wave::WAVE;
use std::cell::Cell;

/// What a thread keeps between batches.
pub struct Room {
    pub slots: Vec<Slot>,
    pub beam: Box<beam::Room>,
    pub order: Vec<u32>,
    pub every: Every,
    pub sorter: Sorter,
    pub answers: Answers,
    pub tiles: Tiles,
    /// 0, 1, 2 and so on, as far as it was needed.
    pub all: Vec<u32>,
}

/// Works in the room of the calling thread, or in another one where that is taken: filters and particles may
/// put batches themselves.
pub fn with_room<T>(work: impl FnOnce(&mut Room) -> T) -> T {
    thread_local! {
        static ROOM: Cell<Option<Box<Room>>> = const { Cell::new(None) };
    }
    let mut room = ROOM.take().unwrap_or_else(|| {
        Box::new(Room {
            slots: (0..WAVE).map(|_| Slot::new()).collect(),
            beam: Box::new(beam::Room::new()),
            order: Vec::new(),
            every: Every::default(),
            sorter: Sorter::default(),
            answers: Answers::default(),
            tiles: Tiles::default(),
            all: Vec::new(),
        })
    });
    let answer = work(&mut room);
    ROOM.set(Some(room));
    answer
}
