//! A scene: bodies, what they are made of, and what surrounds them.

use super::elevations::Elevations;
use super::hash::mix;
use super::medium::{Index, Medium};
use super::shape::{Crossing, Shape};
use super::texture::{Rgb, Texture, noise, srgb_from_linear};
use crate::quantize::quantize;
use refraxel_core::{Aabb, Ray, Vec3, vec3};

/// What a body is made of.
#[derive(Clone, Debug)]
pub enum Matter {
    /// Opaque: a ray ends there with the colour of the texture.
    Opaque(Texture),
    /// Opaque under a clearcoat of this index, whose outer face reflects.
    Glazed(Texture, f64),
    /// Transparent: rays are refracted.
    Refractive {
        /// What fills the body.
        medium: Medium,
        /// Where bodies overlap, the one of the highest priority is there (air bubble 2 in glass 1).
        priority: u32,
        /// For media that fade into air: the part that counts as the object in masks. `None`: all of it.
        visible: Option<Shape>,
    },
}

/// A shape made of something.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name in `scene.json`.
    pub name: String,
    /// Where it is.
    pub shape: Shape,
    /// What it is made of.
    pub matter: Matter,
}

impl Body {
    /// An opaque, emissive body.
    pub fn opaque(name: &str, shape: Shape, texture: Texture) -> Body {
        Body { name: name.into(), shape, matter: Matter::Opaque(texture) }
    }

    /// An opaque body under a clearcoat.
    pub fn glazed(name: &str, shape: Shape, texture: Texture, ior: f64) -> Body {
        Body { name: name.into(), shape, matter: Matter::Glazed(texture, ior) }
    }

    /// A refractive body with a sharp border.
    pub fn refractive(name: &str, shape: Shape, medium: Medium, priority: u32) -> Body {
        Body { name: name.into(), shape, matter: Matter::Refractive { medium, priority, visible: None } }
    }

    /// The medium, where the body is refractive.
    pub fn medium(&self) -> Option<&Medium> {
        match &self.matter {
            Matter::Refractive { medium, .. } => Some(medium),
            Matter::Opaque(_) | Matter::Glazed(..) => None,
        }
    }

    /// The shape that counts as the refractive object in masks and truth.
    pub fn visible_shape(&self) -> &Shape {
        match &self.matter {
            Matter::Refractive { visible: Some(shape), .. } => shape,
            _ => &self.shape,
        }
    }
}

/// Light that comes from far away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Environment {
    /// The same from everywhere.
    Constant(Rgb),
    /// A smooth change with height of the direction, banded so that its refraction shows.
    Sky {
        /// Colour straight up.
        zenith: Rgb,
        /// Colour straight down.
        nadir: Rgb,
        /// Number of bands from nadir to zenith.
        bands: u32,
    },
    /// Blue sky with clouds above wooded hills, as far away as they are to a photographer.
    Landscape {
        /// Choice of clouds and hills.
        seed: u64,
    },
}

impl Environment {
    /// The basic radiance that arrives along a ray leaving towards `d`.
    pub fn color(&self, d: Vec3<f64>) -> Rgb {
        match *self {
            Environment::Constant(c) => c,
            Environment::Sky { zenith, nadir, bands } => {
                let t = 0.5 + d.z.clamp(-1.0, 1.0).asin() / std::f64::consts::PI;
                let t = (t * f64::from(bands)).floor() / f64::from(bands.max(2) - 1);
                [0, 1, 2].map(|k| nadir[k] + (zenith[k] - nadir[k]) * t.min(1.0))
            }
            Environment::Landscape { seed } => landscape(seed, d),
        }
    }
}

/// Hills up to 9° above the horizon, clouds that grow denser towards the horizon.
fn landscape(seed: u64, d: Vec3<f64>) -> Rgb {
    let layer = |k: u64, scale: f64| noise(mix(seed, k), d, scale);
    let around = vec3(d.x, d.y, 0.0).normalized();
    let crest = 0.15 * noise(mix(seed, 1), around, 0.5) + 0.02 * noise(mix(seed, 2), around, 0.05);
    if d.z < crest {
        let light = 0.35 + 0.5 * layer(3, 0.05) + 0.4 * layer(4, 0.012);
        return [0.16 * light, 0.24 * light, 0.14 * light];
    }
    let cloud = (1.9 * layer(5, 0.45) + 0.7 * layer(6, 0.12) + 0.3 * layer(7, 0.03) - 1.15).clamp(0.0, 1.0);
    let blue = [0.17, 0.36, 0.72];
    let pale = [0.55, 0.68, 0.8];
    let t = (1.0 - d.z).powi(3);
    [0, 1, 2].map(|k| {
        let sky = blue[k] + (pale[k] - blue[k]) * t;
        sky + (0.92 - sky) * cloud
    })
}

/// Everything that a ray can meet. At most 64 bodies, so that the set of bodies around a point is one machine word.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name on the command line.
    pub name: String,
    /// One sentence: what the scene shows.
    pub shows: String,
    /// All bodies.
    pub bodies: Vec<Body>,
    /// Light from outside.
    pub environment: Environment,
    /// The box that contains everything worth reconstructing.
    pub bounds: Aabb<f64>,
    /// Where the cameras of [`CameraSet::Upper`](super::CameraSet::Upper) stand.
    pub elevations: Elevations,
}

