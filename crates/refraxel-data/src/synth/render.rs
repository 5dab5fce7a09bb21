//! From a scene and a camera to a picture with its mask, depth and normals.
//!
//! Pixel filter: a box of one pixel, sampled on a jittered grid whose jitter depends on seed, view and pixel only, and
//! averaged in linear light.

use super::hash::{mix, unit};
use super::scene::{Matter, Scene};
use super::texture::{Rgb, srgb_from_linear};
use super::trace::{Beam, Limits, Tally, Tracer};
use crate::image::{Image, Mask, Pixels};
use crate::quantize::quantize;
use rayon::prelude::*;
use refraxel_core::{Camera, Ray, Vec3};
use std::f64::consts::TAU;

/// How pixels are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sampling {
    /// Samples per pixel; rounded up to a square number.
    pub spp: u32,
    /// Samples in pixels whose first samples differ by more than `DETAIL` in display units; 0 or at most `spp`: none.
    pub detail_spp: u32,
    /// Choice of the jitter.
    pub seed: u64,
    /// How far rays are followed.
    pub limits: Limits,
}

/// Spread of sRGB values in [0, 1] among the samples of a pixel above which it gets `detail_spp` samples.
const DETAIL: f64 = 2.0 / 255.0;

impl Default for Sampling {
    fn default() -> Sampling {
        Sampling { spp: 16, detail_spp: 0, seed: 0, limits: Limits::default() }
    }
}

/// A lens of finite width: only what lies at the distance `focus` is sharp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ThinLens {
    /// Radius [scene unit].
    pub radius: f64,
    /// Distance of the sharp plane along the optical axis [scene unit].
    pub focus: f64,
}

/// A rendered view; all fields run row by row from the top.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Width and height [pixel].
    pub size: [u32; 2],
    /// Linear basic radiance L/n².
    pub color: Vec<Rgb>,
    /// Share of the pixel in [0, 1] where a refractive body is the first thing seen.
    pub coverage: Vec<f64>,
    /// Distance along the optical axis of the first thing seen at the pixel's centre [scene unit]; 0 for background.
    pub depth: Vec<f64>,
    /// World normal of that thing, facing the camera; zero for background.
    pub normal: Vec<Vec3<f64>>,
    /// Camera rays traced.
    pub samples: u64,
    /// What tracing them has cost.
    pub tally: Tally,
}

#[derive(Clone, Copy)]
struct Pixel {
    color: Rgb,
    coverage: f64,
    depth: f64,
    normal: Vec3<f64>,
    samples: u64,
    tally: Tally,
}

/// Renders one view; `view` is any number that differs between views, so that their jitter does.
///
/// The same arguments give the same bits on any number of threads.
pub fn render_view(scene: &Scene, camera: &Camera, view: u64, sampling: &Sampling) -> Frame {
    render_view_while(scene, camera, view, sampling, &|| true)
        .unwrap_or_else(|| unreachable!("nothing stops it"))
}

/// The same, unless `goes_on` says no before some pixel.
pub fn render_view_while(
    scene: &Scene,
    camera: &Camera,
    view: u64,
    sampling: &Sampling,
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Option<Frame> {
    render_pixels(&PixelRenderer::new(scene, camera, view, sampling), goes_on)
}

/// [`render_view`] through a lens, whose points are shared out among the samples of a pixel; `None`: a pinhole. Depth and
/// normals are those of the pinhole.
pub(super) fn render_through(
    lens: Option<ThinLens>,
    scene: &Scene,
    camera: &Camera,
    view: u64,
    sampling: &Sampling,
) -> Frame {
    let pixel = PixelRenderer { lens, ..PixelRenderer::new(scene, camera, view, sampling) };
    render_pixels(&pixel, &|| true).unwrap_or_else(|| unreachable!("nothing stops it"))
}

fn render_pixels(pixel: &PixelRenderer, goes_on: &(dyn Fn() -> bool + Sync)) -> Option<Frame> {
    let camera = pixel.camera;
    let pixels: Vec<Pixel> = (0..camera.height)
        .into_par_iter()
        .flat_map_iter(|y| (0..camera.width).map(move |x| (x, y)))
        .map(|(x, y)| goes_on().then(|| pixel.render(x, y)))
        .collect::<Option<_>>()?;
    Some(Frame {
        size: [camera.width, camera.height],
        color: pixels.iter().map(|p| p.color).collect(),
        coverage: pixels.iter().map(|p| p.coverage).collect(),
        depth: pixels.iter().map(|p| p.depth).collect(),
        normal: pixels.iter().map(|p| p.normal).collect(),
        samples: pixels.iter().map(|p| p.samples).sum(),
        tally: pixels.iter().fold(Tally::default(), |t, p| t.plus(p.tally)),
    })
}

struct PixelRenderer<'a> {
    tracer: Tracer<'a>,
    camera: &'a Camera,
    lens: Option<ThinLens>,
    /// The bodies around the camera.
    start: Beam,
    hidden: bool,
    seed: u64,
    sampling: &'a Sampling,
}

impl<'a> PixelRenderer<'a> {
    fn new(scene: &'a Scene, camera: &'a Camera, view: u64, sampling: &'a Sampling) -> Self {
        let tracer = Tracer { scene, limits: sampling.limits };
        let start =
            tracer.beam(Ray { origin: camera.world_from_camera.translation, direction: camera.forward() });
        let seed = mix(sampling.seed, view);
        PixelRenderer {
            tracer,
            camera,
            lens: None,
            start,
            hidden: scene.has_hidden_borders(),
            seed,
            sampling,
        }
    }

