//! The light that arrives against a ray: the sum over the tree of reflected and transmitted rays.

use super::flight::Flight;
use super::limits::{Reflection, Tally};
use super::tracer::{Beam, Interface, Tracer};
use crate::synth::optics::{fresnel, reflect};
use crate::synth::scene::{Inside, Matter};
use crate::synth::texture::Rgb;
use refraxel_core::{Ray, Vec3};

/// A branch of the tree of rays that start at one pixel sample.
#[derive(Clone, Copy, Debug)]
struct Branch {
    /// Share of the sample's energy that the branch carries.
    weight: f64,
    /// Interfaces behind it.
    depth: u32,
}

impl Branch {
    /// The camera ray.
    const ROOT: Branch = Branch { weight: 1.0, depth: 0 };

    /// The branch beyond the next interface, which lets this share through.
    fn onward(self, share: f64) -> Branch {
        Branch { weight: self.weight * share, depth: self.depth + 1 }
    }
}

/// Where a ray arrives at an opaque surface under a clearcoat.
struct Glaze<'a> {
    arrival: &'a Ray<f64>,
    /// Refractive bodies around the place.
    inside: Inside,
    /// Outward unit normal.
    normal: Vec3<f64>,
    /// Index of the clearcoat.
    ior: f64,
    /// Radiance of the surface without a clearcoat.
    own: Rgb,
}

impl Tracer<'_> {
    /// The basic radiance that arrives against a ray, and what it cost.
    pub fn radiance(&self, ray: Ray<f64>) -> (Rgb, Tally) {
        let mut tally = Tally::default();
        let color = self.gather(&self.beam(ray), Branch::ROOT, &mut tally);
        (color, tally)
    }

    /// Radiance against a camera ray and the body that it meets first.
    pub(in crate::synth) fn gather_from(&self, beam: &Beam, tally: &mut Tally) -> (Rgb, Option<usize>) {
        let flight = self.fly(beam);
        (self.shade(beam, &flight, Branch::ROOT, tally), flight.hit.map(|h| h.body))
    }

    /// Radiance that arrives against `beam`.
    fn gather(&self, beam: &Beam, branch: Branch, tally: &mut Tally) -> Rgb {
        self.shade(beam, &self.fly(beam), branch, tally)
    }

    /// Radiance that arrives against `beam` along its `flight`.
    fn shade(&self, beam: &Beam, flight: &Flight, branch: Branch, tally: &mut Tally) -> Rgb {
        tally.flights += 1;
        let weight = branch.weight * flight.transmittance.into_iter().fold(0.0, f64::max);
        let branch = Branch { weight, ..branch };
        let Some(hit) = flight.hit else {
            return product(flight.transmittance, self.scene.environment.color(flight.arrival.direction));
        };
        let is_last = branch.depth >= self.limits.depth || weight < self.limits.energy_cut;
        let arriving = match &self.scene.bodies[hit.body].matter {
            Matter::Opaque(texture) => texture.color(flight.arrival.origin),
            Matter::Glazed(texture, ior) => {
                let own = texture.color(flight.arrival.origin);
                let (inside, normal, ior) = (beam.inside, hit.crossing.normal, *ior);
                let glaze = Glaze { arrival: &flight.arrival, inside, normal, ior, own };
                self.glaze(&glaze, branch, tally)
            }
            Matter::Refractive { .. } if is_last => {
                tally.lost += weight;
                [0.0; 3]
            }
            Matter::Refractive { .. } => {
                let interface = self.interface(beam.inside, &flight.arrival, &hit);
                self.split(&interface, branch, tally)
            }
        };
        product(flight.transmittance, arriving)
    }

    /// Radiance of an opaque surface under a clearcoat: R L_r + (1 − R) of its own. Its own contains the light that the
    /// clearcoat reflects back from within.
    fn glaze(&self, at: &Glaze, branch: Branch, tally: &mut Tally) -> Rgb {
        let n = self.scene.medium(at.inside).map_or(1.0, |m| m.index.n(at.arrival.origin));
        let cosine = -at.normal.dot(at.arrival.direction);
        let r = fresnel(cosine.clamp(0.0, 1.0), n, at.ior);
        let small = branch.weight * r < self.limits.energy_cut || branch.depth >= self.limits.depth;
        if self.limits.reflection == Reflection::Off || small {
            return at.own;
        }
        let direction = reflect(at.arrival.direction, at.normal);
        let beam = Beam { ray: Ray { origin: at.arrival.origin, direction }, inside: at.inside };
        let mirrored = self.gather(&beam, branch.onward(r), tally);
        [0, 1, 2].map(|k| r * mirrored[k] + (1.0 - r) * at.own[k])
    }

    /// Radiance from both branches of an interface, theory (6.3): R L_r + (1 − R) L_t.
    fn split(&self, at: &Interface, branch: Branch, tally: &mut Tally) -> Rgb {
        let Some(transmitted) = &at.transmitted else {
            return self.gather(&at.reflected, branch.onward(1.0), tally);
        };
        let r = at.reflectance;
        let cut = self.limits.energy_cut;
        if self.limits.reflection == Reflection::Off || branch.weight * r < cut {
            return self.gather(transmitted, branch.onward(1.0), tally);
        }
        if branch.weight * (1.0 - r) < cut {
            return self.gather(&at.reflected, branch.onward(1.0), tally);
        }
        let a = self.gather(&at.reflected, branch.onward(r), tally);
        let b = self.gather(transmitted, branch.onward(1.0 - r), tally);
        [0, 1, 2].map(|k| r * a[k] + (1.0 - r) * b[k])
    }
}

#[inline]
fn product(a: Rgb, b: Rgb) -> Rgb {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

#[cfg(test)]
mod tests {
    use super::super::limits::Limits;
    use super::*;
    use crate::synth::elevations::Elevations;
    use crate::synth::scene::{Body, Environment, Scene};
    use crate::synth::shape::Shape;
    use crate::synth::texture::Texture;
    use refraxel_core::{Aabb, vec3};

    #[test]
    fn a_glaze_mirrors_a_share_of_what_is_above_it_and_none_without_reflection() {
        let black = Texture::Plain([0.0; 3]);
        let scene = Scene {
            name: String::new(),
            shows: String::new(),
            bodies: vec![Body::glazed("ball", Shape::sphere([0.0; 3], 1.0), black, 1.5)],
            environment: Environment::Constant([1.0; 3]),
            bounds: Aabb::cube(1.0),
            elevations: Elevations::UPPER,
        };
        let seen = |reflection, offset: f64| {
            let limits = Limits { reflection, ..Limits::default() };
            let ray = Ray { origin: vec3(offset, 0.0, 3.0), direction: vec3(0.0, 0.0, -1.0) };
            Tracer { scene: &scene, limits }.radiance(ray).0[0]
        };
        assert!((seen(Reflection::On, 0.0) - 0.04).abs() < 1e-12);
        let oblique = fresnel(0.6, 1.0, 1.5); // where sin θ = 0.8
        assert!((seen(Reflection::On, 0.8) - oblique).abs() < 1e-12 && oblique > 0.05);
        assert_eq!([seen(Reflection::Off, 0.8), seen(Reflection::On, 1.1)], [0.0, 1.0]);
    }
}
