//! What each process does of a step, and the part of those that help.

use super::message::{Rest, Samples, Task, received};
use crate::backend::{Backend, Batch, Layers, Marching, Objective, StepOutcome};
use crate::cancel::Cancel;
use crate::communicator::wire::{Wire, Words, put_all};
use crate::communicator::{Communicator, Traffic, part};
use crate::cpu::backend::{BucketRange, CpuBackend, overflows, total};
use crate::cpu::composite::BatchLoss;
use crate::cpu::index::Learned;
use crate::cpu::render::CHUNK;
use crate::cpu::tape::{Tape, buckets};
use rayon::prelude::*;
use refraxel_core::Ray;
use std::cell::Cell;
use std::ops::Range;
use std::sync::Arc;

/// One of the processes with its copy of the model.
pub(super) struct Member {
    pub own: CpuBackend,
    pub communicator: Arc<dyn Communicator>,
    pub traffic: Cell<Traffic>,
}

/// Of so many rays those of a process: whole chunks.
pub(super) fn rays_of(rays: usize, rank: usize, count: usize) -> Range<usize> {
    let chunks = part(rays.div_ceil(CHUNK), rank, count);
    (chunks.start * CHUNK).min(rays)..(chunks.end * CHUNK).min(rays)
}

/// A range of the rays of a batch.
pub(super) fn range_of(batch: &Batch, range: Range<usize>) -> Batch {
    fn cut<T: Copy>(all: &[T], range: &Range<usize>) -> Vec<T> {
        if all.is_empty() { Vec::new() } else { all[range.clone()].to_vec() }
    }
    Batch {
        rays: cut(&batch.rays, &range),
        target: cut(&batch.target, &range),
        behind: cut(&batch.behind, &range),
        offset: cut(&batch.offset, &range),
        beside: cut(&batch.beside, &range),
        depth: cut(&batch.depth, &range),
    }
}

impl Member {
    pub fn count(&self) -> usize {
        self.communicator.count()
    }

    pub fn note(&self, add: impl FnOnce(&mut Traffic)) {
        let mut traffic = self.traffic.get();
        add(&mut traffic);
        self.traffic.set(traffic);
    }

    /// The bytes of what goes to others.
    pub fn bytes_to_others(&self, messages: &[Vec<u32>]) -> u64 {
        let others = messages.iter().enumerate().filter(|(rank, _)| *rank != self.communicator.rank());
        others.map(|(_, message)| 4 * message.len() as u64).sum()
    }

    /// The bytes of what goes to each of the others.
    pub fn bytes_to_all(&self, message: &[u32]) -> u64 {
        4 * message.len() as u64 * (self.count() as u64 - 1)
    }

    /// A step on this process's part of a batch of so many rays.
    pub fn step(&mut self, mine: &Batch, rays: usize, objective: &Objective, step: u64) -> StepOutcome {
        let batch_loss = BatchLoss { batch: mine, objective, asked: None };
        let memory = std::mem::take(&mut self.own.tapes);
        let (tapes, outcomes) = self.own.trace_chunks(batch_loss, &mut [], memory);
        let is_alone = self.count() == 1;
        let (tapes, outcomes) = if is_alone { (tapes, outcomes) } else { self.meet(tapes, &outcomes) };
        let mut outcome = StepOutcome { step, ..total(rays, &outcomes) };
        if outcome.finite {
            let learned = Learned { tapes: &tapes, rays, step };
            let mine = part(buckets(self.own.map()), self.communicator.rank(), self.count());
            outcome.overflows = overflows(objective, &tapes);
            let moved =
                self.own.update_all(&learned, objective, &BucketRange { buckets: mine, tells: !is_alone });
            let mut message = moved.voxels;
            message.push(moved.finite.into());
            self.note(|t| t.voxels += self.bytes_to_all(&message));
            for (rank, told) in self.communicator.gather(message).iter().enumerate() {
                let (finite, voxels) = told.split_last().expect("whole messages");
                outcome.finite &= *finite != 0;
                if rank != self.communicator.rank() {
                    self.own.apply_remote(voxels);
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
        let (rank, functions) = (self.communicator.rank(), self.own.layout().functions());
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
        let (shared, samples) = (self.communicator.gather(shared), self.communicator.exchange(messages));

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
    pub fn report<T: Wire>(&self, mine: Vec<T>) -> Vec<T> {
        let mut messages = vec![Vec::new(); self.count()];
        if self.communicator.rank() > 0 {
            mine.put(&mut messages[0]);
            self.note(|t| t.pixels += self.bytes_to_others(&messages));
        }
        let told = self.communicator.exchange(messages);
        let theirs = told.iter().skip(1).filter(|message| !message.is_empty());
        let mut all = mine;
        theirs.for_each(|message| all.extend(Vec::<T>::take(&mut Words(message))));
        all
    }

    /// A task of the first process.
    fn help_with(&mut self, task: Task, words: &mut Words) {
        let mine = || self.communicator.exchange(vec![Vec::new(); self.communicator.count()]).swap_remove(0);
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
pub fn serve(communicator: &Arc<dyn Communicator>) {
    assert!(communicator.rank() > 0, "the first process leads");
    let mut member: Option<Member> = None;
    loop {
        let message = communicator.broadcast(Vec::new());
        let mut words = Words(&message);
        let task = Task::take(&mut words);
        let sent = member.as_ref().map_or_else(Traffic::default, |m| m.traffic.get());
        match (task, &mut member) {
            (Task::End, _) => return,
            (Task::Load, member) => {
                *member = None; // there may be no room for two
                let (model, optimiser) = received(&mut words);
                let own = CpuBackend::resumed(model, optimiser);
                *member = Some(Member { own, communicator: communicator.clone(), traffic: Cell::new(sent) });
            }
            (task, Some(member)) => member.help_with(task, &mut words),
            (_, None) => unreachable!("a model comes before all other tasks"),
        }
    }
}
