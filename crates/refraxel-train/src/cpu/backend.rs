//! The backend itself: a step is a half over rays and a half over voxels.

use super::absorption;
use super::caches::{clearcoat_gradient, mirror_gradients};
use super::composite::BatchLoss;
use super::index::{self, Learned};
use super::layout::{LANES, Layout};
use super::marcher::refresh;
use super::order::best_order;
use super::passes::{learn_chunk, weigh_chunk};
use super::render::{CHUNK, Renderer, with_blocks};
use super::scene::Scene;
use super::tape::{BUCKET_VOXELS, Tape, buckets};
use super::update::{
    BucketGradient, BucketParameters, GradientPool, SYNC_WORDS, VoxelFieldView, accumulate, descend,
};
use super::variation::total_variation;
use crate::backend::{
    AbsorptionObjective, Backend, Batch, BatchGradient, BrickMask, Caches, Layers, Marching, Mirroring,
    Objective, PixelGradient, REFRESH, RULE, RayGradient, ReflectionObjective, Snapshot, StepOutcome,
};
use crate::bake::{Look, RayKind};
use crate::cancel::{Cancel, Cancelled};
use crate::descent;
use crate::model::{
    ClearcoatMoments, IndexMoments, MirrorMoments, Model, Optimiser, Reflection, Refraction, resampled,
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;
use refraxel_core::radiance::Pixel;
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{Background, BrickMap, Domain, FieldGradient, Ray};
use std::borrow::Cow;
use std::ops::Range;

/// Chunks whose tapes exist at the same time while peak weights are sought.
const PORTION: usize = 64;

/// The buckets of voxels that move in a step.
pub(super) struct BucketRange {
    pub buckets: Range<usize>,
    /// Others are to be told how they have moved.
    pub tells: bool,
}

/// What has come of it.
pub(super) struct Update {
    pub finite: bool,
    /// What others are to be told.
    pub voxels: Vec<u32>,
}

/// The outcome of a batch of so many rays.
pub(super) fn total(rays: usize, chunks: &[StepOutcome]) -> StepOutcome {
    let mut total = StepOutcome { rays: rays as u64, ..Default::default() };
    for outcome in chunks {
        total.squared_error += outcome.squared_error;
        total.samples += outcome.samples;
    }
    total.finite = total.squared_error.is_finite();
    total
}

/// What the tapes of a step leave out since its derivative overflowed.
pub(super) fn overflows(objective: &Objective, tapes: &[Tape]) -> u64 {
    let learns = objective.index.is_some() || objective.absorption.is_some();
    if learns { index::overflows(tapes) } else { 0 }
}

/// Parameters, moments and search structures on the CPU.
pub struct CpuBackend {
    level: Level,
    model: Model,
    optimiser: Optimiser,
    layout: Layout,
    /// Memory of the last step, to be written over by the next.
    pub(super) tapes: Vec<Tape>,
    pool: GradientPool,
    /// Outcomes that nobody asked for yet.
    outcomes: Vec<StepOutcome>,
    /// A step was not finite: nothing changes until the next load.
    failed: bool,
}

impl CpuBackend {
    /// A backend with a model that has not learned yet.
    pub fn new(model: Model) -> Self {
        let optimiser = Optimiser::new(&model);
        Self::resumed(model, optimiser)
    }

    /// A backend that goes on from this state of the optimiser.
    ///
    /// # Panics
    /// If the state [does not fit](Optimiser::fits) the model.
    pub fn resumed(model: Model, optimiser: Optimiser) -> Self {
        assert!(optimiser.fits(&model), "the optimiser's state is that of another model");
        let new = Self {
            level: Level::new(),
            layout: Layout::new(model.field.degree),
            tapes: Vec::new(),
            pool: GradientPool::new(model.field.degree.stride()),
            outcomes: Vec::new(),
            failed: false,
            model,
            optimiser,
        };
        new.enlarge_pages();
        new
    }

    /// Large pages for what rays and steps read in no order.
    fn enlarge_pages(&self) {
        let (field, optimiser) = (&self.model.field, &self.optimiser);
        for array in [&field.density, &field.colour, &optimiser.density, &optimiser.colour] {
            array.enlarge_pages();
        }
    }

    /// The parameters as they are now.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Changes values of parameters in place; moments stay. Call [`refresh_occupancy`](Backend::refresh_occupancy) after a change
    /// of densities.
    ///
    /// # Panics
    /// If the moments do not fit the model any more: a change of shapes takes [`load`](Backend::load).
    pub fn edit(&mut self, change: impl FnOnce(&mut Model)) {
        change(&mut self.model);
        assert!(self.optimiser.fits(&self.model), "an edit changes values, not shapes");
    }

    /// Forward and adjoint of a batch without summing gradients; the number of samples, for benchmarks.
    pub fn gradient_tapes(&self, batch: &Batch, objective: &Objective) -> u64 {
        self.trace(batch, objective, &mut [], Vec::new()).1.samples
    }

    /// Transpose of the derivative of [`render`](Backend::render) with all layers, for losses of any kind: from dLoss/d(what
    /// each ray shows) to dLoss/d(everything that it depends on). The depth of a pixel has no adjoint. Changes nothing.
    ///
    /// Exact for the discrete march with its points held fixed, as (3.10)–(3.14) and the tracer's adjoint are. Samples below
    /// the cut-offs of `marching` get no gradient. That of a constant background is not collected; that of an
    /// [`EnvironmentMap`](refraxel_core::EnvironmentMap) of equal texels is, and their sum is the former.
    ///
    /// # Panics
    /// Unless there is one adjoint per ray.
    pub fn vjp(&self, rays: &[Ray<f32>], marching: &Marching, d_pixels: &[PixelGradient]) -> BatchGradient {
        assert_eq!(rays.len(), d_pixels.len(), "one adjoint per ray");
        let absorption = Some(AbsorptionObjective { rate: 0.0 });
        let objective = Objective { absorption, ..Objective::still(*marching) };
        let offset = vec![0.5; rays.len()];
        let batch = Batch { rays: rays.to_vec(), offset, ..Batch::default() };
        self.gradient_of(BatchLoss { batch: &batch, objective: &objective, asked: Some(d_pixels) })
    }

    fn gradient_of(&self, batch_loss: BatchLoss) -> BatchGradient {
        let mut rays = vec![RayGradient::zero(); batch_loss.batch.rays.len()];
        let (tapes, outcome) = self.trace_batch(batch_loss, &mut rays, Vec::new());
        let Model { refraction, reflection, clearcoat, .. } = &self.model;
        let of_clearcoat = |c| clearcoat_gradient(c, reflection.source, &tapes);
        BatchGradient {
            field: self.field_gradient(&tapes),
            background: self.background_gradient(&tapes),
            medium: index::gradient(&refraction.medium, &tapes, f32::INFINITY),
            absorption: absorption::gradient(refraction.medium.regions().len(), &tapes),
            reflection: mirror_gradients(reflection, &tapes),
            clearcoat: clearcoat.as_ref().map(of_clearcoat),
            rays,
            outcome,
        }
    }

    pub(super) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Goes on from all of this model but its field.
    pub(super) fn load_but_field(&mut self, model: Model, optimiser: Optimiser) {
        let Model { field: _, background, refraction, reflection, clearcoat } = model;
        let own = &mut self.model;
        (own.background, own.refraction, own.reflection, own.clearcoat) =
            (background, refraction, reflection, clearcoat);
        let own = &mut self.optimiser;
        (own.background, own.index) = (optimiser.background, optimiser.index);
        (own.reflection, own.clearcoat) = (optimiser.reflection, optimiser.clearcoat);
    }

    fn scene(&self) -> Scene<'_> {
        Scene::new(&self.model, &self.optimiser.occupied, &self.layout)
    }

    fn stride(&self) -> usize {
        self.model.field.degree.stride()
    }

    /// Forward and adjoint of a batch: one tape per chunk, written over `tapes` of an earlier batch.
    fn trace(
        &self,
        batch: &Batch,
        objective: &Objective,
        ray_gradients: &mut [RayGradient],
        tapes: Vec<Tape>,
    ) -> (Vec<Tape>, StepOutcome) {
        self.trace_batch(BatchLoss { batch, objective, asked: None }, ray_gradients, tapes)
    }

    /// The same, by targets or by given adjoints.
    fn trace_batch(
        &self,
        batch_loss: BatchLoss,
        ray_gradients: &mut [RayGradient],
        tapes: Vec<Tape>,
    ) -> (Vec<Tape>, StepOutcome) {
        let rays = batch_loss.batch.rays.len();
        let (tapes, outcomes) = self.trace_chunks(batch_loss, ray_gradients, tapes);
        (tapes, total(rays, &outcomes))
    }

    /// The same, with the outcome of each chunk.
    pub(super) fn trace_chunks(
        &self,
        batch_loss: BatchLoss,
        ray_gradients: &mut [RayGradient],
        mut tapes: Vec<Tape>,
    ) -> (Vec<Tape>, Vec<StepOutcome>) {
        let (scene, n) = (self.scene(), batch_loss.batch.rays.len());
        tapes.resize_with(n.div_ceil(CHUNK), Tape::default);
        let chunk = |k: usize, tape: &mut Tape, gradients: &mut [RayGradient]| {
            let range = k * CHUNK..((k + 1) * CHUNK).min(n);
            with_blocks!(
                self.level,
                self.stride(),
                simd,
                learn_chunk(&scene, batch_loss, range, tape, gradients)
            )
        };
        let outcomes: Vec<StepOutcome> = if ray_gradients.is_empty() {
            tapes.par_iter_mut().enumerate().map(|(k, tape)| chunk(k, tape, &mut [])).collect()
        } else {
            let parts = tapes.par_iter_mut().zip(ray_gradients.par_chunks_mut(CHUNK)).enumerate();
            parts.map(|(k, (tape, gradients))| chunk(k, tape, gradients)).collect()
        };
        (tapes, outcomes)
    }

    /// Total variation of those of some buckets whose turn it is.
    fn variation(&self, objective: &Objective, step: u64, of: &Range<usize>) -> Vec<Option<BucketGradient>> {
        let active = objective.tv_density > 0.0 || objective.tv_colour > 0.0;
        let period = u64::from(objective.tv_period.max(1));
        let turn = |b: usize| active && (b as u64 + step).is_multiple_of(period);
        let field = &self.model.field;
        of.clone()
            .into_par_iter()
            .map(|bucket| {
                turn(bucket).then(|| {
                    let mut grad = self.pool.take();
                    with_blocks!(
                        self.level,
                        self.stride(),
                        simd,
                        total_variation(field, bucket, objective, &mut grad)
                    );
                    grad
                })
            })
            .collect()
    }

    /// Second half of a step: a share of the buckets adds up, feels its priors and moves.
    fn update_field(
        &mut self,
        tapes: &[Tape],
        objective: &Objective,
        variation: Vec<Option<BucketGradient>>,
        share: &BucketRange,
    ) -> Update {
        let stride = self.stride();
        let (level, pool) = (self.level, &self.pool);
        let field = &mut self.model.field;
        let channels = 3 * field.degree.basis();
        let view = VoxelFieldView { map: &field.map, layout: &self.layout };
        let buckets = field
            .density
            .par_chunks_mut(BUCKET_VOXELS)
            .zip(self.optimiser.density.par_chunks_mut(BUCKET_VOXELS))
            .zip(field.colour.par_chunks_mut(BUCKET_VOXELS * stride))
            .zip(self.optimiser.colour.par_chunks_mut(BUCKET_VOXELS))
            .enumerate()
            .skip(share.buckets.start)
            .zip(variation);
        let moved: Vec<Update> = buckets
            .map(|((bucket, (((density, density_moment), colour), colour_moment)), prior)| {
                let mut parameters = BucketParameters { density, density_moment, colour, colour_moment };
                let mut grad = prior.unwrap_or_else(|| pool.take());
                macro_rules! run {
                    ($n:literal) => {
                        dispatch!(level, simd => {
                            accumulate::<_, $n>(simd, &view, bucket, tapes, &mut grad);
                            descend::<_, $n>(simd, &mut parameters, &grad, channels, objective)
                        })
                    };
                }
                let finite = match stride / LANES {
                    1 => run!(1),
                    2 => run!(2),
                    _ => run!(3),
                };
                let voxels = if share.tells { parameters.told(bucket, &grad, channels) } else { Vec::new() };
                pool.give(grad);
                Update { finite, voxels }
            })
            .collect();
        let voxels: Vec<&[u32]> = moved.iter().map(|m| &m.voxels[..]).collect();
        Update { finite: moved.iter().all(|m| m.finite), voxels: voxels.concat() }
    }

    /// Takes over voxels that another process has moved.
    pub(super) fn apply_remote(&mut self, voxels: &[u32]) {
        let (field, optimiser) = (&mut self.model.field, &mut self.optimiser);
        let (channels, stride) = (3 * field.degree.basis(), field.degree.stride());
        for words in voxels.chunks_exact(SYNC_WORDS + channels) {
            let voxel = words[0] as usize;
            let [density, density_moment, colour_moment] = [1, 2, 3].map(|k| f32::from_bits(words[k]));
            field.density[voxel] = density;
            optimiser.density[voxel] = density_moment;
            optimiser.colour[voxel] = colour_moment;
            let colour = &mut field.colour[voxel * stride..][..channels];
            colour.iter_mut().zip(&words[SYNC_WORDS..]).for_each(|(c, word)| *c = f32::from_bits(*word));
        }
    }

    /// The field, and beside it the index: much of the index's step is serial.
    pub(super) fn update_all(
        &mut self,
        learned: &Learned,
        objective: &Objective,
        share: &BucketRange,
    ) -> Update {
        let mut refraction = std::mem::replace(&mut self.model.refraction, Refraction::none());
        let mut moments = std::mem::take(&mut self.optimiser.index);
        let learn_index = || {
            let objective = objective.index.as_ref();
            objective.is_none_or(|o| index::update(&mut refraction, &mut moments, learned, o))
        };
        let learn_field = || {
            if !objective.moves_field() {
                return Update { finite: true, voxels: Vec::new() };
            }
            let variation = self.variation(objective, learned.step, &share.buckets);
            self.update_field(learned.tapes, objective, variation, share)
        };
        let (moved, is_index_finite) = rayon::join(learn_field, learn_index);
        (self.model.refraction, self.optimiser.index) = (refraction, moments);
        Update { finite: moved.finite && is_index_finite, ..moved }
    }

    /// What no process has a share of: background, mirrors and absorption. False when a parameter left the finite numbers.
    pub(super) fn update_rest(&mut self, tapes: &[Tape], objective: &Objective) -> bool {
        let mut finite = self.update_background(tapes, objective.rate_background);
        if let Some(objective) = &objective.reflection {
            finite &= self.update_reflection(tapes, objective);
        }
        let (refraction, moments) = (&mut self.model.refraction, &mut self.optimiser.index);
        if let Some(objective) = &objective.absorption {
            finite &= absorption::update(refraction, moments, tapes, objective);
        }
        finite
    }

    /// Dense gradient of the background's texels, summed in the order of the rays.
    fn background_gradient(&self, tapes: &[Tape]) -> Vec<[f32; 3]> {
        let mut grad = vec![[0.0; 3]; self.optimiser.background.len()];
        for &(texel, g) in tapes.iter().flat_map(|t| &t.texels) {
            for c in 0..3 {
                grad[texel as usize][c] += g[c];
            }
        }
        grad
    }

    /// False when a texel left the finite numbers.
    fn update_background(&mut self, tapes: &[Tape], rate: f32) -> bool {
        let grad = self.background_gradient(tapes);
        let mut finite = true;
        let Background::Environment(map) = &mut self.model.background else { return finite };
        for ((texel, moment), g) in map.texels.iter_mut().zip(&mut self.optimiser.background).zip(&grad) {
            for c in (0..3).filter(|&c| g[c] != 0.0) {
                texel[c] += RULE.step(g[c], &mut moment[c], rate);
                finite &= texel[c].is_finite();
            }
        }
        finite
    }

    /// False when a parameter left the finite numbers.
    fn update_reflection(&mut self, tapes: &[Tape], objective: &ReflectionObjective) -> bool {
        let (model, optimiser) = (&mut self.model, &mut self.optimiser);
        let grads = mirror_gradients(&model.reflection, tapes);
        let (reflection, moments) = (&mut model.reflection, &mut optimiser.reflection);
        let mut finite = descent::update_mirrors(reflection, moments, &grads, objective);
        if let Some(clearcoat) = &mut model.clearcoat {
            let grad = clearcoat_gradient(clearcoat, model.reflection.source, tapes);
            finite &= descent::update_clearcoat(clearcoat, &mut optimiser.clearcoat, &grad, objective);
        }
        finite
    }

    /// One step, all or nothing as far as the loss goes: a loss that is not finite changes nothing. Where a parameter leaves the
    /// finite numbers, others have moved by then. Nobody uses the mixture: no step follows, and nothing is copied or saved,
    /// before the last good state is loaded with its moments, also where a run gives up.
    fn learn(&mut self, batch: &Batch, objective: &Objective, step: u64) -> StepOutcome {
        if step.is_multiple_of(REFRESH) {
            self.refresh_occupancy(&objective.marching);
        }
        let batch = &self.ordered(batch, objective);
        let tapes = std::mem::take(&mut self.tapes);
        let (tapes, mut outcome) = self.trace(batch, objective, &mut [], tapes);
        outcome.step = step;
        if outcome.finite {
            let learned = Learned { tapes: &tapes, rays: batch.rays.len(), step };
            let all = BucketRange { buckets: 0..buckets(&self.model.field.map), tells: false };
            outcome.overflows = overflows(objective, &tapes);
            outcome.finite = self.update_all(&learned, objective, &all).finite;
        }
        if outcome.finite {
            outcome.finite = self.update_rest(&tapes, objective);
        }
        self.tapes = tapes;
        outcome
    }

    /// The batch in the order in which it is best worked on.
    pub(super) fn ordered(&self, batch: &Batch, objective: &Objective) -> Batch {
        let near = objective.marching.near;
        batch.reordered(&best_order(self.level, &self.scene(), &batch.rays, near))
    }

    /// The gradient of the field's parameters, summed from the tapes.
    fn field_gradient(&self, tapes: &[Tape]) -> FieldGradient<f32> {
        let (field, stride) = (&self.model.field, self.stride());
        let mut sum = field.zero_gradient();
        let view = VoxelFieldView { map: &field.map, layout: &self.layout };
        let parts =
            sum.density.par_chunks_mut(BUCKET_VOXELS).zip(sum.colour.par_chunks_mut(BUCKET_VOXELS * stride));
        parts.enumerate().for_each(|(bucket, (density, colour))| {
            let mut grad = self.pool.take();
            with_blocks!(self.level, stride, simd, accumulate(&view, bucket, tapes, &mut grad));
            density.copy_from_slice(&grad.density[..density.len()]);
            colour.copy_from_slice(&grad.colour[..colour.len()]);
            self.pool.give(grad);
        });
        sum
    }
}

