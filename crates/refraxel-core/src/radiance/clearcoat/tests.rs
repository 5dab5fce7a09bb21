use super::coat::{Clearcoat, ClearcoatGradient};
use super::facing::incidence;
use super::shown::{ClearcoatedScene, facing, samples};
use crate::field::VoxelField;
use crate::grid::{BRICK_VOXELS, BrickMap, Domain, Extent};
use crate::index::tests::Sequence;
use crate::radiance::quadrature;
use crate::radiance::{ProbeGrid, QuadraturePoint, Segment};
use crate::sh::ShDegree;
use crate::{Aabb, AlignedVec, Ray, Vec3, vec3};

const BEHIND: [f64; 3] = [0.9, 0.7, 0.4];
const WEIGHTS: [f64; 3] = [0.8, -0.5, 1.1];

fn probes(bounds: Aabb<f64>, resolution: u32, degree: u8, seed: u64) -> ProbeGrid<f64> {
    let mut grid = ProbeGrid::grey(bounds, [resolution; 3], ShDegree::new(degree).unwrap());
    let mut r = Sequence(seed);
    grid.coefficients.iter_mut().for_each(|c| *c = 0.2 * r.next());
    grid
}

/// A field of random density, and a clearcoat on it.
fn scene(extent: Extent) -> (VoxelField<f64>, Clearcoat<f64>) {
    let bounds = Aabb::new(vec3(-1.0, -1.2, -0.8), vec3(1.0, 1.2, 0.8));
    let domain = Domain::with_longest(bounds, extent, 11);
    let map = BrickMap::new(domain.resolution, |b| b != [1, 1, 1]);
    let mut f = VoxelField::uniform(domain, map, ShDegree::new(2).unwrap(), -2.0);
    let mut r = Sequence(5);
    f.density.iter_mut().for_each(|v| *v = 2.0 * r.next() - 2.0);
    f.colour.iter_mut().for_each(|v| *v = 0.2 * r.next());
    f.clear_empty_brick();
    (f, Clearcoat { ior: 1.5, strength: probes(bounds, 3, 0, 7), radiance: probes(bounds, 4, 2, 9) })
}

/// A ray and its quadrature points.
struct SampledRay {
    ray: Ray<f64>,
    points: Vec<QuadraturePoint<f64>>,
}

/// Rays of random directions through the box of a field.
fn rays(f: &VoxelField<f64>) -> Vec<SampledRay> {
    let mut r = Sequence(31);
    let ray = |_| {
        let origin = r.vector().normalized() * 3.0;
        let ray = Ray { origin, direction: (r.vector() * 0.5 - origin).normalized() };
        let path = Segment::straight(&ray, &f.domain, 0.0);
        SampledRay { ray, points: path.map_or(Vec::new(), |s| quadrature(&f.domain, &[s], 0.05, 0.3)) }
    };
    (0..40).map(ray).collect()
}

/// A linear functional of the colours of rays.
fn loss(field: &VoxelField<f64>, clearcoat: &Clearcoat<f64>, rays: &[SampledRay]) -> f64 {
    let scene = ClearcoatedScene { field, clearcoat, behind: BEHIND };
    let of = |s: &SampledRay| {
        let shown = scene.shown(&s.ray, &s.points);
        (0..3).map(|c| WEIGHTS[c] * shown[c]).sum::<f64>()
    };
    rays.iter().map(of).sum()
}

/// Asserts that every `stride`-th parameter from `first` on has its central difference of `loss` as its gradient. `value`
/// is the parameter of a number.
fn check<S>(
    state: &mut S,
    exact: &[f64],
    [first, stride]: [usize; 2],
    value: impl Fn(&mut S, usize) -> &mut f64,
    loss: impl Fn(&S) -> f64,
) {
    const STEP: f64 = 1e-6; // of O(1) quantities in f64: truncation 1e-12, rounding 1e-10
    let size = exact.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(size > 1e-3);
    for j in (first..exact.len()).step_by(stride) {
        let before = *value(state, j);
        *value(state, j) = before + STEP;
        let up = loss(state);
        *value(state, j) = before - STEP;
        let fd = (up - loss(state)) / (2.0 * STEP);
        *value(state, j) = before;
        assert!((fd - exact[j]).abs() < 1e-6 * size, "{fd} vs {}", exact[j]);
    }
}

