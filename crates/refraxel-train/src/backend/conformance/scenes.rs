//! Fields, rays and objectives that the claims share.

use crate::backend::{Batch, IndexObjective, Marching, Objective};
use crate::model::Model;
use refraxel_core::index::priors::Penalty;
use refraxel_core::sh::ShDegree;
use refraxel_core::{
    Aabb, Background, BrickMap, Domain, EnvironmentMap, Extent, Projection, Ray, VoxelField, vec3,
};

/// Pseudo-random numbers in [−1, 1).
pub(super) struct Sequence(pub u64);

impl Sequence {
    pub(super) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
}

/// What a camera in front of the scenes sees, and more behind them.
pub fn projective() -> Extent {
    let ahead = vec3(0.1, -0.2, 1.0).normalized();
    let right = vec3(0.0, 1.0, 0.0).cross(ahead).normalized();
    Extent::Projective(Projection {
        eye: ahead * -3.0,
        axes: [right, ahead.cross(right), ahead],
        near: 1.6,
        edges: [[-0.8, 0.7], [-0.7, 0.8]],
        baseline: 1.4,
    })
}

/// A field of noise with holes.
pub fn field(degree: u8, extent: Extent) -> VoxelField<f32> {
    let bounds = Aabb::new(vec3(-1.0, -1.2, -0.8), vec3(1.0, 1.2, 0.8));
    let domain = Domain::with_longest(bounds, extent, 27);
    let map = BrickMap::new(domain.resolution, |b| (b[0] + b[1] + b[2]) % 4 != 0);
    let mut f = VoxelField::uniform(domain, map, ShDegree::new(degree).unwrap(), -2.0);
    let mut r = Sequence(42 + u64::from(degree));
    f.density.iter_mut().for_each(|v| *v = 2.0 * r.next() - 3.0);
    f.colour.iter_mut().for_each(|v| *v = 0.3 * r.next());
    f.clear_empty_brick();
    f
}

/// The same field, smooth enough that the rounding of a bent path does not show.
pub(super) fn smooth_field(extent: Extent) -> VoxelField<f32> {
    let mut field = field(2, extent);
    for brick in 0..field.map.slots() {
        let at = field.map.brick_of(brick as u32).map(|b| b as f32);
        field.density[64 * brick..64 * (brick + 1)].fill(-2.0 + (at[0] + 2.0 * at[1] + at[2]).sin());
    }
    field.clear_empty_brick();
    field
}

/// A panorama of noise.
pub fn environment() -> Background<f32> {
    let mut r = Sequence(3);
    let mut map = EnvironmentMap::uniform(8, [0.0; 3]);
    map.texels.iter_mut().for_each(|t| *t = [0; 3].map(|_| 0.5 + 0.5 * r.next()));
    Background::Environment(map)
}

/// A scene of straight rays before a panorama.
pub fn straight_model(degree: u8, extent: Extent) -> Model {
    Model::straight(field(degree, extent), environment())
}

/// `n` rays from all around through the middle of the scene.
pub fn batch(n: usize) -> Batch {
    let mut r = Sequence(7);
    let mut b = Batch::default();
    for _ in 0..n {
        let origin = vec3(r.next(), r.next(), r.next()).normalized() * 3.0;
        let target = vec3(r.next(), r.next(), r.next()) * 0.5;
        b.rays.push(Ray { origin, direction: (target - origin).normalized() });
        b.target.push([0.5 + 0.5 * r.next(), 0.5 + 0.5 * r.next(), 0.5 + 0.5 * r.next()]);
        b.offset.push(0.5 + 0.4999 * r.next());
    }
    b
}

/// Those rays of a batch that are wanted, by their number.
pub(super) fn picked(batch: &Batch, is_wanted: impl Fn(usize) -> bool) -> Batch {
    let mut out = Batch::default();
    for k in (0..batch.rays.len()).filter(|&k| is_wanted(k)) {
        out.rays.push(batch.rays[k]);
        out.target.push(batch.target[k]);
        out.offset.push(batch.offset[k]);
    }
    out
}

/// Everything of the field learns, without priors.
pub fn objective() -> Objective {
    Objective { rate_density: 0.1, rate_colour: 0.01, rate_view: 1.0, rate_background: 0.01, ..still() }
}

/// The field and the background are held.
pub(super) fn still() -> Objective {
    Objective::still(Marching::exhaustive(0.7))
}

/// How the index learns: everything counts.
pub fn index_objective() -> IndexObjective {
    IndexObjective {
        rate: 0.01,
        blur: 0.0,
        clip: f32::INFINITY,
        variation: (0.0, Penalty::Squared),
        deviation: (0.0, Penalty::Squared),
        largest: 2.0,
        trust: 0.02,
        surface_rate: 0.01,
        surface_blur: 3.0,
        surface_smooth: 0.01,
        silhouette: 0.2,
        surface_events: 8,
        index_events: 8,
    }
}

/// Largest deviation, relative to the largest entry of the reference.
pub(super) fn relative(a: &[f32], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((f64::from(*a) - b).abs())) / size
}
