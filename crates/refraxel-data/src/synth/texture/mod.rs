//! Procedural solid textures with detail at several scales, so that refraction of them is easy to see.
//!
//! A texture is a function of the world position. Its value is the basic radiance L/n², linear and without unit: a
//! surface under water shows the colour that it shows in air, and no index change along a ray adds a factor.

mod letters;
mod paint;
mod surface;

pub use paint::{Paint, Tiles};
pub use surface::{Face, Lamp, Panel, Surface};

use super::hash::{cell, mix, unit};
use refraxel_core::{Vec3, vec3};
use std::sync::Arc;

/// Linear red, green, blue; 1 = white of the display.
pub type Rgb = [f64; 3];

/// An emissive, view-independent surface colour.
#[derive(Clone, Debug)]
pub enum Texture {
    /// One colour.
    Plain(Rgb),
    /// A lattice of cells with a motif each.
    Mosaic(Mosaic),
    /// A picture laid over the ground.
    Picture(Picture),
    /// Paint on a face, lit by a lamp.
    Surface(Surface),
}

impl Texture {
    /// The basic radiance at a world position.
    #[inline]
    pub fn color(&self, x: Vec3<f64>) -> Rgb {
        match self {
            Texture::Plain(c) => *c,
            Texture::Mosaic(m) => m.color(x),
            Texture::Picture(p) => p.color(x),
            Texture::Surface(s) => s.color(x),
        }
    }
}

/// Cells of hashed colours. Each shows a dot, ring, cross, stripes, checks or small dots in a second colour, under
/// brightness noise at a coarse and a fine scale.
#[derive(Clone, Debug)]
pub struct Mosaic {
    /// Linear colours to choose from; at least two.
    pub palette: Vec<Rgb>,
    /// Edge of a cell per axis [scene unit]; infinity makes the texture constant along an axis.
    pub cell: Vec3<f64>,
    /// Edge of a fine noise cell [scene unit].
    pub grain: f64,
    /// Choice of colours and motifs.
    pub seed: u64,
}

impl Mosaic {
    fn color(&self, x: Vec3<f64>) -> Rgb {
        let q = vec3(x.x / self.cell.x, x.y / self.cell.y, x.z / self.cell.z);
        let i = q.map(f64::floor);
        let flat = self.cell.map(f64::is_infinite);
        let mut f = q - i - Vec3::splat(0.5);
        for a in 0..3 {
            if flat[a] {
                f[a] = 0.0;
            }
        }
        let h = cell(self.seed, [i.x as i64, i.y as i64, i.z as i64]);
        let n = self.palette.len() as u64;
        let base = h % n;
        let ink = (base + 1 + (h >> 8) % (n - 1)) % n;
        let color =
            self.palette[if motif((h >> 16) % 6, (h >> 24) & 1 == 0, f) { ink } else { base } as usize];
        let fine = noise(mix(self.seed, 1), x, self.grain);
        let coarse = noise(mix(self.seed, 2), x, 12.0 * self.grain);
        let light = 0.55 + 0.25 * coarse + 0.35 * fine;
        color.map(|c| (c * light).min(1.0))
    }
}

/// True where a cell's motif is inked; `f` in [−½, ½]³ from the cell's centre, 0 along constant axes.
fn motif(kind: u64, turned: bool, f: Vec3<f64>) -> bool {
    let stripe = |t: f64, per_cell: f64| (t * per_cell).rem_euclid(1.0) < 0.5;
    let parity = |t: f64| (4.0 * t).floor() as i64;
    match kind {
        0 => f.dot(f) < 0.34 * 0.34,
        1 => (0.2 * 0.2..0.4 * 0.4).contains(&f.dot(f)),
        2 => f.map(f64::abs).dot(vec3(1.0, 1.0, 1.0)) < 0.5 && f.x.abs().min(f.y.abs()).max(f.z.abs()) < 0.12,
        3 => stripe(if turned { f.x + f.y + f.z } else { f.x - f.y + f.z }, 3.0),
        4 => (parity(f.x) + parity(f.y) + parity(f.z)).rem_euclid(2) == 0,
        _ => {
            let g = f.map(|t| (3.0 * t + 0.5).rem_euclid(1.0) - 0.5);
            g.dot(g) < 0.3 * 0.3
        }
    }
}

