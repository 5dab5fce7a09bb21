//! What one view says about where a refractive object can be.

use super::contour::signed_distance;
use crate::cancel::Cancel;
use rayon::prelude::*;
use refraxel_core::{Camera, Lens, Vec3};
use refraxel_data::Mask;

/// The silhouette of the refractive objects in one view.
#[derive(Clone, Debug)]
pub struct Silhouette {
    /// The view. Its size is scaled to that of the mask where they differ.
    pub camera: Camera,
    /// Coverage by refractive objects as the first thing hit.
    pub mask: Mask,
    /// Per pixel of the mask the distance from the camera [scene unit] beyond which something opaque hides everything;
    /// infinite where nothing does. Known from a fit of the surroundings; `None`: nothing is hidden.
    pub occluded_beyond: Option<Vec<f32>>,
}

/// Silhouettes prepared for carving: signed distances to their contours.
#[derive(Clone, Debug)]
pub struct Outlines {
    views: Vec<Outline>,
    /// Once cancelled, hulls end early and mean nothing.
    cancel: Cancel,
}

/// Longest edge of a distance map [sample]: larger masks are thinned, which costs nothing where distances are smooth.
const MAP_SIZE: usize = 640;

#[derive(Clone, Debug)]
struct Outline {
    camera: Camera,
    centre: Vec3<f32>,
    /// Rows of `camera_from_world` for a pinhole, scaled to pixels.
    pinhole: Option<[Vec3<f32>; 3]>,
    /// 1 / focal length, the geometric mean of both.
    per_pixel: f32,
    /// Signed distance [pixel] at the centres of every `stride`-th pixel, and what hides there.
    distance: Vec<f32>,
    occluded: Option<Vec<f32>>,
    stride: usize,
    size: [usize; 2],
}

impl Outlines {
    /// Distance maps of all silhouettes, on all threads: about 50 ms per megapixel and core.
    ///
    /// # Panics
    /// If the coverage or `occluded_beyond` of a silhouette does not have one value per pixel of its mask.
    pub fn new(silhouettes: &[Silhouette]) -> Self {
        Self::with_maps(silhouettes, MAP_SIZE)
    }

    /// The same outlines, whose hulls end early once somebody wishes to stop. What they return then means nothing.
    #[must_use]
    pub fn cancelled_by(self, cancel: &Cancel) -> Self {
        Self { cancel: cancel.clone(), ..self }
    }

