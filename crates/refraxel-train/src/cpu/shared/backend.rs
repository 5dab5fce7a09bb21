//! The backend of the first process, and what it asks of the others.

use super::member::{Member, range_of, rays_of};
use super::message::Task;
use crate::alignment::Alignment;
use crate::backend::{
    Backend, Batch, BatchGradient, BrickMask, Caches, Layers, Marching, Mirroring, Objective, REFRESH,
    RayGradient, Snapshot, StepOutcome,
};
use crate::cancel::{Cancel, Cancelled};
use crate::communicator::wire::{Wire, put_all, put_bytes};
use crate::communicator::{Communicator, Traffic};
use crate::cpu::backend::CpuBackend;
use crate::model::{Model, Optimiser, Reflection, Refraction};
use crate::options::Options;
use crate::plan::Plan;
use crate::run::{RunRef, Source, State};
use rayon::prelude::*;
use refraxel_core::radiance::Pixel;
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{Background, BrickMap, Domain, IndexGrid, Ray, VoxelField};
use refraxel_data::{Backdrop, LocalOrigin};
use std::cell::Cell;
use std::sync::{Arc, Mutex};

/// The first process's hold on the others: when its last copy goes, they are sent home.
pub struct Root {
    communicator: Arc<dyn Communicator>,
    sent: Mutex<Traffic>,
}

impl Root {
    /// Of these processes.
    ///
    /// # Panics
    /// If this process is not the first of them.
    pub fn new(communicator: Arc<dyn Communicator>) -> Arc<Self> {
        assert_eq!(communicator.rank(), 0, "the first process leads");
        Arc::new(Self { communicator, sent: Mutex::default() })
    }

    /// What all processes have sent for backends that are gone.
    pub fn traffic(&self) -> Traffic {
        *self.sent.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl Drop for Root {
    fn drop(&mut self) {
        // Who panics ends all others anyway.
        if !std::thread::panicking() {
            let mut message = Vec::new();
            Task::End.put(&mut message);
            self.communicator.broadcast(message);
        }
    }
}

/// What a copy of the model lacks of the first process's.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Behind {
    No,
    /// All but the field has changed.
    ButField,
    All,
}

/// The backend of the first process: what it is asked for, all do together. Steps, renderings, gradients of rays and peak weights are
/// shared; what is rare or has no rays is done by the first, and the others get the result.
pub struct SharedBackend {
    member: Member,
    others: Cell<Behind>,
    /// What a model is stored with.
    options: Options,
    failed: bool,
    outcomes: Vec<StepOutcome>,
    root: Arc<Root>,
}

impl SharedBackend {
    /// A backend of all processes that somebody leads, with a model and the state of its optimiser; `options` are those of the run.
    pub fn new(root: &Arc<Root>, model: Model, optimiser: Option<Optimiser>, options: Options) -> Self {
        let own = match optimiser {
            Some(optimiser) => CpuBackend::resumed(model, optimiser),
            None => CpuBackend::new(model),
        };
        let member = Member { own, communicator: root.communicator.clone(), traffic: Cell::default() };
        let others = Cell::new(Behind::All);
        Self { member, others, options, failed: false, outcomes: Vec::new(), root: root.clone() }
    }

    /// What all processes have sent.
    pub fn traffic(&self) -> Traffic {
        if self.member.traffic.get().models == 0 {
            return Traffic::default(); // the others have no model yet
        }
        self.tell(Task::Account, &[], |t, bytes| t.rays += bytes);
        let all = self.member.report(vec![self.member.traffic.get()]);
        all.into_iter().fold(Traffic::default(), std::ops::Add::add)
    }

    fn own(&self) -> &CpuBackend {
        &self.member.own
    }

    /// What others have of the model is from now on older than this process's.
    fn changed(&self, part: Behind) {
        self.others.set(self.others.get().max(part));
    }

    /// Whether others have the model, or can get it: one that is not finite is not sent.
    fn is_shared(&self) -> bool {
        let is_up = self.others.get() == Behind::No || self.member.count() == 1;
        is_up || is_finite(&self.own().snapshot().model)
    }

    /// Gives all processes a task, and each its own message with it.
    fn give(&self, task: Task, what: &[u32], own: impl Fn(usize) -> Vec<u32>) {
        self.bring_up();
        self.tell(task, what, |t, bytes| t.rays += bytes);
        let count = self.member.count();
        let mut messages: Vec<Vec<u32>> = (1..count).map(own).collect();
        messages.insert(0, Vec::new());
        self.member.note(|t| t.rays += self.member.bytes_to_others(&messages));
        self.member.communicator.exchange(messages);
    }

    fn tell(&self, task: Task, what: &[u32], note: impl FnOnce(&mut Traffic, u64)) {
        let mut message = Vec::new();
        task.put(&mut message);
        message.extend(what);
        self.member.note(|t| note(t, self.member.bytes_to_all(&message)));
        self.member.communicator.broadcast(message);
    }

