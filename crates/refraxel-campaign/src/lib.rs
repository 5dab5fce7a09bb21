//! Attacks on refraxel, to learn what it does with files that are damaged or hostile, and with kills and signals at any moment.
//! docs/reliability.md says what was tried and found.
//!
//! - [`fuzz`] changes valid files at random and gives them to the reader of each format, one [`targets::Target`] a format.
//!   What it finds is repeated from a seed and a number, and stored below `regressions/`.
//! - [`kills`] kills and interrupts trainings, resumes them, and compares the bits with those of an undisturbed run.
//! - [`soak`] trains for long, watches the memory, and does the same again with interruptions.

pub mod fuzz;
pub mod kills;
pub mod soak;
pub mod targets;
pub mod training;
