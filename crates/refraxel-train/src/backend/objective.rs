//! What a step minimises, and how fast the parameters move.

use super::marching::Marching;
use refraxel_core::index::priors::Penalty;
use refraxel_core::optimiser::RmsProp;

/// ε of theory (4.4) [1]: below this difference of raw densities or SH coefficients the penalty is a parabola.
pub const TV_EPSILON: f32 = 0.02;
/// Decay and floor of the second moments, theory (4.7).
pub const RULE: RmsProp<f32> = RmsProp { decay: 0.95, epsilon: 1e-8 };
/// Steps between two looks at which cells are still occupied: a cell that rises above the cut-off is seen that late.
pub const REFRESH: u64 = 32;
/// Slots of a bucket of voxels: 64 × 64 voxels × 128 B of SH gradient = 512 KiB, half of a usual L2 cache.
pub const BUCKET_SLOTS: usize = 64;

/// What a step minimises, theory (4.1): the weighted sum over rays of |C − target|² plus the priors; and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective {
    /// How rays are marched.
    pub marching: Marching,
    /// Samples of smaller optical depth are left out by chance, and the others count for them, theory (4.6); 0: all are taken.
    pub thin: f32,
    /// Weight of |C − target|² of rays that [bend](refraxel_core::optics::Path::bends), but for those [beside](super::Batch::beside)
    /// masks; 1 for all others.
    pub bent_weight: f32,
    /// λ_c of theory (4.5): weight of the distance of each sample's colour from the target, of rays that no gate of something
    /// refractive admits and behind which nothing is given.
    pub sample_colour: f32,
    /// λ_d of theory (4.27): weight of the distance of samples from where something was measured, of the same rays.
    pub depth: f32,
    /// Samples nearer to the camera than this [scene unit] move the field by less, theory (4.29); 0: all move it alike.
    pub full_distance: f32,
    /// Weight of total variation of raw density, per edge.
    pub tv_density: f32,
    /// Weight of total variation of SH coefficients, per edge.
    pub tv_colour: f32,
    /// Every `tv_period`-th bucket of voxels feels total variation in one step, with `tv_period` times the weight.
    pub tv_period: u32,
    /// Learning rate of raw density.
    pub rate_density: f32,
    /// Learning rate of SH coefficients.
    pub rate_colour: f32,
    /// Factor on it for coefficients of degree 1 and above: what depends on the direction.
    pub rate_view: f32,
    /// Learning rate of the background's texels.
    pub rate_background: f32,
    /// How the index learns; `None`: it is held fixed.
    pub index: Option<IndexObjective>,
    /// How mirrors learn; `None`: they are held fixed.
    pub reflection: Option<ReflectionObjective>,
    /// How bodies learn what they absorb; `None`: it is held fixed.
    pub absorption: Option<AbsorptionObjective>,
}

/// How bodies learn what they absorb, theory (7.20): Adam on the optical thickness over the longest edge of a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsorptionObjective {
    /// Learning rate of that thickness [1].
    pub rate: f32,
}

/// How what surfaces mirror learns, theory (7.10).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectionObjective {
    /// Learning rate of the coefficients of the radiance caches.
    pub rate: f32,
    /// Learning rate of the strengths.
    pub rate_strength: f32,
    /// Learning rate of the strength of clearcoats of opaque things.
    pub rate_clearcoat: f32,
}

/// How the index of refraction and its surfaces learn, theory (4.18): Adam on the blurred gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexObjective {
    /// Learning rate of n at a node [1].
    pub rate: f32,
    /// Standard deviation of the blur of its gradient [voxel of the index grid].
    pub blur: f32,
    /// Bound on |dLoss/dp| of an index sample; infinite for none.
    pub clip: f32,
    /// Weight and penalty of the variation of n, theory (2.20).
    pub variation: (f32, Penalty<f32>),
    /// Weight and penalty of the deviation of n from 1, theory (2.21).
    pub deviation: (f32, Penalty<f32>),
    /// n stays within [1, this].
    pub largest: f32,
    /// The one index of a body stays this near to what a search found.
    pub trust: f32,
    /// Learning rate of φ at a node [voxel of the level set].
    pub surface_rate: f32,
    /// Standard deviation of the blur of the gradient of φ [voxel of the level set].
    pub surface_blur: f32,
    /// Strength of the smoothing of surfaces per step, theory (2.31), in [0, 1].
    pub surface_smooth: f32,
    /// Weight of the depth at which rays [beside](super::Batch::beside) masks pass through a surface [1 / voxel of the level set].
    pub silhouette: f32,
    /// Surfaces learn only from rays that meet them at most this often: further crossings amplify noise.
    pub surface_events: u32,
    /// The index learns only from rays that meet surfaces at most this often. It is one number for many rays, whose noise
    /// averages out.
    pub index_events: u32,
}

impl Objective {
    /// The error of pictures alone, of which nothing learns but poses.
    pub fn still(marching: Marching) -> Self {
        Self {
            marching,
            thin: 0.0,
            bent_weight: 1.0,
            sample_colour: 0.0,
            depth: 0.0,
            full_distance: 0.0,
            tv_density: 0.0,
            tv_colour: 0.0,
            tv_period: 1,
            rate_density: 0.0,
            rate_colour: 0.0,
            rate_view: 0.0,
            rate_background: 0.0,
            index: None,
            reflection: None,
            absorption: None,
        }
    }

    /// Slow everything down, or speed it up.
    pub fn scale_rates(&mut self, factor: f32) {
        self.rate_density *= factor;
        self.rate_colour *= factor;
        self.rate_background *= factor;
        if let Some(index) = &mut self.index {
            index.rate *= factor;
            index.surface_rate *= factor;
        }
        if let Some(reflection) = &mut self.reflection {
            reflection.rate *= factor;
            reflection.rate_strength *= factor;
            reflection.rate_clearcoat *= factor;
        }
        if let Some(absorption) = &mut self.absorption {
            absorption.rate *= factor;
        }
    }

    /// False when density and colour are held fixed.
    pub fn moves_field(&self) -> bool {
        self.rate_density > 0.0 || self.rate_colour > 0.0
    }
}