    /// Sends others what they lack of the model.
    fn bring_up(&self) {
        if self.member.count() == 1 {
            return; // there are no others
        }
        let Snapshot { model, optimiser } = self.own().snapshot();
        let (task, bytes) = match self.others.replace(Behind::No) {
            Behind::No => return,
            Behind::All => (Task::Load, self.stored(&model, &optimiser)),
            Behind::ButField => {
                let (model, optimiser) = without_field(&model, &optimiser);
                (Task::LoadButField, self.stored(&model, &optimiser))
            }
        };
        let mut what = Vec::new();
        put_bytes(&bytes, &mut what);
        self.tell(task, &what, |t, bytes| t.models += bytes);
    }

    /// A model as checkpoints hold it.
    fn stored(&self, model: &Model, optimiser: &Optimiser) -> Vec<u8> {
        let (origin, backdrop) = (LocalOrigin::default(), Backdrop::Surroundings);
        let plan = Plan { finest: model.field.domain, near: 0.0, origin, backdrop };
        let (state, source, alignment) = (State::default(), Source::default(), Alignment::default());
        let run = RunRef {
            options: &self.options,
            plan: &plan,
            state: &state,
            source: &source,
            model,
            optimiser,
            detected: None,
            alignment: &alignment,
        };
        let mut bytes = Vec::new();
        run.write(&mut bytes).expect("memory takes all bytes");
        bytes
    }

    /// The rays of each process, as messages.
    fn rays<'a>(&'a self, rays: &'a [Ray<f32>]) -> impl Fn(usize) -> Vec<u32> + 'a {
        let (communicator, n) = (self.member.communicator.count(), rays.len());
        move |rank| {
            let mut message = Vec::new();
            put_all(&rays[rays_of(n, rank, communicator)], &mut message);
            message
        }
    }

    /// The parts of a batch, as messages.
    fn parts<'a>(&'a self, batch: &'a Batch) -> impl Fn(usize) -> Vec<u32> + 'a {
        let (communicator, n) = (self.member.communicator.count(), batch.rays.len());
        move |rank| {
            let mut message = Vec::new();
            range_of(batch, rays_of(n, rank, communicator)).put(&mut message);
            message
        }
    }
}

/// Whether all parameters are numbers.
fn is_finite(model: &Model) -> bool {
    let finite = |values: &[f32]| values.par_iter().all(|v| v.is_finite());
    let Model { field, background, refraction, reflection, clearcoat } = model;
    let texels = match background {
        Background::Constant(colour) => &colour[..],
        Background::Environment(map) => map.texels.as_flattened(),
    };
    let region = |r: &IndexGrid<f32>| {
        finite(r.coefficients()) && r.level_set().is_none_or(|l| finite(l.coefficients()))
    };
    finite(&field.density)
        && finite(&field.colour)
        && finite(texels)
        && refraction.medium.regions().iter().all(region)
        && reflection.mirrors.iter().all(|m| finite(&m.outer.coefficients) && finite(&m.inner.coefficients))
        && clearcoat.iter().all(|c| finite(&c.strength.coefficients) && finite(&c.radiance.coefficients))
}

/// The same model with a field of next to nothing.
fn without_field(model: &Model, optimiser: &Optimiser) -> (Model, Optimiser) {
    let Domain { bounds, extent, .. } = model.field.domain;
    let domain = Domain::with_longest(bounds, extent, 2);
    let map = BrickMap::dense(domain.resolution);
    let field = VoxelField::uniform(domain, map, model.field.degree, 0.0);
    let Model { background, refraction, reflection, clearcoat, .. } = model;
    let model = Model {
        field,
        background: background.clone(),
        refraction: refraction.clone(),
        reflection: reflection.clone(),
        clearcoat: clearcoat.clone(),
    };
    let Optimiser { background, index, reflection, clearcoat, .. } = optimiser.clone();
    let optimiser = Optimiser { background, index, reflection, clearcoat, ..Optimiser::new(&model) };
    (model, optimiser)
}

impl Drop for SharedBackend {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            let mut sent = self.root.sent.lock().unwrap_or_else(|e| e.into_inner());
            *sent = *sent + self.traffic();
        }
    }
}

impl Backend for SharedBackend {
    fn load(&mut self, model: Model, optimiser: Option<Optimiser>) {
        self.member.own.load(model, optimiser);
        self.outcomes.clear();
        self.failed = false;
        self.changed(Behind::All);
    }

