//! The silhouette of one view, and its maps: how far it is, and what hides it.

use crate::rays::MaskedView;
use crate::silhouettes::contour::signed_distance;
use crate::silhouettes::occluders::Occluders;
use refraxel_core::{Camera, Lens, Ray, Vec3};
use refraxel_data::Mask;
use std::sync::Arc;

/// The silhouette of the refractive objects in one view.
#[derive(Clone, Debug)]
pub struct Silhouette {
    /// The view. Its size is scaled to that of the mask where they differ.
    pub camera: Camera,
    /// Coverage by refractive objects as the first thing hit, shared with the photograph.
    pub mask: Arc<Mask>,
    /// What stands in front, known from a fit of the surroundings; `None`: nothing is hidden.
    pub occluders: Option<Occluders>,
}

impl Silhouette {
    /// That of a view with a mask.
    pub(crate) fn of(view: &MaskedView, occluders: Option<Occluders>) -> Self {
        Self { camera: *view.camera, mask: view.mask.clone(), occluders }
    }
}

/// The silhouette of one view as maps.
#[derive(Clone, Debug)]
pub(in crate::silhouettes) struct Outline {
    pub(super) camera: Camera,
    centre: Vec3<f32>,
    /// Rows of `camera_from_world` for a pinhole, scaled to pixels.
    pinhole: Option<[Vec3<f32>; 3]>,
    /// 1 / focal length, the geometric mean of both.
    pub(super) per_pixel: f32,
    /// Signed distance [pixel] at the centres of squares of `stride` pixels, and the nearest that hides there.
    pub(super) distance: Vec<f32>,
    pub(super) occluded: Option<Vec<f32>>,
    pub(super) stride: usize,
    pub(super) size: [usize; 2],
}

/// Edge of the squares of pixels that samples stand for, and the samples per row and column.
pub(super) fn map_size(image: [usize; 2], longest: usize) -> (usize, [usize; 2]) {
    let stride = image[0].max(image[1]).div_ceil(longest).max(1);
    (stride, image.map(|n| n.div_ceil(stride)))
}

impl Outline {
    pub(super) fn new(silhouette: &Silhouette, longest: usize) -> Self {
        let mask = &silhouette.mask;
        let full = [mask.width as usize, mask.height as usize];
        assert_eq!(mask.coverage.len(), full[0] * full[1], "one coverage per pixel");
        let camera = silhouette.camera.resized(mask.width, mask.height);
        let (stride, size) = map_size(full, longest);
        let distance = if stride == 1 {
            signed_distance(&mask.coverage, full)
        } else {
            let mut distance = signed_distance(&averages(&mask.coverage, full, stride), size);
            distance.iter_mut().for_each(|d| *d *= stride as f32);
            distance
        };
        let occluded = silhouette.occluders.as_ref().map(|occluders| {
            assert_eq!(occluders.image(), full, "occluders in the same image");
            nearest_occluder(occluders, stride, size)
        });
        let pose = &camera.world_from_camera;
        let [x, y, z] = pose.rotation.columns;
        let [fx, fy] = camera.focal;
        let pinhole = (camera.lens == Lens::Pinhole).then(|| [x * fx, y * fy, z].map(Vec3::cast));
        let per_pixel = (1.0 / (fx * fy).abs().sqrt()) as f32;
        Self { centre: pose.translation.cast(), camera, pinhole, per_pixel, distance, occluded, stride, size }
    }

    /// The same view with other distances.
    pub(super) fn with(&self, distance: Vec<f32>) -> Self {
        Self { distance, ..self.clone() }
    }

    /// Number of samples of the maps.
    pub(in crate::silhouettes) fn samples(&self) -> usize {
        self.distance.len()
    }

    /// Whether the mask shows something refractive at a sample.
    pub(in crate::silhouettes) fn shows(&self, sample: usize) -> bool {
        self.distance[sample] <= 0.0
    }

    /// The distance beyond which everything is hidden at a sample [scene unit].
    pub(in crate::silhouettes) fn occluded_beyond(&self, sample: usize) -> f32 {
        self.occluded.as_ref().map_or(f32::INFINITY, |beyond| beyond[sample])
    }

