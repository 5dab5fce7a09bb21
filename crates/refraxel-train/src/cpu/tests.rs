//! The CPU backend against the reference of `refraxel-core`, rung by rung.

use super::*;
use crate::backend::IndexObjective;
use refraxel_core::index::priors::Penalty;
use refraxel_core::radiance::{PixelAdjoint, QuadraturePoint, Segment, quadrature, render, render_vjp};
use refraxel_core::sh::ShDegree;
use refraxel_core::{Aabb, Extent, vec3};

mod bent;
mod clearcoated;
mod mirrored;

/// f32 epsilon 6e-8 × about 30 samples × up to 16 terms each, with a margin of 3.
const TOLERANCE: f64 = 1e-4;

struct Sequence(u64);
impl Sequence {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }
}

fn field(degree: u8, extent: Extent) -> VoxelField<f32> {
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

fn batch(n: usize) -> Batch {
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

fn objective() -> Objective {
    Objective {
        marching: Marching::exhaustive(0.7),
        sparsity: 0.0,
        opacity: 0.0,
        tv_density: 0.0,
        tv_colour: 0.0,
        tv_period: 1,
        rate_density: 0.1,
        rate_colour: 0.01,
        rate_view: 1.0,
        rate_background: 0.01,
        index: None,
        reflection: None,
    }
}

fn environment() -> Background<f32> {
    let mut r = Sequence(3);
    let mut map = EnvironmentMap::uniform(8, [0.0; 3]);
    map.texels.iter_mut().for_each(|t| *t = [0; 3].map(|_| 0.5 + 0.5 * r.next()));
    Background::Environment(map)
}

fn relative(a: &[f32], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((f64::from(*a) - b).abs())) / size
}

/// The reference in double precision.
struct Oracle {
    field: VoxelField<f64>,
    background: Background<f64>,
}

impl Oracle {
    fn new(backend: &CpuBackend) -> Self {
        let f = backend.field();
        let wide = |v: &[f32]| AlignedVec::from_slice(&v.iter().map(|&v| f64::from(v)).collect::<Vec<_>>());
        let background = match backend.background() {
            Background::Constant(c) => Background::Constant(c.map(f64::from)),
            Background::Environment(m) => {
                let texels = m.texels.iter().map(|t| t.map(f64::from)).collect();
                Background::Environment(EnvironmentMap::from_texels(m.height(), texels).unwrap())
            }
        };
        let field = VoxelField {
            domain: f.domain.cast(),
            map: f.map.clone(),
            degree: f.degree,
            density: wide(&f.density),
            colour: wide(&f.colour),
        };
        Self { field, background }
    }

    fn path(
        &self,
        ray: &Ray<f32>,
        offset: f32,
        step: f32,
    ) -> Option<(Segment<f64>, Vec<QuadraturePoint<f64>>)> {
        let s = Segment::straight(&ray.cast(), &self.field.domain, 0.0)?;
        let step = f64::from(step) * self.field.domain.voxel();
        Some((s, quadrature(&self.field.domain, &[s], step, f64::from(offset))))
    }
}

#[test]
fn rendering_agrees_with_the_reference() {
    for (degree, extent) in
        [(0, Extent::Bounded), (1, Extent::Bounded), (2, Extent::Contracted), (3, Extent::Bounded)]
    {
        let backend = CpuBackend::new(field(degree, extent), environment());
        let oracle = Oracle::new(&backend);
        let b = batch(64);
        let marching = objective().marching;
        for (ray, got) in b.rays.iter().zip(backend.render(&b.rays, &marching)) {
            let (s, points) = oracle.path(ray, 0.5, marching.step).unwrap();
            let want = render(&oracle.field, &[s], &points);
            let behind = oracle.background.radiance(s.start, s.momentum);
            for c in 0..3 {
                let colour = want.colour[c] + want.transmittance * behind[c];
                assert!((f64::from(got.colour[c]) - colour).abs() < TOLERANCE, "degree {degree}");
            }
        }
    }
}

#[test]
fn gradients_agree_with_the_reference() {
    for degree in 0..=3 {
        let backend = CpuBackend::new(field(degree, Extent::Bounded), environment());
        let (oracle, b, o) = (Oracle::new(&backend), batch(300), objective());
        let got = backend.gradient(&b, &o);
        let mut grad = oracle.field.zero_gradient();
        let (mut d_rays, mut got_rays) = (Vec::new(), Vec::new());
        let mut texels = vec![0.0; 3 * got.background.len()];
        for (k, ray) in b.rays.iter().enumerate() {
            let Some((s, points)) = oracle.path(ray, b.offset[k], o.marching.step) else { continue };
            let behind = oracle.background.radiance(s.start, s.momentum);
            let pixel = render(&oracle.field, &[s], &points);
            let colour = std::array::from_fn(|c| {
                2.0 * (pixel.colour[c] + pixel.transmittance * behind[c] - f64::from(b.target[k][c]))
            });
            let d = PixelAdjoint { colour, transmittance: 0.0, behind };
            let path = render_vjp(&oracle.field, &[s], &points, &d, &mut grad);
            let Background::Environment(map) = &oracle.background else { unreachable!() };
            let (stencil, left) = (map.stencil(s.momentum), pixel.transmittance);
            for (i, w) in stencil.index.into_iter().zip(stencil.weight) {
                (0..3).for_each(|c| texels[3 * i + c] += left * w * colour[c]);
            }
            let free = map.radiance_vjp(s.momentum, colour.map(|g| g * left));
            let d_direction = path[0].momentum + free - s.momentum * s.momentum.dot(free);
            d_rays.extend([path[0].start, d_direction].iter().flat_map(|v| v.to_array()));
            got_rays.extend([got.rays[k].0, got.rays[k].1].iter().flat_map(|v| v.to_array()));
        }
        assert!(
            relative(&got.field.density, &grad.density) < TOLERANCE,
            "density, degree {degree}: {}",
            relative(&got.field.density, &grad.density)
        );
        assert!(
            relative(&got.field.colour, &grad.colour) < TOLERANCE,
            "colour, degree {degree}: {}",
            relative(&got.field.colour, &grad.colour)
        );
        assert!(relative(got.background.as_flattened(), &texels) < TOLERANCE, "texels, degree {degree}");
        // A ray's gradient jumps where a sample changes its cell by rounding; 1e-3 of the largest covers it.
        assert!(
            relative(&got_rays, &d_rays) < 1e-3,
            "rays, degree {degree}: {}",
            relative(&got_rays, &d_rays)
        );
    }
}

#[test]
fn a_step_is_the_same_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut backend = CpuBackend::new(field(2, Extent::Bounded), environment());
            let o = Objective { tv_density: 0.01, tv_colour: 0.01, sparsity: 0.01, ..objective() };
            let outcomes: Vec<_> = (0..3).map(|step| backend.learn(&batch(700), &o, step)).collect();
            (outcomes, backend.field().density.to_vec(), backend.field().colour.to_vec())
        })
    };
    let one = run(1);
    for threads in [2, 3] {
        let many = run(threads);
        assert_eq!(one.0, many.0);
        assert!(one.1 == many.1 && one.2 == many.2, "bitwise equal parameters");
    }
}

