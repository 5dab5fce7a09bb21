//! A picture that gets better: coarse first, then finer, then with several rays per pixel.

use super::layers::Canvas;
use super::protocol::Shown;
use super::scene::Scene;
use refraxel_core::Camera;
use refraxel_train::evaluation::SUBPIXELS;

/// Rays of a portion: a few hundredths of a second, after which somebody else may be painted.
pub const PORTION: usize = 8192;
/// Coarsest picture: one of so many pixels along each axis.
const COARSEST: f64 = 8.0;

/// A picture that is being painted.
pub struct Picture {
    shown: Shown,
    camera: Camera,
    /// Sizes of the passes with one ray per pixel, from the coarsest.
    sizes: Vec<[u32; 2]>,
    /// The pass that is painted.
    pass: usize,
    /// The first row that is not painted yet.
    row: u32,
    canvas: Canvas,
    moving: bool,
}

/// A pass that is finished.
pub struct Painted {
    /// Pixels, three bytes each.
    pub pixels: Vec<u8>,
    /// Size [pixel].
    pub size: [u32; 2],
    /// Rays per pixel of the picture that was asked for; 0 where this one is coarser.
    pub rays: u32,
    /// The picture gets no better.
    pub last: bool,
    /// The values of the first and the last colour.
    pub range: Option<[f32; 2]>,
}

impl Picture {
    /// A picture of a camera, whose first pass should take no more than so many rays.
    pub fn new(shown: Shown, camera: Camera, moving: bool, first: f64) -> Self {
        let size = [camera.width, camera.height];
        let rays = f64::from(size[0]) * f64::from(size[1]) * shown.rays_per_pixel();
        let sizes = sizes(size, (rays / first.max(1.0)).sqrt().clamp(1.0, COARSEST));
        let canvas = Canvas::new(shown, sizes[0]);
        Self { shown, camera, sizes, pass: 0, row: 0, canvas, moving }
    }

    /// How far it is: finished passes.
    pub fn passes(&self) -> usize {
        self.pass
    }

    /// A moving camera shall see its first pass, whatever comes next.
    pub fn must_finish(&self) -> bool {
        self.moving && self.pass == 0
    }

    /// No better picture follows.
    pub fn is_finished(&self) -> bool {
        self.pass >= self.passes_in_all()
    }

    /// Every pixel has a ray, as far as it gets one.
    pub fn is_whole(&self) -> bool {
        self.pass >= self.sizes.len().min(self.passes_in_all())
    }

    fn passes_in_all(&self) -> usize {
        match self.moving {
            true => 1,
            false if self.shown.is_averaged() => self.sizes.len() + SUBPIXELS.len(),
            false => self.sizes.len(),
        }
    }

    /// Paints at most about `rays` rays; gives the picture where a pass that is worth showing is finished. Returns how many rays
    /// were traced.
    pub fn advance(&mut self, scene: &Scene, rays: usize) -> (usize, Option<Painted>) {
        let coarse = self.pass < self.sizes.len();
        let size = if coarse { self.sizes[self.pass] } else { [self.camera.width, self.camera.height] };
        // Whole rows of tiles, whose rays share their voxels.
        let rows = (rays as u32 / size[0]).max(1).next_multiple_of(8).min(size[1] - self.row);
        let camera = self.camera.resized(size[0], size[1]);
        let at = if coarse { [0.5; 2] } else { SUBPIXELS[self.pass - self.sizes.len()] };
        self.canvas.paint(scene, &camera, self.row..self.row + rows, at);
        self.row += rows;
        let traced = (f64::from(rows * size[0]) * self.shown.rays_per_pixel()) as usize;
        (traced, (self.row == size[1]).then(|| self.finish_pass(scene, size)).flatten())
    }

    fn finish_pass(&mut self, scene: &Scene, size: [u32; 2]) -> Option<Painted> {
        self.row = 0;
        self.pass += 1;
        let one_ray = self.sizes.len();
        let last = self.is_finished();
        let is_shown = self.pass <= one_ray || last;
        let painted = is_shown.then(|| {
            let (pixels, range) = self.canvas.colours(scene);
            let rays = match self.pass {
                pass if pass < one_ray => 0,
                pass if pass == one_ray => u32::from(size == [self.camera.width, self.camera.height]),
                pass => (pass - one_ray) as u32,
            };
            Painted { pixels, size, rays, last, range }
        });
        if self.pass <= one_ray && !last {
            let next = self.sizes.get(self.pass).copied().unwrap_or([self.camera.width, self.camera.height]);
            self.canvas.clear(next);
        }
        painted
    }
}

/// Sizes from the coarsest by factors of about 2 to the size itself.
fn sizes(size: [u32; 2], coarsest: f64) -> Vec<[u32; 2]> {
    let mut sizes = Vec::new();
    let mut factor = coarsest;
    while factor > 1.2 {
        sizes.push(size.map(|n| (f64::from(n) / factor).round().max(8.0) as u32));
        factor *= 0.5;
    }
    sizes.push(size);
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_grow_to_the_whole() {
        assert_eq!(sizes([400, 300], 4.0), [[100, 75], [200, 150], [400, 300]]);
        assert_eq!(sizes([400, 300], 1.0), [[400, 300]]);
        assert_eq!(sizes([16, 16], 8.0)[0], [8, 8]);
    }
}
