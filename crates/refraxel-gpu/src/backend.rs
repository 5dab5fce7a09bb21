//! The backend itself: a model in the memory of a device.

use crate::bending::{Bending, Paths, follow};
use crate::constants::{STATUS_FAILED, STATUS_WORDS, WANTS_FIELD, WANTS_INDEX};
use crate::drawing::Drawing;
use crate::field::{
    HostMoments, OUTCOMES, blank, download, upload, upload_medium, upload_mirrors, upload_shown,
    without_values,
};
use crate::kernels::Kernels;
use crate::memory::Buffers;
use crate::pools::{Purpose, Shape, workgroups};
use crate::show::Showing;
use crate::step::{Gradients, RayBuffers, Room};
use crate::task::{Given, Lesson, Seen, Task};
use crate::{Gpu, GpuError, Unsupported};
use refraxel_core::radiance::{Pixel, clearcoat::Clearcoat};
use refraxel_core::{BrickMap, Domain, Integrator, Ray};
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
use std::sync::Arc;

/// Rays of one dispatch of a rendering: short enough for a watchdog, long enough to fill a device.
const PORTION: usize = 1 << 16;
/// The same where they may bend.
const BENT_PORTION: usize = 1 << 14;
/// Steps after which outcomes are read also where nobody waits for them.
const READ_EVERY: usize = 25;
/// Steps across a grid along its diagonal, in units of its longest edge, bounded from above.
const DIAGONAL: f64 = 1.75;

