//! How a chunk sees a scene: rays are traced, marched and shaded, a packet at a time.

use super::clearcoat::OpaqueSurface;
use super::colour::{prefetch_corners, shade};
use super::layout::voxels;
use super::mirrored::{self, TracedPath};
use super::packet::{MarchedRay, Packet};
use super::sample::{MarchedSegment, Samples};
use super::scene::Scene;
use crate::backend::Marching;
use fearless_simd::Simd;
use fearless_simd_macros::simd;
use refraxel_core::optics::Tracer;
use refraxel_core::radiance::{Filter, Segment};
use refraxel_core::{Path, Ray};

/// Samples between prefetch and use.
const AHEAD: usize = 4;

/// How a chunk traces its rays.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub scene: &'a Scene<'a>,
    pub marching: &'a Marching,
    /// Absent when all rays are straight.
    pub tracer: Option<Tracer<'a, f32>>,
    /// Colours pass what absorbs; otherwise nothing does, and nothing shall learn to.
    pub absorbing: bool,
}

impl<'a> View<'a> {
    pub(super) fn new(scene: &'a Scene<'a>, marching: &'a Marching) -> Self {
        let tracer = (!scene.refraction.is_none())
            .then(|| scene.refraction.tracer(scene.marcher.domain(), marching.near));
        Self { scene, marching, tracer, absorbing: scene.refraction.is_absorbing() }
    }

    /// The tracer, where surfaces mirror.
    #[inline(always)]
    fn mirroring(&self) -> Option<&Tracer<'a, f32>> {
        self.tracer.as_ref().filter(|_| !self.scene.reflection.is_none())
    }

    /// The surfaces of opaque things, where they have a clearcoat.
    #[inline(always)]
    pub(super) fn opaque_surface(&self) -> Option<OpaqueSurface<'a>> {
        let (scene, least) = (self.scene, self.marching.min_optical_depth);
        scene.clearcoat.map(|clearcoat| OpaqueSurface { scene, clearcoat, least })
    }

    /// Append the samples of one ray; where it bends, its path.
    #[simd]
    pub(super) fn march<S: Simd>(
        &self,
        simd: S,
        ray: &Ray<f32>,
        offset: f32,
        path: &mut Path<f32>,
        out: &mut Samples,
    ) -> MarchedRay {
        let (scene, marcher) = (self.scene, &self.scene.marcher);
        let mut front = marcher.start(offset, self.marching, out.samples.len());
        let bending = self.tracer.as_ref().filter(|_| scene.refraction.admits(ray));
        let mut exit = *ray;
        let straight;
        let segments = match bending {
            Some(tracer) => {
                tracer.trace_into(ray, path);
                exit = path.exit;
                &path.segments[..]
            }
            None => {
                straight = Segment::straight(ray, marcher.domain(), self.marching.near);
                straight.as_slice()
            }
        };
        let mut arc = 0.0;
        for (place, segment) in segments.iter().enumerate() {
            let speed = segment.momentum.length();
            if segment.range[0] < segment.range[1] {
                let number = out.segments.len() as u32;
                if marcher.march(simd, segment, number, &mut front, &mut out.samples) {
                    let unit = segment.momentum / speed;
                    let (basis, place) = (scene.layout.basis(unit), place as u32);
                    out.segments.push(MarchedSegment { segment: *segment, place, unit, speed, arc, basis });
                }
                if front.opaque {
                    break;
                }
            }
            arc += speed * segment.range[1];
        }
        marcher.finish(simd, &mut front, &mut out.samples);
        let (samples, left) = (out.samples.len(), front.transmittance);
        let (bent, through) = (bending.is_some(), Filter::clear());
        MarchedRay { samples, mirrored: 0, left, bent, exit, through }
    }

    /// March and shade a packet of rays. Without offsets, points lie in the middle of their steps.
    #[inline(always)]
    pub(super) fn march_packet<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        rays: &[Ray<f32>],
        offsets: &[f32],
        packet: &mut Packet,
    ) {
        let Packet { seen, rays: marched, paths, mirrored, reflections, .. } = packet;
        seen.clear();
        marched.clear();
        mirrored.clear();
        for ((i, ray), path) in rays.iter().enumerate().zip(paths) {
            let (offset, first) = (offsets.get(i).copied().unwrap_or(0.5), seen.samples.len());
            let mut of_ray = self.march(simd, ray, offset, path, seen);
            let own = seen.of(first..seen.samples.len());
            if let Some(tracer) = self.mirroring().filter(|_| of_ray.bent) {
                let opaque = of_ray.left < self.marching.min_transmittance;
                let path = TracedPath { tracer, path, opaque };
                mirrored::find(self.scene.reflection, &path, own, reflections, mirrored);
            }
            if let Some(surface) = self.opaque_surface().filter(|_| !of_ray.bent) {
                mirrored.extend(surface.mirrored(ray.direction, own));
            }
            of_ray.mirrored = mirrored.len();
            marched.push(of_ray);
        }
        self.shade_all::<S, BLOCKS>(simd, seen);
    }

    /// Give all samples their colours.
    #[simd]
    pub(super) fn shade_all<S: Simd, const BLOCKS: usize>(&self, simd: S, seen: &mut Samples) {
        let (colour, Samples { samples, segments }) = (voxels::<BLOCKS>(&self.scene.field.colour), seen);
        for s in samples.iter().take(AHEAD) {
            prefetch_corners(colour, &s.corners);
        }
        for k in 0..samples.len() {
            if let Some(next) = samples.get(k + AHEAD) {
                prefetch_corners(colour, &next.corners);
            }
            let s = &mut samples[k];
            let coloured = self.scene.layout.with(&segments[s.segment as usize].basis);
            s.colour = shade::<S, BLOCKS>(simd, colour, &s.corners, &s.weights, coloured);
        }
    }
}
