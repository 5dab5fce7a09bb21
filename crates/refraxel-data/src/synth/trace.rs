//! The exact tracer: straight flights between closed-form crossings, adaptive integration in graded media, and a tree
//! of reflected and transmitted rays at every interface.
//!
//! What is transported is the basic radiance L/n², which is invariant along a ray, theory (1.4); so no factor n²
//! appears anywhere.

use super::grin::{Phase, next_step, step};
use super::medium::{Index, Medium};
use super::optics::{fresnel, reflect, refract, transmittance};
use super::scene::{Hit, Inside, Matter, Scene};
use super::shape::S_MIN;
use super::texture::Rgb;
use refraxel_core::Ray;

/// Indices closer than this are the same: the border of a lens that starts with n = 1.
const SAME_INDEX: f64 = 1e-9;
/// Longest chord of a step in a graded medium [scene unit]; its sagitta bounds what a grazed edge may be off by.
const CHORD_MAX: f64 = 0.05;
/// A ray that winds longer than this in a graded medium is trapped [scene unit].
const WINDING_MAX: f64 = 60.0;

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

/// What tracing has cost.
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

/// One flight: where it ended and what was absorbed on the way.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Position and direction on arrival.
    pub arrival: Ray<f64>,
    /// The surface met, or `None` when the ray left the scene. `crossing.s` is the length of the flight.
    pub hit: Option<Hit>,
    /// Beer–Lambert transmittance of the flight per colour.
    pub transmittance: Rgb,
}

/// What an interface does to a ray.
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
    /// What is traced.
    pub scene: &'a Scene,
    /// How far.
    pub limits: Limits,
}