/// Value noise in [0, 1], 1/2 in the mean: trilinear between hashed lattice values, with smoothed weights.
pub(in crate::synth) fn noise(seed: u64, x: Vec3<f64>, scale: f64) -> f64 {
    let q = x / scale;
    let i = q.map(f64::floor);
    let t = (q - i).map(|t| t * t * (3.0 - 2.0 * t));
    let at =
        |dx: i64, dy: i64, dz: i64| unit(cell(seed, [i.x as i64 + dx, i.y as i64 + dy, i.z as i64 + dz]));
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let row = |dy, dz| mix(at(0, dy, dz), at(1, dy, dz), t.x);
    let sheet = |dz| mix(row(0, dz), row(1, dz), t.y);
    mix(sheet(0), sheet(1), t.z)
}

/// A picture over the rectangle `min..max` of the (x, y) plane, bilinear between pixel centres, clamped at its edges.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height [pixel].
    pub size: [usize; 2],
    /// Linear colours, row by row; row 0 lies at `min[1]`.
    pub pixels: Arc<Vec<Rgb>>,
    /// Smallest (x, y) [scene unit].
    pub min: [f64; 2],
    /// Largest (x, y) [scene unit].
    pub max: [f64; 2],
}

impl Picture {
    fn color(&self, x: Vec3<f64>) -> Rgb {
        let mut corner = [0; 2];
        let mut t = [0.0; 2];
        for a in 0..2 {
            let last = self.size[a] - 1;
            let p = (x[a] - self.min[a]) / (self.max[a] - self.min[a]) * self.size[a] as f64 - 0.5;
            let p = p.clamp(0.0, last as f64);
            corner[a] = (p.floor() as usize).min(last.saturating_sub(1));
            t[a] = p - corner[a] as f64;
        }
        let at = |dx: usize, dy: usize| {
            let [i, j] = [(corner[0] + dx).min(self.size[0] - 1), (corner[1] + dy).min(self.size[1] - 1)];
            self.pixels[j * self.size[0] + i]
        };
        let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
        [0, 1, 2].map(|k| {
            (a[k] * (1.0 - t[0]) + b[k] * t[0]) * (1.0 - t[1]) + (c[k] * (1.0 - t[0]) + d[k] * t[0]) * t[1]
        })
    }
}

/// Linear value of an sRGB-encoded channel in [0, 1] (IEC 61966-2-1).
pub fn linear_from_srgb(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// sRGB encoding of a linear channel, clamped to [0, 1] (IEC 61966-2-1).
pub fn srgb_from_linear(v: f64) -> f64 {
    let v = v.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// Linear colour of a display colour such as 0xff8800.
pub(super) fn rgb(hex: u32) -> Rgb {
    [16, 8, 0].map(|shift| linear_from_srgb(f64::from(hex >> shift & 0xff) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_encoding_inverts_decoding() {
        for i in 0..=255 {
            let v = f64::from(i) / 255.0;
            assert!((srgb_from_linear(linear_from_srgb(v)) - v).abs() < 1e-7); // the standard's own rounding
        }
    }

    #[test]
    fn a_picture_shows_its_pixels_at_their_centres_and_blends_between() {
        let pixels = vec![[0.0; 3], [1.0; 3], [0.5; 3], [0.25; 3]];
        let picture = Picture { size: [2, 2], pixels: Arc::new(pixels), min: [-1.0; 2], max: [1.0; 2] };
        assert_eq!(picture.color(vec3(0.5, -0.5, 9.0)), [1.0; 3]);
        assert_eq!(picture.color(vec3(0.0, -0.5, 9.0)), [0.5; 3]);
        assert_eq!(picture.color(vec3(-3.0, 3.0, 0.0)), [0.5; 3]);
    }

    #[test]
    fn textures_of_different_seeds_differ_and_stay_in_range() {
        let texture = |seed| {
            Texture::Mosaic(Mosaic {
                palette: vec![rgb(0xffffff), rgb(0x204080), rgb(0xd03010)],
                cell: vec3(0.2, 0.2, f64::INFINITY),
                grain: 0.02,
                seed,
            })
        };
        let (a, b) = (texture(1), texture(2));
        let points = (0..300).map(|k| vec3(f64::from(k).sin(), f64::from(k).cos(), -0.7));
        assert!(points.clone().filter(|&x| a.color(x) != b.color(x)).count() > 200);
        assert!(points.flat_map(|x| a.color(x)).all(|c| (0.0..=1.0).contains(&c)));
    }
}
