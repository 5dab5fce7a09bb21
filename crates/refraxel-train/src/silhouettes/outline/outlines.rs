//! The silhouettes of all views, prepared for carving.

use super::view::{Outline, Silhouette, map_size};
use crate::cancel::Cancel;
use rayon::prelude::*;
use refraxel_core::{Camera, Vec3};
use std::sync::Arc;

/// Silhouettes prepared for carving: signed distances to their contours, and what hides them.
///
/// Both maps have one value per sample, which stands for a square of pixels. Their memory stays
/// below [`MAP_BYTES`] however many views there are and however large they are.
#[derive(Clone, Debug)]
pub struct Outlines {
    pub(super) views: Vec<Arc<Outline>>,
    /// Once cancelled, hulls end early and mean nothing.
    pub(super) cancel: Cancel,
}

/// Longest edge of a map [sample]: larger masks are reduced first, by averages of coverage, which keeps the contour
/// accurate to 0.06 samples.
pub(super) const MAP_SIZE: usize = 640;
/// Most memory of all maps together [byte]. Many large views share it by having smaller maps.
pub const MAP_BYTES: u64 = 256 << 20;
/// Bytes of a sample: a distance to the contour and one to what hides, in f32.
const SAMPLE_BYTES: u64 = 8;
/// Least edge of a map [sample].
const LEAST_SIZE: usize = 32;

impl Outlines {
    /// Maps of all silhouettes, on all threads: about 50 ms per million samples of the maps and core.
    ///
    /// Each thread needs 60 bytes per sample of one map beside the result, at most 25 MB.
    ///
    /// # Panics
    /// If the coverage of a silhouette does not have one value per pixel of its mask, or its occluders are those of an
    /// image of another size.
    pub fn new(silhouettes: &[Silhouette]) -> Self {
        Self::with_maps(silhouettes, longest(silhouettes.len()))
    }

    /// The same outlines, whose hulls end early once somebody wishes to stop. What they return then means nothing.
    #[must_use]
    pub fn cancelled_by(self, cancel: &Cancel) -> Self {
        Self { cancel: cancel.clone(), ..self }
    }

    /// True once nobody is interested in the result any more.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// The wish to stop.
    pub(crate) fn cancel(&self) -> &Cancel {
        &self.cancel
    }

    /// [`Self::new`] with maps of at most `longest` samples along an edge.
    pub(crate) fn with_maps(silhouettes: &[Silhouette], longest: usize) -> Self {
        let views = silhouettes.par_iter().map(|s| Arc::new(Outline::new(s, longest))).collect();
        Self { views, cancel: Cancel::new() }
    }

    /// The same outlines without some views; the maps of the others are shared.
    pub(in crate::silhouettes) fn only(&self, keep: &[bool]) -> Self {
        let kept = self.views.iter().zip(keep).filter(|(_, keep)| **keep);
        Self { views: kept.map(|(view, _)| Arc::clone(view)).collect(), cancel: self.cancel.clone() }
    }

    pub(in crate::silhouettes) fn views(&self) -> &[Arc<Outline>] {
        &self.views
    }

    /// Memory of the maps.
    #[cfg(test)]
    pub fn bytes(&self) -> u64 {
        let of = |v: &Arc<Outline>| v.distance.len() + v.occluded.as_ref().map_or(0, Vec::len);
        self.views.iter().map(|v| 4 * of(v) as u64).sum()
    }

    /// Memory of the maps of masks of these sizes [pixel], where occluders are known.
    pub fn bytes_for(masks: &[[u32; 2]]) -> u64 {
        let samples = |image: &[u32; 2]| {
            let size = map_size(image.map(|n| n as usize), longest(masks.len())).1;
            (size[0] * size[1]) as u64
        };
        masks.iter().map(|image| SAMPLE_BYTES * samples(image)).sum()
    }

    /// The cameras of the views.
    pub(crate) fn cameras(&self) -> impl Iterator<Item = &Camera> {
        self.views.iter().map(|v| &v.camera)
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.views.len()
    }
    /// True without views.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// True when no mask shows anything.
    pub(in crate::silhouettes) fn all_empty(&self) -> bool {
        self.views.iter().all(|v| v.distance.iter().all(|&d| d > 0.0))
    }

    /// What the views say about each of `points`: `report` is told the point's number and one signed distance
    /// [scene unit] per view that sees it, in order of the views. A view abstains, with an infinite distance, whose line
    /// of sight misses the mask but is hidden at the point, more than `margin` [scene unit] behind something opaque.
    pub(crate) fn ask(
        &self,
        points: &[Vec3<f32>],
        margin: f32,
        votes: &mut Vec<f32>,
        mut report: impl FnMut(usize, &mut [f32]),
    ) {
        // View by view, so that the part of a map that the points fall on stays in the cache.
        votes.clear();
        votes.resize(points.len() * self.views.len(), f32::NAN);
        for (v, view) in self.views.iter().enumerate() {
            for (k, &x) in points.iter().enumerate() {
                if let Some(d) = view.distance_at(x, margin) {
                    votes[k * self.views.len() + v] = d;
                }
            }
        }
        for (k, all) in votes.chunks_exact_mut(self.views.len().max(1)).enumerate() {
            let mut cast = 0;
            for v in 0..all.len() {
                if !all[v].is_nan() {
                    all[cast] = all[v];
                    cast += 1;
                }
            }
            report(k, &mut all[..cast]);
        }
    }
}

/// Longest edge of the maps of so many views [sample], such that they need at most [`MAP_BYTES`].
fn longest(views: usize) -> usize {
    let samples = MAP_BYTES / SAMPLE_BYTES / views.max(1) as u64;
    (samples.isqrt() as usize).clamp(LEAST_SIZE, MAP_SIZE)
}
