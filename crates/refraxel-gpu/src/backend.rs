//! The backend itself: a model in the memory of a device that renders and learns.

use crate::constants::{STATUS_FAILED, WANTS_FIELD, WANTS_INDEX};
use crate::drawing::{Drawing, draw, drawn};
use crate::error::{GpuError, Unsupported};
use crate::field::{HostMoments, OUTCOMES, blank, download};
use crate::gpu::Gpu;
use crate::gradients::Gradients;
use crate::learn::Room;
use crate::loaded::{self, LoadedModel};
use crate::memory::Buffers;
use crate::shape::{Purpose, Shape};
use crate::show::{Showing, show};
use crate::step::{self, Step};
use crate::task::{Given, Lesson, Seen};
use crate::weights::weigh;
use refraxel_core::radiance::{Pixel, clearcoat::Clearcoat};
use refraxel_core::{BrickMap, Domain, Integrator, Ray, ShDegree};
use refraxel_train::Options;
use refraxel_train::backend::{
    Backend, Batch, BatchGradient, BrickMask, Caches, Layers, Marching, Mirroring, Objective, RayGradient,
    Snapshot, StepOutcome,
};
use refraxel_train::bake::Look;
use refraxel_train::cancel::{Cancel, Cancelled};
use refraxel_train::model::{
    ClearcoatMoments, IndexMoments, MirrorMoments, Model, Optimiser, Reflection, Refraction, resampled,
};
use refraxel_train::rays::Draw;
use refraxel_train::run::Run;
use std::borrow::Cow;

/// Steps after which outcomes are read also where nobody waits for them.
const READ_EVERY: usize = 25;

/// Parameters, moments and search structures in the memory of a GPU.
///
/// Straight and bent rays, sharp surfaces and smooth regions that mirror, bodies that absorb, bounded and contracted domains, constant
/// backgrounds and panoramas, all priors. Models with more are refused by [`GpuBackend::new`] and [`GpuBackend::supports`].
#[derive(Debug)]
pub struct GpuBackend {
    model: LoadedModel,
    /// Room for the batch that learns.
    room: Room,
    /// Moments of what bends rays and mirrors, which the host moves.
    moments: HostMoments,
    /// Numbers and rays of the steps whose outcomes are on the device, in the order of their places there.
    pending: Vec<(u64, u64)>,
    /// Outcomes that nobody asked for yet.
    outcomes: Vec<StepOutcome>,
    /// Where batches are drawn.
    drawing: Drawing,
}

impl GpuBackend {
    /// A backend with a model that has not learned yet.
    pub fn new(gpu: Gpu, model: Model) -> Result<Self, GpuError> {
        let optimiser = Optimiser::new(&model);
        Self::resumed(gpu, &model, &optimiser)
    }

    /// A backend that goes on from this state of the optimiser.
    ///
    /// # Panics
    /// If the state [does not fit](Optimiser::fits) the model.
    pub fn resumed(gpu: Gpu, model: &Model, optimiser: &Optimiser) -> Result<Self, GpuError> {
        let model = LoadedModel::learning(gpu, model, optimiser)?;
        let (room, moments) = (Room::default(), HostMoments::of(optimiser));
        let (pending, outcomes) = (Vec::new(), Vec::new());
        Ok(Self { model, room, moments, pending, outcomes, drawing: Drawing::default() })
    }

    /// Whether the backend has everything that a model needs.
    pub fn supports(model: &Model) -> Result<(), Unsupported> {
        loaded::supports(model)
    }

    /// Whether a GPU can bind and hold a field of this degree and so many voxels that learns, of rays that bend or not.
    pub fn fits(gpu: &Gpu, degree: ShDegree, voxels: usize, bends: bool) -> Result<(), GpuError> {
        Shape::fitting(&gpu.device, Purpose::Learning, (degree, voxels), bends).map(drop)
    }

