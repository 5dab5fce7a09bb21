//! What every backend must prove: agreement with the f64 reference of `refraxel-core`, and the contract of
//! [`Backend`](super::Backend).
//!
//! A backend instantiates the whole suite in one of its test files, with the tolerances that it answers for:
//!
//! ```
//! use refraxel_train::CpuBackend;
//! use refraxel_train::backend::conformance::{Suite, Tolerances};
//! refraxel_train::conformance_tests!(Suite { make: CpuBackend::new, tolerances: Tolerances::SINGLE_PRECISION });
//! ```
//!
//! The suite uses nothing but the trait. That a step gives the same bits at any number of threads is asked of the CPU alone.

pub mod absorbing;
pub mod bent;
mod claims;
pub mod clearcoated;
pub mod contract;
pub mod drawn;
pub mod mirrored;
mod reference;
pub mod scenes;
pub mod straight;
mod suite;

pub use suite::{Suite, Tolerances};