impl Tracer<'_> {
    /// A ray that starts outside or inside of bodies.
    pub fn beam(&self, ray: Ray<f64>) -> Beam {
        Beam { ray, inside: self.scene.inside(ray.origin) }
    }

    /// Follow a ray to the next surface.
    pub fn fly(&self, beam: &Beam) -> Flight {
        let medium = self.scene.medium(beam.inside);
        match medium {
            Some(m) if !m.index.is_constant() => self.fly_bent(beam, m),
            _ => self.fly_straight(beam, medium),
        }
    }

    fn fly_straight(&self, beam: &Beam, medium: Option<&Medium>) -> Flight {
        let hit = self.scene.nearest(&beam.ray, f64::INFINITY);
        let s = hit.map_or(0.0, |h| h.crossing.s);
        let arrival = Ray { origin: beam.ray.at(s), direction: beam.ray.direction };
        Flight { arrival, hit, transmittance: medium.map_or([1.0; 3], |m| transmittance(m.absorption, s)) }
    }

    fn fly_bent(&self, beam: &Beam, medium: &Medium) -> Flight {
        let mut y = Phase::new(beam.ray.origin, beam.ray.direction, &medium.index);
        let mut h = 0.5 * CHORD_MAX / y.p.length();
        let land = |y: Phase, hit: Option<Hit>| Flight {
            arrival: Ray { origin: y.x, direction: y.direction() },
            hit,
            transmittance: transmittance(medium.absorption, y.s),
        };
        while y.s < WINDING_MAX {
            h = h.min(CHORD_MAX / y.p.length());
            let (end, error) = step(&medium.index, &y, h);
            let taken = h;
            h = next_step(h, error, self.limits.tolerance);
            if error > self.limits.tolerance {
                continue;
            }
            let chord = end.x - y.x;
            let ray = Ray { origin: y.x, direction: chord.normalized() };
            // A little beyond the end, so that no surface falls between two chords.
            if let Some(hit) = self.scene.nearest(&ray, chord.length() + S_MIN) {
                let (at, hit) = self.arrive(&medium.index, &y, hit, taken * hit.crossing.s / chord.length());
                return land(at, Some(hit));
            }
            y = end;
        }
        land(y, None)
    }

    /// The exact event, theory (6.11): the time at which the bent ray, not its chord, meets the surface that the
    /// chord met.
    fn arrive(&self, index: &Index, start: &Phase, hit: Hit, guess: f64) -> (Phase, Hit) {
        let shape = &self.scene.bodies[hit.body].shape;
        let mut t = guess;
        let mut at = step(index, start, t).0;
        let mut normal = hit.crossing.normal;
        for _ in 0..20 {
            let (f, n) = shape.surface(at.x);
            normal = n;
            let slope = n.dot(at.p);
            // Where the bent ray only touches what its chord crossed, Newton's step would run away.
            if slope == 0.0 || (f / slope).abs() > CHORD_MAX {
                break;
            }
            t -= f / slope;
            at = step(index, start, t).0;
            if f.abs() < 1e-15 {
                break;
            }
        }
        // Near an edge or on a smooth-shaded mesh the chord's own normal tells entering from leaving.
        if normal.dot(hit.crossing.normal) < 0.9 {
            normal = hit.crossing.normal;
        }
        let mut hit = hit;
        hit.crossing.normal = normal;
        hit.crossing.s = at.s;
        (at, hit)
    }

    /// What happens where a ray arrives at the surface of a refractive body.
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

    /// The basic radiance that arrives against a ray, and what it cost.
    pub fn radiance(&self, ray: Ray<f64>) -> (Rgb, Tally) {
        let mut tally = Tally::default();
        let color = self.gather(&self.beam(ray), 1.0, 0, &mut tally);
        (color, tally)
    }

    /// Radiance against a camera ray and the body that it meets first.
    pub(super) fn gather_from(&self, beam: &Beam, tally: &mut Tally) -> (Rgb, Option<usize>) {
        let flight = self.fly(beam);
        (self.shade(beam, &flight, 1.0, 0, tally), flight.hit.map(|h| h.body))
    }

    /// Radiance against `beam`, which contributes with `weight` to its pixel sample.
    pub(super) fn gather(&self, beam: &Beam, weight: f64, depth: u32, tally: &mut Tally) -> Rgb {
        self.shade(beam, &self.fly(beam), weight, depth, tally)
    }

    /// Radiance that arrives against `beam` when it flies as `flight` tells.
    fn shade(&self, beam: &Beam, flight: &Flight, weight: f64, depth: u32, tally: &mut Tally) -> Rgb {
        tally.flights += 1;
        let weight = weight * flight.transmittance.into_iter().fold(0.0, f64::max);
        let Some(hit) = flight.hit else {
            return product(flight.transmittance, self.scene.environment.color(flight.arrival.direction));
        };
        let arriving = match &self.scene.bodies[hit.body].matter {
            Matter::Opaque(texture) => texture.color(flight.arrival.origin),
            Matter::Glazed(texture, ior) => {
                let own = texture.color(flight.arrival.origin);
                self.glaze(beam.inside, (&flight.arrival, &hit, *ior), own, (weight, depth), tally)
            }
            Matter::Refractive { .. } if depth >= self.limits.depth || weight < self.limits.energy_cut => {
                tally.lost += weight;
                [0.0; 3]
            }
            Matter::Refractive { .. } => {
                let interface = self.interface(beam.inside, &flight.arrival, &hit);
                self.split(&interface, weight, depth, tally)
            }
        };
        product(flight.transmittance, arriving)
    }

    /// Radiance of an opaque surface under a clear coat: R L_r + (1 − R) of its own. What the coat sends back from within is
    /// part of that.
    fn glaze(
        &self,
        inside: Inside,
        (arrival, hit, ior): (&Ray<f64>, &Hit, f64),
        own: Rgb,
        (weight, depth): (f64, u32),
        tally: &mut Tally,
    ) -> Rgb {
        let n = self.scene.medium(inside).map_or(1.0, |m| m.index.n(arrival.origin));
        let cosine = -hit.crossing.normal.dot(arrival.direction);
        let r = fresnel(cosine.clamp(0.0, 1.0), n, ior);
        let small = weight * r < self.limits.energy_cut || depth >= self.limits.depth;
        if self.limits.reflection == Reflection::Off || small {
            return own;
        }
        let direction = reflect(arrival.direction, hit.crossing.normal);
        let beam = Beam { ray: Ray { origin: arrival.origin, direction }, inside };
        let mirrored = self.gather(&beam, weight * r, depth + 1, tally);
        [0, 1, 2].map(|k| r * mirrored[k] + (1.0 - r) * own[k])
    }

    /// Radiance from both branches of an interface, theory (6.3): R L_r + (1 − R) L_t.
    fn split(&self, at: &Interface, weight: f64, depth: u32, tally: &mut Tally) -> Rgb {
        let Some(transmitted) = &at.transmitted else {
            return self.gather(&at.reflected, weight, depth + 1, tally);
        };
        let r = at.reflectance;
        let cut = self.limits.energy_cut;
        if self.limits.reflection == Reflection::Off || weight * r < cut {
            return self.gather(transmitted, weight, depth + 1, tally);
        }
        if weight * (1.0 - r) < cut {
            return self.gather(&at.reflected, weight, depth + 1, tally);
        }
        let a = self.gather(&at.reflected, weight * r, depth + 1, tally);
        let b = self.gather(transmitted, weight * (1.0 - r), depth + 1, tally);
        [0, 1, 2].map(|k| r * a[k] + (1.0 - r) * b[k])
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

#[inline]
fn product(a: Rgb, b: Rgb) -> Rgb {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

#[cfg(test)]
mod tests {
    use super::super::scene::{Body, Environment};
    use super::super::shape::Shape;
    use super::super::texture::Texture;
    use super::*;
    use refraxel_core::{Aabb, Vec3, vec3};

    #[test]
    fn a_glaze_mirrors_a_share_of_what_is_above_it_and_none_without_reflection() {
        let black = Texture::Plain([0.0; 3]);
        let scene = Scene {
            name: String::new(),
            shows: String::new(),
            bodies: vec![Body::glazed("ball", Shape::sphere([0.0; 3], 1.0), black, 1.5)],
            environment: Environment::Constant([1.0; 3]),
            bounds: Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0)),
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
