//! What a tracer is; [`trace`](super::trace) and its neighbours hold what it does.

use super::options::{Integrator, Options};
use crate::{Domain, Medium, Real};

/// Traces rays through a medium, inside the domain of a radiance field.
#[derive(Clone, Copy, Debug)]
pub struct Tracer<'a, T: Copy> {
    pub(super) medium: &'a Medium<T>,
    pub(super) domain: &'a Domain<T>,
    pub(super) options: Options<T>,
}

impl<'a, T: Real> Tracer<'a, T> {
    /// A tracer of rays through `medium` that are seen inside `domain`.
    ///
    /// # Panics
    /// If the step is not in (0, 1], if there are more than 65 535 regions, or if one of them has a level set and the
    /// integrator is not leapfrog.
    pub fn new(medium: &'a Medium<T>, domain: &'a Domain<T>, options: Options<T>) -> Self {
        assert!(
            options.step > T::zero() && options.step <= T::one(),
            "a step is a fraction of a voxel, (0, 1], got {:?}",
            options.step
        );
        assert!(medium.regions().len() <= usize::from(u16::MAX), "at most 65 535 refractive regions");
        assert!(
            options.integrator == Integrator::Leapfrog
                || medium.regions().iter().all(|r| r.level_set().is_none()),
            "sharp interfaces need leapfrog"
        );
        Self { medium, domain, options }
    }

    /// Step length in t [scene unit] in a region, theory (2.9): h = `step` · voxel / (largest n), so that ds = n h is at
    /// most `step` voxels.
    pub fn step_length(&self, region: usize) -> T {
        let grid = &self.medium.regions()[region];
        self.options.step * grid.voxel() / grid.largest_index()
    }
}
