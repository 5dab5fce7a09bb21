//! The two sides of a surface, as a ray meets them.

/// A value on both sides of a surface, as a ray meets them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sides<T> {
    /// On the side that the ray comes from.
    pub before: T,
    /// On the other side.
    pub after: T,
}
