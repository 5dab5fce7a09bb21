//! A backend that several processes are together. The first leads a step, the others help:
//!
//! 1. The first orders the rays and sends each process its chunks of them.
//! 2. Each follows its rays. Samples of the field go to the owners of the buckets around them; samples of the index, of mirrors and
//!    of the background, few beside them, go to all.
//! 3. Each moves its own buckets, and all of the index, of mirrors and of the background; what has moved in its buckets goes to all.
//!
//! Every process takes its sums over all chunks in their order, as one process does: the model has the same bits.

use super::backend::{CpuBackend, Share, overflows, total};
use super::index::Learned;
use super::record::{CacheLookup, IndexSample, Record};
use super::render::CHUNK;
use super::tape::{Tape, buckets};
use super::trace::Lesson;
use crate::alignment::Alignment;
use crate::backend::{
    AbsorptionObjective, Backend, Batch, BatchGradient, BrickMask, Caches, IndexObjective, Layers, Marching,
    Mirroring, Objective, REFRESH, RayGradient, ReflectionObjective, Snapshot, StepOutcome,
};
use crate::cancel::{Cancel, Cancelled};
use crate::model::{CacheId, MirrorSource, Model, Optimiser, Reflection, Refraction};
use crate::options::Options;
use crate::peers::wire::{Wire, Words, put_all, put_bytes, take_bytes, wire};
use crate::peers::{Peers, Traffic, part};
use crate::plan::Plan;
use crate::run::{Run, RunRef, Source, State};
use rayon::prelude::*;
use refraxel_core::radiance::Pixel;
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{Background, BrickMap, Domain, IndexGrid, Ray, VoxelField};
use refraxel_data::Backdrop;
use std::cell::Cell;
use std::ops::Range;
use std::sync::{Arc, Mutex};

wire! {
    Traffic { rays, samples, shared, voxels, pixels, models }
    Record { cell, fraction, basis, d_theta, d_colour }
    IndexSample { region, surface, x, d_value, d_gradient }
    CacheId { region, inner }
    CacheLookup { surface, cache, x, direction, d_radiance, d_strength }
    Batch { rays, target, behind, offset, beside }
    RayGradient { origin, direction, residual }
    Marching { step, near, min_optical_depth, min_transmittance }
    AbsorptionObjective { rate }
    ReflectionObjective { rate, rate_strength, rate_clearcoat }
    IndexObjective {
        rate, blur, clip, variation, deviation, largest, trust, surface_rate, surface_blur, surface_smooth, silhouette, surface_events,
        index_events,
    }
    Objective {
        marching, bent_weight, sparsity, opacity, tv_density, tv_colour, tv_period, rate_density, rate_colour, rate_view,
        rate_background, index, reflection, absorption,
    }
}

/// What the first process asks of the others.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Task {
    /// Nothing more.
    End,
    /// Go on from this model.
    Load,
    /// Go on from this model, but with the field as it is.
    LoadButField,
    Refresh,
    Step,
    Render,
    RayGradients,
    PeakWeights,
    Account,
}

impl Wire for Task {
    fn put(&self, to: &mut Vec<u32>) {
        (*self as u32).put(to);
    }
    fn take(from: &mut Words) -> Self {
        const ALL: [Task; 9] = [
            Task::End,
            Task::Load,
            Task::LoadButField,
            Task::Refresh,
            Task::Step,
            Task::Render,
            Task::RayGradients,
            Task::PeakWeights,
            Task::Account,
        ];
        ALL[u32::take(from) as usize]
    }
}

impl Wire for Layers {
    fn put(&self, to: &mut Vec<u32>) {
        let number: u32 = match self {
            Self::All => 0,
            Self::Transmitted => 1,
            Self::Mirroring(MirrorSource::Black) => 2,
            Self::Mirroring(MirrorSource::Exact) => 3,
            Self::Mirroring(MirrorSource::Learned) => 4,
            Self::Mirroring(MirrorSource::Baked) => 5,
        };
        number.put(to);
    }
    fn take(from: &mut Words) -> Self {
        match u32::take(from) {
            0 => Self::All,
            1 => Self::Transmitted,
            2 => Self::Mirroring(MirrorSource::Black),
            3 => Self::Mirroring(MirrorSource::Exact),
            4 => Self::Mirroring(MirrorSource::Learned),
            _ => Self::Mirroring(MirrorSource::Baked),
        }
    }
}

/// The first process's hold on the others: when its last copy goes, they are sent home.
pub struct Lead {
    peers: Arc<dyn Peers>,
    sent: Mutex<Traffic>,
}

impl Lead {
    /// Of these processes.
    ///
    /// # Panics
    /// If this process is not the first of them.
    pub fn new(peers: Arc<dyn Peers>) -> Arc<Self> {
        assert_eq!(peers.rank(), 0, "the first process leads");
        Arc::new(Self { peers, sent: Mutex::default() })
    }

