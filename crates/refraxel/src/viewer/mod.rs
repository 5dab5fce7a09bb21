//! The live viewer: a page in the browser that shows a run, rendered here and streamed over loopback.
//!
//! One [`Painter`] thread owns the scene and paints for all pages in turn. The [`Server`] lets pages in that know the token of
//! its address, and carries messages: [`Ask`] from a page, [`Tell`] and pictures to it. Nothing that a page sends names a file.

mod bend;
mod client;
mod contours;
mod control;
mod doorstep;
mod error;
mod gate;
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
pub use orders::{LAST_WORDS, Orders};
pub use page_camera::PageCamera;
pub use painter::Painter;
pub use protocol::{Ask, BentRay, Bounce, Edits, Header, Look, Shown, Tell};
pub use scene::{Scene, UP, start};
pub use server::{Server, ServerError};
