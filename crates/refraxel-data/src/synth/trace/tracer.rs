//! What a tracer is, and what it does where a ray arrives.

use super::limits::Limits;
use crate::synth::optics::{fresnel, reflect, refract};
use crate::synth::scene::{Hit, Inside, Matter, Scene};
use refraxel_core::Ray;

/// Indices closer than this are the same: the border of a lens that starts with n = 1.
const SAME_INDEX: f64 = 1e-9;

/// A ray under way, with the refractive bodies around it.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Position and unit direction.
    pub ray: Ray<f64>,
    /// Bodies around the position.
    pub inside: Inside,
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
