//! Batches before they are drawn: what they are a function of, for devices that draw them on their own.

use super::{RaySampler, Selection};
use crate::backend::Batch;
use std::sync::Arc;

/// Random numbers that a ray may take.
pub const LANES: u64 = 64;
/// The number that shifts its quadrature points; those before are the colour behind it.
pub const OFFSET_LANE: u64 = 3;
/// The numbers that move a pixel of a refractive mask along columns and rows.
pub const MOVE_LANES: [u64; 2] = [4, 5];
/// The first of the numbers that choose its pixel.
pub const PIXEL_LANE: u64 = 8;
/// Pixels that must not be used are drawn again this often before the ray is given up.
pub const REDRAWS: u64 = 32;

/// What a sampler holds at one moment: equal to itself, and to nothing else.
#[derive(Clone, Debug, Default)]
pub struct Edition(Arc<()>);

impl PartialEq for Edition {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

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
}

impl Draw<'_> {
    /// Draws it here.
    pub fn batch(&self) -> Batch {
        self.sampler.batch(self.number, self.size, self.selection)
    }

    /// How many of its rays, the first ones, are drawn inside refractive masks alone.
    pub fn rays_inside(&self) -> u64 {
        self.sampler.rays_inside(self.size as u64, self.selection)
    }

    /// What all its random numbers have in common, see [`Random::stream`](crate::random::Random::stream).
    pub fn stream(&self) -> u64 {
        self.sampler.random.stream(self.number)
    }
}

impl RaySampler {
    /// How many rays of a batch, the first ones, are drawn inside refractive masks alone.
    pub(super) fn rays_inside(&self, size: u64, selection: Selection) -> u64 {
        match selection {
            Selection::Inside(share) => (self.extra_inside(share) * size as f64).ceil() as u64,
            Selection::Around(_) if self.inside.count() > 0 => size,
            _ => 0,
        }
    }

    /// Share of a batch to draw from inside alone, so that `share` of it lies inside in all.
    fn extra_inside(&self, share: f64) -> f64 {
        let natural = self.mask_share();
        if self.inside.count() == 0 || natural >= share { 0.0 } else { (share - natural) / (1.0 - natural) }
    }

    /// Changes with the masks of what is refractive.
    pub fn masks_edition(&self) -> &Edition {
        &self.masks
    }

    /// That of the photographs themselves, of their masks of what may be used, and of the lenses that the data say: they never change.
    pub fn photographs_edition(&self) -> &Edition {
        &self.photographs
    }

    /// Whether what lies behind the photographs is random.
    pub fn is_transparent(&self) -> bool {
        self.transparent
    }

    /// Whether batches draw from a view.
    pub fn is_aside(&self, view: usize) -> bool {
        self.aside.contains(&view)
    }
}
