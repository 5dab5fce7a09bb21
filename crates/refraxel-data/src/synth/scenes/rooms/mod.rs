//! Rooms for photographs: a thing on a table, walls or a garden several of its sizes away.
//!
//! The table's top lies at [`GROUND`](super::surroundings::GROUND), as the ground of the other scenes does, so that their
//! bodies stand on it. One unit is about a quarter of a metre.

mod catalogue;
mod decor;
mod kitchen;
mod place;
mod study;
mod terrace;
mod things;

pub use catalogue::{Room, room, room_list};
