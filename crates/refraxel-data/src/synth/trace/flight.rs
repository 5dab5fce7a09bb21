//! From one surface to the next: straight in a constant medium, by adaptive integration in a graded one.

use super::tracer::{Beam, Tracer};
use crate::synth::grin::{Phase, next_step, step};
use crate::synth::medium::{Index, Medium};
use crate::synth::optics::transmittance;
use crate::synth::scene::Hit;
use crate::synth::shape::S_MIN;
use crate::synth::texture::Rgb;
use refraxel_core::Ray;

/// Longest chord of a step in a graded medium [scene unit]; its sagitta bounds the error at a
/// grazed edge.
const CHORD_MAX: f64 = 0.05;
/// A ray that winds longer than this in a graded medium is trapped [scene unit].
const WINDING_MAX: f64 = 60.0;

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

impl Tracer<'_> {
    /// Follows a ray to the next surface.
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
}