    /// Whether the backend has everything that a run may come to need: what its options switch on, and, for a run that goes on,
    /// what it holds and has decided.
    pub fn supports_run(options: &Options, saved: Option<&Run>, has_depth: bool) -> Result<(), Unsupported> {
        if has_depth && options.field.depth > 0.0 {
            return Err(Unsupported::Depth);
        }
        if let Some(run) = saved {
            Self::supports(&run.model)?;
        }
        let stays_straight = saved.is_some_and(|run| run.state.stays_straight);
        let bends = options.refraction.bend.is_on() && !stays_straight;
        if bends && Integrator::from(options.index.integrator) != Integrator::Leapfrog {
            return Err(Unsupported::Integrator);
        }
        Ok(())
    }

    pub(crate) fn model(&self) -> &LoadedModel {
        &self.model
    }

    /// The device, and what went wrong there.
    pub fn gpu(&self) -> &Gpu {
        &self.model.gpu
    }

    /// The model and the optimiser's state as they are now.
    pub fn read(&self) -> Result<(Model, Optimiser), GpuError> {
        let LoadedModel { gpu, kernels, held, buffers } = &self.model;
        download(&gpu.device, &kernels.shape, buffers, held, &self.moments)
    }

    /// A batch as the device draws it, and which of its rays may bend; `None` where it has to come from the host, see
    /// [`why_on_host`](refraxel_train::Backend::why_on_host).
    pub fn drawn(&mut self, draw: &Draw<'_>) -> Result<Option<(Batch, Vec<bool>)>, GpuError> {
        self.drawing.take_photographs(self.model.device(), draw);
        self.drawing.photographs().map(|photographs| drawn(&self.model, photographs, draw)).transpose()
    }

    /// Another model, with everything that belongs to it.
    fn replace(&mut self, model: &Model, optimiser: &Optimiser) -> Result<(), GpuError> {
        self.model.replace(model, optimiser)?;
        self.moments = HostMoments::of(optimiser);
        Ok(())
    }

    /// Note what went wrong.
    ///
    /// # Panics
    /// If it was something that the caller had to ask for before: a model that is not supported.
    fn noted<T>(&self, result: Result<T, GpuError>) -> Option<T> {
        match result {
            Ok(value) => Some(value),
            Err(GpuError::Unsupported(what)) => panic!("{what}"),
            Err(error) => {
                self.model.device().fail(error);
                None
            }
        }
    }

    /// Get the outcomes of all enqueued steps. Those of a device with a fault are not finite.
    fn settle(&mut self) {
        if self.pending.is_empty() {
            return;
        }
        let read = step::outcomes(&self.model, &self.pending);
        let lost = std::mem::take(&mut self.pending);
        let known = self.noted(read).unwrap_or_else(|| {
            let failed = |&(step, rays): &(u64, u64)| StepOutcome { step, rays, ..StepOutcome::default() };
            lost.iter().map(failed).collect()
        });
        self.outcomes.extend(known);
    }

    /// What rays show; nothing on a device with a fault.
    fn shown(&self, rays: &[Ray<f32>], marching: &Marching, showing: Showing) -> Vec<Pixel<f32>> {
        let portion = |rays: &[Ray<f32>]| {
            let seen = self.noted(show(&self.model, rays, marching, showing));
            seen.unwrap_or_else(|| vec![Seen::default(); rays.len()])
        };
        rays.chunks(self.model.portion()).flat_map(portion).map(Pixel::from).collect()
    }

    /// Change what is read from the device and put it back.
    fn edit(&mut self, change: impl FnOnce(Model, Optimiser) -> (Model, Optimiser)) {
        self.settle();
        let failed = self.outcomes.last().is_some_and(|o| !o.finite);
        let read = self.read();
        let Some((model, optimiser)) = self.noted(read) else { return };
        let (model, optimiser) = change(model, optimiser);
        let replaced = self.replace(&model, &optimiser);
        if self.noted(replaced).is_some() && failed {
            let mut status = vec![0_u32; STATUS_FAILED as usize + 1];
            status[STATUS_FAILED as usize] = 1;
            self.model.buffers.write(self.model.device(), "status", &status);
        }
    }

