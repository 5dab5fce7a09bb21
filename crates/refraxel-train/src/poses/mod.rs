//! Poses that learn. Each camera has six numbers that say how far it is from where the data put it; Gauss–Newton steps on the
//! error of its rays, straight or bent, move it, theory (8.1)–(8.5).

mod correction;
mod find;
mod gauge;
mod learn;
mod lens;
mod normal;
mod numbers;
mod shift;
#[cfg(test)]
mod tests;
mod views;

pub use correction::Correction;
pub use find::{find, is_black};
pub use learn::PoseRate;
pub use lens::{LensCorrection, LensShift, lens_slopes};
pub use shift::PoseShift;
pub use views::Poses;