    fn snapshot(&self) -> Snapshot<'_> {
        self.own().snapshot()
    }

    fn domain(&self) -> &Domain<f32> {
        self.own().domain()
    }

    fn map(&self) -> &BrickMap {
        self.own().map()
    }

    fn medium(&self) -> &Refraction {
        self.own().medium()
    }

    fn mirroring(&self) -> Mirroring {
        self.own().mirroring()
    }

    fn set_medium(&mut self, medium: Refraction) {
        self.member.own.set_medium(medium);
        self.changed(Behind::ButField);
    }

    fn set_reflection(&mut self, reflection: Reflection) {
        self.member.own.set_reflection(reflection);
        self.changed(Behind::ButField);
    }

    fn set_clearcoat(&mut self, clearcoat: Clearcoat<f32>) {
        self.member.own.set_clearcoat(clearcoat);
        self.changed(Behind::ButField);
    }

    fn set_density(&mut self, value: f32, inside: &BrickMask) {
        self.member.own.set_density(value, inside);
        self.changed(Behind::All);
    }

    fn resample(&mut self, domain: Domain<f32>, map: BrickMap) {
        self.member.own.resample(domain, map);
        self.changed(Behind::All);
    }

    fn refresh_occupancy(&mut self, marching: &Marching) {
        self.member.own.refresh_occupancy(marching);
        if self.others.get() < Behind::All {
            let mut what = Vec::new();
            marching.put(&mut what);
            self.tell(Task::Refresh, &what, |t, bytes| t.rays += bytes);
        }
    }

    fn bake(&mut self, caches: Caches, marching: &Marching, cancel: &Cancel) -> Result<(), Cancelled> {
        self.member.own.bake(caches, marching, cancel)?;
        self.changed(Behind::ButField);
        Ok(())
    }

    fn render(&self, rays: &[Ray<f32>], marching: &Marching, layers: Layers) -> Vec<Pixel<f32>> {
        if !self.is_shared() {
            return self.own().render(rays, marching, layers);
        }
        let mut what = Vec::new();
        marching.put(&mut what);
        layers.put(&mut what);
        self.give(Task::Render, &what, self.rays(rays));
        let mine = rays_of(rays.len(), 0, self.member.count());
        self.member.report(self.own().render(&rays[mine], marching, layers))
    }

    fn submit(&mut self, batch: &Batch, objective: &Objective, step: u64) {
        if self.failed {
            return;
        }
        if !self.is_shared() {
            self.failed = true;
            let rays = batch.rays.len() as u64;
            self.outcomes.push(StepOutcome { step, rays, squared_error: f64::NAN, ..StepOutcome::default() });
            return;
        }
        if step.is_multiple_of(REFRESH) {
            self.refresh_occupancy(&objective.marching);
        }
        let (batch, rays) = (self.own().ordered(batch, objective), batch.rays.len());
        let mut what = Vec::new();
        objective.put(&mut what);
        (step, rays).put(&mut what);
        self.give(Task::Step, &what, self.parts(&batch));
        let mine = range_of(&batch, rays_of(rays, 0, self.member.count()));
        let outcome = self.member.step(&mine, rays, objective, step);
        self.failed = !outcome.finite;
        self.outcomes.push(outcome);
    }

    fn outcomes(&mut self, _wait: bool) -> Vec<StepOutcome> {
        std::mem::take(&mut self.outcomes)
    }

    fn gradient(&self, batch: &Batch, objective: &Objective) -> BatchGradient {
        self.own().gradient(batch, objective)
    }

    fn ray_gradients(&self, batch: &Batch, objective: &Objective) -> Vec<RayGradient> {
        if !self.is_shared() {
            return self.own().ray_gradients(batch, objective);
        }
        let mut what = Vec::new();
        objective.put(&mut what);
        self.give(Task::RayGradients, &what, self.parts(batch));
        let mine = range_of(batch, rays_of(batch.rays.len(), 0, self.member.count()));
        self.member.report(self.own().ray_gradients(&mine, objective))
    }

    fn peak_weights(
        &self,
        rays: &[Ray<f32>],
        marching: &Marching,
        cancel: &Cancel,
    ) -> Result<Vec<f32>, Cancelled> {
        cancel.check()?;
        if !self.is_shared() {
            return self.own().peak_weights(rays, marching, cancel);
        }
        let mut what = Vec::new();
        marching.put(&mut what);
        self.give(Task::PeakWeights, &what, self.rays(rays));
        let mine = rays_of(rays.len(), 0, self.member.count());
        // All are done before anybody stops.
        let mine = self.own().peak_weights(&rays[mine], marching, &Cancel::new())?;
        let voxels = mine.len();
        let all = self.member.report(mine);
        let mut peaks = all.chunks_exact(voxels);
        let mut peak = peaks.next().unwrap_or_default().to_vec();
        peaks.for_each(|other| peak.iter_mut().zip(other).for_each(|(p, q)| *p = p.max(*q)));
        cancel.check()?;
        Ok(peak)
    }
}
