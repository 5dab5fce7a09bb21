//! Mirrored samples: what the surfaces on a ray's path mirror, and the way back, theory (7.5)–(7.8).
//!
//! Surfaces cut the samples of a ray into sections. From the back, a section is composited over what is behind it, and a
//! surface adds the light that it mirrors.

use super::record::CacheLookup;
use super::sample::{RaySamples, Sample, over};
use crate::model::{CacheId, Reflection};
use refraxel_core::Path;
use refraxel_core::optics::{PartialReflection, PartialReflectionAdjoint, Tracer};
use refraxel_core::radiance::{Filter, Filtered, Pixel, mix, mix_vjp};
use std::ops::Range;

/// What one surface mirrors into a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct MirroredSample {
    pub of: PartialReflection<f32>,
    /// The ray's samples up to here lie before it.
    pub samples: usize,
    /// ρ R.
    share: f32,
    /// The mirrored light, behind what absorbs before the surface.
    pub mirrored: Filtered<f32>,
    /// What is seen behind the surface, and with what it mirrors.
    behind: [f32; 3],
    shown: [f32; 3],
    /// dLoss/dshown for a transmittance of 1 before it.
    d_shown: [f32; 3],
    /// dLoss/d(mirrored light, before what absorbs) and dLoss/dshare.
    pub d_mirrored: [f32; 3],
    pub d_share: f32,
    /// dLoss/d(thickness of what absorbs before the surface).
    pub d_thickness: [f32; 3],
}

impl MirroredSample {
    pub(super) fn new(of: PartialReflection<f32>, samples: usize, share: f32, mirrored: [f32; 3]) -> Self {
        let zero = [0.0; 3];
        Self {
            of,
            samples,
            share,
            mirrored: Filtered::unfiltered(mirrored),
            behind: zero,
            shown: zero,
            d_shown: zero,
            d_mirrored: zero,
            d_share: 0.0,
            d_thickness: zero,
        }
    }

    /// The mirrored light passes what absorbs between the camera and the surface.
    pub(super) fn filter(&mut self, filter: &Filter<f32>) {
        self.mirrored = filter.through(self.mirrored.colour);
    }
}

/// Append the mirrored samples of a bent ray; those behind its last sample only if the ray is not `opaque` there. What they
/// mirror is read from the caches. `found` is memory for the path's reflections.
pub(super) fn find(
    reflection: &Reflection,
    path: &TracedPath,
    ray: RaySamples,
    found: &mut Vec<PartialReflection<f32>>,
    out: &mut Vec<MirroredSample>,
) {
    path.tracer.partial_reflections(path.path, found);
    for of in found.iter() {
        let mirror = &reflection.mirrors[usize::from(of.region)];
        let before = ray.samples.partition_point(|s| ray.segment_of(s).place as usize <= of.segment);
        if path.opaque && before == ray.samples.len() {
            break;
        }
        let mirrored = if reflection.source.reads_caches() {
            let cache = reflection.cache(CacheId::read_by(of));
            cache.radiance(&cache.stencil(of.position, of.direction))
        } else {
            [0.0; 3]
        };
        out.push(MirroredSample::new(*of, before, mirror.strength * of.reflectance, mirrored));
    }
}

/// A bent path, and whether matter ends the ray on it.
pub(super) struct TracedPath<'a> {
    pub tracer: &'a Tracer<'a, f32>,
    pub path: &'a Path<f32>,
    pub opaque: bool,
}

/// What a ray of these samples shows before `behind`, theory (7.5).
#[inline(always)]
pub(super) fn composite(samples: &[Sample], mirrored: &mut [MirroredSample], behind: [f32; 3]) -> [f32; 3] {
    let (mut seen, mut end) = (behind, samples.len());
    for m in mirrored.iter_mut().rev() {
        m.behind = over(&samples[m.samples..end], seen);
        m.shown = mix(m.share, m.mirrored.colour, m.behind);
        (seen, end) = (m.shown, m.samples);
    }
    over(&samples[..end], seen)
}

