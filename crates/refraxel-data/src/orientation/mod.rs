//! Photographs with an orientation tag (EXIF): whether their poses belong to the pixels as they are stored, or as the tag
//! turns them.

mod colours;
mod decide;
mod neighbours;
mod picture;

pub(crate) use decide::decide;
pub use picture::Orientation;
pub(crate) use picture::Picture;