/// Parameters, moments and search structures in the memory of a GPU.
///
/// Straight and bent rays, sharp surfaces and smooth regions that mirror, bodies that absorb, bounded and contracted domains, constant
/// backgrounds and panoramas, all priors. Models with more are refused by [`GpuBackend::new`] and [`GpuBackend::supports`].
#[derive(Debug)]
pub struct GpuBackend {
    pub(crate) gpu: Gpu,
    pub(crate) kernels: Arc<Kernels>,
    /// The model without the values that the device holds.
    pub(crate) held: Model,
    pub(crate) buffers: Buffers,
    /// Room for the batch that learns.
    pub(crate) room: Room,
    /// Moments of what bends rays and mirrors, which the host moves.
    pub(crate) moments: HostMoments,
    /// Numbers and rays of the steps whose outcomes are on the device, in the order of their places there.
    pub(crate) pending: Vec<(u64, u64)>,
    /// Outcomes that nobody asked for yet.
    outcomes: Vec<StepOutcome>,
    /// Where batches are drawn.
    pub(crate) drawing: Drawing,
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
        assert!(optimiser.fits(model), "the optimiser's state is that of another model");
        Self::supports(model)?;
        let shape = Shape::new(&gpu, model, Purpose::Learning)?;
        let kernels = gpu.kernels(shape)?;
        let buffers = upload(&gpu, &shape, model, optimiser)?;
        Ok(Self::with(gpu, kernels, without_values(model), buffers, optimiser))
    }

    /// A backend that shows a model, and has no room to learn.
    pub(crate) fn to_show(gpu: Gpu, model: &Model) -> Result<Self, GpuError> {
        Self::supports(model)?;
        let shape = Shape::new(&gpu, model, Purpose::Showing)?;
        let kernels = gpu.kernels(shape)?;
        let optimiser = Optimiser::new(model);
        let mut buffers = upload_shown(&gpu, &shape, model, &optimiser.occupied)?;
        buffers.zeros(&gpu, "status", 4 * u64::from(STATUS_WORDS))?;
        upload_medium(&gpu, &mut buffers, &model.refraction)?;
        crate::reflections::upload(&gpu, &mut buffers, model)?;
        Ok(Self::with(gpu, kernels, without_values(model), buffers, &optimiser))
    }

    fn with(gpu: Gpu, kernels: Arc<Kernels>, held: Model, buffers: Buffers, optimiser: &Optimiser) -> Self {
        let (room, moments) = (Room::default(), HostMoments::of(optimiser));
        let (pending, outcomes) = (Vec::new(), Vec::new());
        let drawing = Drawing::default();
        Self { gpu, kernels, held, buffers, room, moments, pending, outcomes, drawing }
    }

    /// Whether the backend has everything that a model needs.
    pub fn supports(model: &Model) -> Result<(), Unsupported> {
        let leapfrog = model.refraction.optics.integrator == Integrator::Leapfrog;
        if leapfrog { Ok(()) } else { Err(Unsupported::Integrator) }
    }

    /// Whether the backend has everything that a run may come to need: what its options switch on, and, for a run that goes on,
    /// what it holds and has decided.
    pub fn supports_run(options: &Options, saved: Option<&Run>) -> Result<(), Unsupported> {
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

    /// The device, and what went wrong there.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The model and the optimiser's state as they are now.
    pub fn read(&self) -> Result<(Model, Optimiser), GpuError> {
        download(&self.gpu, &self.kernels.shape, &self.buffers, &self.held, &self.moments)
    }

    /// Another model, with everything that belongs to it.
    fn replace(&mut self, model: &Model, optimiser: &Optimiser) -> Result<(), GpuError> {
        assert!(optimiser.fits(model), "the optimiser's state is that of another model");
        Self::supports(model)?;
        let shape = Shape::new(&self.gpu, model, Purpose::Learning)?;
        if let Some(fault) = self.gpu.fault() {
            return Err(fault); // with the arrays as they are: whoever asks goes on to be told
        }
        self.buffers = Buffers::default(); // no two fields at a time
        self.kernels = self.gpu.kernels(shape)?;
        self.buffers = upload(&self.gpu, &shape, model, optimiser)?;
        self.held = without_values(model);
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
                self.gpu.fail(error);
                None
            }
        }
    }

    /// Get the outcomes of all enqueued steps. Those of a device with a fault are not finite.
    fn settle(&mut self) {
        if self.pending.is_empty() {
            return;
        }
        let read = self.read_outcomes();
        let lost = std::mem::take(&mut self.pending);
        let known = self.noted(read).unwrap_or_else(|| {
            let failed = |&(step, rays): &(u64, u64)| StepOutcome { step, rays, ..StepOutcome::default() };
            lost.iter().map(failed).collect()
        });
        self.outcomes.extend(known);
    }

    /// Refuse rays that a software adapter would leave half-way, with so many iterations per sample.
    pub(crate) fn check_steps(&self, marching: &Marching, per_sample: u64) -> Result<(), GpuError> {
        let Some(most) = self.gpu.iteration_limit() else { return Ok(()) };
        let nodes = self.held.field.domain.resolution.into_iter().max().unwrap_or(0);
        let steps = (DIAGONAL * f64::from(nodes) / f64::from(marching.step)) as u64;
        let needed = steps * per_sample;
        let adapter = || self.gpu.adapter().name.clone();
        if needed > most { Err(GpuError::TooManySteps { adapter: adapter(), needed, most }) } else { Ok(()) }
    }

    /// Iterations per sample: of the loop over samples, of the search for the next one, and of shading.
    pub(crate) fn forward_loops(&self) -> u64 {
        2 + u64::from(self.kernels.shape.blocks())
    }

    /// The same with the way back: eight corners, their blocks, and where rays receive gradients both once more.
    fn backward_loops(&self, wants_rays: bool) -> u64 {
        self.forward_loops() * (1 + 8 + if wants_rays { 9 } else { 0 })
    }

    /// Rays of one dispatch.
    pub(crate) fn portion(&self) -> usize {
        if self.held.refraction.is_none() { PORTION } else { BENT_PORTION }
    }

    /// What rays show; nothing on a device with a fault.
    fn shown(&self, rays: &[Ray<f32>], marching: &Marching, showing: Showing) -> Vec<Pixel<f32>> {
        let portion = |rays: &[Ray<f32>]| {
            let seen = self.noted(self.show(rays, marching, showing));
            seen.unwrap_or_else(|| vec![Seen::default(); rays.len()])
        };
        rays.chunks(self.portion()).flat_map(portion).map(Pixel::from).collect()
    }

    fn weigh_portion(
        &self,
        weights: &Buffers,
        rays: &[Ray<f32>],
        marching: &Marching,
    ) -> Result<(), GpuError> {
        let (mut buffers, refraction) = (RayBuffers::default(), &self.held.refraction);
        buffers.fill(&self.gpu, &Lesson::of_rays(rays, refraction), false)?;
        self.buffers.write(&self.gpu, "task", &[Task::marching(marching, &self.held, rays.len())]);
        if refraction.is_none() {
            let mut encoder = self.encoder();
            let of = [&self.buffers, &buffers.buffers, weights];
            self.kernels.peak.run(&self.gpu, &mut encoder, &of, workgroups(rays.len()));
            self.gpu.queue.submit([encoder.finish()]);
        } else {
            let paths = Paths::standing(&self.gpu, rays.len())?;
            let of = [&self.buffers, &buffers.buffers, weights, &paths.buffers];
            let portion = Bending::shown(&self.gpu, &self.held, marching, rays.len());
            follow(&self.gpu, &self.kernels.bent(&self.gpu)?.peak, &of, &portion, 1)?;
        }
        Ok(())
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
            self.buffers.write(&self.gpu, "status", &status);
        }
    }

    /// Begin a step on a batch that is on the device.
    fn begin(&mut self, given: Result<Given, GpuError>, rays: usize, objective: &Objective, step: u64) {
        if self.pending.len() == OUTCOMES {
            self.settle();
        }
        let (place, rays) = (self.pending.len(), rays as u64);
        let checked = self.check_steps(&objective.marching, self.backward_loops(false));
        let enqueued = checked.and(given).and_then(|given| self.enqueue(given, objective, step, place));
        match self.noted(enqueued) {
            Some(()) => self.pending.push((step, rays)),
            None => {
                self.settle();
                self.outcomes.push(StepOutcome { step, rays, ..StepOutcome::default() });
            }
        }
    }

    fn gradients(&self, batch: &Batch, objective: &Objective, wants: u32) -> Option<Gradients> {
        let gradients = self
            .check_steps(&objective.marching, self.backward_loops(true))
            .and_then(|()| self.look_back(batch, objective, wants));
        self.noted(gradients)
    }
}