/// From the front: dLoss/dshown of every surface given dLoss/dC, theory (7.6); returns dLoss/d(background) for a
/// transmittance of 1. Notes what the caches and strengths receive.
pub(super) fn look_back(
    samples: &[Sample],
    mirrored: &mut [MirroredSample],
    d_colour: [f32; 3],
    lookups: &mut Vec<CacheLookup>,
) -> [f32; 3] {
    let mut d_seen = d_colour;
    for m in mirrored {
        let before = samples[..m.samples].last().map_or(1.0, |s| s.before * (1.0 - s.alpha));
        let d = mix_vjp(m.share, m.mirrored.colour, m.behind, d_seen);
        m.d_shown = d_seen;
        let d_filter = m.mirrored.vjp(d.mirrored.map(|v| before * v));
        (m.d_mirrored, m.d_thickness) = (d_filter.colour, d_filter.thickness);
        m.d_share = before * d.share;
        d_seen = d.behind;
        lookups.push(CacheLookup {
            surface: m.of.region,
            cache: CacheId::read_by(&m.of),
            x: m.of.position,
            direction: m.of.direction,
            d_radiance: m.d_mirrored,
            d_strength: m.d_share * m.of.reflectance,
        });
    }
    d_seen
}

/// A section of a ray: its samples, dLoss/dcolour for a transmittance of 1 before the ray, and what is behind.
pub(super) struct Section {
    pub samples: Range<usize>,
    pub d_colour: [f32; 3],
    pub behind: [f32; 3],
}

/// What a whole ray shows: dLoss/dC, dLoss/d(what the background shows) for a transmittance of 1, and what it shows.
#[derive(Clone, Copy)]
pub(super) struct ShownAdjoint {
    pub d_colour: [f32; 3],
    pub d_exit: [f32; 3],
    pub behind: [f32; 3],
}

/// The sections of a ray of `count` samples, from the back.
#[inline(always)]
pub(super) fn sections(
    count: usize,
    mirrored: &[MirroredSample],
    d: ShownAdjoint,
) -> impl Iterator<Item = Section> + '_ {
    let n = mirrored.len();
    (0..=n).rev().map(move |k| Section {
        samples: if k == 0 { 0 } else { mirrored[k - 1].samples }
            ..mirrored.get(k).map_or(count, |m| m.samples),
        d_colour: mirrored.get(k).map_or(if n == 0 { d.d_colour } else { d.d_exit }, |m| m.d_shown),
        behind: mirrored.get(k).map_or(d.behind, |m| m.shown),
    })
}

/// dLoss/d(partial reflections) of a ray, theory (7.4): what the path's adjoint starts from.
pub(super) fn reflection_adjoints(
    reflection: &Reflection,
    mirrored: &[MirroredSample],
    out: &mut Vec<PartialReflectionAdjoint<f32>>,
) {
    out.clear();
    for m in mirrored {
        let mirror = &reflection.mirrors[usize::from(m.of.region)];
        let mut d =
            PartialReflectionAdjoint { reflectance: m.d_share * mirror.strength, ..Default::default() };
        if reflection.source.reads_caches() {
            let (cache, direction) = (reflection.cache(CacheId::read_by(&m.of)), m.of.direction);
            let stencil = cache.stencil(m.of.position, direction);
            (d.position, d.direction) = cache.radiance_vjp(&stencil, direction, m.d_mirrored);
        }
        out.push(d);
    }
}

/// C + T B of a ray, with what surfaces mirror: theory (3.9), (7.5).
#[inline(always)]
pub(super) fn shown(
    samples: &[Sample],
    mirrored: &mut [MirroredSample],
    pixel: &Pixel<f32>,
    behind: [f32; 3],
) -> [f32; 3] {
    if !mirrored.is_empty() {
        return composite(samples, mirrored, behind);
    }
    [0, 1, 2].map(|c| pixel.colour[c] + pixel.transmittance * behind[c])
}