    /// What all processes have sent for backends that are gone.
    pub fn traffic(&self) -> Traffic {
        *self.sent.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl Drop for Lead {
    fn drop(&mut self) {
        // Who panics ends all others anyway.
        if !std::thread::panicking() {
            let mut message = Vec::new();
            Task::End.put(&mut message);
            self.peers.broadcast(message);
        }
    }
}

/// One of the processes with its copy of the model.
struct Member {
    own: CpuBackend,
    peers: Arc<dyn Peers>,
    traffic: Cell<Traffic>,
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
    lead: Arc<Lead>,
}

/// What a chunk of rays has left behind, but for its samples of the field.
struct Rest {
    squared_error: f64,
    samples: u64,
    index_samples: Vec<IndexSample>,
    lookups: Vec<CacheLookup>,
    absorption: Vec<[f64; 3]>,
    overflows: u64,
    texels: Vec<(u32, [f32; 3])>,
}

wire! {
    Rest { squared_error, samples, index_samples, lookups, absorption, overflows, texels }
}

/// Samples of the field of a chunk: their records, and the functions of the bases that these name, one after the other.
struct Samples {
    records: Vec<Record>,
    bases: Vec<f32>,
}

wire! {
    Samples { records, bases }
}

impl Samples {
    /// Those of a tape that touch some buckets, with bases of so many functions.
    fn of(tape: &Tape, touched: &Range<usize>, functions: usize) -> Self {
        let numbers = tape.touching(touched);
        let mut renamed = vec![u32::MAX; tape.bases.len()];
        let mut bases: Vec<f32> = Vec::new();
        let mut rename = |basis: u32| {
            let Some(name) = renamed.get_mut(basis as usize) else { return basis }; // no basis, but a mark
            if *name == u32::MAX {
                *name = (bases.len() / functions) as u32;
                bases.extend(&tape.bases[basis as usize].functions()[..functions]);
            }
            *name
        };
        let record = |n: &u32| {
            let record = tape.records[*n as usize];
            Record { basis: rename(record.basis), ..record }
        };
        let records = numbers.iter().map(record).collect();
        Self { records, bases }
    }
}

/// Of so many rays those of a process: whole chunks.
fn rays_of(rays: usize, rank: usize, count: usize) -> Range<usize> {
    let chunks = part(rays.div_ceil(CHUNK), rank, count);
    (chunks.start * CHUNK).min(rays)..(chunks.end * CHUNK).min(rays)
}

/// A range of the rays of a batch.
fn range_of(batch: &Batch, range: Range<usize>) -> Batch {
    fn cut<T: Copy>(all: &[T], range: &Range<usize>) -> Vec<T> {
        if all.is_empty() { Vec::new() } else { all[range.clone()].to_vec() }
    }
    Batch {
        rays: cut(&batch.rays, &range),
        target: cut(&batch.target, &range),
        behind: cut(&batch.behind, &range),
        offset: cut(&batch.offset, &range),
        beside: cut(&batch.beside, &range),
    }
}

impl Member {
    fn count(&self) -> usize {
        self.peers.count()
    }

    fn note(&self, add: impl FnOnce(&mut Traffic)) {
        let mut traffic = self.traffic.get();
        add(&mut traffic);
        self.traffic.set(traffic);
    }

    /// The bytes of what goes to others.
    fn bytes_to_others(&self, messages: &[Vec<u32>]) -> u64 {
        let others = messages.iter().enumerate().filter(|(rank, _)| *rank != self.peers.rank());
        others.map(|(_, message)| 4 * message.len() as u64).sum()
    }

    /// The bytes of what goes to each of the others.
    fn bytes_to_all(&self, message: &[u32]) -> u64 {
        4 * message.len() as u64 * (self.count() as u64 - 1)
    }

    /// A step on this process's part of a batch of so many rays.
    fn step(&mut self, mine: &Batch, rays: usize, objective: &Objective, step: u64) -> StepOutcome {
        let lesson = Lesson { batch: mine, objective, asked: None };
        let memory = std::mem::take(&mut self.own.tapes);
        let (tapes, outcomes) = self.own.trace_chunks(lesson, &mut [], memory);
        let is_alone = self.count() == 1;
        let (tapes, outcomes) = if is_alone { (tapes, outcomes) } else { self.meet(tapes, &outcomes) };
        let mut outcome = StepOutcome { step, ..total(rays, &outcomes) };
        if outcome.finite {
            let learned = Learned { tapes: &tapes, rays, step };
            let mine = part(buckets(self.own.map()), self.peers.rank(), self.count());
            outcome.overflows = overflows(objective, &tapes);
            let moved = self.own.update_all(&learned, objective, &Share { buckets: mine, tells: !is_alone });
            let mut message = moved.voxels;
            message.push(moved.finite.into());
            self.note(|t| t.voxels += self.bytes_to_all(&message));
            for (rank, told) in self.peers.gather(message).iter().enumerate() {
                let (finite, voxels) = told.split_last().expect("whole messages");
                outcome.finite &= *finite != 0;
                if rank != self.peers.rank() {
                    self.own.take_over(voxels);
                }
            }
        }
        if outcome.finite {
            outcome.finite = self.own.update_rest(&tapes, objective);
        }
        self.own.tapes = tapes;
        outcome
    }

    /// The tapes of all chunks in order, those of others as far as they touch this process's buckets; and all outcomes.
    fn meet(&self, mine: Vec<Tape>, outcomes: &[StepOutcome]) -> (Vec<Tape>, Vec<StepOutcome>) {
        let (rank, functions) = (self.peers.rank(), self.own.layout().functions());
        let rest = |(tape, outcome): (&Tape, &StepOutcome)| Rest {
            squared_error: outcome.squared_error,
            samples: outcome.samples,
            index_samples: tape.index_samples.clone(),
            lookups: tape.lookups.clone(),
            absorption: tape.absorption.clone(),
            overflows: tape.overflows,
            texels: tape.texels.clone(),
        };
        let mut shared = Vec::new();
        put_all(&mine.iter().zip(outcomes).map(rest).collect::<Vec<_>>(), &mut shared);
        self.note(|t| t.shared += self.bytes_to_all(&shared));
        let (all, count) = (buckets(self.own.map()), self.count());
        let message = |to: usize| {
            let mut message = Vec::new();
            if to != rank {
                let touched = part(all, to, count);
                mine.iter().for_each(|tape| Samples::of(tape, &touched, functions).put(&mut message));
            }
            message
        };
        let messages: Vec<_> = (0..count).into_par_iter().map(message).collect();
        self.note(|t| t.samples += self.bytes_to_others(&messages));
        let (shared, samples) = (self.peers.gather(shared), self.peers.exchange(messages));

        let (mut mine, mut tapes, mut all_outcomes) = (Some(mine), Vec::new(), Vec::new());
        for (from, (shared, samples)) in shared.iter().zip(&samples).enumerate() {
            let rests: Vec<Rest> = Vec::take(&mut Words(shared));
            all_outcomes.extend(rests.iter().map(|rest| StepOutcome {
                squared_error: rest.squared_error,
                samples: rest.samples,
                ..StepOutcome::default()
            }));
            if from == rank {
                tapes.extend(mine.take().into_iter().flatten());
                continue;
            }
            let mut words = Words(samples);
            let theirs: Vec<(Rest, Samples)> =
                rests.into_iter().map(|rest| (rest, Samples::take(&mut words))).collect();
            let own = &self.own;
            let tape = |(rest, samples)| tape_of(own, rest, samples);
            tapes.par_extend(theirs.into_par_iter().map(tape));
        }
        (tapes, all_outcomes)
    }

    /// Tells the first process what has come of this one's part; it gets the parts of all, in order.
    fn report<T: Wire>(&self, mine: Vec<T>) -> Vec<T> {
        let mut messages = vec![Vec::new(); self.count()];
        if self.peers.rank() > 0 {
            mine.put(&mut messages[0]);
            self.note(|t| t.pixels += self.bytes_to_others(&messages));
        }
        let told = self.peers.exchange(messages);
        let theirs = told.iter().skip(1).filter(|message| !message.is_empty());
        let mut all = mine;
        theirs.for_each(|message| all.extend(Vec::<T>::take(&mut Words(message))));
        all
    }
}

/// The tape of a chunk that another process has followed, for the model of this one.
fn tape_of(own: &CpuBackend, rest: Rest, samples: Samples) -> Tape {
    let layout = own.layout();
    let bases = samples.bases.chunks_exact(layout.functions()).map(|basis| layout.basis_of(basis));
    let mut tape = Tape::default();
    (tape.records, tape.bases) = (samples.records, bases.collect());
    (tape.index_samples, tape.lookups) = (rest.index_samples, rest.lookups);
    (tape.absorption, tape.overflows, tape.texels) = (rest.absorption, rest.overflows, rest.texels);
    tape.sort(own.map());
    tape
}

/// Helps the first process until it has no more tasks.
///
/// # Panics
/// If this process is the first, or the first one is lost.
pub fn help(peers: &Arc<dyn Peers>) {
    assert!(peers.rank() > 0, "the first process leads");
    let mut member: Option<Member> = None;
    loop {
        let message = peers.broadcast(Vec::new());
        let mut words = Words(&message);
        let task = Task::take(&mut words);
        let sent = member.as_ref().map_or_else(Traffic::default, |m| m.traffic.get());
        match (task, &mut member) {
            (Task::End, _) => return,
            (Task::Load, member) => {
                *member = None; // there may be no room for two
                let (model, optimiser) = received(&mut words);
                let own = CpuBackend::resumed(model, optimiser);
                *member = Some(Member { own, peers: peers.clone(), traffic: Cell::new(sent) });
            }
            (task, Some(member)) => member.help_with(task, &mut words),
            (_, None) => unreachable!("a model comes before all other tasks"),
        }
    }
}

impl Member {
    fn help_with(&mut self, task: Task, words: &mut Words) {
        let mine = || self.peers.exchange(vec![Vec::new(); self.peers.count()]).swap_remove(0);
        match task {
            Task::End | Task::Load => unreachable!("these need no model"),
            Task::LoadButField => {
                let (model, optimiser) = received(words);
                self.own.load_but_field(model, optimiser);
            }
            Task::Refresh => self.own.refresh_occupancy(&Marching::take(words)),
            Task::Step => {
                let (objective, (step, rays)) = (Objective::take(words), <(u64, usize)>::take(words));
                let mine = Batch::take(&mut Words(&mine()));
                self.step(&mine, rays, &objective, step);
            }
            Task::Render => {
                let (marching, layers) = (Marching::take(words), Layers::take(words));
                let rays: Vec<Ray<f32>> = Vec::take(&mut Words(&mine()));
                self.report(self.own.render(&rays, &marching, layers));
            }
            Task::RayGradients => {
                let objective = Objective::take(words);
                let mine = Batch::take(&mut Words(&mine()));
                self.report(self.own.ray_gradients(&mine, &objective));
            }
            Task::Account => drop(self.report(vec![self.traffic.get()])),
            Task::PeakWeights => {
                let marching = Marching::take(words);
                let rays: Vec<Ray<f32>> = Vec::take(&mut Words(&mine()));
                let peak = self.own.peak_weights(&rays, &marching, &Cancel::new());
                self.report(peak.expect("nobody else cancels"));
            }
        }
    }
}

impl SharedBackend {
    /// A backend of all processes that somebody leads, with a model and the state of its optimiser; `options` are those of the run.
    pub fn new(lead: &Arc<Lead>, model: Model, optimiser: Option<Optimiser>, options: Options) -> Self {
        let own = match optimiser {
            Some(optimiser) => CpuBackend::resumed(model, optimiser),
            None => CpuBackend::new(model),
        };
        let member = Member { own, peers: lead.peers.clone(), traffic: Cell::default() };
        let others = Cell::new(Behind::All);
        Self { member, others, options, failed: false, outcomes: Vec::new(), lead: lead.clone() }
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
        self.member.peers.exchange(messages);
    }

    fn tell(&self, task: Task, what: &[u32], note: impl FnOnce(&mut Traffic, u64)) {
        let mut message = Vec::new();
        task.put(&mut message);
        message.extend(what);
        self.member.note(|t| note(t, self.member.bytes_to_all(&message)));
        self.member.peers.broadcast(message);
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
        let plan = Plan { finest: model.field.domain, near: 0.0, backdrop: Backdrop::Surroundings };
        let (state, source, alignment) = (State::default(), Source::default(), Alignment::default());
        let run = RunRef {
            options: &self.options,
            plan: &plan,
            state: &state,
            source: &source,
            model,
            optimiser,
            sought: None,
            alignment: &alignment,
        };
        let mut bytes = Vec::new();
        run.write(&mut bytes).expect("memory takes all bytes");
        bytes
    }

    /// The rays of each process, as messages.
    fn rays<'a>(&'a self, rays: &'a [Ray<f32>]) -> impl Fn(usize) -> Vec<u32> + 'a {
        let (peers, n) = (self.member.peers.count(), rays.len());
        move |rank| {
            let mut message = Vec::new();
            put_all(&rays[rays_of(n, rank, peers)], &mut message);
            message
        }
    }

    /// The parts of a batch, as messages.
    fn parts<'a>(&'a self, batch: &'a Batch) -> impl Fn(usize) -> Vec<u32> + 'a {
        let (peers, n) = (self.member.peers.count(), batch.rays.len());
        move |rank| {
            let mut message = Vec::new();
            range_of(batch, rays_of(n, rank, peers)).put(&mut message);
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

/// The model of a message, and the state of its optimiser.
fn received(words: &mut Words) -> (Model, Optimiser) {
    let run = Run::read(&take_bytes(words)[..]).expect("the model of another process");
    (run.model, run.optimiser)
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
            let mut sent = self.lead.sent.lock().unwrap_or_else(|e| e.into_inner());
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
