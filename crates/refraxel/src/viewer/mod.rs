//! The live viewer: a page in the browser that shows a run, rendered here and streamed over loopback.
//!
//! One [`Painter`] thread owns the scene and paints for all pages in turn. The [`Server`] lets pages in that know the token of
//! its address, and carries messages: [`Ask`] from a page, [`Tell`] and pictures to it. Nothing that the page of a scene sends names a
//! file. The start page (`start`) has the same server.

mod answers;
mod bend;
mod bricks;
mod client;
mod contours;
mod control;
mod crop;
mod doorstep;
mod error;
mod films;
mod gate;
mod history;
mod layers;
mod orders;
mod outgoing;
mod page;
mod page_camera;
mod painter;
mod photograph_desk;
mod photographs;
mod picture;
mod protocol;
mod questions;
mod scene;
mod server;
mod slice;
mod socket;

pub use control::{Control, Wish};
pub use error::SceneError;
pub use films::Films;
pub use orders::{LAST_WORDS, Orders};
pub(crate) use outgoing::{Out, Outgoing};
pub(crate) use page::Page;
pub use page_camera::PageCamera;
pub use painter::Painter;
pub use protocol::{
    Ask, BentRay, Bounce, Edits, FilmFormat, FilmState, FilmWish, Header, Look, Shown, Tell, Training,
};
pub use scene::{Scene, UP, start};
pub use server::{Server, ServerError};
pub(crate) use socket::{Answerer, Visitor};
