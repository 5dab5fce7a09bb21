//! What pages and the program say to each other.
//!
//! A page sends [`Ask`] as JSON text. The program answers with [`Tell`] as JSON text, and with pictures as binary messages: the
//! length of a JSON header as four bytes, least significant first, the header, and a JPEG file. The types of the page in
//! `viewer/src/protocol.ts` are made of these (`crate::typescript`).

mod ask;
mod picture;
mod scene;
mod tell;
mod training;

pub use ask::{Ask, Edits, FilmFormat, FilmWish, Look, Shown};
pub use picture::{Header, message};
pub use scene::{RegionFacts, SceneFacts, ViewFacts};
pub use tell::{BentRay, Bounce, FilmState, HullPart, Piece, Tell};
pub use training::Training;
