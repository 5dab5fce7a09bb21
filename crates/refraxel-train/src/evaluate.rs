//! Rendering views and scoring them: the one function behind training curves, `eval` and `compare`.

use crate::backend::{Backend, Marching};
use crate::cpu::CpuBackend;
use crate::metrics::{ImageScore, MetricsError, Rgb8, quantize};
use crate::rays::{pixel_ray, ray_within};
use crate::reflection::MirrorSource;
use crate::refraction::Refraction;
use rayon::prelude::*;
use refraxel_core::radiance::{Pixel, without};
use refraxel_core::{Camera, Domain, Path, Ray, Vec3};
use refraxel_data::{Backdrop, MaskMeaning, Photo, View};

/// What a camera sees of a field.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// Width [pixel].
    pub width: u32,
    /// Height [pixel].
    pub height: u32,
    /// 8-bit sRGB, rows from the top.
    pub colour: Vec<[u8; 3]>,
    /// Opacity, 0 to 1.
    pub opacity: Vec<f32>,
    /// Mean arc length to what is seen [scene unit]; 0 where nothing is.
    pub depth: Vec<f32>,
}

/// Where a pixel is looked through when paths turn behind it: what they see is drawn together, by much near the rim of a
/// ball, and one ray would miss most of it.
const WITHIN: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];

/// Render a camera's whole image. Pixels that the lens does not see are black.
pub fn render(backend: &impl Backend, camera: &Camera, marching: &Marching) -> Rendering {
    render_with(backend, camera, |rays| backend.render(rays, marching))
}

/// What the surfaces that a camera sees mirror, alone: its picture without what it would be if they mirrored blackness.
pub fn render_reflection(backend: &CpuBackend, camera: &Camera, marching: &Marching) -> Rendering {
    render_with(backend, camera, |rays| {
        let mut all = backend.render(rays, marching);
        for (all, rest) in all.iter_mut().zip(backend.render_mirroring(rays, marching, MirrorSource::Black)) {
            all.colour = without(all.colour, rest.colour);
        }
        all
    })
}

/// What a camera would see if no surface mirrored but totally.
pub fn render_transmission(backend: &CpuBackend, camera: &Camera, marching: &Marching) -> Rendering {
    render_with(backend, camera, |rays| backend.render_transmitted(rays, marching))
}

/// The rays of a pixel; none where the lens is blind.
fn rays_of_pixel(
    camera: &Camera,
    pixel: usize,
    (refraction, domain): (&Refraction, &Domain<f32>),
    path: &mut Path<f32>,
) -> Vec<Ray<f32>> {
    let Some(centre) = pixel_ray(camera, pixel) else { return Vec::new() };
    if !refraction.turns(&centre, domain, path) {
        return vec![centre];
    }
    let several: Option<Vec<_>> = WITHIN.iter().map(|&at| ray_within(camera, pixel, at)).collect();
    several.unwrap_or_else(|| vec![centre])
}

fn render_with(
    backend: &impl Backend,
    camera: &Camera,
    pixels: impl FnOnce(&[Ray<f32>]) -> Vec<Pixel<f32>>,
) -> Rendering {
    let count = camera.width as usize * camera.height as usize;
    let bending = (backend.refraction(), &backend.field().domain);
    let order = tiles(camera.width, camera.height);
    let of_pixel = |path: &mut Path<f32>, &p: &usize| rays_of_pixel(camera, p, bending, path);
    let rays: Vec<Vec<Ray<f32>>> = order.par_iter().map_init(Path::default, of_pixel).collect();
    let mut out = Rendering {
        width: camera.width,
        height: camera.height,
        colour: vec![[0; 3]; count],
        opacity: vec![0.0; count],
        depth: vec![0.0; count],
    };
    let all = pixels(&rays.concat());
    let mut rest = &all[..];
    for (&p, rays) in order.iter().zip(&rays) {
        let own;
        (own, rest) = rest.split_at(rays.len());
        let Some(pixel) = mean(own) else { continue };
        let opacity = 1.0 - pixel.transmittance;
        out.colour[p] = pixel.colour.map(quantize);
        out.opacity[p] = opacity;
        out.depth[p] = if opacity > 1e-3 { pixel.depth / opacity } else { 0.0 };
    }
    out
}

/// The mean of what the rays of a pixel show, of code values as the field's colours are.
fn mean(of: &[Pixel<f32>]) -> Option<Pixel<f32>> {
    let (first, more) = of.split_first()?;
    let mut sum = *first;
    for pixel in more {
        sum.colour = [0, 1, 2].map(|c| sum.colour[c] + pixel.colour[c]);
        sum.transmittance += pixel.transmittance;
        sum.depth += pixel.depth;
    }
    let share = 1.0 / of.len() as f32;
    let Pixel { colour, transmittance, depth } = sum;
    Some(Pixel {
        colour: colour.map(|c| share * c),
        transmittance: share * transmittance,
        depth: share * depth,
    })
}

/// Pixels in 8 × 8 tiles, whose rays share their voxels.
fn tiles(width: u32, height: u32) -> Vec<usize> {
    const TILE: u32 = 8;
    let mut order = Vec::with_capacity((width * height) as usize);
    for ty in (0..height).step_by(TILE as usize) {
        for tx in (0..width).step_by(TILE as usize) {
            for y in ty..(ty + TILE).min(height) {
                order.extend((tx..(tx + TILE).min(width)).map(|x| (y * width + x) as usize));
            }
        }
    }
    order
}

/// The truth as 8-bit colour; alpha is composited on white.
pub fn truth(photo: &Photo, backdrop: Backdrop) -> Vec<[u8; 3]> {
    (0..photo.image.len())
        .map(|p| {
            let [r, g, b, alpha] = photo.image.rgba(p);
            let alpha = if backdrop == Backdrop::Transparent { alpha } else { 1.0 };
            [r, g, b].map(|c| quantize(c * alpha + 1.0 - alpha))
        })
        .collect()
}

/// A checksum of truth images in their order, so that scores of different images are not compared.
pub fn truth_checksum<'a>(truths: impl IntoIterator<Item = &'a [[u8; 3]]>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for truth in truths {
        hasher.update(&(truth.len() as u64).to_le_bytes());
        hasher.update(truth.as_flattened());
    }
    format!("{:08x}", hasher.finalize())
}

/// The colour behind transparent pictures in renderings and scores.
pub const WHITE: [f32; 3] = [1.0; 3];

/// Score a rendering against its photograph. Refractive masks give the scores inside and outside; other masks none.
pub fn score(
    rendering: &Rendering,
    view: &View,
    photo: &Photo,
    backdrop: Backdrop,
) -> Result<ImageScore, MetricsError> {
    let expected = truth(photo, backdrop);
    let rendered = Rgb8::new(&rendering.colour, rendering.width as usize, rendering.height as usize);
    let truth = Rgb8::new(&expected, photo.image.width as usize, photo.image.height as usize);
    let refractive = view.mask_meaning == MaskMeaning::Refractive;
    let mask = photo.mask.as_ref().filter(|_| refractive).map(|m| &m.coverage[..]);
    ImageScore::new(&view.name, rendered, truth, mask)
}

/// Distance below which a view sees nothing: a share of the camera's distance to the middle of the scene, the smallest
/// over the views.
pub fn near_limit(views: &[&View], middle: Vec3<f64>, share: f32) -> f32 {
    let distances = views.iter().map(|v| (v.camera.world_from_camera.translation - middle).length());
    let nearest = distances.fold(f64::INFINITY, f64::min);
    if nearest.is_finite() { share * nearest as f32 } else { 0.0 }
}
