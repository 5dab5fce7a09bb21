//! The CPU backend: threads over chunks of rays, SIMD over the channels of a voxel.
//!
//! A step has two halves. First every chunk of rays is marched, compared with its targets and marched back, leaving one
//! record per sample (`tape`). Then every bucket of voxels adds up its own records in order, adds its priors and takes
//! its optimiser step while the gradient is still in the cache (`update`). No gradient of the whole field ever exists,
//! nothing is locked, and the result does not depend on the number of threads.

mod bake;
mod clearcoat;
mod colour;
mod index;
mod march;
mod mirrors;
mod optics16;
mod path_adjoint;
mod prefetch;
mod reflection;
mod resample;
mod secondary;
mod tape;
mod trace;
mod update;

use crate::backend::{Backend, Batch, BatchGradient, Marching, Objective, StepOutcome};
use crate::reflection::Reflection;
use crate::refraction::Refraction;
pub use clearcoat::ClearcoatMoments;
use colour::Layout;
use fearless_simd::{Level, dispatch};
pub use index::{AdamMoments, IndexMoments};
use march::Marcher;
pub use mirrors::{MirrorGradient, MirrorMoments};
use rayon::prelude::*;
use refraxel_core::grid::{BRICK, BRICK_VOXELS};
use refraxel_core::optimiser::RmsProp;
use refraxel_core::radiance::{Pixel, clearcoat::Clearcoat};
use refraxel_core::{
    AlignedVec, Background, BrickMap, Domain, EnvironmentMap, FieldGradient, Ray, Vec3, VoxelField,
};
use tape::{BUCKET_VOXELS, Tape, buckets};
use update::{
    BucketGradient, BucketParameters, GradientPool, VoxelFieldView, accumulate, descend, total_variation,
};

/// Rays of a chunk, the unit of work of a thread. Part of the arithmetic: it fixes the order of sums.
const CHUNK: usize = 256;
/// Steps between two looks at which cells are still occupied: a cell that rises above the cut-off is seen that late.
const REFRESH: u64 = 32;

/// Everything a ray can see.
struct Scene<'a> {
    field: &'a VoxelField<f32>,
    background: &'a Background<f32>,
    refraction: &'a Refraction,
    reflection: &'a Reflection,
    clearcoat: Option<&'a Clearcoat<f32>>,
    layout: &'a Layout,
    marcher: &'a Marcher,
}

/// Parameters, moments and search structures on the CPU.
pub struct CpuBackend {
    level: Level,
    field: VoxelField<f32>,
    background: Background<f32>,
    refraction: Refraction,
    reflection: Reflection,
    clearcoat: Option<Clearcoat<f32>>,
    moments: Moments,
    layout: Layout,
    marcher: Marcher,
    /// Memory of the last step, to be written over by the next.
    tapes: Vec<Tape>,
    pool: GradientPool,
}

/// Second moments of the optimiser, laid out like what they belong to.
#[derive(Clone, Debug)]
pub struct Moments {
    /// Of [`VoxelField::density`].
    pub density: AlignedVec<f32>,
    /// Of the colour of each voxel: one for all its channels.
    pub colour: AlignedVec<f32>,
    /// Of the texels of an environment map; empty for a constant background.
    pub background: Vec<[f32; 3]>,
    /// Of the coefficients of the index, per region.
    pub index: Vec<IndexMoments>,
    /// Of what surfaces mirror, per region.
    pub reflection: Vec<MirrorMoments>,
    /// Of the clearcoat of opaque things; empty without one.
    pub clearcoat: ClearcoatMoments,
}

/// Run a kernel that is generic over the number of 16-lane blocks of a voxel.
macro_rules! with_blocks {
    ($self:expr, $simd:ident, $kernel:ident ( $($arg:expr),* $(,)? )) => {
        match $self.field.degree.stride() / colour::LANES {
            1 => dispatch!($self.level, $simd => $kernel::<_, 1>($simd, $($arg),*)),
            2 => dispatch!($self.level, $simd => $kernel::<_, 2>($simd, $($arg),*)),
            _ => dispatch!($self.level, $simd => $kernel::<_, 3>($simd, $($arg),*)),
        }
    };
}

use with_blocks;

