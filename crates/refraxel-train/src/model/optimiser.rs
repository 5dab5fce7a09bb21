//! The state of the optimiser: moments, laid out like the parameters they belong to, and the occupied cells.

use super::Mirror;
use super::scene::Model;
use refraxel_core::grid::EMPTY_SLOT;
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{AlignedVec, Background, BrickMap, IndexGrid, VoxelField};

/// What training needs besides the parameters to go on as if it had never stopped.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimiser {
    /// Second moments of [`VoxelField::density`].
    pub density: AlignedVec<f32>,
    /// Second moments of the colour of each voxel: one for all its channels.
    pub colour: AlignedVec<f32>,
    /// Second moments of the texels of an environment map; empty for a constant background.
    pub background: Vec<[f32; 3]>,
    /// Moments of the coefficients of the index, per region.
    pub index: Vec<IndexMoments>,
    /// Moments of what surfaces mirror, per region.
    pub reflection: Vec<MirrorMoments>,
    /// Moments of the clearcoat of opaque things; empty without one.
    pub clearcoat: ClearcoatMoments,
    /// Which cells may hold matter, one bit per cell, 64 cells per slot of the grid's map. Rays skip the others.
    pub occupied: Vec<u64>,
}

/// Adam's moments of one array of parameters, and how many steps they saw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdamMoments {
    /// Mean of the gradient.
    pub first: Vec<f32>,
    /// Mean of its square.
    pub second: Vec<f32>,
    /// Steps taken.
    pub steps: u32,
}

/// The moments of one region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndexMoments {
    /// Of the coefficients of w.
    pub index: AdamMoments,
    /// Of the coefficients of φ; empty without a surface. The first are those of the planes' parameters where planes learn.
    pub surface: AdamMoments,
    /// Of the three absorption coefficients.
    pub absorption: AdamMoments,
}

/// Second moments of one mirror.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MirrorMoments {
    /// Of its strength.
    pub strength: f32,
    /// One per probe of the outer cache.
    pub outer: Vec<f32>,
    /// One per probe of the inner cache.
    pub inner: Vec<f32>,
}

/// Second moments of a clearcoat: one per probe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClearcoatMoments {
    /// Of its strength.
    pub strength: Vec<f32>,
    /// Of what it mirrors.
    pub radiance: Vec<f32>,
}

impl Optimiser {
    /// The state before the first step: no moments, and every stored cell may hold matter.
    pub fn new(model: &Model) -> Self {
        let mut new = Self {
            density: AlignedVec::from_slice(&[]),
            colour: AlignedVec::from_slice(&[]),
            background: vec![[0.0; 3]; texels(&model.background)],
            index: model.refraction.medium.regions().iter().map(IndexMoments::zero).collect(),
            reflection: model.reflection.mirrors.iter().map(MirrorMoments::zero).collect(),
            clearcoat: model.clearcoat.as_ref().map(ClearcoatMoments::zero).unwrap_or_default(),
            occupied: Vec::new(),
        };
        new.forget_field(&model.field);
        new
    }

    /// Forget what is known of the voxels, since they are those of another grid.
    pub fn forget_field(&mut self, field: &VoxelField<f32>) {
        self.density = AlignedVec::filled(field.density.len(), 0.0);
        self.colour = AlignedVec::filled(field.density.len(), 0.0);
        self.occupied = all_occupied(&field.map);
    }

    /// Whether the moments and cells are of the shape of a model's parameters.
    pub fn fits(&self, model: &Model) -> bool {
        let voxels = model.field.density.len();
        let regions = model.refraction.medium.regions();
        let mirrors = &model.reflection.mirrors;
        self.density.len() == voxels
            && self.colour.len() == voxels
            && self.background.len() == texels(&model.background)
            && self.occupied.len() == model.field.map.slots()
            && self.occupied.first() == Some(&0)
            && self.index.len() == regions.len()
            && self.index.iter().zip(regions).all(|(moments, grid)| moments.fits(grid))
            && self.reflection.len() == mirrors.len()
            && self.reflection.iter().zip(mirrors).all(|(moments, mirror)| moments.fits(mirror))
            && self.clearcoat.fits(model.clearcoat.as_ref())
    }

    /// Share of the stored cells that rays have to look at.
    pub fn occupancy(&self, map: &BrickMap) -> f64 {
        let set: u64 = self.occupied.iter().map(|b| u64::from(b.count_ones())).sum();
        set as f64 / (map.voxels() as f64).max(1.0)
    }
}

/// All cells but those of the empty brick.
fn all_occupied(map: &BrickMap) -> Vec<u64> {
    let mut occupied = vec![u64::MAX; map.slots()];
    occupied[EMPTY_SLOT as usize] = 0;
    occupied
}

/// Parameters of a background.
fn texels(background: &Background<f32>) -> usize {
    match background {
        Background::Constant(_) => 0,
        Background::Environment(map) => map.texels.len(),
    }
}

impl AdamMoments {
    /// Those of `n` parameters that have not learned yet.
    pub fn zero(n: usize) -> Self {
        Self { first: vec![0.0; n], second: vec![0.0; n], steps: 0 }
    }
}

impl IndexMoments {
    /// Those of a region that has not learned yet.
    pub fn zero(grid: &IndexGrid<f32>) -> Self {
        Self {
            index: AdamMoments::zero(grid.coefficients().len()),
            surface: AdamMoments::zero(nodes(grid)),
            absorption: AdamMoments::zero(3),
        }
    }

    fn fits(&self, grid: &IndexGrid<f32>) -> bool {
        self.index.first.len() == grid.coefficients().len()
            && self.surface.first.len() == nodes(grid)
            && self.absorption.first.len() == 3
    }
}

/// Nodes of the surface of a region.
fn nodes(grid: &IndexGrid<f32>) -> usize {
    grid.level_set().map_or(0, |l| l.coefficients().len())
}

impl MirrorMoments {
    /// Those of a mirror that has not learned yet.
    pub fn zero(mirror: &Mirror) -> Self {
        let zeros = |probes| vec![0.0; probes];
        Self { strength: 0.0, outer: zeros(mirror.outer.probes()), inner: zeros(mirror.inner.probes()) }
    }

    fn fits(&self, mirror: &Mirror) -> bool {
        self.outer.len() == mirror.outer.probes() && self.inner.len() == mirror.inner.probes()
    }
}

impl ClearcoatMoments {
    /// Those of a clearcoat that has not learned yet.
    pub fn zero(clearcoat: &Clearcoat<f32>) -> Self {
        let zeros = |probes| vec![0.0; probes];
        let (strength, radiance) = (clearcoat.strength.probes(), clearcoat.radiance.probes());
        Self { strength: zeros(strength), radiance: zeros(radiance) }
    }

    fn fits(&self, clearcoat: Option<&Clearcoat<f32>>) -> bool {
        let probes = clearcoat.map_or([0, 0], |c| [c.strength.probes(), c.radiance.probes()]);
        [self.strength.len(), self.radiance.len()] == probes
    }
}