#[test]
fn cut_offs_change_a_picture_by_no_more_than_they_say() {
    let mut backend = CpuBackend::new(field(2, Extent::Bounded), environment());
    let b = batch(200);
    let exact = backend.render(&b.rays, &Marching::exhaustive(0.7));
    let marching = Marching { min_optical_depth: 1e-4, min_transmittance: 1e-3, ..Marching::exhaustive(0.7) };
    backend.refresh_occupancy(&marching);
    let samples = 4.0 * 27.0 / 0.7;
    for (a, b) in exact.iter().zip(backend.render(&b.rays, &marching)) {
        let bound = (1e-4 * samples + 1e-3) * 2.0;
        assert!((0..3).all(|c| (a.colour[c] - b.colour[c]).abs() < bound));
    }
}

#[test]
fn learning_lowers_the_loss() {
    let mut backend = CpuBackend::new(field(1, Extent::Bounded), environment());
    let (b, o) = (batch(500), objective());
    let losses: Vec<f64> = (0..30).map(|step| backend.learn(&b, &o, step).squared_error).collect();
    assert!(losses[29] < 0.3 * losses[0], "{losses:?}");
}

#[test]
fn resampling_to_a_finer_grid_keeps_the_picture() {
    let mut f = field(1, Extent::Bounded);
    f.map = BrickMap::dense(f.domain.resolution);
    let mut smooth = VoxelField::uniform(f.domain, f.map.clone(), f.degree, -3.0);
    for node in refraxel_core::grid::bricks::coordinates(f.domain.resolution) {
        // Linear in the coordinates, so that trilinear interpolation is exact.
        smooth.density[f.map.voxel(node)] = -3.0 + 0.02 * node[0] as f32 - 0.01 * node[2] as f32;
    }
    let mut backend = CpuBackend::new(smooth, Background::Constant([1.0; 3]));
    let b = batch(100);
    let before = backend.render(&b.rays, &Marching::exhaustive(0.5));
    let fine = Domain { resolution: f.domain.resolution.map(|n| 2 * n - 1), ..f.domain };
    backend.resample(fine, BrickMap::dense(fine.resolution));
    // Twice as many nodes: a step of one voxel is as long as half a voxel was.
    for (a, b) in before.iter().zip(backend.render(&b.rays, &Marching::exhaustive(1.0))) {
        assert!((a.transmittance - b.transmittance).abs() < 1e-4, "{} {}", a.transmittance, b.transmittance);
    }
}