impl Backend for CpuBackend {
    fn load(&mut self, model: Model, optimiser: Option<Optimiser>) {
        let optimiser = optimiser.unwrap_or_else(|| Optimiser::new(&model));
        assert!(optimiser.fits(&model), "the optimiser's state is that of another model");
        if model.field.degree != self.model.field.degree {
            self.layout = Layout::new(model.field.degree);
            self.pool = GradientPool::new(model.field.degree.stride());
        }
        (self.model, self.optimiser) = (model, optimiser);
        self.enlarge_pages();
        self.outcomes.clear();
        self.failed = false;
    }

    fn snapshot(&self) -> Snapshot<'_> {
        Snapshot { model: Cow::Borrowed(&self.model), optimiser: Cow::Borrowed(&self.optimiser) }
    }

    fn domain(&self) -> &Domain<f32> {
        &self.model.field.domain
    }

    fn map(&self) -> &BrickMap {
        &self.model.field.map
    }

    fn medium(&self) -> &Refraction {
        &self.model.refraction
    }

    fn mirroring(&self) -> Mirroring {
        Mirroring::of(&self.model)
    }

    fn set_medium(&mut self, medium: Refraction) {
        self.optimiser.index = medium.medium.regions().iter().map(IndexMoments::zero).collect();
        self.model.refraction = medium;
    }

    fn set_reflection(&mut self, reflection: Reflection) {
        self.optimiser.reflection = reflection.mirrors.iter().map(MirrorMoments::zero).collect();
        self.model.reflection = reflection;
    }

    fn set_clearcoat(&mut self, clearcoat: Clearcoat<f32>) {
        self.optimiser.clearcoat = ClearcoatMoments::zero(&clearcoat);
        self.model.clearcoat = Some(clearcoat);
    }

    fn set_density(&mut self, value: f32, inside: &BrickMask) {
        for voxel in inside.voxels() {
            self.model.field.density[voxel] = value;
            self.optimiser.density[voxel] = 0.0;
            self.optimiser.colour[voxel] = 0.0;
        }
    }

    fn resample(&mut self, domain: Domain<f32>, map: BrickMap) {
        self.model.field = resampled(&self.model.field, domain, map);
        self.optimiser.forget_field(&self.model.field);
        self.enlarge_pages();
    }

    fn refresh_occupancy(&mut self, marching: &Marching) {
        refresh(&mut self.optimiser.occupied, &self.model.field, marching);
    }

    fn bake(&mut self, caches: Caches, marching: &Marching, cancel: &Cancel) -> Result<(), Cancelled> {
        let scene = self.scene();
        let (straight, silent) = (Refraction::none(), Reflection::none());
        let marching = Marching { near: 0.0, ..*marching };
        let see = |rays: &[Ray<f32>], through| {
            let refraction = if through == RayKind::Bent { scene.refraction } else { &straight };
            let scene = Scene { refraction, reflection: &silent, clearcoat: None, ..scene };
            Renderer { level: self.level, scene }.render(rays, &marching)
        };
        let look = Look { refraction: scene.refraction, domain: &scene.field.domain, see, cancel };
        match (caches, &self.model.clearcoat) {
            (Caches::Reflection, _) => self.model.reflection = look.reflection(scene.reflection)?,
            (Caches::Clearcoat, Some(clearcoat)) => self.model.clearcoat = Some(look.clearcoat(clearcoat)?),
            (Caches::Clearcoat, None) => {}
        }
        Ok(())
    }

    fn render(&self, rays: &[Ray<f32>], marching: &Marching, layers: Layers) -> Vec<Pixel<f32>> {
        let scene = self.scene();
        let (level, silent) = (self.level, Reflection::none());
        match layers {
            Layers::All => Renderer { level, scene }.render(rays, marching),
            Layers::Mirroring(source) => {
                let reflection = &Reflection { source, ..self.model.reflection.clone() };
                Renderer { level, scene: Scene { reflection, ..scene } }.render(rays, marching)
            }
            Layers::Transmitted => {
                let scene = Scene { reflection: &silent, clearcoat: None, ..scene };
                Renderer { level, scene }.render(rays, marching)
            }
        }
    }

    fn submit(&mut self, batch: &Batch, objective: &Objective, step: u64) {
        if self.failed {
            return;
        }
        let outcome = self.learn(batch, objective, step);
        self.failed = !outcome.finite;
        self.outcomes.push(outcome);
    }

    fn outcomes(&mut self, _wait: bool) -> Vec<StepOutcome> {
        std::mem::take(&mut self.outcomes)
    }

    fn gradient(&self, batch: &Batch, objective: &Objective) -> BatchGradient {
        self.gradient_of(BatchLoss { batch, objective, asked: None })
    }

    fn ray_gradients(&self, batch: &Batch, objective: &Objective) -> Vec<RayGradient> {
        let mut rays = vec![RayGradient::zero(); batch.rays.len()];
        self.trace(batch, objective, &mut rays, Vec::new());
        rays
    }

    fn peak_weights(
        &self,
        rays: &[Ray<f32>],
        marching: &Marching,
        cancel: &Cancel,
    ) -> Result<Vec<f32>, Cancelled> {
        let (scene, map) = (self.scene(), &self.model.field.map);
        let mut peak = vec![0.0_f32; map.voxels()];
        for portion in rays.chunks(PORTION * CHUNK) {
            cancel.check()?;
            let weigh =
                |rays| with_blocks!(self.level, self.stride(), simd, weigh_chunk(&scene, rays, marching));
            let tapes: Vec<Tape> = portion.par_chunks(CHUNK).map(weigh).collect();
            peak.par_chunks_mut(BUCKET_VOXELS).enumerate().for_each(|(bucket, peak)| {
                let first = (bucket * BUCKET_VOXELS) as u32;
                for record in tapes.iter().flat_map(|t| t.of_bucket(bucket)) {
                    for v in map.corners(record.cell) {
                        if let Some(p) = v.checked_sub(first).and_then(|v| peak.get_mut(v as usize)) {
                            *p = p.max(record.d_theta);
                        }
                    }
                }
            });
        }
        Ok(peak)
    }
}
