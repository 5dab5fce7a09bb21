//! What bodies on a ray's path absorb, theory (7.17)–(7.20): the colours of samples, of mirrored light and of the background
//! are filtered once they are shaded. On the way back, dLoss/dcolour passes the filters and leaves dLoss/dthickness.

use super::mirrored::MirroredSample;
use super::packet::{Absorbed, Packet};
use super::record::Record;
use super::sample::{MarchedSegment, RaySamples, Sample};
use super::tape::Tape;
use crate::backend::AbsorptionObjective;
use crate::descent;
use crate::model::{IndexMoments, Refraction};
use refraxel_core::radiance::{AbsorptionAdjoint, Filter, Filtered, SegmentAdjoint};
use refraxel_core::{Medium, Path};

/// The stage of absorption: filters the colours of all bent rays.
pub(super) fn absorb(medium: &Medium<f32>, packet: &mut Packet) {
    let Packet { seen, rays, paths, mirrored, absorbed, .. } = packet;
    absorbed.clear();
    for (ray, path) in rays.iter_mut().zip(paths).filter(|(ray, _)| ray.bent) {
        absorbed.skip_to(ray.samples.start);
        let (samples, segments) = (&mut seen.samples[ray.samples.clone()], &seen.segments[..]);
        let shaded = ShadedRay { samples, segments, mirrored: &mut mirrored[ray.mirrored.clone()] };
        ray.through = absorbed.filter(medium, path, shaded);
    }
}

/// A bent ray whose samples and mirrored samples have their colours, and the marched segments of its packet.
pub(super) struct ShadedRay<'a> {
    pub samples: &'a mut [Sample],
    pub segments: &'a [MarchedSegment],
    pub mirrored: &'a mut [MirroredSample],
}

impl Absorbed {
    pub(super) fn clear(&mut self) {
        self.filtered.clear();
    }

    /// Passes over the samples before number `end`: they lie on straight rays, where nothing absorbs.
    pub(super) fn skip_to(&mut self, end: usize) {
        self.filtered.resize(end, Filter::clear().through([0.0; 3]));
    }

    /// The filtered colours of the samples of a ray.
    pub(super) fn of(&self, range: std::ops::Range<usize>) -> &[Filtered<f32>] {
        self.filtered.get(range).unwrap_or(&[])
    }

    /// Filters the colours of the next bent ray; what filters its background.
    pub(super) fn filter(&mut self, medium: &Medium<f32>, path: &Path<f32>, ray: ShadedRay) -> Filter<f32> {
        self.along.follow(medium, path);
        let mut constant: Option<(usize, Filter<f32>)> = None;
        for s in ray.samples {
            let place = ray.segments[s.segment as usize].place as usize;
            let filter = match constant {
                Some((known, filter)) if known == place => filter,
                _ => self.along.filter(place, s.t),
            };
            constant = self.along.is_constant(place).then_some((place, filter));
            let filtered = filter.through(s.colour);
            s.colour = filtered.colour;
            self.filtered.push(filtered);
        }
        for m in ray.mirrored {
            m.filter(&self.along.after(m.of.segment));
        }
        self.along.whole()
    }
}

/// What the way back through the filters of a ray starts from.
pub(super) struct FilteredRay<'a> {
    pub medium: &'a Medium<f32>,
    pub path: &'a Path<f32>,
    pub samples: RaySamples<'a>,
    pub filtered: &'a [Filtered<f32>],
    pub mirrored: &'a [MirroredSample],
    /// dLoss/d(thickness of the whole path).
    pub d_whole: [f32; 3],
}

/// dLoss/d(thickness) along a path, and what its segments receive. Memory of one thread.
#[derive(Default)]
pub(super) struct LengthAdjoint {
    adjoint: AbsorptionAdjoint<f32>,
    pub segments: Vec<SegmentAdjoint<f32>>,
}

impl FilteredRay<'_> {
    /// The way back of the stage: turns dLoss/d(filtered colour) of the samples' `records` into that of the colour, theory (7.19). Adds what the
    /// coefficients receive to those of the tape, and notes what the segments do, theory (7.20). Gives the number of segments
    /// that were left out since their derivative overflowed.
    pub(super) fn absorb_vjp(
        &self,
        records: &mut [Record],
        coefficients: &mut [[f64; 3]],
        out: &mut LengthAdjoint,
    ) -> u64 {
        let LengthAdjoint { adjoint, segments } = out;
        adjoint.clear(self.path.segments.len());
        for ((s, r), f) in self.samples.samples.iter().zip(records).zip(self.filtered) {
            let place = self.samples.segment_of(s).place as usize;
            let d = f.vjp(r.d_colour);
            adjoint.add(place, s.t, d.thickness);
            r.d_colour = d.colour;
        }
        for m in self.mirrored {
            adjoint.add_after(m.of.segment, m.d_thickness);
        }
        adjoint.add_after(usize::MAX, self.d_whole);
        segments.clear();
        segments.resize(self.path.segments.len(), SegmentAdjoint::default());
        let mut overflows = 0;
        adjoint.vjp(self.medium, self.path, segments, |region, d| {
            if d.iter().all(|d| d.is_finite()) {
                (0..3).for_each(|c| coefficients[region][c] += f64::from(d[c]));
            } else {
                overflows += 1; // a path so chaotic that its length overflowed says nothing
            }
        });
        overflows
    }
}

/// The gradient of all regions' coefficients, in the order of the tapes.
pub(super) fn gradient(regions: usize, tapes: &[Tape]) -> Vec<[f64; 3]> {
    let mut sums = vec![[0.0; 3]; regions];
    for tape in tapes {
        for (sum, part) in sums.iter_mut().zip(&tape.absorption) {
            (0..3).for_each(|c| sum[c] += part[c]);
        }
    }
    sums
}

/// One step of every region; false when a coefficient left the finite numbers.
pub(super) fn update(
    refraction: &mut Refraction,
    moments: &mut [IndexMoments],
    tapes: &[Tape],
    objective: &AbsorptionObjective,
) -> bool {
    let gradients = gradient(moments.len(), tapes);
    descent::update_absorption(refraction, moments, &gradients, objective)
}
