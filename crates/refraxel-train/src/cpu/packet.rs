//! Some rays, what they meet, and what absorbs it: the memory that the stages of a pass share.

use super::absorption::{Absorbed, ShadedRay};
use super::mirrored::MirroredSample;
use super::sample::Samples;
use refraxel_core::optics::PartialReflection;
use refraxel_core::radiance::Filter;
use refraxel_core::{Medium, Path, Ray};

/// Rays marched before their samples are shaded: enough samples to prefetch across rays, few enough for the L2 cache.
pub(super) const PACKET: usize = 8;

/// What marching found of one ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct MarchedRay {
    /// End of its samples in the packet's.
    pub samples: usize,
    /// End of its mirrored samples in the packet's.
    pub mirrored: usize,
    /// Transmittance at its end.
    pub left: f32,
    /// The path bends.
    pub bent: bool,
    /// The ray that reaches the background.
    pub exit: Ray<f32>,
    /// What absorbs light from the background.
    pub through: Filter<f32>,
}

/// Some rays and what they meet. Memory of one thread, written over by the next packet.
#[derive(Default)]
pub(super) struct Packet {
    pub seen: Samples,
    pub rays: Vec<MarchedRay>,
    /// The bent paths, one per ray of the packet.
    pub paths: [Path<f32>; PACKET],
    pub mirrored: Vec<MirroredSample>,
    pub absorbed: Absorbed,
    /// Reflections of the path at hand.
    pub reflections: Vec<PartialReflection<f32>>,
}

impl Packet {
    /// Filters the colours of all bent rays.
    pub(super) fn absorb(&mut self, medium: &Medium<f32>) {
        let Self { seen, rays, paths, mirrored, absorbed, .. } = self;
        absorbed.clear();
        let (mut first, mut first_mirrored) = (0, 0);
        for (ray, path) in rays.iter_mut().zip(paths) {
            if ray.bent {
                absorbed.skip_to(first);
                let (samples, segments) = (&mut seen.samples[first..ray.samples], &seen.segments[..]);
                let shaded =
                    ShadedRay { samples, segments, mirrored: &mut mirrored[first_mirrored..ray.mirrored] };
                ray.through = absorbed.filter(medium, path, shaded);
            }
            (first, first_mirrored) = (ray.samples, ray.mirrored);
        }
    }
}
