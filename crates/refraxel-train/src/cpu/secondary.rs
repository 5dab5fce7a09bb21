//! What surfaces mirror, by a second ray through the field: the reference for the caches.

use super::gloss::COAT;
use super::march::Sample;
use super::reflection::Glimpse;
use super::trace::{Arm, View, composite, shown};
use crate::backend::Marching;
use fearless_simd::Simd;
use refraxel_core::{Path, Ray};

/// Samples, arms and path of a secondary ray.
pub(super) type SecondScratch = (Vec<Sample>, Vec<Arm>, Path<f32>);

/// Distance from the surface at which a secondary ray begins [voxel of the field]: it must not meet where it comes from.
const LIFT: f32 = 1e-2;
/// The same where an opaque thing ends or the index changes gradually, over some voxels [voxel of the field or the index].
const OUT_OF_THE_EDGE: f32 = 2.0;

impl View<'_> {
    /// What partial reflections show by a second ray through the field, without further reflections.
    #[inline(always)]
    pub fn look_exactly<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        (samples, arms, path): &mut SecondScratch,
        glimpses: &mut [Glimpse],
    ) {
        let marching = Marching { near: 0.0, ..*self.marching };
        let tracer = self.scene.refraction.secondary_tracer(self.scene.marcher.domain());
        let view = View { scene: self.scene, marching: &marching, tracer: Some(tracer) };
        let lift = LIFT * self.scene.field.domain.voxel();
        for glimpse in glimpses {
            let of = &glimpse.of;
            let away = match of.region {
                COAT => OUT_OF_THE_EDGE * self.scene.field.domain.voxel(),
                region => {
                    let grid = &self.scene.refraction.medium.regions()[usize::from(region)];
                    if grid.level_set().is_some() { lift } else { OUT_OF_THE_EDGE * grid.voxel() }
                }
            };
            let side = away * of.direction.dot(of.normal).signum();
            let ray = Ray { origin: of.position + of.normal * side, direction: of.direction };
            samples.clear();
            arms.clear();
            let found = view.march(simd, (&ray, 0.5), path, (samples, arms));
            view.shade_all::<S, BLOCKS>(simd, samples, arms);
            let pixel = composite(samples, arms, found.left);
            let behind = self.scene.background.radiance(found.exit.origin, found.exit.direction);
            glimpse.mirrored = shown(samples, 0..samples.len(), &mut [], (&pixel, behind));
        }
    }
}
