//! Shrinking a region to what the pictures show: a coarse visual hull of everything that is not backdrop.

use super::scene::Region;
use crate::{Backdrop, Dataset, MaskMeaning, Photo, is_white};
use rayon::prelude::*;
use refraxel_core::{Aabb, Camera, Vec3, vec3};

/// Cells along each axis of the region.
const CELLS: usize = 64;
/// Views that vote; more change the box by less than a cell.
const MAX_VIEWS: usize = 32;
/// A cell stays when this share of the views that see it show something there. Not all: glass may show backdrop.
const KEEP_SHARE: f64 = 0.9;
/// A cell is judged only when this share of the views sees it; others may hold anything and stay out of the box.
const SEEN_SHARE: f64 = 0.5;
/// Alpha and colour difference from the backdrop beyond which a pixel shows something: noise and JPEG stay below.
const THRESHOLD: f32 = 6.0 / 255.0;

/// Which pixels of a view are not backdrop, as sums over rectangles.
struct Silhouette<'a> {
    camera: &'a Camera,
    /// (height + 1) × (width + 1) prefix sums of the foreground, rows from the top.
    sums: Vec<u32>,
}

impl Region {
    /// The smallest box inside this region that contains what `photos` (of the views `indices`) show in front of a
    /// known backdrop. Unchanged for unbounded scenes and where the pictures show nothing.
    ///
    /// # Panics
    /// When `indices` and `photos` differ in length, or an index is not a view of `data`.
    pub fn around_content(&self, data: &Dataset, indices: &[usize], photos: &[Photo]) -> Region {
        assert_eq!(indices.len(), photos.len(), "one photo for each index");
        if data.backdrop == Backdrop::Surroundings || photos.is_empty() {
            return *self;
        }
        let silhouettes = silhouettes(data, indices, photos);
        let cell = self.bounds.extent() / CELLS as f64;
        let layers: Vec<Aabb<f64>> =
            (0..CELLS).into_par_iter().map(|k| hull_of_layer(&self.bounds, cell, k, &silhouettes)).collect();
        let hull = layers.iter().filter(|layer| layer.extent().min_element() >= 0.0).fold(
            Aabb::empty(),
            |mut all, layer| {
                all.include(layer.min);
                all.include(layer.max);
                all
            },
        );
        if hull.extent().min_element() < 0.0 {
            return *self;
        }
        // Cell centres, plus half a cell to their border and one for what the grid cut off.
        let margin = cell * 1.5;
        let bounds =
            Aabb::new((hull.min - margin).max(self.bounds.min), (hull.max + margin).min(self.bounds.max));
        Region { bounds, ..*self }
    }

    /// How much surface what `photos` show has: the area of its coarse visual hull over the volume of this region, both with the
    /// region's longest edge as the unit of length. `None` for unbounded scenes and where the pictures show nothing.
    ///
    /// # Panics
    /// As [`Self::around_content`].
    pub fn surface_density(&self, data: &Dataset, indices: &[usize], photos: &[Photo]) -> Option<f64> {
        assert_eq!(indices.len(), photos.len(), "one photo for each index");
        let edge = self.bounds.extent().max_element() / CELLS as f64;
        if data.backdrop == Backdrop::Surroundings || photos.is_empty() || edge <= 0.0 {
            return None;
        }
        let silhouettes = silhouettes(data, indices, photos);
        let n = self.bounds.extent().map(|e| (e / edge).round().max(1.0)).to_array().map(|n| n as usize);
        let at = |k: usize| {
            let cell = [k % n[0], k / n[0] % n[1], k / (n[0] * n[1])];
            let center = self.bounds.min + Vec3::from(cell.map(|c| c as f64 + 0.5)) * edge;
            occupied(center, 0.5 * 3.0_f64.sqrt() * edge, &silhouettes)
        };
        let filled: Vec<bool> = (0..n.iter().product()).into_par_iter().map(at).collect();
        let strides = [1, n[0], n[0] * n[1]];
        let has_next = |k: usize, a: usize| k / strides[a] % n[a] + 1 < n[a];
        let faces =
            |k: usize| (0..3).filter(|&a| has_next(k, a) && filled[k] != filled[k + strides[a]]).count();
        let faces: usize = (0..filled.len()).map(faces).sum();
        // Faces of edge² each, cells of edge³.
        (faces > 0).then(|| faces as f64 * CELLS as f64 / filled.len() as f64)
    }
}

/// What is not backdrop in some of the views.
fn silhouettes<'a>(data: &'a Dataset, indices: &[usize], photos: &[Photo]) -> Vec<Silhouette<'a>> {
    let of = |k: usize| {
        let view = &data.views[indices[k]];
        let refractive = view.mask_meaning == MaskMeaning::Refractive;
        Silhouette::new(&view.camera, &photos[k], data.backdrop, refractive)
    };
    (0..indices.len()).step_by(indices.len().div_ceil(MAX_VIEWS)).map(of).collect()
}