impl Moments {
    fn zero(field: &VoxelField<f32>, background: &Background<f32>) -> Self {
        Self {
            density: AlignedVec::filled(field.density.len(), 0.0),
            colour: AlignedVec::filled(field.density.len(), 0.0),
            background: vec![[0.0; 3]; texels_of(background)],
            index: Vec::new(),
            reflection: Vec::new(),
            clearcoat: ClearcoatMoments::default(),
        }
    }
}

/// Parameters of a background.
fn texels_of(background: &Background<f32>) -> usize {
    match background {
        Background::Constant(_) => 0,
        Background::Environment(map) => map.texels.len(),
    }
}

impl CpuBackend {
    /// A backend that starts from these parameters.
    pub fn new(field: VoxelField<f32>, background: Background<f32>) -> Self {
        let moments = Moments::zero(&field, &background);
        Self::with_moments(field, background, moments)
    }

    /// A backend that goes on from these parameters and moments.
    ///
    /// # Panics
    /// If the moments are not of the shape of the parameters.
    pub fn with_moments(field: VoxelField<f32>, background: Background<f32>, moments: Moments) -> Self {
        assert_eq!(field.density.len(), moments.density.len(), "moments of another field");
        assert_eq!(field.density.len(), moments.colour.len(), "moments of another field");
        assert_eq!(texels_of(&background), moments.background.len(), "moments of another background");
        Self {
            level: Level::new(),
            layout: Layout::new(field.degree),
            marcher: Marcher::new(&field),
            refraction: Refraction::none(),
            reflection: Reflection::none(),
            clearcoat: None,
            tapes: Vec::new(),
            pool: GradientPool::new(field.degree.stride()),
            field,
            background,
            moments,
        }
    }

    /// The optimiser's state.
    pub fn moments(&self) -> &Moments {
        &self.moments
    }

    /// Which cells may hold matter, 64 bits per slot of the map: state of the training loop between two looks.
    pub fn occupied(&self) -> &[u64] {
        &self.marcher.occupied
    }

    /// Go on with cells that were occupied when a run was saved; false when they are not those of this map.
    pub fn restore_occupied(&mut self, occupied: Vec<u64>) -> bool {
        let fits = occupied.len() == self.field.map.slots() && occupied.first() == Some(&0);
        if fits {
            self.marcher.occupied = occupied;
        }
        fits
    }

    /// Bend the rays, and go on with these moments of the index.
    pub fn restore_refraction(&mut self, refraction: Refraction, moments: Vec<IndexMoments>) {
        self.refraction = refraction;
        self.moments.index = moments;
    }

    /// What surfaces mirror.
    pub fn reflection(&self) -> &Reflection {
        &self.reflection
    }

    /// Mirror otherwise; mirrors forget their moments.
    pub fn set_reflection(&mut self, reflection: Reflection) {
        self.moments.reflection = reflection.mirrors.iter().map(MirrorMoments::zero).collect();
        self.reflection = reflection;
    }

    /// Mirror, and go on with these moments.
    pub fn restore_reflection(&mut self, reflection: Reflection, moments: Vec<MirrorMoments>) {
        self.reflection = reflection;
        self.moments.reflection = moments;
    }

    /// The clearcoat of opaque things.
    pub fn clearcoat(&self) -> Option<&Clearcoat<f32>> {
        self.clearcoat.as_ref()
    }

    /// ClearcoatReflection opaque things; the clearcoat has no moments yet.
    pub fn set_clearcoat(&mut self, clearcoat: Clearcoat<f32>) {
        self.moments.clearcoat = ClearcoatMoments::zero(&clearcoat);
        self.clearcoat = Some(clearcoat);
    }

    /// ClearcoatReflection opaque things, and go on with these moments.
    pub fn restore_clearcoat(&mut self, clearcoat: Option<Clearcoat<f32>>, moments: ClearcoatMoments) {
        self.clearcoat = clearcoat;
        self.moments.clearcoat = moments;
    }

    /// Set the raw density of all voxels whose world position is chosen; their moments start anew.
    pub fn set_density(&mut self, density: f32, chosen: impl Fn(Vec3<f32>) -> bool) {
        let field = &mut self.field;
        for (slot, brick) in field.map.bricks().iter().enumerate() {
            for local in 0..BRICK_VOXELS {
                let within = [local & 3, local >> 2 & 3, local >> 4];
                let node = [0, 1, 2].map(|a| (BRICK * brick[a] + within[a] as u32) as f32);
                if chosen(field.domain.position(Vec3::from(node))) {
                    let voxel = (slot + 1) * BRICK_VOXELS + local;
                    field.density[voxel] = density;
                    self.moments.density[voxel] = 0.0;
                    self.moments.colour[voxel] = 0.0;
                }
            }
        }
    }

