//! What a compute backend offers the trainer: render, learn from a batch, reshape the grid.

use crate::cpu::MirrorGradient;
use crate::refraction::Refraction;
use refraxel_core::index::MediumGradient;
use refraxel_core::index::priors::Penalty;
use refraxel_core::radiance::{Pixel, clearcoat::ClearcoatGradient};
use refraxel_core::{Background, BrickMap, Domain, FieldGradient, Ray, Vec3, VoxelField};

/// How densely and how far rays are marched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marching {
    /// Quadrature step [voxel].
    pub step: f32,
    /// Nothing nearer to the camera than this is seen [scene unit].
    pub near: f32,
    /// Samples of smaller optical depth per voxel count as perfectly transparent and get no gradient.
    pub min_optical_depth: f32,
    /// A ray ends once its transmittance falls below this.
    pub min_transmittance: f32,
}

impl Marching {
    /// No cut-offs: every sample inside the grid is evaluated. For tests and benchmarks.
    pub fn exhaustive(step: f32) -> Self {
        Self { step, near: 0.0, min_optical_depth: 0.0, min_transmittance: 0.0 }
    }
}

/// Rays with the colours that they should show.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Rays in world coordinates.
    pub rays: Vec<Ray<f32>>,
    /// Observed colour per ray (sRGB-encoded).
    pub target: Vec<[f32; 3]>,
    /// Radiance behind the field per ray; empty: the model's own background.
    pub behind: Vec<[f32; 3]>,
    /// Shift of the quadrature points per ray, in [0, 1) steps.
    pub offset: Vec<f32>,
}

/// What a step minimises, theory (4.1): the sum over rays of |C − target|² plus the priors; and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective {
    /// How rays are marched.
    pub marching: Marching,
    /// Weight of the Cauchy sparsity of each sample's optical depth.
    pub sparsity: f32,
    /// Weight of the opacity prior on each ray's transmittance.
    pub opacity: f32,
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

/// How the index of refraction and its surfaces learn, theory (4.14): Adam on the blurred gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexObjective {
    /// Learning rate of n at a node [1].
    pub rate: f32,
    /// Standard deviation of the blur of its gradient [voxel of the index grid].
    pub blur: f32,
    /// Bound on |dLoss/dp| of a index_sample; infinite for none.
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
    /// Strength of the smoothing of surfaces per step, theory (2.32), in [0, 1].
    pub surface_smooth: f32,
    /// Surfaces learn only from rays that meet them at most this often: further crossings amplify noise.
    pub most_events: u32,
}

impl Objective {
    /// False when density and colour are held fixed.
    pub fn moves_field(&self) -> bool {
        self.rate_density > 0.0 || self.rate_colour > 0.0
    }
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepOutcome {
    /// Σ over rays of |C − target|², without priors.
    pub squared_error: f64,
    /// Samples whose colour was evaluated.
    pub samples: u64,
    /// False when the squared error was NaN or infinite; nothing was updated then.
    pub finite: bool,
}

/// dLoss/d(everything) of a batch, for conformance tests and pose refinement.
#[derive(Clone, Debug)]
pub struct BatchGradient {
    /// With respect to the field's parameters.
    pub field: FieldGradient<f32>,
    /// With respect to the texels of an environment map; empty for a constant background.
    pub background: Vec<[f32; 3]>,
    /// With respect to the index and its surfaces; without blur and clip.
    pub medium: MediumGradient<f32>,
    /// With respect to what surfaces mirror, per region.
    pub reflection: Vec<MirrorGradient>,
    /// With respect to the clearcoat of opaque things.
    pub clearcoat: Option<ClearcoatGradient<f32>>,
    /// With respect to each ray's (origin, direction). What clearcoats of opaque things mirror is in it only in part.
    pub rays: Vec<(Vec3<f32>, Vec3<f32>)>,
    /// The outcome of the forward pass.
    pub outcome: StepOutcome,
}

/// A compute backend: owns the parameters and the state of their optimiser.
pub trait Backend {
    /// The field's current parameters.
    fn field(&self) -> &VoxelField<f32>;
    /// The current background.
    fn background(&self) -> &Background<f32>;
    /// What bends the rays.
    fn refraction(&self) -> &Refraction;
    /// Bend the rays otherwise; the index forgets its moments.
    fn set_refraction(&mut self, refraction: Refraction);
    /// Render rays over the background.
    fn render(&self, rays: &[Ray<f32>], marching: &Marching) -> Vec<Pixel<f32>>;
    /// Render a batch, compare, accumulate gradients, add priors, update the parameters. `step` counts from 0.
    fn learn(&mut self, batch: &Batch, objective: &Objective, step: u64) -> StepOutcome;
    /// The gradient of the batch's loss without total variation; changes nothing.
    fn gradient(&self, batch: &Batch, objective: &Objective) -> BatchGradient;
    /// Largest rendering weight T a that any of the rays gives to the samples around each voxel.
    fn peak_weights(&self, rays: &[Ray<f32>], marching: &Marching) -> Vec<f32>;
    /// Move the field to another domain and set of bricks by interpolation; the optimiser forgets its moments.
    fn resample(&mut self, domain: Domain<f32>, map: BrickMap);
}