    /// Begin a step on a batch that is on the device.
    fn begin(&mut self, given: Result<Given, GpuError>, rays: usize, objective: &Objective, number: u64) {
        if self.pending.len() == OUTCOMES {
            self.settle();
        }
        let (place, rays) = (self.pending.len(), rays as u64);
        let checked = self.model.check_steps(&objective.marching, self.model.backward_loops(false));
        let enqueued = checked.and(given).and_then(|given| {
            let step = Step { number, place, given, objective };
            step.enqueue(&mut self.model, &mut self.room, &mut self.moments)
        });
        match self.noted(enqueued) {
            Some(()) => self.pending.push((number, rays)),
            None => {
                self.settle();
                self.outcomes.push(StepOutcome { step: number, rays, ..StepOutcome::default() });
            }
        }
    }

    fn gradients(&self, batch: &Batch, objective: &Objective, wants: u32) -> Option<Gradients> {
        let model = &self.model;
        let gradients = model
            .check_steps(&objective.marching, model.backward_loops(true))
            .and_then(|()| Gradients::of(model, batch, objective, wants));
        self.noted(gradients)
    }
}

impl Backend for GpuBackend {
    fn fault(&self) -> Option<String> {
        self.model.gpu.fault().map(|e| e.to_string())
    }

    fn may_fail(&self) -> bool {
        true
    }

    fn load(&mut self, model: Model, optimiser: Option<Optimiser>) {
        let optimiser = optimiser.unwrap_or_else(|| Optimiser::new(&model));
        self.pending.clear();
        self.outcomes.clear();
        let replaced = self.replace(&model, &optimiser);
        self.noted(replaced);
    }

