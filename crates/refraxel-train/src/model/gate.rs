//! Which straight rays may bend: those that truly meet the object.
//!
//! A smooth transition of the index is some voxels wide, wider than the object's surface. Rays that pass beside the object
//! but through that halo must stay straight; without the gate they bend, and the surroundings of the object fit badly.

use refraxel_core::index::distance_to;
use refraxel_core::{Domain, Ray, Vec3, vec3};
use refraxel_data::quantize;

/// A share of each node's voxel that is object, and what a straight ray meets of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    domain: Domain<f32>,
    /// Share of the voxel of each node, in 1/255, x fastest.
    values: Vec<u8>,
    /// Per cell (n − 1 per axis) the Chebyshev distance in cells to the nearest that can hold a share ≥ ½.
    clearance: Vec<u8>,
}

/// Half of full, trilinear.
pub const HALF: f32 = 127.5;
/// Distance of the points along a ray [voxel].
pub const STEP: f32 = 0.5;
/// How far behind a face hops end [step].
pub const HOP: f32 = 1e-3;

impl Gate {
    /// A gate of the share 0..=1 of each node, such as that of a visual hull.
    ///
    /// # Panics
    /// If there is not one share per node.
    pub fn new(domain: Domain<f32>, fraction: &[f32]) -> Self {
        let values = fraction.iter().copied().map(quantize).collect();
        let Some(gate) = Self::from_values(domain, values) else {
            panic!("one share per node of {:?}, got {}", domain.resolution, fraction.len())
        };
        gate
    }

    /// The gate with these [`Self::values`]; `None` unless there is one per node.
    pub fn from_values(domain: Domain<f32>, values: Vec<u8>) -> Option<Self> {
        let n = domain.resolution.map(|n| n as usize);
        (values.len() == n[0] * n[1] * n[2] && n.iter().all(|&n| n > 1)).then(|| {
            let clearance = clearance(&values, n);
            Self { domain, values, clearance }
        })
    }

    /// The share of each node in 1/255, x fastest: all there is to store.
    pub fn values(&self) -> &[u8] {
        &self.values
    }
    /// Per cell, n − 1 per axis and x fastest, how many cells away the nearest is that a ray may meet the object in: 0 for such a cell.
    pub fn clearances(&self) -> &[u8] {
        &self.clearance
    }
    /// Where the gate lies.
    pub fn domain(&self) -> &Domain<f32> {
        &self.domain
    }

    /// Whether the trilinear share at a point is at least ½.
    pub fn is_inside(&self, x: Vec3<f32>) -> bool {
        self.domain.bounds.contains(x) && self.share_at(x) >= HALF
    }

    /// The trilinear share at a point of the grid, 0 to 255.
    pub fn share_at(&self, x: Vec3<f32>) -> f32 {
        let (n, g) = (self.domain.resolution, self.domain.node(x));
        let cell = std::array::from_fn(|a| (g[a].max(0.0) as usize).min(n[a] as usize - 2));
        self.share(cell, g)
    }

    /// Whether a straight ray meets the object: the trilinear share is at least ½ at one of the points along it that lie
    /// half a voxel apart. Cells that cannot hold such a point are crossed in one hop. Chords shorter than half a voxel
    /// may be missed.
    pub fn admits(&self, ray: &Ray<f32>) -> bool {
        self.enters(ray).is_some()
    }

    /// The distance along a ray of unit direction of the first point at which [`Self::admits`] finds the object [scene unit].
    pub fn enters(&self, ray: &Ray<f32>) -> Option<f32> {
        let [enter, leave] = self.domain.bounds.clip(ray)?;
        let n = self.domain.resolution;
        let scale = self.domain.nodes_per_unit().hadamard(self.domain.unit_per_world());
        let start = (ray.origin - self.domain.bounds.min).hadamard(scale);
        let speed = ray.direction.hadamard(scale); // nodes per scene unit
        let inverse = speed.map(f32::recip);
        let step = STEP / speed.length();
        // Hops end just behind a face, so that rounding cannot hold them on it.
        let nudge = HOP * step;
        let mut s = enter;
        while s <= leave {
            let g = start + speed * s;
            let cell: [usize; 3] = std::array::from_fn(|a| (g[a].max(0.0) as usize).min(n[a] as usize - 2));
            let clear = self.clearance[self.cell_index(cell)];
            if clear == 0 {
                if self.share(cell, g) >= HALF {
                    return Some(s);
                }
                s += step;
                continue;
            }
            let ahead = |a: usize| {
                if speed[a] > 0.0 {
                    cell[a] as f32 + f32::from(clear)
                } else {
                    cell[a] as f32 + 1.0 - f32::from(clear)
                }
            };
            let faces = vec3(ahead(0), ahead(1), ahead(2));
            let exit = (faces - start).hadamard(inverse);
            // An axis along which the ray does not move never leaves.
            let exit = exit.zip(speed, |e, v| if v == 0.0 { f32::INFINITY } else { e }).min_element();
            s = exit.max(s) + nudge;
        }
        None
    }