#[test]
fn gradients_match_central_differences() {
    for extent in [Extent::Bounded, Extent::Contracted] {
        let mut state = scene(extent);
        let (f, clearcoat) = &state;
        let rays = rays(f);
        let mut grad = f.zero_gradient();
        let zeros = |g: &ProbeGrid<f64>| vec![0.0; g.coefficients.len()];
        let mut d_clearcoat =
            ClearcoatGradient { strength: zeros(&clearcoat.strength), radiance: zeros(&clearcoat.radiance) };
        for SampledRay { ray, points } in &rays {
            let scene = ClearcoatedScene { field: f, clearcoat, behind: BEHIND };
            scene.shown_vjp(ray, points, WEIGHTS, &mut grad, &mut d_clearcoat);
        }
        let loss = |s: &(VoxelField<f64>, Clearcoat<f64>)| loss(&s.0, &s.1, &rays);
        check(&mut state, &grad.density, [BRICK_VOXELS, 7], |s, j| &mut s.0.density[j], loss);
        let ClearcoatGradient { strength, radiance } = &d_clearcoat;
        check(&mut state, strength, [0, 1], |s, j| &mut s.1.strength.coefficients[j], loss);
        check(&mut state, radiance, [0, 11], |s, j| &mut s.1.radiance.coefficients[j], loss);
    }
}

/// An opaque ball of radius ½ with an edge of some voxels, on a grid of so many nodes.
fn ball(nodes: u32, edge: f64) -> VoxelField<f64> {
    let cube = Aabb::cube(1.0);
    let domain = Domain::with_longest(cube, Extent::Bounded, nodes);
    let map = BrickMap::dense(domain.resolution);
    let mut f = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -10.0);
    for voxel in 64..f.map.voxels() {
        let depth = 0.5 - f.domain.position(Vec3::from(f.map.node(voxel).map(f64::from))).length();
        f.density[voxel] = 20.0 * (depth / (edge * f.domain.voxel())).clamp(-0.5, 0.5);
    }
    f
}

#[test]
fn one_edge_mirrors_one_reflectance_whatever_the_voxels_and_its_width() {
    // Trilinear normals waver within a voxel: the mean over rays up to 40° from the normal.
    for (nodes, edge) in [(32, 3.0), (64, 3.0), (64, 5.0), (96, 4.0)] {
        let f = ball(nodes, edge);
        let (mut sum, mut r) = (0.0, Sequence(3));
        for _ in 0..200 {
            let d = r.vector().normalized();
            let aside = d.cross(r.vector()).normalized() * (0.32 * r.next());
            let ray = Ray { origin: aside - d * 3.0, direction: d };
            let s = Segment::straight(&ray, &f.domain, 0.0).unwrap();
            let points = quadrature(&f.domain, &[s], 0.25 * f.domain.voxel(), 0.5);
            let facing = facing(&samples(&f, &s, &points)).unwrap();
            assert!((facing.opacity - 1.0).abs() < 1e-3);
            let sine = aside.length() / facing.position.length();
            let exact = incidence((1.0 - sine * sine).sqrt(), 1.5).reflectance();
            sum += facing.reflection(d, 1.5).unwrap().share / exact / 200.0;
        }
        assert!((sum - 1.0).abs() < 0.01, "{nodes} nodes, edge of {edge} voxels: {sum}");
    }
}

#[test]
fn fog_mirrors_nothing_and_what_is_mirrored_takes_from_the_rest() {
    let cube = Aabb::cube(1.0);
    let domain = Domain::with_longest(cube, Extent::Bounded, 33);
    let fog = VoxelField::uniform(domain, BrickMap::dense(domain.resolution), ShDegree::new(0).unwrap(), 3.0);
    let ray = Ray { origin: vec3(0.0, 0.0, 3.0), direction: vec3(0.0, 0.0, -1.0) };
    let s = Segment::straight(&ray, &domain, 0.0).unwrap();
    let points = quadrature(&domain, &[s], 0.05, 0.5);
    let facing = facing(&samples(&fog, &s, &points)).unwrap();
    assert!(facing.opacity > 0.99 && facing.reflection(ray.direction, 1.5).is_none());
    // Between equal lights a clearcoat is invisible.
    let mut grey = ball(32, 2.0);
    grey.colour = AlignedVec::filled(grey.colour.len(), 0.0);
    let even = |degree: u8| ProbeGrid::grey(cube, [2; 3], ShDegree::new(degree).unwrap());
    let clearcoat = Clearcoat { ior: 1.5, strength: even(0), radiance: even(1) };
    let scene = ClearcoatedScene { field: &grey, clearcoat: &clearcoat, behind: [0.5; 3] };
    let shown = scene.shown(&ray, &quadrature(&grey.domain, &[s], 0.02, 0.5));
    assert!(shown.iter().all(|v| (v - 0.5).abs() < 1e-6), "{shown:?}");
}
