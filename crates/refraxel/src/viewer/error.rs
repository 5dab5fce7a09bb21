//! Why a scene cannot be shown as a page wishes.

/// Why a scene cannot be shown as a page wishes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A camera makes no sense, or an edit.
    #[error("{0}")]
    Look(String),
    /// There is no such photograph.
    #[error("photograph {found}: the scene has {count}")]
    Photo {
        /// The number that was asked for.
        found: usize,
        /// How many there are.
        count: usize,
    },
    /// There is no such region.
    #[error("refractive region {found}: the scene has {count}")]
    Region {
        /// The number that was asked for.
        found: usize,
        /// How many there are.
        count: usize,
    },
}
