//! Samples of rays, and the segments that they lie on.

use super::layout::Lanes;
use refraxel_core::Vec3;
use refraxel_core::grid::Cell;
use refraxel_core::radiance::{Pixel, Segment};
use std::ops::Range;

/// A quadrature point that matters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Voxels around the point and their weights.
    pub corners: [u32; 8],
    pub weights: [f32; 8],
    /// The same, as cell and position within it.
    pub cell: Cell,
    pub fraction: Vec3<f32>,
    /// Which marched segment of the packet it lies on, and the midpoint's parameter there [scene unit].
    pub segment: u32,
    pub t: f32,
    /// Optical depth τ, dτ/dθ, opacity 1 − e^(−τ), and the transmittance in front.
    pub tau: f32,
    pub slope: f32,
    pub alpha: f32,
    pub before: f32,
    /// Colour; filled by shading.
    pub colour: [f32; 3],
    /// dLoss/d(T a) beyond what the colour explains.
    pub d_weight: f32,
}

impl Sample {
    /// A sample of nothing.
    pub(super) const BLANK: Self = Self {
        corners: [0; 8],
        weights: [0.0; 8],
        cell: Cell { slot: 0, local: 0 },
        fraction: Vec3 { x: 0.0, y: 0.0, z: 0.0 },
        segment: 0,
        t: 0.0,
        tau: 0.0,
        slope: 0.0,
        alpha: 0.0,
        before: 0.0,
        colour: [0.0; 3],
        d_weight: 0.0,
    };
}

/// A segment that has samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct MarchedSegment {
    pub segment: Segment<f32>,
    /// Which segment of its path.
    pub place: u32,
    pub unit: Vec3<f32>,
    /// |p|.
    pub speed: f32,
    /// Arc length of the path up to t = 0 [scene unit].
    pub arc: f32,
    /// SH basis of the direction.
    pub basis: Lanes,
}

/// The samples of one ray, from the front, and the marched segments of its packet.
#[derive(Clone, Copy)]
pub(super) struct RaySamples<'a> {
    pub samples: &'a [Sample],
    pub segments: &'a [MarchedSegment],
}

impl<'a> RaySamples<'a> {
    /// The segment that a sample lies on.
    #[inline(always)]
    pub(super) fn segment_of(&self, s: &Sample) -> &'a MarchedSegment {
        &self.segments[s.segment as usize]
    }

    /// C = Σ T a c over the samples, theory (3.9).
    #[inline(always)]
    pub(super) fn composite(&self, transmittance: f32) -> Pixel<f32> {
        let mut pixel = Pixel { colour: [0.0; 3], transmittance, depth: 0.0 };
        for s in self.samples {
            let weight = s.before * s.alpha;
            for c in 0..3 {
                pixel.colour[c] += weight * s.colour[c];
            }
            let on = self.segment_of(s);
            pixel.depth += weight * (on.arc + on.speed * s.t);
        }
        pixel
    }
}

/// The samples of some rays and the segments that they lie on.
#[derive(Default)]
pub(super) struct Samples {
    pub samples: Vec<Sample>,
    pub segments: Vec<MarchedSegment>,
}

impl Samples {
    pub(super) fn clear(&mut self) {
        self.samples.clear();
        self.segments.clear();
    }

    /// The samples of one ray.
    #[inline(always)]
    pub(super) fn of(&self, range: Range<usize>) -> RaySamples<'_> {
        RaySamples { samples: &self.samples[range], segments: &self.segments }
    }
}

/// Samples over what lies behind them, theory (3.10).
#[inline(always)]
pub(super) fn over(samples: &[Sample], mut behind: [f32; 3]) -> [f32; 3] {
    for s in samples.iter().rev() {
        for c in 0..3 {
            behind[c] += s.alpha * (s.colour[c] - behind[c]);
        }
    }
    behind
}