    #[inline]
    fn cell_index(&self, c: [usize; 3]) -> usize {
        let n = self.domain.resolution.map(|n| n as usize - 1);
        c[0] + n[0] * (c[1] + n[1] * c[2])
    }

    /// Trilinear share at node coordinates `g` in a cell.
    #[inline]
    fn share(&self, c: [usize; 3], g: Vec3<f32>) -> f32 {
        let n = self.domain.resolution.map(|n| n as usize);
        let f = g - Vec3::from(c.map(|c| c as f32));
        let at = |k: usize| {
            let node = c[0] + (k & 1) + n[0] * (c[1] + (k >> 1 & 1) + n[1] * (c[2] + (k >> 2)));
            f32::from(self.values[node])
        };
        refraxel_core::grid::trilinear::weights(f).iter().enumerate().map(|(k, w)| w * at(k)).sum()
    }
}

fn clearance(values: &[u8], n: [usize; 3]) -> Vec<u8> {
    let m = n.map(|n| n - 1);
    let can_be_met = |cell: usize| {
        let node = cell % m[0] + n[0] * (cell / m[0] % m[1] + n[1] * (cell / (m[0] * m[1])));
        let corner = |k: usize| values[node + (k & 1) + n[0] * ((k >> 1 & 1) + n[1] * (k >> 2))];
        (0..8).any(|k| f32::from(corner(k)) >= HALF)
    };
    let marked: Vec<bool> = (0..m[0] * m[1] * m[2]).map(can_be_met).collect();
    distance_to(&marked, n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use refraxel_core::{Aabb, Extent};

    const RADIUS: f32 = 0.6;

    fn domain() -> Domain<f32> {
        Domain {
            bounds: Aabb::new(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.2)),
            extent: Extent::Bounded,
            resolution: [41, 41, 45],
        }
    }

    fn ball() -> Gate {
        let d = domain();
        let fraction = (0..41 * 41 * 45).map(|i| {
            let x = d.position(vec3((i % 41) as f32, (i / 41 % 41) as f32, (i / 1681) as f32));
            (0.5 + (RADIUS - x.length()) / d.voxel()).clamp(0.0, 1.0)
        });
        Gate::new(d, &fraction.collect::<Vec<_>>())
    }

    /// Rays from all around past the origin, and their distance from it.
    fn rays() -> impl Iterator<Item = (Ray<f32>, f32)> {
        let random = Random::new(7);
        (0..4000).map(move |i| {
            let r = |k: u64| random.uniform(i, k) as f32 * 2.0 - 1.0;
            let origin = vec3(r(0), r(1), r(2)).normalized() * 3.0;
            let ray = Ray { origin, direction: (vec3(r(3), r(4), r(5)) - origin).normalized() };
            (ray, origin.cross(ray.direction).length())
        })
    }

    #[test]
    fn rays_that_meet_the_ball_are_admitted_and_those_beside_it_are_not() {
        let (gate, voxel) = (ball(), domain().voxel());
        let (mut met, mut missed) = (0, 0);
        for (ray, distance) in rays() {
            // A chord of two steps has its middle 0.02 voxels under the surface; the grid rounds the ball by as much.
            if distance < RADIUS - 0.1 * voxel {
                met += 1;
                assert!(gate.admits(&ray), "{distance}");
            } else if distance > RADIUS + 0.1 * voxel {
                missed += 1;
                assert!(!gate.admits(&ray), "{distance}");
            }
        }
        assert!(met > 500 && missed > 500, "{met} {missed}");
    }

    #[test]
    fn hops_change_nothing() {
        let gate = ball();
        let plain = Gate { clearance: vec![0; gate.clearance.len()], ..gate.clone() };
        let differ = rays().filter(|(ray, _)| gate.admits(ray) != plain.admits(ray)).count();
        // Only rays that graze the surface depend on where the samples fall.
        assert!(differ <= 8, "{differ}");
    }

    #[test]
    fn rays_along_the_axes_and_from_within_are_met() {
        let gate = ball();
        for (origin, direction, met) in [
            (vec3(-2.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), true),
            (vec3(-2.0, 0.7, 0.0), vec3(1.0, 0.0, 0.0), false),
            (vec3(0.1, 0.0, 3.0), vec3(0.0, 0.0, -1.0), true),
            (vec3(0.1, 0.0, 3.0), vec3(0.0, 0.0, 1.0), false),
            (vec3(0.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), true),
            (vec3(0.0, 0.8, 0.0), vec3(0.0, 1.0, 0.0), false),
        ] {
            assert_eq!(gate.admits(&Ray { origin, direction }), met, "{origin:?} {direction:?}");
        }
    }

    #[test]
    fn a_gate_survives_storage_and_refuses_other_sizes() {
        let gate = ball();
        assert_eq!(Gate::from_values(domain(), gate.values().to_vec()), Some(gate));
        assert_eq!(Gate::from_values(domain(), vec![0; 7]), None);
    }
}