    /// True once nobody is interested in the result any more.
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// [`Self::new`] with maps of at most `longest` samples along an edge.
    pub(super) fn with_maps(silhouettes: &[Silhouette], longest: usize) -> Self {
        let views = silhouettes.par_iter().map(|s| Outline::new(s, longest)).collect();
        Self { views, cancel: Cancel::new() }
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
    pub(super) fn all_empty(&self) -> bool {
        self.views.iter().all(|v| v.distance.iter().all(|&d| d > 0.0))
    }

    /// What the views say about each of `points`: `report` is told the point's number and one signed distance
    /// [scene unit] per view that sees it, in order of the views. A view abstains, with an infinite distance, whose line
    /// of sight misses the mask but is hidden at the point, more than `margin` [scene unit] behind something opaque.
    pub(super) fn ask(
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

impl Outline {
    fn new(silhouette: &Silhouette, longest: usize) -> Self {
        let mask = &silhouette.mask;
        let full = [mask.width as usize, mask.height as usize];
        assert_eq!(mask.coverage.len(), full[0] * full[1], "one coverage per pixel");
        let camera = silhouette.camera.resized(mask.width, mask.height);
        let stride = full[0].max(full[1]).div_ceil(longest).max(1);
        let size = full.map(|n| n.div_ceil(stride));
        let at = |i: usize| (i / size[0] * full[0] + i % size[0]) * stride;
        let distance = signed_distance(&mask.coverage, full);
        let distance = (0..size[0] * size[1]).map(|i| distance[at(i)]).collect();
        let occluded = silhouette.occluded_beyond.as_deref().map(|beyond| {
            assert_eq!(beyond.len(), full[0] * full[1], "one distance per pixel");
            nearest_occluder(beyond, full, stride)
        });
        let pose = &camera.world_from_camera;
        let [x, y, z] = pose.rotation.columns;
        let [fx, fy] = camera.focal;
        let pinhole = (camera.lens == Lens::Pinhole).then(|| [x * fx, y * fy, z].map(Vec3::cast));
        let per_pixel = (1.0 / (fx * fy).abs().sqrt()) as f32;
        Self { centre: pose.translation.cast(), camera, pinhole, per_pixel, distance, occluded, stride, size }
    }

    /// Pixel coordinates of the point at `d` from the camera, and what one pixel covers there [scene unit].
    #[inline]
    fn project(&self, d: Vec3<f32>) -> Option<([f32; 2], f32)> {
        if let Some(rows) = &self.pinhole {
            let (z, c) = (rows[2].dot(d), self.camera.center);
            let inv = z.recip();
            return (z > 0.0).then(|| {
                ([rows[0].dot(d) * inv + c[0] as f32, rows[1].dot(d) * inv + c[1] as f32], z * self.per_pixel)
            });
        }
        let pixel = self.camera.project(self.camera.world_from_camera.translation + d.cast())?;
        Some((pixel.map(|p| p as f32), d.length() * self.per_pixel))
    }

    /// Signed distance [scene unit] to the cone of the silhouette: that in the image times the footprint of a pixel at
    /// the point's depth. To first order in the distance from the cone, and up to the cosine of the edge's angle from the
    /// axis (6 % at the border of a field of view of 40°). `None`: out of the picture. Infinite: hidden.
    #[inline]
    fn distance_at(&self, x: Vec3<f32>, margin: f32) -> Option<f32> {
        let d = x - self.centre;
        let ([u, v], footprint) = self.project(d)?;
        let inside = u >= 0.0 && v >= 0.0 && u <= self.camera.width as f32 && v <= self.camera.height as f32;
        if !inside {
            return None;
        }
        let s = (self.stride as f32).recip();
        let clamp = |p: f32, n: usize| ((p - 0.5) * s).clamp(0.0, (n - 1) as f32);
        let (u, v) = (clamp(u, self.size[0]), clamp(v, self.size[1]));
        let pixels = self.bilinear(u, v);
        let is_hidden = |beyond: &Vec<f32>| {
            let nearest = (v + 0.5) as usize * self.size[0] + (u + 0.5) as usize;
            d.length() > beyond[nearest] + margin
        };
        let abstains = pixels > 0.0 && self.occluded.as_ref().is_some_and(is_hidden);
        Some(if abstains { f32::INFINITY } else { pixels * footprint })
    }

    #[inline]
    fn bilinear(&self, u: f32, v: f32) -> f32 {
        let [w, h] = self.size;
        let (x, y) = (u as usize, v as usize);
        let (fx, fy) = (u - x as f32, v - y as f32);
        let (right, below) = (usize::from(x + 1 < w), if y + 1 < h { w } else { 0 });
        let i = y * w + x;
        let m = &self.distance;
        let top = m[i] + (m[i + right] - m[i]) * fx;
        let bottom = m[i + below] + (m[i + below + right] - m[i + below]) * fx;
        top + (bottom - top) * fy
    }
}

/// The nearest occluder within a pixel of the area that each sample stands for: the edge of a mask that was cut by an
/// occluder lies on mixed pixels, where either may be seen.
fn nearest_occluder(beyond: &[f32], [width, height]: [usize; 2], stride: usize) -> Vec<f32> {
    let reach = stride / 2 + 1;
    let range = |p: usize, n: usize| p.saturating_sub(reach)..(p + reach + 1).min(n);
    let mut samples = Vec::with_capacity(width.div_ceil(stride) * height.div_ceil(stride));
    for y in (0..height).step_by(stride) {
        for x in (0..width).step_by(stride) {
            let rows = range(y, height).flat_map(|y| &beyond[y * width..][range(x, width)]);
            samples.push(rows.copied().fold(f32::INFINITY, f32::min));
        }
    }
    samples
}
