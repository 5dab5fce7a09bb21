//! The exact tracer: straight flights between closed-form crossings, adaptive integration in graded media, and a tree
//! of reflected and transmitted rays at every interface.
//!
//! What is transported is the basic radiance L/n², which is invariant along a ray, theory (1.4); so no factor n²
//! appears anywhere.

mod flight;
mod radiance;

use super::optics::{fresnel, reflect, refract};
use super::scene::{Hit, Inside, Matter, Scene};
use super::texture::Rgb;
use refraxel_core::Ray;

/// Indices closer than this are the same: the border of a lens that starts with n = 1.
const SAME_INDEX: f64 = 1e-9;

/// Whether interfaces reflect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reflection {
    /// Fresnel reflection and transmission, both followed.
    On,
    /// Only transmission, with weight 1; total internal reflection still reflects.
    Off,
}

/// How far the tree of rays is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Whether interfaces reflect.
    pub reflection: Reflection,
    /// A branch that carries less than this share of its pixel sample is not followed; its energy is given to the
    /// other branch, so that weights always add up to 1.
    pub energy_cut: f64,
    /// Interfaces after which a ray is given up; what it still carries is reported as [`Tally::lost`].
    pub depth: u32,
    /// Error allowed per step in graded media [scene unit].
    pub tolerance: f64,
}

impl Default for Limits {
    fn default() -> Limits {
        Limits { reflection: Reflection::On, energy_cut: 1e-3, depth: 64, tolerance: 1e-9 }
    }
}

/// The cost of tracing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Flights from one surface to the next.
    pub flights: u64,
    /// Sum over samples of the energy that ended at the depth limit.
    pub lost: f64,
}

impl Tally {
    /// Sum of two tallies.
    pub fn plus(self, o: Tally) -> Tally {
        Tally { flights: self.flights + o.flights, lost: self.lost + o.lost }
    }
}

/// A ray under way, with the refractive bodies around it.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Position and unit direction.
    pub ray: Ray<f64>,
    /// Bodies around the position.
    pub inside: Inside,
}

/// The way from one surface to the next: where it ended and what was absorbed.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Position and direction on arrival.
    pub arrival: Ray<f64>,
    /// The surface met, or `None` when the ray left the scene. `crossing.s` is the length of the flight.
    pub hit: Option<Hit>,
    /// Beer–Lambert transmittance of the flight per colour.
    pub transmittance: Rgb,
}

/// The two rays that leave an interface.
#[derive(Clone, Copy, Debug)]
pub struct Interface {
    /// The ray that goes on beyond; `None` on total internal reflection.
    pub transmitted: Option<Beam>,
    /// The mirrored ray.
    pub reflected: Beam,
    /// Fresnel reflectance.
    pub reflectance: f64,
}

/// A scene and the limits under which it is traced.
#[derive(Clone, Copy, Debug)]
pub struct Tracer<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// How far rays are followed.
    pub limits: Limits,
}

impl Tracer<'_> {
    /// A ray that starts outside or inside of bodies.
    pub fn beam(&self, ray: Ray<f64>) -> Beam {
        Beam { ray, inside: self.scene.inside(ray.origin) }
    }

    /// Refraction and reflection where a ray arrives at the surface of a refractive body.
    pub fn interface(&self, inside: Inside, arrival: &Ray<f64>, hit: &Hit) -> Interface {
        let entering = hit.crossing.normal.dot(arrival.direction) < 0.0;
        let bit: Inside = 1 << hit.body;
        let beyond = if entering { inside | bit } else { inside & !bit };
        let n = |set| self.scene.medium(set).map_or(1.0, |m| m.index.n(arrival.origin));
        let (n1, n2) = (n(inside), n(beyond));
        let facing = if entering { hit.crossing.normal } else { -hit.crossing.normal };
        let onward = |direction, inside| Beam { ray: Ray { origin: arrival.origin, direction }, inside };
        let reflected = onward(reflect(arrival.direction, facing), inside);
        if (n1 - n2).abs() < SAME_INDEX {
            return Interface {
                transmitted: Some(onward(arrival.direction, beyond)),
                reflected,
                reflectance: 0.0,
            };
        }
        let reflectance = fresnel(-facing.dot(arrival.direction), n1, n2);
        let transmitted = refract(arrival.direction, facing, n1, n2).map(|d| onward(d, beyond));
        Interface { transmitted, reflected, reflectance }
    }

    /// The single ray that always transmits (and reflects only totally): its vertices, and the ray that leaves the
    /// scene or ends at an opaque surface last.
    pub fn main_path(&self, ray: Ray<f64>) -> Vec<Ray<f64>> {
        let mut beam = self.beam(ray);
        let mut path = vec![ray];
        for _ in 0..self.limits.depth {
            let flight = self.fly(&beam);
            let Some(hit) = flight.hit else {
                path.push(flight.arrival);
                break;
            };
            path.push(flight.arrival);
            if matches!(self.scene.bodies[hit.body].matter, Matter::Opaque(_) | Matter::Glazed(..)) {
                break;
            }
            let at = self.interface(beam.inside, &flight.arrival, &hit);
            beam = at.transmitted.unwrap_or(at.reflected);
            path.push(beam.ray);
        }
        path
    }
}
