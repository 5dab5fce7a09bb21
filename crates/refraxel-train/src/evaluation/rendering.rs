//! Rendering views and scoring them: the one function behind training curves, `eval` and `compare`.

use crate::backend::{Backend, Layers, Marching};
use crate::cancel::{Cancel, Cancelled};
use crate::model::{MirrorSource, Refraction};
use crate::rays::{pixel_ray, ray_within};
use rayon::prelude::*;
use refraxel_core::radiance::{Pixel, without};
use refraxel_core::{Camera, Domain, Path, Ray};
use refraxel_data::quantize;

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
pub const SUBPIXELS: [[f64; 2]; 4] = [[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];

/// Pixels whose rays exist at the same time, and between two looks at a wish to stop: a fraction of a second of one thread. A
/// multiple of 256, the rays of a chunk.
const PORTION: usize = 16_384;

/// Render a camera's whole image, unless somebody wishes to stop. Pixels that the lens does not see are black.
pub fn render(
    backend: &dyn Backend,
    camera: &Camera,
    marching: &Marching,
    cancel: &Cancel,
) -> Result<Rendering, Cancelled> {
    render_by(backend, camera, cancel, |rays| backend.render(rays, marching, Layers::All))
}

/// Which part of the light is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// All of it.
    All,
    /// What surfaces mirror, alone: all light without what it would be if they mirrored blackness.
    Reflected,
    /// What would be seen if no surface mirrored but totally.
    Transmitted,
}

impl Light {
    /// What rays show of it, by what `render` shows of all layers.
    pub fn of(
        self,
        rays: &[Ray<f32>],
        render: impl Fn(&[Ray<f32>], Layers) -> Vec<Pixel<f32>>,
    ) -> Vec<Pixel<f32>> {
        match self {
            Self::All => render(rays, Layers::All),
            Self::Transmitted => render(rays, Layers::Transmitted),
            Self::Reflected => {
                let mut all = render(rays, Layers::All);
                let black = render(rays, Layers::Mirroring(MirrorSource::Black));
                for (all, black) in all.iter_mut().zip(black) {
                    all.colour = without(all.colour, black.colour);
                }
                all
            }
        }
    }
}

/// The rays of a pixel; none where the lens is blind.
fn rays_of_pixel(
    camera: &Camera,
    pixel: usize,
    refraction: &Refraction,
    domain: &Domain<f32>,
    path: &mut Path<f32>,
) -> Vec<Ray<f32>> {
    let Some(centre) = pixel_ray(camera, pixel) else { return Vec::new() };
    if !refraction.turns(&centre, domain, path) {
        return vec![centre];
    }
    let several: Option<Vec<_>> = SUBPIXELS.iter().map(|&at| ray_within(camera, pixel, at)).collect();
    several.unwrap_or_else(|| vec![centre])
}

/// The same with `pixels` to say what rays show of what the backend holds.
pub fn render_by(
    backend: &dyn Backend,
    camera: &Camera,
    cancel: &Cancel,
    pixels: impl Fn(&[Ray<f32>]) -> Vec<Pixel<f32>>,
) -> Result<Rendering, Cancelled> {
    let count = camera.width as usize * camera.height as usize;
    let (medium, domain) = (backend.medium(), backend.domain());
    let order = tiles(camera.width, camera.height);
    let of_pixel = |path: &mut Path<f32>, &p: &usize| rays_of_pixel(camera, p, medium, domain, path);
    let mut out = Rendering {
        width: camera.width,
        height: camera.height,
        colour: vec![[0; 3]; count],
        opacity: vec![0.0; count],
        depth: vec![0.0; count],
    };
    for portion in order.chunks(PORTION) {
        cancel.check()?;
        let rays: Vec<Vec<Ray<f32>>> = portion.par_iter().map_init(Path::default, of_pixel).collect();
        let all = pixels(&rays.concat());
        let mut rest = &all[..];
        for (&p, rays) in portion.iter().zip(&rays) {
            let own;
            (own, rest) = rest.split_at(rays.len());
            let Some(pixel) = mean(own) else { continue };
            let opacity = 1.0 - pixel.transmittance;
            out.colour[p] = pixel.colour.map(quantize);
            out.opacity[p] = opacity;
            out.depth[p] = if opacity > 1e-3 { pixel.depth / opacity } else { 0.0 };
        }
    }
    Ok(out)
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
