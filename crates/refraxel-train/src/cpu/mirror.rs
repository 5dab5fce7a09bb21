//! What surfaces mirror: of bodies on bent paths and of opaque things at the end of straight rays, read from caches, or by a second
//! ray through the field, the reference for the caches.

use super::absorption::ShadedRay;
use super::colour::shade;
use super::composite::composite;
use super::march::march_path;
use super::mirrored::{self, MirroredSample, TracedPath};
use super::packet::{Absorbed, Packet, PacketRay};
use super::record::{CLEARCOAT, Record};
use super::sample::Samples;
use super::trace::trace_ray;
use super::view::View;
use crate::backend::Marching;
use crate::model::MirrorSource;
use crate::second_rays;
use fearless_simd::Simd;
use refraxel_core::optics::PartialReflectionAdjoint;
use refraxel_core::radiance::Filter;
use refraxel_core::{Path, Ray, Vec3};
use std::ops::Range;

/// Samples and path of a secondary ray: memory of one thread.
#[derive(Default)]
pub(super) struct SecondaryRay {
    seen: Samples,
    path: Path<f32>,
    absorbed: Absorbed,
}

/// The fourth stage: what surfaces mirror into rays.
#[inline(always)]
pub(super) fn mirror<S: Simd, const BLOCKS: usize>(
    simd: S,
    view: &View,
    rays: &[Ray<f32>],
    packet: &mut Packet,
    second: &mut SecondaryRay,
) {
    let Packet { seen, rays: marched, paths, mirrored, reflections, .. } = packet;
    mirrored.clear();
    let (bodies, opaque_surface) = (view.mirroring(), view.opaque_surface());
    if bodies.is_none() && opaque_surface.is_none() {
        return;
    }
    for ((ray, found), path) in rays.iter().zip(marched).zip(paths) {
        let (own, first) = (seen.of(found.samples.clone()), mirrored.len());
        if let Some(tracer) = bodies.filter(|_| found.bent) {
            let opaque = found.left < view.marching.min_transmittance;
            let path = TracedPath { tracer, path, opaque };
            mirrored::find(view.scene.reflection, &path, own, reflections, mirrored);
        }
        if let Some(surface) = opaque_surface.filter(|_| !found.bent) {
            mirrored.extend(surface.mirrored(ray.direction, own));
        }
        found.mirrored = first..mirrored.len();
    }
    if view.scene.reflection.source == MirrorSource::Exact {
        look_exactly::<S, BLOCKS>(simd, view, second, mirrored);
    }
}

/// The way back of the stage for one ray of direction `d`: what a clearcoat owes to the weights of the ray's samples, which are `own` of
/// the packet's, and to density gradients; what bodies owe to partial reflections.
#[inline(always)]
pub(super) fn mirror_vjp(
    view: &View,
    d: Vec3<f32>,
    mirrored: &[MirroredSample],
    own: Range<usize>,
    seen: &mut Samples,
    out: &mut MirrorAdjoint,
) {
    out.density_gradients.clear();
    out.reflections.clear();
    let Some(first) = mirrored.first() else { return };
    if first.of.region == CLEARCOAT {
        let Some(surface) = view.opaque_surface() else { return };
        let Samples { samples, segments } = seen;
        surface.mirrored_vjp(d, first, &mut samples[own], segments, &mut out.density_gradients);
    } else {
        mirrored::reflection_adjoints(view.scene.reflection, mirrored, &mut out.reflections);
    }
}

/// What the surfaces of a ray owe. Memory of one thread.
#[derive(Default)]
pub(super) struct MirrorAdjoint {
    pub reflections: Vec<PartialReflectionAdjoint<f32>>,
    pub density_gradients: Vec<Record>,
}

/// Give mirrored samples what a second ray through the field shows, without further reflections.
#[inline(always)]
fn look_exactly<S: Simd, const BLOCKS: usize>(
    simd: S,
    view: &View,
    second: &mut SecondaryRay,
    mirrored: &mut [MirroredSample],
) {
    let (scene, marching) = (view.scene, Marching { near: 0.0, ..*view.marching });
    let tracer = scene.refraction.secondary_tracer(scene.marcher.domain());
    let view =
        View { scene, marching: &marching, thin: 0.0, tracer: Some(tracer), absorbing: view.absorbing };
    for sample in mirrored {
        let of = &sample.of;
        let region = (of.region != CLEARCOAT).then_some(usize::from(of.region));
        let away = second_rays::distance(&scene.refraction.medium, scene.field.domain.voxel(), region);
        let from = Ray { origin: of.position, direction: of.direction };
        let ray = second_rays::lifted(from, of.normal, away);
        let SecondaryRay { seen, path, absorbed } = second;
        seen.clear();
        absorbed.clear();
        let bent = trace_ray(&view, &ray, path);
        let left = march_path(simd, &view, &path.segments, 0.5, seen);
        shade::<S, BLOCKS>(simd, scene, seen);
        let mut through = Filter::clear();
        if view.absorbing && bent {
            let (samples, segments) = (&mut seen.samples[..], &seen.segments[..]);
            let shaded = ShadedRay { samples, segments, mirrored: &mut [] };
            through = absorbed.filter(&scene.refraction.medium, path, shaded);
        }
        let samples = 0..seen.samples.len();
        let own = seen.of(samples.clone());
        let found = PacketRay { bent, exit: path.exit, samples, left, mirrored: 0..0, through };
        sample.mirrored.colour = composite(scene.background, &found, own, &mut []).colour;
    }
}
