//! What surfaces mirror, by a second ray through the field: the reference for the caches.

use super::clearcoat::CLEARCOAT;
use super::march::Sample;
use super::reflection::MirroredSample;
use super::trace::{MarchedSegment, View, composite, shown};
use crate::backend::Marching;
use fearless_simd::Simd;
use refraxel_core::{Path, Ray};

/// Samples, marched and path of a secondary ray.
pub(super) type SecondScratch = (Vec<Sample>, Vec<MarchedSegment>, Path<f32>);

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
        (samples, marched, path): &mut SecondScratch,
        mirrored_samples: &mut [MirroredSample],
    ) {
        let marching = Marching { near: 0.0, ..*self.marching };
        let tracer = self.scene.refraction.secondary_tracer(self.scene.marcher.domain());
        let view = View { scene: self.scene, marching: &marching, tracer: Some(tracer) };
        let lift = LIFT * self.scene.field.domain.voxel();
        for mirrored_sample in mirrored_samples {
            let of = &mirrored_sample.of;
            let away = match of.region {
                CLEARCOAT => OUT_OF_THE_EDGE * self.scene.field.domain.voxel(),
                region => {
                    let grid = &self.scene.refraction.medium.regions()[usize::from(region)];
                    if grid.level_set().is_some() { lift } else { OUT_OF_THE_EDGE * grid.voxel() }
                }
            };
            let side = away * of.direction.dot(of.normal).signum();
            let ray = Ray { origin: of.position + of.normal * side, direction: of.direction };
            samples.clear();
            marched.clear();
            let found = view.march(simd, (&ray, 0.5), path, (samples, marched));
            view.shade_all::<S, BLOCKS>(simd, samples, marched);
            let pixel = composite(samples, marched, found.left);
            let behind = self.scene.background.radiance(found.exit.origin, found.exit.direction);
            mirrored_sample.mirrored = shown(samples, 0..samples.len(), &mut [], (&pixel, behind));
        }
    }
}
