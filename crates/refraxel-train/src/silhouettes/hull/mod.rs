//! The visual hull: where most views see a silhouette.

mod carve;
#[cfg(test)]
mod tests;
mod vote;

pub use carve::Hull;
pub use vote::Vote;
