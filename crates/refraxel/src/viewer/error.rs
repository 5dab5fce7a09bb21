//! Why a scene cannot be shown as a page wishes.

/// Why a scene cannot be shown as a page wishes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// A camera makes no sense, or an edit.
    #[error("{0}")]
    Look(String),
    /// There is no such photograph.
    #[error("photograph {}: the scene has {count}", .found + 1)]
    Photo {
        /// The number that was asked for, from 0; people are told it from 1.
        found: usize,
        /// How many there are.
        count: usize,
    },
    /// There is no such region.
    #[error("refractive region {}: the scene has {count}", .found + 1)]
    Region {
        /// The number that was asked for, from 0; people are told it from 1.
        found: usize,
        /// How many there are.
        count: usize,
    },
}