#[test]
fn peak_weights_mark_what_rays_see() {
    let mut f = field(0, Extent::Bounded);
    f.density.fill(-8.0);
    let node = [13, 16, 10];
    let voxel = f.map.voxel(node);
    assert!(voxel >= 64);
    f.density[voxel] = 6.0;
    let at = f.domain.position(Vec3::from(node.map(|n| n as f32)));
    let backend = CpuBackend::new(f, Background::Constant([1.0; 3]));
    let origin = at + vec3(3.0, 0.0, 0.0);
    let ray = Ray { origin, direction: (at - origin).normalized() };
    let peak = backend.peak_weights(&[ray], &Marching::exhaustive(0.5));
    assert!(peak[voxel] > 0.3, "{}", peak[voxel]);
    assert!(peak.iter().filter(|&&p| p > 0.1).count() < 30);
}

#[test]
fn skipping_never_jumps_over_matter_in_flat_contracted_boxes() {
    let bounds = Aabb::new(vec3(-4.0, -4.0, -0.4), vec3(4.0, 4.0, 0.4));
    let domain = Domain::with_longest(bounds, Extent::Contracted, 80);
    let map = BrickMap::new(domain.resolution, |b| (b[0] * 7 + b[1] * 5 + b[2] * 3) % 11 == 0);
    let mut f = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -1.0);
    f.clear_empty_brick();
    let backend = CpuBackend::new(f, Background::Constant([0.2; 3]));
    let oracle = Oracle::new(&backend);
    let mut b = batch(300);
    b.rays.iter_mut().for_each(|r| r.origin *= 2.0);
    let marching = objective().marching;
    for (ray, got) in b.rays.iter().zip(backend.render(&b.rays, &marching)) {
        let (s, points) = oracle.path(ray, 0.5, marching.step).unwrap();
        let want = render(&oracle.field, &[s], &points);
        assert!((f64::from(got.transmittance) - want.transmittance).abs() < 1e-3, "{ray:?}");
    }
}

#[test]
fn a_parameter_that_is_not_a_number_is_reported() {
    for poison in [f32::NAN, f32::INFINITY] {
        for which in 0..2 {
            let mut f = field(1, Extent::Bounded);
            let values = if which == 0 { &mut f.density } else { &mut f.colour };
            values[64..].fill(poison);
            let outcome = CpuBackend::new(f, environment()).learn(&batch(50), &objective(), 0);
            assert!(!outcome.finite, "{poison} in array {which}");
        }
    }
}

#[test]
fn priors_on_rays_and_samples_have_the_reference_gradient() {
    let backend = CpuBackend::new(field(0, Extent::Bounded), Background::Constant([0.3; 3]));
    let (oracle, b) = (Oracle::new(&backend), batch(100));
    let o = Objective { sparsity: 0.7, opacity: 0.4, ..objective() };
    let (with, without) = (backend.gradient(&b, &o), backend.gradient(&b, &objective()));
    let mut grad = oracle.field.zero_gradient();
    for (k, ray) in b.rays.iter().enumerate() {
        let Some((s, points)) = oracle.path(ray, b.offset[k], o.marching.step) else { continue };
        let pixel = render(&oracle.field, &[s], &points);
        let transmittance = 0.4 * refraxel_core::priors::opacity_beta_slope(pixel.transmittance);
        let d = PixelAdjoint { colour: [0.0; 3], transmittance, behind: [0.3; 3] };
        render_vjp(&oracle.field, &[s], &points, &d, &mut grad);
        for q in points {
            let y = refraxel_core::sh::basis(oracle.field.degree, s.momentum);
            let Some(medium) = oracle.field.at(s.at(q.t), &y) else { continue };
            let d_tau = 0.7 * refraxel_core::priors::cauchy_slope(medium.density * q.dt);
            let d = refraxel_core::field::Matter { density: d_tau * q.dt, colour: [0.0; 3] };
            oracle.field.at_vjp(s.at(q.t), &y, &d, &mut grad);
        }
    }
    let difference: Vec<f32> =
        with.field.density.iter().zip(without.field.density.iter()).map(|(a, b)| a - b).collect();
    assert!(relative(&difference, &grad.density) < 1e-3, "{}", relative(&difference, &grad.density));
}
