//! The pose of a photograph that the scene was not learned from.

use super::correction::Correction;
use super::learn::slope;
use super::normal::Normal;
use crate::backend::{Backend, Batch, Layers, Objective};
use crate::cancel::{Cancel, Cancelled};
use crate::random::Random;
use crate::rays::{WHITE, is_used, over, pixel_ray, shown};
use refraxel_core::{Camera, Pose};
use refraxel_data::{Backdrop, Photo, View};

/// Edge of the squares of the chequer of which every other one is looked at [pixel].
const SQUARE: u32 = 8;
/// Edges of the cells over which residuals are averaged, one after the other [pixel]; the first ones see large shifts.
const CELLS: [u32; 4] = [8, 4, 2, 1];
/// Steps with each of them.
const STEPS: u64 = 4;
/// Rays of a step.
const RAYS: usize = 2048;
/// A step turns a camera by at most so many pixels.
const MOST: f64 = 4.0;

/// The camera of a photograph, found against a finished scene from where the data put it, by the half of its pixels that are the
/// black squares of a chequer. Steps are Gauss–Newton steps on differences that are averaged over cells, theory (8.6). `unit` is
/// the distance of the cameras from the scene [scene unit].
pub fn find(
    backend: &dyn Backend,
    objective: &Objective,
    (view, photo): (&View, &Photo),
    backdrop: Backdrop,
    unit: f64,
    cancel: &Cancel,
) -> Result<Camera, Cancelled> {
    let mut found = view.camera;
    let mut correction = Correction::default();
    let sight = Sight { view, photo, is_transparent: backdrop == Backdrop::Transparent };
    for (edge, first) in CELLS.into_iter().zip((0..).step_by(STEPS as usize)) {
        for step in first..first + STEPS {
            cancel.check()?;
            let cells = sight.cells(&found, edge, step);
            let normal = cells.normal(backend, objective, unit);
            let most = MOST / found.focal[0].max(found.focal[1]);
            let Some(by) = normal.step(most, None) else { return Ok(found) };
            correction = correction.moved(&by, unit);
            let pose: Pose = correction.of(&view.camera.world_from_camera);
            found = Camera { world_from_camera: pose, ..view.camera };
        }
    }
    Ok(found)
}

/// A photograph with what may be seen of it.
struct Sight<'a> {
    view: &'a View,
    photo: &'a Photo,
    is_transparent: bool,
}

/// Whether a pixel lies in a black square: that half of a photograph says how it was taken.
pub fn is_black(x: u32, y: u32) -> bool {
    (x / SQUARE + y / SQUARE).is_multiple_of(2)
}

/// Rays in cells.
#[derive(Default)]
struct Cells {
    batch: Batch,
    /// Where the rays of each cell end.
    ends: Vec<usize>,
}

impl Sight<'_> {
    /// Whether the pixel lies in a black square and says something.
    fn counts(&self, x: u32, y: u32) -> bool {
        let pixel = (y * self.view.camera.width + x) as usize;
        is_black(x, y) && is_used(self.photo, self.view.mask_meaning, pixel)
    }

    /// Some cells within black squares, with rays through all of their pixels or 16 of them.
    fn cells(&self, camera: &Camera, edge: u32, step: u64) -> Cells {
        let (random, mut cells) = (Random::new(0), Cells::default());
        let stride = (edge / 4).max(1);
        let per_cell = (edge / stride).pow(2) as usize;
        let [across, down] = [camera.width, camera.height].map(|n| u64::from(n.div_ceil(edge)));
        for k in 0..(RAYS / per_cell) as u64 {
            let [x, y] = [(across, 2 * k), (down, 2 * k + 1)]
                .map(|(n, lane)| edge * random.below(n, step, lane) as u32);
            let inside = |x: u32, y: u32| x < camera.width && y < camera.height && self.counts(x, y);
            for (dx, dy) in (0..edge * edge).map(|i| (i % edge, i / edge)) {
                let (x, y) = (x + dx, y + dy);
                if dx % stride != stride / 2 || dy % stride != stride / 2 || !inside(x, y) {
                    continue;
                }
                let pixel = (y * camera.width + x) as usize;
                let Some(ray) = pixel_ray(camera, pixel) else { continue };
                let [r, g, b, alpha] = self.photo.image.rgba(pixel);
                let alpha = if self.is_transparent { alpha } else { 1.0 };
                cells.batch.rays.push(ray);
                cells.batch.target.push(over([r, g, b, alpha], WHITE));
                cells.batch.offset.push(0.5);
                cells.batch.behind.extend(self.is_transparent.then_some(WHITE));
            }
            cells.ends.push(cells.batch.rays.len());
        }
        cells
    }
}

impl Cells {
    /// What the mean grey of the cells says. Targets that lie ½ below what is seen make the gradient of a ray the sum of the
    /// Jacobians of its channels.
    fn normal(&self, backend: &dyn Backend, objective: &Objective, unit: f64) -> Normal {
        let pixels = backend.render(&self.batch.rays, &objective.marching, Layers::All);
        let seen = shown(&pixels, &self.batch);
        let below = seen.iter().map(|colour| colour.map(|c| c - 0.5)).collect();
        let gradients = backend.ray_gradients(&Batch { target: below, ..self.batch.clone() }, objective);
        let (mut normal, mut first) = (Normal::default(), 0);
        for &end in &self.ends {
            let (mut jacobian, mut residual) = ([0.0; 6], 0.0);
            for ray in first..end {
                let of = slope(&self.batch.rays[ray], &gradients[ray], unit);
                (0..6).for_each(|k| jacobian[k] += of[k]);
                residual += (0..3).map(|c| f64::from(seen[ray][c] - self.batch.target[ray][c])).sum::<f64>();
            }
            let count = 3.0 * (end - first) as f64;
            if end > first {
                normal.add_linear(jacobian.map(|j| j / count), residual / count);
            }
            first = end;
        }
        normal
    }
}
