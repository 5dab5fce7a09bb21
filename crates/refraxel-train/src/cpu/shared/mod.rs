//! A backend that several processes are together. The first leads a step, the others help:
//!
//! 1. The first orders the rays and sends each process its chunks of them.
//! 2. Each follows its rays. Samples of the field go to the owners of the buckets around them; samples of the index, of mirrors and
//!    of the background, few beside them, go to all.
//! 3. Each moves its own buckets, and all of the index, of mirrors and of the background; what has moved in its buckets goes to all.
//!
//! Every process takes its sums over all chunks in their order, as one process does: the model has the same bits.

mod backend;
mod member;
mod message;

pub use backend::{Root, SharedBackend};
pub use member::serve;