    fn render(&self, x: u32, y: u32) -> Pixel {
        let (depth, normal) = self.center(x, y);
        let mut pixel =
            Pixel { color: [0.0; 3], coverage: 0.0, depth, normal, samples: 0, tally: Tally::default() };
        let spread = self.sample(&mut pixel, [x, y], self.sampling.spp);
        if self.sampling.detail_spp > self.sampling.spp && spread > DETAIL {
            self.sample(&mut pixel, [x, y], self.sampling.detail_spp);
        }
        pixel
    }

    /// Sets colour and coverage from `spp` samples; returns how far the samples' sRGB values lie apart.
    fn sample(&self, pixel: &mut Pixel, [x, y]: [u32; 2], spp: u32) -> f64 {
        let side = f64::from(spp).sqrt().ceil() as u64;
        let seed = mix(self.seed, u64::from(y) << 32 | u64::from(x));
        let (mut sum, mut covered) = ([0.0; 3], 0.0);
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for k in 0..side * side {
            let jitter = [unit(mix(seed, 2 * k)), unit(mix(seed, 2 * k + 1))];
            let u = f64::from(x) + ((k % side) as f64 + jitter[0]) / side as f64;
            let v = f64::from(y) + ((k / side) as f64 + jitter[1]) / side as f64;
            let (color, refractive) = self.trace(self.ray([u, v], seed, k), &mut pixel.tally);
            covered += f64::from(u8::from(refractive));
            for c in 0..3 {
                sum[c] += color[c];
                low[c] = low[c].min(color[c]);
                high[c] = high[c].max(color[c]);
            }
        }
        let count = (side * side) as f64;
        pixel.samples += side * side;
        pixel.color = sum.map(|s| s / count);
        pixel.coverage = covered / count;
        (0..3).map(|c| srgb_from_linear(high[c]) - srgb_from_linear(low[c])).fold(0.0, f64::max)
    }

    /// The ray of sample `k` of a pixel. Points of the lens follow the additive recurrence of [`cameras`](super::cameras).
    fn ray(&self, [u, v]: [f64; 2], seed: u64, k: u64) -> Option<Ray<f64>> {
        const INVERSE_PLASTIC: f64 = 0.754_877_666_246_692_7;
        let ray = self.camera.ray(u, v)?;
        let Some(ThinLens { radius, focus }) = self.lens else { return Some(ray) };
        let share = |draw: u64, step: f64| (unit(mix(!seed, draw)) + k as f64 * step).fract();
        let r = radius * share(0, INVERSE_PLASTIC).sqrt();
        let (sin, cos) = (TAU * share(1, INVERSE_PLASTIC * INVERSE_PLASTIC)).sin_cos();
        let [right, down, forward] = self.camera.world_from_camera.rotation.columns;
        let origin = ray.origin + right * (r * cos) + down * (r * sin);
        let sharp = ray.at(focus / ray.direction.dot(forward));
        Some(Ray { origin, direction: (sharp - origin).normalized() })
    }

    /// Radiance of one camera ray and whether a refractive body is the first thing that it meets.
    fn trace(&self, ray: Option<Ray<f64>>, tally: &mut Tally) -> (Rgb, bool) {
        let Some(ray) = ray else { return ([0.0; 3], false) };
        let scene = self.tracer.scene;
        let is_refractive = |body: usize| scene.bodies[body].medium().is_some();
        let beam = Beam { ray, inside: self.start.inside };
        if self.hidden {
            let covered = scene.first_visible(&ray, beam.inside).is_some_and(|h| is_refractive(h.body));
            return (self.tracer.gather_from(&beam, tally).0, covered);
        }
        let (color, first) = self.tracer.gather_from(&beam, tally);
        (color, first.is_some_and(is_refractive))
    }

    fn center(&self, x: u32, y: u32) -> (f64, Vec3<f64>) {
        let ray = self.camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let hit = ray.and_then(|ray| Some((ray, self.tracer.scene.first_visible(&ray, self.start.inside)?)));
        hit.map_or((0.0, Vec3::zero()), |(ray, hit)| {
            let (s, n) = (hit.crossing.s, hit.crossing.normal);
            (s * ray.direction.dot(self.camera.forward()), if n.dot(ray.direction) > 0.0 { -n } else { n })
        })
    }
}

impl Frame {
    /// The picture, sRGB-encoded with 8 bits.
    pub fn image(&self) -> Image {
        let encode = |&v: &f64| quantize(srgb_from_linear(v));
        let pixels = self.color.iter().flatten().map(encode).collect();
        Image { width: self.size[0], height: self.size[1], channels: 3, pixels: Pixels::U8(pixels) }
    }

    /// Coverage by refractive bodies with 8 bits; 255 = all of the pixel.
    pub fn mask(&self) -> Mask {
        let coverage = self.coverage.iter().copied().map(quantize).collect();
        Mask { width: self.size[0], height: self.size[1], coverage }
    }
}

/// True when a scene has a refractive body.
pub(super) fn refracts(scene: &Scene) -> bool {
    scene.bodies.iter().any(|b| matches!(b.matter, Matter::Refractive { .. }))
}