    /// The ray through a sample.
    pub(in crate::silhouettes) fn ray(&self, sample: usize) -> Option<Ray<f32>> {
        let at = |k: usize| (k as f64 + 0.5) * self.stride as f64;
        let ray = self.camera.ray(at(sample % self.size[0]), at(sample / self.size[0]))?;
        Some(ray.cast())
    }

    /// Pixel coordinates of the point at `d` from the camera, if they may lie in the picture, and what one pixel covers there [scene unit].
    #[inline(always)]
    fn project(&self, d: Vec3<f32>) -> Option<([f32; 2], f32)> {
        if let Some(rows) = &self.pinhole {
            let (z, c) = (rows[2].dot(d), self.camera.center);
            let inv = z.recip();
            return (z > 0.0).then(|| {
                ([rows[0].dot(d) * inv + c[0] as f32, rows[1].dot(d) * inv + c[1] as f32], z * self.per_pixel)
            });
        }
        let pixel = self.camera.project_into(self.camera.world_from_camera.translation + d.cast())?;
        Some((pixel.map(|p| p as f32), d.length() * self.per_pixel))
    }

    /// Signed distance [scene unit] to the cone of the silhouette: that in the image times the footprint of a pixel at
    /// the point's depth. To first order in the distance from the cone, and up to the cosine of the edge's angle from the
    /// axis (6 % at the border of a field of view of 40°). `None`: out of the picture. Infinite: hidden.
    #[inline(always)]
    pub(super) fn distance_at(&self, x: Vec3<f32>, margin: f32) -> Option<f32> {
        let d = x - self.centre;
        let ([u, v], footprint) = self.project(d)?;
        let inside = u >= 0.0 && v >= 0.0 && u <= self.camera.width as f32 && v <= self.camera.height as f32;
        if !inside {
            return None;
        }
        let s = (self.stride as f32).recip();
        let clamp = |p: f32, n: usize| (p * s - 0.5).clamp(0.0, (n - 1) as f32);
        let (u, v) = (clamp(u, self.size[0]), clamp(v, self.size[1]));
        let pixels = self.bilinear(u, v);
        let is_hidden = |beyond: &Vec<f32>| {
            let nearest = (v + 0.5) as usize * self.size[0] + (u + 0.5) as usize;
            d.length() > beyond[nearest] + margin
        };
        let abstains = pixels > 0.0 && self.occluded.as_ref().is_some_and(is_hidden);
        Some(if abstains { f32::INFINITY } else { pixels * footprint })
    }

    #[inline(always)]
    pub(super) fn bilinear(&self, u: f32, v: f32) -> f32 {
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

/// Coverages averaged over squares of `stride` pixels; those that stick out of the image count with the pixels they have.
pub(super) fn averages(coverage: &[u8], [width, height]: [usize; 2], stride: usize) -> Vec<u8> {
    let mut averages = Vec::with_capacity(width.div_ceil(stride) * height.div_ceil(stride));
    let mut sums = vec![0_u32; width.div_ceil(stride)];
    for rows in coverage.chunks(width * stride) {
        sums.fill(0);
        for row in rows.chunks_exact(width) {
            for (sum, square) in sums.iter_mut().zip(row.chunks(stride)) {
                *sum += square.iter().map(|&c| u32::from(c)).sum::<u32>();
            }
        }
        let tall = rows.len() / width;
        let average = |(x, sum): (usize, &u32)| {
            let pixels = (tall * stride.min(width - x * stride)) as u32;
            ((sum + pixels / 2) / pixels) as u8
        };
        averages.extend(sums.iter().enumerate().map(average));
    }
    averages
}

/// The nearest occluder within a pixel of the square that each sample stands for: the edge of a mask that was cut by an
/// occluder lies on mixed pixels, where either may be seen.
fn nearest_occluder(occluders: &Occluders, stride: usize, size: [usize; 2]) -> Vec<f32> {
    let image = occluders.image();
    let range = |k: usize, n: usize| (k * stride).saturating_sub(1)..((k + 1) * stride + 1).min(n);
    let samples = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    samples.map(|(x, y)| occluders.nearest(range(x, image[0]), range(y, image[1]))).collect()
}
