//! What processes tell each other.

use crate::backend::{
    AbsorptionObjective, Batch, IndexObjective, Layers, Marching, Objective, RayGradient, ReflectionObjective,
};
use crate::communicator::Traffic;
use crate::communicator::wire::{Wire, Words, take_bytes, wire};
use crate::cpu::record::{CacheLookup, IndexSample, Record};
use crate::cpu::tape::Tape;
use crate::model::{CacheId, MirrorSource, Model, Optimiser};
use crate::run::Run;
use std::ops::Range;

wire! {
    Traffic { rays, samples, shared, voxels, pixels, models }
    Record { cell, fraction, basis, d_theta, d_colour }
    IndexSample { region, surface, x, d_value, d_gradient }
    CacheId { region, inner }
    CacheLookup { surface, cache, x, direction, d_radiance, d_strength }
    Batch { rays, target, behind, offset, beside, depth }
    RayGradient { origin, direction, residual }
    Marching { step, near, min_optical_depth, min_transmittance }
    AbsorptionObjective { rate }
    ReflectionObjective { rate, rate_strength, rate_clearcoat }
    IndexObjective {
        rate, blur, clip, variation, deviation, largest, trust, surface_rate, surface_blur, surface_smooth, silhouette, surface_events,
        index_events,
    }
    Objective {
        marching, thin, bent_weight, sample_colour, depth, full_distance, tv_density, tv_colour, tv_period, rate_density, rate_colour,
        rate_view, rate_background, index, reflection, absorption,
    }
}

/// What the first process asks of the others.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Task {
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
        };
        number.put(to);
    }
    fn take(from: &mut Words) -> Self {
        match u32::take(from) {
            0 => Self::All,
            1 => Self::Transmitted,
            2 => Self::Mirroring(MirrorSource::Black),
            3 => Self::Mirroring(MirrorSource::Exact),
            _ => Self::Mirroring(MirrorSource::Learned),
        }
    }
}

/// What a chunk of rays has left behind, but for its samples of the field.
pub(super) struct Rest {
    pub squared_error: f64,
    pub samples: u64,
    pub index_samples: Vec<IndexSample>,
    pub lookups: Vec<CacheLookup>,
    pub absorption: Vec<[f64; 3]>,
    pub overflows: u64,
    pub texels: Vec<(u32, [f32; 3])>,
}

wire! {
    Rest { squared_error, samples, index_samples, lookups, absorption, overflows, texels }
}

/// Samples of the field of a chunk: their records, and the functions of the bases that these name, one after the other.
pub(super) struct Samples {
    pub records: Vec<Record>,
    pub bases: Vec<f32>,
}

wire! {
    Samples { records, bases }
}

impl Samples {
    /// Those of a tape that touch some buckets, with bases of so many functions.
    pub fn of(tape: &Tape, touched: &Range<usize>, functions: usize) -> Self {
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

/// The model of a message, and the state of its optimiser.
pub(super) fn received(words: &mut Words) -> (Model, Optimiser) {
    let run = Run::read(&take_bytes(words)[..]).expect("the model of another process");
    (run.model, run.optimiser)
}