    /// |C − target|² of each ray of a batch, without learning from it.
    pub fn squared_errors(&self, batch: &Batch, marching: &Marching) -> Vec<f64> {
        let own = match &self.background {
            Background::Constant(c) => *c,
            Background::Environment(_) => [0.0; 3],
        };
        let pixels = self.render(&batch.rays, marching);
        let error = |(ray, (pixel, target)): (usize, (&Pixel<f32>, &[f32; 3]))| {
            // Renderings lie before the model's own background.
            let behind: [f32; 3] =
                batch.behind.get(ray).map_or([0.0; 3], |b| [0, 1, 2].map(|c| b[c] - own[c]));
            let of = |c: usize| pixel.colour[c] + pixel.transmittance * behind[c] - target[c];
            (0..3).map(|c| f64::from(of(c)).powi(2)).sum()
        };
        pixels.iter().zip(&batch.target).enumerate().map(error).collect()
    }

    /// Share of the stored cells that rays have to look at.
    pub fn occupancy(&self) -> f64 {
        self.marcher.occupancy(&self.field.map)
    }

    /// Recompute which cells can be skipped at these cut-offs.
    pub fn refresh_occupancy(&mut self, marching: &Marching) {
        self.marcher.refresh(&self.field, marching);
    }

    fn scene(&self) -> Scene<'_> {
        Scene {
            field: &self.field,
            background: &self.background,
            refraction: &self.refraction,
            reflection: &self.reflection,
            clearcoat: self.clearcoat.as_ref(),
            layout: &self.layout,
            marcher: &self.marcher,
        }
    }

    /// Forward and adjoint of a batch: one tape per chunk, written over `tapes` of an earlier batch.
    fn trace(
        &self,
        batch: &Batch,
        objective: &Objective,
        ray_gradients: &mut [(Vec3<f32>, Vec3<f32>)],
        mut tapes: Vec<Tape>,
    ) -> (Vec<Tape>, StepOutcome) {
        use trace::learn_chunk;
        let (scene, n) = (self.scene(), batch.rays.len());
        tapes.resize_with(n.div_ceil(CHUNK), Tape::default);
        let chunk = |k: usize, tape: &mut Tape, gradients: &mut [(Vec3<f32>, Vec3<f32>)]| {
            let range = k * CHUNK..((k + 1) * CHUNK).min(n);
            with_blocks!(self, simd, learn_chunk(&scene, batch, range, objective, (tape, gradients)))
        };
        let outcomes: Vec<StepOutcome> = if ray_gradients.is_empty() {
            tapes.par_iter_mut().enumerate().map(|(k, tape)| chunk(k, tape, &mut [])).collect()
        } else {
            let parts = tapes.par_iter_mut().zip(ray_gradients.par_chunks_mut(CHUNK)).enumerate();
            parts.map(|(k, (tape, gradients))| chunk(k, tape, gradients)).collect()
        };
        let mut total = StepOutcome { finite: true, ..Default::default() };
        for outcome in outcomes {
            total.squared_error += outcome.squared_error;
            total.samples += outcome.samples;
        }
        total.finite = total.squared_error.is_finite();
        (tapes, total)
    }

    /// Forward and adjoint of a batch without summing gradients; the number of samples, for benchmarks.
    pub fn gradient_tapes(&self, batch: &Batch, objective: &Objective) -> u64 {
        self.trace(batch, objective, &mut [], Vec::new()).1.samples
    }

    /// Total variation of the buckets whose turn it is.
    fn variation(&self, objective: &Objective, step: u64) -> Vec<Option<BucketGradient>> {
        let active = objective.tv_density > 0.0 || objective.tv_colour > 0.0;
        let period = u64::from(objective.tv_period.max(1));
        let turn = |b: usize| active && (b as u64 + step).is_multiple_of(period);
        (0..buckets(&self.field.map))
            .into_par_iter()
            .map(|bucket| {
                turn(bucket).then(|| {
                    let mut grad = self.pool.take();
                    with_blocks!(self, simd, total_variation(&self.field, bucket, objective, &mut grad));
                    grad
                })
            })
            .collect()
    }

    /// Second half of a step: buckets add up, feel their priors and move. False when a parameter left the finite numbers.
    fn update(
        &mut self,
        tapes: &[Tape],
        objective: &Objective,
        variation: Vec<Option<BucketGradient>>,
    ) -> bool {
        let stride = self.field.degree.stride();
        let (level, blocks, pool) = (self.level, stride / colour::LANES, &self.pool);
        let channels = 3 * self.field.degree.basis();
        let view = VoxelFieldView { map: &self.field.map, layout: &self.layout };
        let buckets = self
            .field
            .density
            .par_chunks_mut(BUCKET_VOXELS)
            .zip(self.moments.density.par_chunks_mut(BUCKET_VOXELS))
            .zip(self.field.colour.par_chunks_mut(BUCKET_VOXELS * stride))
            .zip(self.moments.colour.par_chunks_mut(BUCKET_VOXELS))
            .zip(variation)
            .enumerate();
        let finite =
            buckets.map(|(bucket, ((((density, density_moment), colour), colour_moment), prior))| {
                let mut parameters = BucketParameters { density, density_moment, colour, colour_moment };
                let mut grad = prior.unwrap_or_else(|| pool.take());
                macro_rules! run {
                ($n:literal) => {
                    dispatch!(level, simd => {
                        accumulate::<_, $n>(simd, &view, bucket, tapes, &mut grad);
                        descend::<_, $n>(simd, &mut parameters, (&grad, channels), objective)
                    })
                };
            }
                let finite = match blocks {
                    1 => run!(1),
                    2 => run!(2),
                    _ => run!(3),
                };
                pool.give(grad);
                finite
            });
        finite.reduce(|| true, |a, b| a & b)
    }

    /// The field, and beside it the index: much of the index's step is serial.
    fn update_all(&mut self, (tapes, rays, step): (&[Tape], usize, u64), objective: &Objective) -> bool {
        let mut refraction = std::mem::replace(&mut self.refraction, Refraction::none());
        let mut moments = std::mem::take(&mut self.moments.index);
        let learn_index = || {
            if let Some(objective) = &objective.index {
                index::update(&mut refraction, &mut moments, (tapes, rays, step), objective);
            }
        };
        let learn_field = || {
            let variation = objective.moves_field().then(|| self.variation(objective, step));
            variation.is_none_or(|variation| self.update(tapes, objective, variation))
        };
        let (finite, ()) = rayon::join(learn_field, learn_index);
        (self.refraction, self.moments.index) = (refraction, moments);
        finite
    }

    /// Dense gradient of the background's texels, summed in the order of the rays.
    fn background_gradient(&self, tapes: &[Tape]) -> Vec<[f32; 3]> {
        let mut grad = vec![[0.0; 3]; self.moments.background.len()];
        for &(texel, g) in tapes.iter().flat_map(|t| &t.texels) {
            for c in 0..3 {
                grad[texel as usize][c] += g[c];
            }
        }
        grad
    }

    fn update_background(&mut self, tapes: &[Tape], rate: f32) {
        let grad = self.background_gradient(tapes);
        if let Background::Environment(map) = &mut self.background {
            descend_texels(map, &mut self.moments.background, &grad, rate, update::RULE);
        }
    }
}