    fn snapshot(&self) -> Snapshot<'_> {
        let read = self.read();
        // Of a device with a fault: nothing was learned.
        let (model, optimiser) = self.noted(read).unwrap_or_else(|| {
            let model = blank(&self.model.held);
            let optimiser = Optimiser::new(&model);
            (model, optimiser)
        });
        Snapshot { model: Cow::Owned(model), optimiser: Cow::Owned(optimiser) }
    }

    fn domain(&self) -> &Domain<f32> {
        &self.model.held.field.domain
    }

    fn map(&self) -> &BrickMap {
        &self.model.held.field.map
    }

    fn medium(&self) -> &Refraction {
        &self.model.held.refraction
    }

    fn mirroring(&self) -> Mirroring {
        Mirroring::of(&self.model.held)
    }

    fn set_medium(&mut self, medium: Refraction) {
        self.moments.index = medium.medium.regions().iter().map(IndexMoments::zero).collect();
        let uploaded = self.model.set_medium(medium);
        self.noted(uploaded);
    }

    fn set_reflection(&mut self, reflection: Reflection) {
        self.moments.reflection = reflection.mirrors.iter().map(MirrorMoments::zero).collect();
        self.model.held.reflection = reflection;
        let uploaded = self.model.make_mirrors();
        self.noted(uploaded);
    }

    fn set_clearcoat(&mut self, clearcoat: Clearcoat<f32>) {
        self.moments.clearcoat = ClearcoatMoments::zero(&clearcoat);
        self.model.held.clearcoat = Some(clearcoat);
        let uploaded = self.model.make_mirrors();
        self.noted(uploaded);
    }

    fn set_density(&mut self, value: f32, inside: &BrickMask) {
        self.edit(|mut model, mut optimiser| {
            for v in inside.voxels() {
                model.field.density[v] = value;
                (optimiser.density[v], optimiser.colour[v]) = (0.0, 0.0);
            }
            (model, optimiser)
        });
    }

    fn resample(&mut self, domain: Domain<f32>, map: BrickMap) {
        self.edit(|model, mut optimiser| {
            let field = resampled(&model.field, domain, map);
            optimiser.forget_field(&field);
            (Model { field, ..model }, optimiser)
        });
    }

    fn refresh_occupancy(&mut self, marching: &Marching) {
        self.model.refresh_occupancy(marching);
    }

    fn bake(&mut self, caches: Caches, marching: &Marching, cancel: &Cancel) -> Result<(), Cancelled> {
        let marching = Marching { near: 0.0, ..*marching };
        let see = |rays: &[Ray<f32>], through| self.shown(rays, &marching, Showing::of_probes(through));
        let held = &self.model.held;
        let (refraction, domain) = (&held.refraction, &held.field.domain);
        let look = Look { refraction, domain, see, cancel };
        match (caches, &held.clearcoat) {
            (Caches::Reflection, _) => self.model.held.reflection = look.reflection(&held.reflection)?,
            (Caches::Clearcoat, Some(clearcoat)) => {
                self.model.held.clearcoat = Some(look.clearcoat(clearcoat)?);
            }
            (Caches::Clearcoat, None) => {}
        }
        let uploaded = self.model.upload_caches();
        self.noted(uploaded);
        Ok(())
    }

    fn render(&self, rays: &[Ray<f32>], marching: &Marching, layers: Layers) -> Vec<Pixel<f32>> {
        self.shown(rays, marching, Showing::layers(layers))
    }

    fn submit(&mut self, batch: &Batch, objective: &Objective, step: u64) {
        let lessons = Lesson::of_batch(batch, &self.model.held.refraction);
        let filled = self.room.rays.fill(self.model.device(), &lessons, false);
        let given = filled.map(|()| Given::of(batch));
        self.begin(given, batch.rays.len(), objective, step);
    }

    fn submit_drawn(&mut self, batch: &Draw<'_>, objective: &Objective, step: u64) -> bool {
        self.drawing.take_photographs(self.model.device(), batch);
        let Some(photographs) = self.drawing.photographs() else {
            let batch = batch.batch();
            let is_any = !batch.rays.is_empty();
            if is_any {
                self.submit(&batch, objective, step);
            }
            return is_any;
        };
        let given = draw(&self.model, photographs, batch, &mut self.room.rays);
        self.begin(given, batch.size, objective, step);
        true
    }

    fn why_on_host(&self) -> Option<String> {
        let device = &self.model.gpu.adapter().name;
        self.drawing.why_on_host.as_ref().map(|why| format!("{device}: {why}"))
    }

    fn outcomes(&mut self, wait: bool) -> Vec<StepOutcome> {
        if wait || self.pending.len() >= READ_EVERY {
            self.settle();
        }
        std::mem::take(&mut self.outcomes)
    }

    fn gradient(&self, batch: &Batch, objective: &Objective) -> BatchGradient {
        let found = self.gradients(batch, objective, WANTS_FIELD | WANTS_INDEX);
        // Of a device with a fault: nothing, and an outcome that is not finite.
        let Gradients { field, texels, medium, absorption, mirrored, rays, outcome } =
            found.unwrap_or_else(|| Gradients::none(batch));
        BatchGradient {
            field,
            background: texels,
            medium,
            absorption,
            reflection: mirrored.mirrors,
            clearcoat: mirrored.clearcoat,
            rays,
            outcome,
        }
    }

    fn ray_gradients(&self, batch: &Batch, objective: &Objective) -> Vec<RayGradient> {
        let found = self.gradients(batch, objective, 0);
        found.map_or_else(|| vec![RayGradient::zero(); batch.rays.len()], |g| g.rays)
    }

    fn peak_weights(
        &self,
        rays: &[Ray<f32>],
        marching: &Marching,
        cancel: &Cancel,
    ) -> Result<Vec<f32>, Cancelled> {
        let voxels = self.model.held.field.map.voxels();
        let (model, mut weights) = (&self.model, Buffers::default());
        let made = weights.zeros(model.device(), "weights", 4 * voxels as u64);
        let checked = made.and_then(|()| model.check_steps(marching, model.backward_loops(false)));
        let mut done = self.noted(checked);
        for portion in rays.chunks(model.portion()) {
            cancel.check()?;
            done = done.and_then(|()| self.noted(weigh(model, &weights, portion, marching)));
        }
        cancel.check()?;
        let read = done.and_then(|()| self.noted(weights.read(model.device(), "weights", voxels)));
        Ok(read.unwrap_or_else(|| vec![0.0; voxels]))
    }
}
