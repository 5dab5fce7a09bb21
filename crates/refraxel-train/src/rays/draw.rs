//! Batches before they are drawn: what they are a function of, for devices that draw them on their own.

use super::batch::Batch;
use super::sampler::RaySampler;
use super::selection::Selection;
use crate::random::Random;

/// A batch that is to be drawn: a function of the seed and of the number, of what the sampler holds, and of what is selected.
#[derive(Clone, Copy)]
pub struct Draw<'a> {
    /// Who draws it.
    pub sampler: &'a RaySampler,
    /// The number of the batch.
    pub number: u64,
    /// Rays, at most.
    pub size: usize,
    /// Which pixels it draws from.
    pub selection: Selection,
    /// A ray shows the mean colour of the pixels up to so many rows and columns from its own, theory (4.26): photographs that are no
    /// finer than the grid.
    pub reach: u32,
}

impl Draw<'_> {
    /// Draws it here.
    pub fn batch(&self) -> Batch {
        self.sampler.blurred_batch(self.number, self.size, self.selection, self.reach)
    }

    /// How many of its rays, the first ones, are drawn inside refractive masks alone.
    pub fn rays_inside(&self) -> u64 {
        self.sampler.rays_inside(self.size as u64, self.selection)
    }

    /// What the numbers have in common that say where its rays begin to take turns, and how far round they have gone, see
    /// [`Random::turn`](crate::random::Random::turn).
    pub fn turns(&self) -> (u64, u32) {
        (self.sampler.random.beginnings(), Random::turned(self.number))
    }

    /// What all its random numbers have in common, see [`Random::stream`](crate::random::Random::stream).
    pub fn stream(&self) -> u64 {
        self.sampler.random.stream(self.number)
    }
}
