//! Painted things of a room: walls, furniture, and what lies around.

use crate::synth::hash::mix;
use crate::synth::scene::Body;
use crate::synth::scenes::surroundings::Setting;
use crate::synth::shape::Shape;
use crate::synth::texture::{Face, Lamp, Mosaic, Paint, Panel, Rgb, Surface, Texture, Tiles, rgb};
use refraxel_core::{Vec3, vec3};

/// Light of a room, and the seed of its patterns.
pub(super) struct Decor {
    lamp: Lamp,
    seed: u64,
}

pub(super) fn colors(display: &[u32]) -> Vec<Rgb> {
    display.iter().map(|&c| rgb(c)).collect()
}

impl Decor {
    pub(super) fn new(setting: &Setting, at: Vec3<f64>, power: f64, ambient: f64) -> Decor {
        Decor { lamp: Lamp { at, power, ambient }, seed: setting.salted(200) }
    }

    pub(super) fn seed(&self, salt: u64) -> u64 {
        mix(self.seed, salt)
    }

    /// Paint of this room's light on a face.
    pub(super) fn texture(&self, face: Face, paint: Paint) -> Texture {
        Texture::Surface(Surface { face, paint, panels: Vec::new(), lamp: self.lamp })
    }

    /// A box painted on its six sides.
    pub(super) fn block(&self, name: &str, min: [f64; 3], max: [f64; 3], paint: Paint) -> Body {
        let (low, high) = (Vec3::from(min), Vec3::from(max));
        let face = Face::Box { center: (low + high) * 0.5, half: (high - low) * 0.5 };
        Body::opaque(name, Shape::cuboid(min, max), self.texture(face, paint))
    }

    /// A wall, floor or ceiling: a box that shows one side.
    pub(super) fn wall(&self, min: [f64; 3], max: [f64; 3], normal: [f64; 3], paint: Paint) -> Body {
        self.hung(min, max, normal, paint, Vec::new())
    }

    /// The same with panels on it.
    pub(super) fn hung(
        &self,
        min: [f64; 3],
        max: [f64; 3],
        normal: [f64; 3],
        paint: Paint,
        panels: Vec<Panel>,
    ) -> Body {
        let surface = Surface { face: Face::Flat(normal.into()), paint, panels, lamp: self.lamp };
        Body::opaque("wall", Shape::cuboid(min, max), Texture::Surface(surface))
    }

    /// A ball.
    pub(super) fn ball(&self, name: &str, center: [f64; 3], radius: f64, paint: Paint) -> Body {
        let face = Face::Round { center: center.into(), radius, half: f64::INFINITY };
        Body::opaque(name, Shape::sphere(center, radius), self.texture(face, paint))
    }

    /// An upright can between two heights.
    pub(super) fn can(&self, name: &str, [x, y]: [f64; 2], z: [f64; 2], radius: f64, paint: Paint) -> Body {
        let face = Face::Round { center: vec3(x, y, 0.5 * (z[0] + z[1])), radius, half: 0.5 * (z[1] - z[0]) };
        let shape = Shape::cylinder([x, y, z[0]], [x, y, z[1]], radius);
        Body::opaque(name, shape, self.texture(face, paint))
    }

    pub(super) fn tiles(&self, salt: u64, edge: [f64; 2], between: u32, display: &[u32]) -> Tiles {
        let grain = [0.3 * edge[0], 0.3 * edge[1]];
        let joint = 0.04 * edge[0].min(edge[1]);
        let between = rgb(between);
        Tiles { edge, shift: 0.0, joint, between, colors: colors(display), grain, seed: self.seed(salt) }
    }

    /// Boards of wood of this length and width.
    pub(super) fn boards(&self, salt: u64, edge: [f64; 2], display: &[u32]) -> Paint {
        let grain = [0.25 * edge[0], 0.07 * edge[1]];
        let tiles = self.tiles(salt, edge, 0x2a1a10, display);
        Paint::Tiles(Tiles { shift: 0.37, grain, joint: 0.02 * edge[1], ..tiles })
    }

    pub(super) fn print(&self, salt: u64, line: f64, display: [u32; 2]) -> Paint {
        Paint::Print { colors: display.map(rgb), line, seed: self.seed(salt) }
    }

    pub(super) fn motifs(&self, salt: u64, cell: f64, display: &[u32]) -> Paint {
        let cell = vec3(cell, cell, f64::INFINITY);
        Paint::Mosaic(Mosaic { palette: colors(display), cell, grain: 0.02, seed: self.seed(salt) })
    }

    pub(super) fn speckle(&self, salt: u64, patch: f64, display: &[u32]) -> Paint {
        Paint::Speckle { colors: colors(display), patch, seed: self.seed(salt) }
    }
}

pub(super) fn stripes(width: f64, display: &[u32]) -> Paint {
    Paint::Stripes { colors: colors(display), width }
}

/// A panel in a frame of this display colour and width.
pub(super) fn panel(min: [f64; 2], max: [f64; 2], frame: (u32, f64), paint: Paint) -> Panel {
    Panel { min, max, paint, frame: (rgb(frame.0), frame.1) }
}