/// Box of the centres of the occupied cells of layer `k`.
fn hull_of_layer(bounds: &Aabb<f64>, cell: Vec3<f64>, k: usize, silhouettes: &[Silhouette]) -> Aabb<f64> {
    let mut hull = Aabb::empty();
    for j in 0..CELLS {
        for i in 0..CELLS {
            let at = vec3(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
            let center = bounds.min + at.hadamard(cell);
            if occupied(center, 0.5 * cell.length(), silhouettes) {
                hull.include(center);
            }
        }
    }
    hull
}

fn occupied(center: Vec3<f64>, radius: f64, silhouettes: &[Silhouette]) -> bool {
    let votes = silhouettes.iter().filter_map(|s| s.shows_something(center, radius));
    let (seen, shown) = votes.fold((0, 0), |(seen, shown), vote| (seen + 1, shown + usize::from(vote)));
    seen as f64 >= SEEN_SHARE * silhouettes.len() as f64 && shown as f64 >= KEEP_SHARE * f64::from(seen)
}

impl<'a> Silhouette<'a> {
    fn new(camera: &'a Camera, photo: &Photo, backdrop: Backdrop, refractive: bool) -> Self {
        let (w, h) = (photo.image.width as usize, photo.image.height as usize);
        let inside = |i: usize| refractive && photo.mask.as_ref().is_some_and(|m| is_white(m.coverage[i]));
        let mut sums = vec![0; (w + 1) * (h + 1)];
        for y in 0..h {
            let mut row = 0;
            for x in 0..w {
                let i = y * w + x;
                row += u32::from(inside(i) || is_foreground(photo.image.rgba(i), backdrop));
                sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
            }
        }
        Self { camera, sums }
    }

    /// Does the view show anything within `radius` of `center`? `None` when the point is not in the picture.
    fn shows_something(&self, center: Vec3<f64>, radius: f64) -> Option<bool> {
        let [u, v] = self.camera.project(center)?;
        let (w, h) = (self.camera.width as usize, self.camera.height as usize);
        if !(u >= 0.0 && v >= 0.0 && u < w as f64 && v < h as f64) {
            return None;
        }
        let distance = (center - self.camera.world_from_camera.translation).length();
        let reach = radius / distance;
        let [ru, rv] = self.camera.focal.map(|f| f * reach);
        let clamp = |x: f64, end: usize| (x.max(0.0) as usize).min(end);
        let (x0, x1) = (clamp((u - ru).floor(), w), clamp((u + ru).ceil(), w));
        let (y0, y1) = (clamp((v - rv).floor(), h), clamp((v + rv).ceil(), h));
        let at = |x: usize, y: usize| self.sums[y * (w + 1) + x];
        Some(at(x1, y1) + at(x0, y0) > at(x0, y1) + at(x1, y0))
    }
}

fn is_foreground([r, g, b, a]: [f32; 4], backdrop: Backdrop) -> bool {
    match backdrop {
        Backdrop::Color([br, bg, bb]) if a >= 1.0 => {
            (r - br).abs().max((g - bg).abs()).max((b - bb).abs()) > THRESHOLD
        }
        _ => a > THRESHOLD,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Image, Pixels, PosedPhoto, Split};

    /// A ball of this radius around the origin, black before white, from the corners and faces of a cube.
    fn ball(radius: f64) -> Dataset {
        let directions = (0..27).filter(|k| *k != 13).map(|k| {
            let at = [k % 3, k / 3 % 3, k / 9].map(|c| f64::from(c) - 1.0);
            Vec3::from(at).normalized()
        });
        let posed = directions.enumerate().map(|(k, direction)| {
            let up = vec3(0.1, 0.2, 1.0);
            let camera = Camera::look_at(direction * 6.0, Vec3::zero(), up, 0.6, [128, 128]);
            let is_ball = |pixel: u32| {
                let ray = camera.ray(f64::from(pixel % 128) + 0.5, f64::from(pixel / 128) + 0.5).unwrap();
                ray.origin.cross(ray.direction).length() < radius
            };
            let pixels = (0..128 * 128).flat_map(|p| if is_ball(p) { [0_u8; 3] } else { [255; 3] }).collect();
            let image = Image { width: 128, height: 128, channels: 3, pixels: Pixels::U8(pixels) };
            let photo = Photo::new(image, None);
            PosedPhoto { name: format!("{k}.png"), camera, photo, mask_meaning: MaskMeaning::Keep }
        });
        let split = Split { train: (0..26).collect(), ..Split::default() };
        Dataset::in_memory(posed.collect(), split, Backdrop::Color([1.0; 3])).unwrap()
    }

    #[test]
    fn the_density_of_surfaces_is_that_of_the_faces_of_a_ball_s_cells() {
        let bounds = Aabb::cube(1.0);
        let region = Region { bounds, up: vec3(0.0, 0.0, 1.0), unbounded: false, projection: None };
        for radius in [0.3, 0.5, 0.8] {
            let data = ball(radius);
            let photos = data.load_photos(&data.split.train, |_| {}).unwrap();
            let density = region.surface_density(&data, &data.split.train, &photos).unwrap();
            // The faces of cells have 3/2 of the area of a ball, whose hull is a little larger.
            let faces = 1.5 * 4.0 * std::f64::consts::PI * (radius / 2.0).powi(2);
            assert!((1.0..1.35).contains(&(density / faces)), "{radius}: {density} instead of {faces}");
        }
        let nothing = ball(0.0);
        let photos = nothing.load_photos(&nothing.split.train, |_| {}).unwrap();
        assert_eq!(region.surface_density(&nothing, &nothing.split.train, &photos), None);
    }
}
