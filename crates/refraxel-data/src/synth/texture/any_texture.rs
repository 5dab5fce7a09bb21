//! A texture of any kind.

use super::color::Rgb;
use super::mosaic::Mosaic;
use super::picture::Picture;
use super::surface::Surface;
use refraxel_core::Vec3;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::texture::color::rgb;
    use refraxel_core::vec3;

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
