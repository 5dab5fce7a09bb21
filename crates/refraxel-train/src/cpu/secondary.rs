//! What surfaces mirror, by a second ray through the field: the reference for the caches.

use super::absorption::{Absorbed, ShadedRay};
use super::mirrored::{self, MirroredSample};
use super::record::CLEARCOAT;
use super::sample::Samples;
use super::view::View;
use crate::backend::Marching;
use crate::second_rays;
use fearless_simd::Simd;
use refraxel_core::{Path, Ray};

/// Samples and path of a secondary ray: memory of one thread.
#[derive(Default)]
pub(super) struct SecondaryRay {
    seen: Samples,
    path: Path<f32>,
    absorbed: Absorbed,
}

/// Give mirrored samples what a second ray through the field shows, without further reflections.
#[inline(always)]
pub(super) fn look_exactly<S: Simd, const BLOCKS: usize>(
    simd: S,
    view: &View,
    second: &mut SecondaryRay,
    mirrored: &mut [MirroredSample],
) {
    let (scene, marching) = (view.scene, Marching { near: 0.0, ..*view.marching });
    let tracer = scene.refraction.secondary_tracer(scene.marcher.domain());
    let view = View { scene, marching: &marching, tracer: Some(tracer), absorbing: view.absorbing };
    for sample in mirrored {
        let of = &sample.of;
        let region = (of.region != CLEARCOAT).then_some(usize::from(of.region));
        let away = second_rays::distance(&scene.refraction.medium, scene.field.domain.voxel(), region);
        let from = Ray { origin: of.position, direction: of.direction };
        let ray = second_rays::lifted(from, of.normal, away);
        let SecondaryRay { seen, path, absorbed } = second;
        seen.clear();
        absorbed.clear();
        let found = view.march(simd, &ray, 0.5, path, seen);
        view.shade_all::<S, BLOCKS>(simd, seen);
        let mut through = found.through;
        if view.absorbing && found.bent {
            let (samples, segments) = (&mut seen.samples[..], &seen.segments[..]);
            let shaded = ShadedRay { samples, segments, mirrored: &mut [] };
            through = absorbed.filter(&scene.refraction.medium, path, shaded);
        }
        let pixel = seen.of(0..seen.samples.len()).composite(found.left);
        let behind = scene.background.radiance(found.exit.origin, found.exit.direction);
        let behind = through.through(behind).colour;
        sample.mirrored.colour = mirrored::shown(&seen.samples, &mut [], &pixel, behind);
    }
}