fn descend_texels(
    map: &mut EnvironmentMap<f32>,
    moments: &mut [[f32; 3]],
    grad: &[[f32; 3]],
    rate: f32,
    rule: RmsProp<f32>,
) {
    for ((texel, moment), g) in map.texels.iter_mut().zip(moments).zip(grad) {
        for c in (0..3).filter(|&c| g[c] != 0.0) {
            texel[c] += rule.step(g[c], &mut moment[c], rate);
        }
    }
}

impl Backend for CpuBackend {
    fn field(&self) -> &VoxelField<f32> {
        &self.field
    }

    fn background(&self) -> &Background<f32> {
        &self.background
    }

    fn refraction(&self) -> &Refraction {
        &self.refraction
    }

    fn set_refraction(&mut self, refraction: Refraction) {
        self.moments.index = refraction.medium.regions().iter().map(IndexMoments::zero).collect();
        self.refraction = refraction;
    }

    fn render(&self, rays: &[Ray<f32>], marching: &Marching) -> Vec<Pixel<f32>> {
        self.render_scene(&self.scene(), rays, marching)
    }

    fn learn(&mut self, batch: &Batch, objective: &Objective, step: u64) -> StepOutcome {
        if step.is_multiple_of(REFRESH) {
            self.refresh_occupancy(&objective.marching);
        }
        let tapes = std::mem::take(&mut self.tapes);
        let (tapes, mut outcome) = self.trace(batch, objective, &mut [], tapes);
        if outcome.finite {
            outcome.finite = self.update_all((&tapes, batch.rays.len(), step), objective);
        }
        if outcome.finite {
            self.update_background(&tapes, objective.rate_background);
            if let Some(objective) = &objective.reflection {
                mirrors::update(&mut self.reflection, &mut self.moments.reflection, &tapes, objective);
                if let Some(clearcoat) = &mut self.clearcoat {
                    let seen = (self.reflection.source, &tapes[..]);
                    clearcoat::update(clearcoat, &mut self.moments.clearcoat, seen, objective);
                }
            }
        }
        self.tapes = tapes;
        outcome
    }