/// A crossing and the body that it belongs to.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Where the ray crosses the surface.
    pub crossing: Crossing,
    /// Index into [`Scene::bodies`].
    pub body: usize,
}

/// The refractive bodies that contain a point, as bits.
pub type Inside = u64;

impl Scene {
    /// The one sRGB colour behind everything, if it is one.
    pub fn background(&self) -> Option<[u8; 3]> {
        match self.environment {
            Environment::Constant(c) => Some(c.map(|v| quantize(srgb_from_linear(v)))),
            Environment::Sky { .. } | Environment::Landscape { .. } => None,
        }
    }

    /// The first surface of any body before `s_max`.
    #[inline]
    pub fn nearest(&self, ray: &Ray<f64>, s_max: f64) -> Option<Hit> {
        let (mut s_max, mut best) = (s_max, None);
        for (body, b) in self.bodies.iter().enumerate() {
            if let Some(crossing) = b.shape.hit(ray, s_max) {
                s_max = crossing.s;
                best = Some(Hit { crossing, body });
            }
        }
        best
    }

    /// The first visible surface along a straight ray from a point with `inside` around it: that of an opaque body, or
    /// of the visible part of a refractive one. Masks, depth and normals show it.
    pub fn first_visible(&self, ray: &Ray<f64>, inside: Inside) -> Option<Hit> {
        let (mut inside, mut at) = (inside, *ray);
        let mut gone = 0.0;
        // A crossing between equal media (an air bubble that opens into the air) shows nothing.
        for _ in 0..2 * self.bodies.len() {
            let mut hit = self.nearest_by(&at, Body::visible_shape)?;
            let entering = hit.crossing.normal.dot(at.direction) < 0.0;
            let bit: Inside = 1 << hit.body;
            let beyond = if entering { inside | bit } else { inside & !bit };
            let x = at.at(hit.crossing.s);
            gone += hit.crossing.s;
            let n = |set| self.medium(set).map_or(1.0, |m| m.index.n(x));
            let graded = self.medium(inside).is_some_and(|m| !m.index.is_constant())
                || self.medium(beyond).is_some_and(|m| !m.index.is_constant());
            if self.bodies[hit.body].medium().is_none() || graded || n(inside) != n(beyond) {
                hit.crossing.s = gone;
                return Some(hit);
            }
            (inside, at.origin) = (beyond, x);
        }
        None
    }

    fn nearest_by(&self, ray: &Ray<f64>, shape: impl Fn(&Body) -> &Shape) -> Option<Hit> {
        let (mut s_max, mut best) = (f64::INFINITY, None);
        for (body, b) in self.bodies.iter().enumerate() {
            if let Some(crossing) = shape(b).hit(ray, s_max) {
                s_max = crossing.s;
                best = Some(Hit { crossing, body });
            }
        }
        best
    }

    /// True when the first surface that a ray meets need not be the first one that shows: some body is visible only in
    /// part, or is a bubble of air that may open into the air.
    pub fn has_hidden_borders(&self) -> bool {
        self.bodies.iter().any(|b| match &b.matter {
            Matter::Refractive { medium, visible, .. } => {
                visible.is_some() || medium.index == Index::Constant { ior: 1.0 }
            }
            Matter::Opaque(_) | Matter::Glazed(..) => false,
        })
    }

    /// The refractive bodies that contain `x`.
    pub fn inside(&self, x: Vec3<f64>) -> Inside {
        let contains = |b: &Body| b.medium().is_some() && b.shape.contains(x);
        self.bodies.iter().enumerate().filter(|(_, b)| contains(b)).fold(0, |set, (i, _)| set | 1 << i)
    }

    /// The body whose medium fills a point with this set around it: highest priority, later ones first among equals.
    #[inline]
    pub fn filling(&self, inside: Inside) -> Option<usize> {
        let (mut left, mut best) = (inside, None);
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            if let Matter::Refractive { priority, .. } = self.bodies[i].matter
                && best.is_none_or(|(p, _)| priority >= p)
            {
                best = Some((priority, i));
            }
        }
        best.map(|(_, i)| i)
    }

    /// The medium at a point with this set around it; `None` is air, n = 1.
    #[inline]
    pub fn medium(&self, inside: Inside) -> Option<&Medium> {
        self.filling(inside).and_then(|i| self.bodies[i].medium())
    }

    /// The index n(x).
    pub fn index_at(&self, x: Vec3<f64>) -> f64 {
        self.medium(self.inside(x)).map_or(1.0, |m| m.index.n(x))
    }

    /// The twin of this scene: the same without everything refractive.
    pub fn without_refraction(&self) -> Scene {
        let mut twin = self.clone();
        twin.bodies.retain(|b| b.medium().is_none());
        twin
    }

    /// The default box of the built-in scenes.
    pub fn usual_bounds() -> Aabb<f64> {
        Aabb::new(vec3(-1.0, -1.0, -0.75), vec3(1.0, 1.0, 0.75))
    }
}
