//! The order of rays: those that meet matter in the same place follow each other, so that what one has fetched the next
//! finds in the cache.

use super::scene::Scene;
use crate::backend::Batch;
use fearless_simd::{Level, Simd, dispatch};
use fearless_simd_macros::simd;
use rayon::prelude::*;
use refraxel_core::Ray;
use refraxel_core::radiance::Segment;

/// Rays of a unit of work.
const PORTION: usize = 1024;

/// The numbers of rays in the order in which they are best worked on: by the first brick of matter on a straight line. A
/// function of rays and scene alone.
pub(super) fn best_order(level: Level, scene: &Scene, rays: &[Ray<f32>], near: f32) -> Vec<u32> {
    let mut keys = vec![0; rays.len()];
    keys.par_chunks_mut(PORTION).zip(rays.par_chunks(PORTION)).enumerate().for_each(|(k, (keys, rays))| {
        dispatch!(level, simd => number(simd, scene, rays, near, (k * PORTION) as u64, keys));
    });
    keys.par_sort_unstable();
    keys.into_iter().map(|key| key as u32).collect()
}

/// Keys to sort by: the slot of the first brick, then the number of the ray, from `first` on.
#[simd]
fn number<S: Simd>(simd: S, scene: &Scene, rays: &[Ray<f32>], near: f32, first: u64, keys: &mut [u64]) {
    for ((ray, key), number) in rays.iter().zip(keys).zip(first..) {
        let straight = Segment::straight(ray, scene.marcher.domain(), near);
        let slot = straight.and_then(|segment| scene.marcher.first_slot(simd, &segment));
        *key = u64::from(slot.unwrap_or(u32::MAX)) << 32 | number;
    }
}

impl Batch {
    /// The same rays in another order.
    pub(super) fn reordered(&self, order: &[u32]) -> Self {
        fn picked<T: Copy>(from: &[T], order: &[u32]) -> Vec<T> {
            if from.is_empty() { Vec::new() } else { order.iter().map(|&i| from[i as usize]).collect() }
        }
        Self {
            rays: picked(&self.rays, order),
            target: picked(&self.target, order),
            behind: picked(&self.behind, order),
            offset: picked(&self.offset, order),
            beside: picked(&self.beside, order),
            depth: picked(&self.depth, order),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::conformance::scenes::{batch, straight_model};
    use crate::cpu::layout::Layout;
    use crate::model::Optimiser;
    use refraxel_core::Extent;

    #[test]
    fn all_rays_come_once_and_in_the_order_of_what_they_meet() {
        let model = straight_model(1, Extent::Bounded);
        let (optimiser, layout) = (Optimiser::new(&model), Layout::new(model.field.degree));
        let scene = Scene::new(&model, &optimiser.occupied, &layout);
        let rays = batch(1500).rays;
        let order = best_order(Level::new(), &scene, &rays, 0.0);
        let mut all = order.clone();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..1500));
        let mut keys = vec![0; rays.len()];
        dispatch!(Level::new(), simd => number(simd, &scene, &rays, 0.0, 0, &mut keys));
        assert!(order.is_sorted_by_key(|&i| keys[i as usize]));
        let met = keys.iter().filter(|key| **key >> 32 != u64::from(u32::MAX)).count();
        assert!(met > 100, "{met} rays met matter");
    }
}