    fn gradient(&self, batch: &Batch, objective: &Objective) -> BatchGradient {
        let mut rays = vec![(Vec3::zero(), Vec3::zero()); batch.rays.len()];
        let (tapes, outcome) = self.trace(batch, objective, &mut rays, Vec::new());
        let stride = self.field.degree.stride();
        let mut field: FieldGradient<f32> = self.field.zero_gradient();
        let view = VoxelFieldView { map: &self.field.map, layout: &self.layout };
        let parts = field
            .density
            .par_chunks_mut(BUCKET_VOXELS)
            .zip(field.colour.par_chunks_mut(BUCKET_VOXELS * stride));
        parts.enumerate().for_each(|(bucket, (density, colour))| {
            let mut grad = self.pool.take();
            with_blocks!(self, simd, accumulate(&view, bucket, &tapes, &mut grad));
            density.copy_from_slice(&grad.density[..density.len()]);
            colour.copy_from_slice(&grad.colour[..colour.len()]);
            self.pool.give(grad);
        });
        let medium = index::gradient(&self.refraction.medium, &tapes, f32::INFINITY);
        let reflection = mirrors::gradient(&self.reflection, &tapes);
        BatchGradient {
            field,
            background: self.background_gradient(&tapes),
            medium,
            reflection,
            clearcoat: self
                .clearcoat
                .as_ref()
                .map(|g| clearcoat::gradient(g, self.reflection.source, &tapes)),
            rays,
            outcome,
        }
    }

    fn peak_weights(&self, rays: &[Ray<f32>], marching: &Marching) -> Vec<f32> {
        use trace::weigh_chunk;
        let scene = self.scene();
        let mut peak = vec![0.0_f32; self.field.map.voxels()];
        // In portions, so that the tapes of all rays need not be held at once.
        for portion in rays.chunks(64 * CHUNK) {
            let tapes: Vec<Tape> = portion
                .par_chunks(CHUNK)
                .map(|rays| with_blocks!(self, simd, weigh_chunk(&scene, rays, marching)))
                .collect();
            peak.par_chunks_mut(BUCKET_VOXELS).enumerate().for_each(|(bucket, peak)| {
                let first = (bucket * BUCKET_VOXELS) as u32;
                for record in tapes.iter().flat_map(|t| t.of_bucket(bucket)) {
                    for v in self.field.map.corners(record.cell) {
                        if let Some(p) = v.checked_sub(first).and_then(|v| peak.get_mut(v as usize)) {
                            *p = p.max(record.d_theta);
                        }
                    }
                }
            });
        }
        peak
    }

    fn resample(&mut self, domain: Domain<f32>, map: BrickMap) {
        self.field = resample::resampled(&self.field, domain, map);
        self.moments = Moments {
            background: std::mem::take(&mut self.moments.background),
            index: std::mem::take(&mut self.moments.index),
            reflection: std::mem::take(&mut self.moments.reflection),
            clearcoat: std::mem::take(&mut self.moments.clearcoat),
            ..Moments::zero(&self.field, &Background::Constant([0.0; 3]))
        };
        self.marcher = Marcher::new(&self.field);
    }
}

#[cfg(test)]
mod tests;
