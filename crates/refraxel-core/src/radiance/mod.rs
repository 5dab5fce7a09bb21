//! Emission and absorption along a path of straight segments, and its exact adjoint, theory (3.8)–(3.14); and the light
//! that surfaces mirror: cache look-ups, mixtures and clearcoats, theory (7.5)–(7.16); and the light that bodies absorb,
//! theory (7.17)–(7.20). Thin matter may be sampled by chance, theory (4.6).
//!
//! A path may be one straight ray or the many segments of a bent one: nothing here makes a difference between them.

mod absorption;
pub mod clearcoat;
pub mod light;
mod march;
pub mod probes;
mod quadrature;
mod thinning;

pub use crate::segment::{Segment, SegmentAdjoint};
pub use absorption::{Absorption, AbsorptionAdjoint, LEAST_CONTRAST};
pub use light::{Filter, FilterAdjoint, Filtered, MixAdjoint, mix, mix_vjp, without};
pub use march::{Pixel, PixelAdjoint, render, render_through, render_vjp};
pub use probes::{ProbeGrid, ProbeStencil};
pub use quadrature::{GROUP, QuadraturePoint, quadrature};
pub use thinning::{thinned, thinning_phase};

#[cfg(test)]
mod tests;