impl Backend for GpuBackend {
    fn fault(&self) -> Option<String> {
        self.gpu.fault().map(|e| e.to_string())
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
            let model = blank(&self.held);
            let optimiser = Optimiser::new(&model);
            (model, optimiser)
        });
        Snapshot { model: Cow::Owned(model), optimiser: Cow::Owned(optimiser) }
    }

    fn domain(&self) -> &Domain<f32> {
        &self.held.field.domain
    }

    fn map(&self) -> &BrickMap {
        &self.held.field.map
    }

    fn medium(&self) -> &Refraction {
        &self.held.refraction
    }

    fn mirroring(&self) -> Mirroring {
        Mirroring::of(&self.held)
    }

    fn set_medium(&mut self, medium: Refraction) {
        self.moments.index = medium.medium.regions().iter().map(IndexMoments::zero).collect();
        self.held.refraction = medium;
        let uploaded = Self::supports(&self.held)
            .map_err(GpuError::from)
            .and_then(|()| Shape::new(&self.gpu, &self.held, self.kernels.shape.purpose))
            .and_then(|_| upload_medium(&self.gpu, &mut self.buffers, &self.held.refraction));
        self.noted(uploaded);
    }

    fn set_reflection(&mut self, reflection: Reflection) {
        self.moments.reflection = reflection.mirrors.iter().map(MirrorMoments::zero).collect();
        self.held.reflection = reflection;
        let uploaded = upload_mirrors(&self.gpu, &mut self.buffers, &self.held);
        self.noted(uploaded);
    }

    fn set_clearcoat(&mut self, clearcoat: Clearcoat<f32>) {
        self.moments.clearcoat = ClearcoatMoments::zero(&clearcoat);
        self.held.clearcoat = Some(clearcoat);
        let uploaded = upload_mirrors(&self.gpu, &mut self.buffers, &self.held);
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
        let (gpu, field) = (&self.gpu, &self.held.field);
        self.buffers.write(gpu, "task", &[Task::marching(marching, &self.held, 0)]);
        let mut encoder = self.encoder();
        let groups = workgroups(2 * field.map.slots());
        self.kernels.occupancy.run(gpu, &mut encoder, &[&self.buffers], groups);
        gpu.queue.submit([encoder.finish()]);
    }

    fn bake(&mut self, caches: Caches, marching: &Marching, cancel: &Cancel) -> Result<(), Cancelled> {
        let marching = Marching { near: 0.0, ..*marching };
        let see = |rays: &[Ray<f32>], through| self.shown(rays, &marching, Showing::of_probes(through));
        let (refraction, domain) = (&self.held.refraction, &self.held.field.domain);
        let look = Look { refraction, domain, see, cancel };
        match (caches, &self.held.clearcoat) {
            (Caches::Reflection, _) => self.held.reflection = look.reflection(&self.held.reflection)?,
            (Caches::Clearcoat, Some(clearcoat)) => self.held.clearcoat = Some(look.clearcoat(clearcoat)?),
            (Caches::Clearcoat, None) => {}
        }
        let uploaded = crate::reflections::upload(&self.gpu, &mut self.buffers, &self.held);
        self.noted(uploaded);
        Ok(())
    }

    fn render(&self, rays: &[Ray<f32>], marching: &Marching, layers: Layers) -> Vec<Pixel<f32>> {
        self.shown(rays, marching, Showing::layers(layers))
    }

    fn submit(&mut self, batch: &Batch, objective: &Objective, step: u64) {
        let given = self.put(batch);
        self.begin(given, batch.rays.len(), objective, step);
    }

    fn submit_drawn(&mut self, draw: &Draw<'_>, objective: &Objective, step: u64) -> bool {
        self.take_photographs(draw);
        let Some(photographs) = self.drawing.photographs() else {
            let batch = draw.batch();
            let is_any = !batch.rays.is_empty();
            if is_any {
                self.submit(&batch, objective, step);
            }
            return is_any;
        };
        let mut rays = std::mem::take(&mut self.room.rays);
        let given = self.draw(photographs, draw, &mut rays);
        self.room.rays = rays;
        self.begin(given, draw.size, objective, step);
        true
    }

    fn why_on_host(&self) -> Option<String> {
        let device = &self.gpu.adapter().name;
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
        let voxels = self.held.field.map.voxels();
        let mut weights = Buffers::default();
        let made = weights.zeros(&self.gpu, "weights", 4 * voxels as u64);
        let mut done = self.noted(made.and_then(|()| self.check_steps(marching, self.backward_loops(false))));
        for portion in rays.chunks(self.portion()) {
            cancel.check()?;
            done = done.and_then(|()| self.noted(self.weigh_portion(&weights, portion, marching)));
        }
        cancel.check()?;
        let read = done.and_then(|()| self.noted(weights.read(&self.gpu, "weights", voxels)));
        Ok(read.unwrap_or_else(|| vec![0.0; voxels]))
    }
}
