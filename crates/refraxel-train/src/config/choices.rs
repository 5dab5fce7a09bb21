//! Options that are one of a few words.

use crate::reflection::Source;
use refraxel_core::index::priors::Penalty;
use refraxel_core::optics::Weight;
use refraxel_core::{Integrator, Interpolation};
use serde::{Deserialize, Serialize};

/// Whether rays bend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Bending {
    /// All rays are straight.
    #[default]
    Off,
    /// Rays follow the index of refraction.
    On,
}

/// What the index looks like before it learns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum IndexShape {
    /// n = 1 everywhere.
    Uniform,
    /// The whole box is filled.
    Block,
    /// The ellipsoid in the box.
    Ball,
    /// What the masks carve out of the box.
    #[default]
    Hull,
    /// From the file `index_from`.
    File,
}

/// What the surface of a refractive body is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Surface {
    /// What fits best at the start.
    #[default]
    Auto,
    /// A level set, where the index jumps.
    Sharp,
    /// A transition of the index over some voxels.
    Smooth,
    /// None: the index rises from 1 at the hull towards its middle, like in lenses with an index gradient.
    Graded,
}

/// A choice between doing and leaving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Switch {
    /// It is done.
    #[default]
    On,
    /// It is not.
    Off,
}

impl Switch {
    /// True when on.
    pub fn is_on(self) -> bool {
        self == Self::On
    }
}

/// Where the light comes from that surfaces mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReflectionCache {
    /// Probes that learn from the pictures.
    #[default]
    Learned,
    /// Probes that look at the field now and then.
    Baked,
    /// No probes: a second ray through the field. Slow, for reference.
    Exact,
}

impl From<ReflectionCache> for Source {
    fn from(choice: ReflectionCache) -> Self {
        match choice {
            ReflectionCache::Learned => Self::Learned,
            ReflectionCache::Baked => Self::Baked,
            ReflectionCache::Exact => Self::Exact,
        }
    }
}

/// How much of the light surfaces mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReflectionWeight {
    /// Fresnel's reflectance.
    #[default]
    Whole,
    /// The plain product of Fresnel's reflectance and the gradient of the index along the path, for comparison.
    Gradient,
}

impl From<ReflectionWeight> for Weight {
    fn from(choice: ReflectionWeight) -> Self {
        match choice {
            ReflectionWeight::Whole => Self::Whole,
            ReflectionWeight::Gradient => Self::Gradient,
        }
    }
}

/// How the index is interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum IndexInterpolation {
    /// Cubic B-spline.
    #[default]
    Cubic,
    /// Trilinear, of central differences at the nodes.
    Differences,
    /// Trilinear, with its own gradient.
    Trilinear,
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

/// How rays are integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stepping {
    /// Symplectic, second order.
    #[default]
    Leapfrog,
    /// Explicit, first order.
    Euler,
}

impl From<Stepping> for Integrator {
    fn from(choice: Stepping) -> Self {
        match choice {
            Stepping::Leapfrog => Self::Leapfrog,
            Stepping::Euler => Self::ExplicitEuler,
        }
    }
}

/// How differences of the index are penalised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum IndexPenalty {
    /// Total variation (smoothed absolute value).
    #[default]
    L1,
    /// Half the square.
    L2,
    /// Square for small differences, absolute value for large ones.
    Huber,
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
