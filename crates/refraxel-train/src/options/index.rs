//! The index of refraction: how rays follow it, how it learns and is regularised.

use super::section::section;
use super::value::choice;
use refraxel_core::index::priors::Penalty;
use refraxel_core::{Integrator, Interpolation};

choice! {
    /// How the index is interpolated between nodes.
    pub enum IndexInterpolation {
        /// Cubic B-spline.
        Cubic = "cubic",
        /// Trilinear interpolation of central differences at the nodes.
        Differences = "differences",
        /// Trilinear interpolation with its own gradient.
        Trilinear = "trilinear",
    }
}

impl From<IndexInterpolation> for Interpolation {
    fn from(choice: IndexInterpolation) -> Self {
        match choice {
            IndexInterpolation::Cubic => Self::CubicBSpline,
            IndexInterpolation::Differences => Self::TrilinearOfDifferences,
            IndexInterpolation::Trilinear => Self::Trilinear,
        }
    }
}

choice! {
    /// How rays are integrated.
    pub enum IndexIntegrator {
        /// Symplectic, of second order.
        Leapfrog = "leapfrog",
        /// Explicit, of first order.
        Euler = "euler",
    }
}

impl From<IndexIntegrator> for Integrator {
    fn from(choice: IndexIntegrator) -> Self {
        match choice {
            IndexIntegrator::Leapfrog => Self::Leapfrog,
            IndexIntegrator::Euler => Self::ExplicitEuler,
        }
    }
}

choice! {
    /// How differences of the index are penalised.
    pub enum IndexPenalty {
        /// Their smoothed absolute value: total variation.
        L1 = "l1",
        /// Half their square.
        L2 = "l2",
        /// The square of small ones, the absolute value of large ones.
        Huber = "huber",
    }
}

impl From<IndexPenalty> for Penalty<f32> {
    fn from(choice: IndexPenalty) -> Self {
        match choice {
            IndexPenalty::L1 => Self::Charbonnier { epsilon: 1e-3 },
            IndexPenalty::L2 => Self::Squared,
            IndexPenalty::Huber => Self::Huber { delta: 0.05 },
        }
    }
}

section! {
    /// The index of refraction: how rays follow it, how it learns, and how it is regularised.
    pub struct IndexOptions "index" {
        /// Learning rate of the index of a body; 0 holds it fixed. Nodes of an index without a surface (graded, or with a smooth
        /// edge) learn half as fast, and ever more slowly.
        rate: f32 = 0.001, in 0.0..=1.0;
        /// How the index is interpolated between nodes.
        interpolation: IndexInterpolation = IndexInterpolation::Cubic;
        /// How rays are integrated.
        integrator: IndexIntegrator = IndexIntegrator::Leapfrog;
        /// Longest step of a ray through the index [voxel of the index grid].
        step: f32 = 0.5, in 0.05..=1.0, "voxel";
        /// Weight of the variation of the index.
        variation: f32 = 0.0, in 0.0..;
        /// Penalty of both the variation and the deviation of the index.
        penalty: IndexPenalty = IndexPenalty::L1;
        /// Weight of the deviation of the index from 1.
        deviation: f32 = 0.0, in 0.0..;
    }
}
