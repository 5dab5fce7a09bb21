//! The live viewer: a page in the browser that shows a run, rendered here and streamed over loopback.
//!
//! One [`Painter`] thread owns the scene and paints for all pages in turn. The [`Server`] lets pages in that know the token of
//! its address, and carries messages: [`Ask`] from a page, [`Tell`] and pictures to it. Nothing that a page sends names a file.

mod bend;
mod client;
mod contours;
mod gate;
mod layers;
mod page;
mod painter;
mod photographs;
mod picture;
mod protocol;
mod scene;
mod server;
mod slice;
mod socket;

pub use bend::{BentRay, Bounce};
pub use painter::{Orders, Painter};
pub use protocol::{Ask, Edits, Header, Look, PageCamera, Shown, Tell};
pub use scene::{Scene, SceneError, UP, start};
pub use server::{Control, Server, ServerError, Wish};
