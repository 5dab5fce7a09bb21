//! Which light is shown.

use crate::model::MirrorSource;

/// Which parts of the light a rendering shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layers {
    /// What a camera sees.
    #[default]
    All,
    /// The same if surfaces mirrored light of another source.
    Mirroring(MirrorSource),
    /// The same if no surface mirrored anything, except by total reflection.
    Transmitted,
}
