//! Partial reflections of a packet's rays: what they show, and the way back, theory (7.5)–(7.8).
//!
//! Surfaces cut the samples of a ray into sections. From the back, a section is composited over what is behind it, and a
//! surface adds the light that it mirrors.

use super::march::Sample;
use super::tape::{CacheLookup, Tape};
use super::trace::MarchedSegment;
use crate::reflection::{MirrorSource, Reflection};
use refraxel_core::Path;
use refraxel_core::optics::{PartialReflection, PartialReflectionAdjoint, Tracer};
use refraxel_core::radiance::{mix, mix_vjp};
use std::ops::Range;

/// A partial reflection of a ray of the packet.
#[derive(Clone, Copy, Debug)]
pub(super) struct MirroredSample {
    pub of: PartialReflection<f32>,
    /// The packet's samples up to here lie before it.
    pub samples: usize,
    /// ρ R.
    share: f32,
    /// What is mirrored.
    pub mirrored: [f32; 3],
    /// What is seen behind the surface, and with what it mirrors.
    behind: [f32; 3],
    shown: [f32; 3],
    /// dLoss/dshown for a transmittance of 1 before it.
    d_shown: [f32; 3],
    /// dLoss/dmirrored and dLoss/dshare.
    d_mirrored: [f32; 3],
    d_share: f32,
}

impl MirroredSample {
    pub(super) fn new(of: PartialReflection<f32>, samples: usize, share: f32, mirrored: [f32; 3]) -> Self {
        let zero = [0.0; 3];
        Self {
            of,
            samples,
            share,
            mirrored,
            behind: zero,
            shown: zero,
            d_shown: zero,
            d_mirrored: zero,
            d_share: 0.0,
        }
    }

    /// dLoss/dmirrored and dLoss/dshare.
    pub(super) fn d(&self) -> ([f32; 3], f32) {
        (self.d_mirrored, self.d_share)
    }
}

/// The partial reflections of a ray whose samples are `range`, appended; those behind its last sample only if the ray is
/// not `opaque` there. What they mirror is read from the caches.
pub(super) fn find(
    reflection: &Reflection,
    (tracer, path): (&Tracer<f32>, &Path<f32>),
    (samples, marched, range): (&[Sample], &[MarchedSegment], Range<usize>),
    opaque: bool,
    (found, out): (&mut Vec<PartialReflection<f32>>, &mut Vec<MirroredSample>),
) {
    tracer.partial_reflections(path, found);
    let own = &samples[range.clone()];
    for of in found.iter() {
        let mirror = &reflection.mirrors[usize::from(of.region)];
        let before = own.partition_point(|s| marched[s.segment as usize].place as usize <= of.segment);
        if opaque && before == own.len() {
            break;
        }
        let mirrored = match reflection.source {
            MirrorSource::Learned | MirrorSource::Baked => {
                let cache = mirror.cache(of.from_inside);
                cache.radiance(&cache.stencil(of.position, of.direction))
            }
            MirrorSource::Exact | MirrorSource::Black => [0.0; 3],
        };
        out.push(MirroredSample::new(*of, range.start + before, mirror.strength * of.reflectance, mirrored));
    }
}

/// Samples over what is behind them, theory (3.10).
#[inline(always)]
fn over(samples: &[Sample], mut behind: [f32; 3]) -> [f32; 3] {
    for s in samples.iter().rev() {
        for c in 0..3 {
            behind[c] += s.alpha * (s.colour[c] - behind[c]);
        }
    }
    behind
}

/// What a ray shows whose samples are `range` of the packet's, theory (7.5).
pub(super) fn composite(
    samples: &[Sample],
    range: Range<usize>,
    mirrored_samples: &mut [MirroredSample],
    behind: [f32; 3],
) -> [f32; 3] {
    let (mut seen, mut end) = (behind, range.end);
    for g in mirrored_samples.iter_mut().rev() {
        g.behind = over(&samples[g.samples..end], seen);
        g.shown = mix(g.share, g.mirrored, g.behind);
        (seen, end) = (g.shown, g.samples);
    }
    over(&samples[range.start..end], seen)
}

/// From the front: dLoss/dshown of every surface given dLoss/dC, theory (7.6); dLoss/d(background) for a transmittance of 1.
/// Notes what the caches and strengths receive.
pub(super) fn look_back(
    (samples, first): (&[Sample], usize),
    mirrored_samples: &mut [MirroredSample],
    d_colour: [f32; 3],
    tape: &mut Tape,
) -> [f32; 3] {
    let mut d_seen = d_colour;
    for g in mirrored_samples {
        let before = samples[first..g.samples].last().map_or(1.0, |s| s.before * (1.0 - s.alpha));
        let d = mix_vjp(g.share, g.mirrored, g.behind, d_seen);
        g.d_shown = d_seen;
        g.d_mirrored = d.mirrored.map(|v| before * v);
        g.d_share = before * d.share;
        d_seen = d.behind;
        tape.lookups.push(CacheLookup {
            region: g.of.region.into(),
            inner: g.of.from_inside,
            x: g.of.position,
            direction: g.of.direction,
            d_radiance: g.d_mirrored,
            d_strength: g.d_share * g.of.reflectance,
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

/// The sections of a ray, from the back.
pub(super) fn sections<'a>(
    range: Range<usize>,
    mirrored_samples: &'a [MirroredSample],
    (d_exit, behind): ([f32; 3], [f32; 3]),
    d_colour: [f32; 3],
) -> impl Iterator<Item = Section> + 'a {
    let n = mirrored_samples.len();
    (0..=n).rev().map(move |k| Section {
        samples: if k == 0 { range.start } else { mirrored_samples[k - 1].samples }
            ..mirrored_samples.get(k).map_or(range.end, |g| g.samples),
        d_colour: mirrored_samples.get(k).map_or(if n == 0 { d_colour } else { d_exit }, |g| g.d_shown),
        behind: mirrored_samples.get(k).map_or(behind, |g| g.shown),
    })
}

/// dLoss/d(partial reflections) of a ray, theory (7.4): what the path's adjoint starts from.
pub(super) fn reflection_adjoints(
    reflection: &Reflection,
    mirrored_samples: &[MirroredSample],
    out: &mut Vec<PartialReflectionAdjoint<f32>>,
) {
    out.clear();
    for g in mirrored_samples {
        let mirror = &reflection.mirrors[usize::from(g.of.region)];
        let mut d =
            PartialReflectionAdjoint { reflectance: g.d_share * mirror.strength, ..Default::default() };
        if matches!(reflection.source, MirrorSource::Learned | MirrorSource::Baked) {
            let (cache, direction) = (mirror.cache(g.of.from_inside), g.of.direction);
            let stencil = cache.stencil(g.of.position, direction);
            (d.position, d.direction) = cache.radiance_vjp(&stencil, direction, g.d_mirrored);
        }
        out.push(d);
    }
}
