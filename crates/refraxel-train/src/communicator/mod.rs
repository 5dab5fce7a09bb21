//! Processes that train one model together, theory (4.19).
//!
//! One of them, the first, leads: it has the photographs, takes all decisions and saves. The others
//! [serve](crate::cpu::serve): each holds a copy of the model, follows its share of every batch of rays, and owns a
//! share of the voxels. What one process has computed of another's voxels travels by [`Communicator::exchange`]; no gradient of the
//! whole field ever exists. Sums are taken in the order in which one process takes them: the result has the same bits.

mod exchange;
mod part;
pub mod threads;
mod traffic;
pub(crate) mod wire;

pub use exchange::Communicator;
pub use part::part;
pub use traffic::Traffic;
