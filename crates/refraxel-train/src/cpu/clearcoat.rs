//! Clearcoats of opaque things, theory (7.13)–(7.16): a mirrored sample before all samples of a straight ray, from the surface
//! at which the ray ends, and the way back to the samples.

use super::mirrored::MirroredSample;
use super::record::{CLEARCOAT, DENSITY_GRADIENT, Record};
use super::sample::{MarchedSegment, RaySamples, Sample};
use super::scene::Scene;
use crate::model::MirrorSource;
use refraxel_core::optics::{PartialReflection, PartialReflectionAdjoint};
use refraxel_core::radiance::clearcoat::{Clearcoat, Facing};
use refraxel_core::{Vec3, grid::trilinear};

/// The surfaces of opaque things, as straight rays see them.
#[derive(Clone, Copy)]
pub(super) struct OpaqueSurface<'a> {
    pub scene: &'a Scene<'a>,
    pub clearcoat: &'a Clearcoat<f32>,
    /// Samples of at most this weight T a do not count.
    pub least: f32,
}

impl OpaqueSurface<'_> {
    /// Point and h ∇θ of a sample.
    #[inline(always)]
    fn at(&self, s: &Sample, on: &MarchedSegment) -> (Vec3<f32>, Vec3<f32>) {
        let (x, field) = (on.segment.at(s.t), self.scene.field);
        let theta_at = s.corners.map(|v| field.density[v as usize]);
        (x, field.domain.node_vjp(x, trilinear::gradient(s.fraction, &theta_at)) * field.domain.voxel())
    }

    /// The surface at which a ray ends, by its samples.
    fn facing(&self, ray: RaySamples) -> Option<Facing<f32>> {
        let mut sum = Facing::nothing();
        for s in ray.samples {
            let w = s.before * s.alpha;
            if w > self.least {
                let (x, slope) = self.at(s, ray.segment_of(s));
                sum.add(w, x, slope);
            }
        }
        sum.finished()
    }

    /// What the clearcoat mirrors where a straight ray in direction `d` ends.
    pub(super) fn mirrored(&self, d: Vec3<f32>, ray: RaySamples) -> Option<MirroredSample> {
        let (clearcoat, facing) = (self.clearcoat, self.facing(ray)?);
        let coating = facing.reflection(d, clearcoat.ior)?;
        let (position, direction) = (facing.position, coating.direction);
        let mirrored = if self.scene.reflection.source.reads_caches() {
            clearcoat.radiance.radiance(&clearcoat.radiance.stencil(position, direction))
        } else {
            [0.0; 3]
        };
        let of = PartialReflection {
            segment: 0,
            region: CLEARCOAT,
            from_inside: false,
            within: None,
            position,
            direction,
            normal: coating.normal,
            reflectance: coating.share,
        };
        Some(MirroredSample::new(of, 0, clearcoat.strength_at(position) * coating.share, mirrored))
    }

    /// The way back to the samples of a ray in direction `d`: dLoss/d(their weights), and records of their density gradients.
    pub(super) fn mirrored_vjp(
        &self,
        d: Vec3<f32>,
        mirrored: &MirroredSample,
        samples: &mut [Sample],
        segments: &[MarchedSegment],
        density_gradients: &mut Vec<Record>,
    ) {
        let Some(facing) = self.facing(RaySamples { samples, segments }) else { return };
        let d_of = adjoint(self.clearcoat, self.scene.reflection.source, mirrored);
        let mut own = facing.reflection_vjp(d, self.clearcoat.ior, d_of.reflectance, d_of.direction).facing;
        own.position = d_of.position;
        let domain = &self.scene.field.domain;
        for s in samples {
            let w = s.before * s.alpha;
            if w > self.least {
                let (x, slope) = self.at(s, &segments[s.segment as usize]);
                s.d_weight = facing.d_weight(&own, x, slope);
                let d_node = domain.node_jvp(x, own.slope * -w) * domain.voxel();
                let (cell, fraction, d_colour) = (s.cell, s.fraction, d_node.to_array());
                density_gradients.push(Record {
                    cell,
                    fraction,
                    basis: DENSITY_GRADIENT,
                    d_theta: 1.0,
                    d_colour,
                });
            }
        }
    }
}

/// dLoss/d(the reflection itself) from the adjoints of what it has shown.
fn adjoint(
    clearcoat: &Clearcoat<f32>,
    source: MirrorSource,
    mirrored: &MirroredSample,
) -> PartialReflectionAdjoint<f32> {
    let (of, d_share) = (&mirrored.of, mirrored.d_share);
    let (d_x, direction) = if source.reads_caches() {
        let stencil = clearcoat.radiance.stencil(of.position, of.direction);
        clearcoat.radiance.radiance_vjp(&stencil, of.direction, mirrored.d_mirrored)
    } else {
        (Vec3::zero(), Vec3::zero())
    };
    PartialReflectionAdjoint {
        position: d_x + clearcoat.strength_vjp(of.position, d_share * of.reflectance),
        direction,
        reflectance: d_share * clearcoat.strength_at(of.position),
    }
}
