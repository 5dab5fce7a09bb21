//! Coats of opaque things on the CPU backend, against the reference of `refraxel-core` in double precision.

use super::*;
use crate::backend::ReflectionObjective;
use crate::reflection::Source;
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::radiance::clearcoat::{Clearcoat, ClearcoatGradient, ClearcoatedScene};

fn probes(longest: u32, degree: u8, seed: u64) -> ProbeGrid<f32> {
    let bounds = field(0, Extent::Bounded).domain.bounds;
    let mut grid = ProbeGrid::grey(bounds, [longest; 3], ShDegree::new(degree).unwrap());
    let mut r = Sequence(seed);
    grid.coefficients.iter_mut().for_each(|c| *c = 0.2 * r.next());
    grid
}

fn clearcoated(extent: Extent) -> CpuBackend {
    let mut backend = CpuBackend::new(field(2, extent), environment());
    backend.set_clearcoat(Clearcoat { ior: 1.5, strength: probes(4, 0, 3), radiance: probes(3, 2, 4) });
    backend
}

fn wide(clearcoat: &Clearcoat<f32>) -> Clearcoat<f64> {
    let grid = |g: &ProbeGrid<f32>| {
        let values = g.coefficients.iter().map(|&v| f64::from(v)).collect();
        ProbeGrid::grey(g.bounds().cast(), g.resolution(), g.degree()).with_coefficients(values).unwrap()
    };
    Clearcoat {
        ior: clearcoat.ior.into(),
        strength: grid(&clearcoat.strength),
        radiance: grid(&clearcoat.radiance),
    }
}

#[test]
fn coats_and_their_gradients_agree_with_the_reference() {
    for extent in [Extent::Bounded, Extent::Contracted] {
        let (backend, b) = (clearcoated(extent), batch(200));
        let (reference, clearcoat) = (Oracle::new(&backend), wide(backend.clearcoat().unwrap()));
        let mut grad = reference.field.zero_gradient();
        let zeros = |g: &ProbeGrid<f64>| vec![0.0; g.coefficients.len()];
        let mut d_clearcoat =
            ClearcoatGradient { strength: zeros(&clearcoat.strength), radiance: zeros(&clearcoat.radiance) };
        let (mut squared, mut changed) = (0.0, 0);
        let plain = backend.render_transmitted(&b.rays, &objective().marching);
        let seen = backend.render(&b.rays, &objective().marching);
        for (k, ray) in b.rays.iter().enumerate() {
            let Some((segment, points)) = reference.path(ray, b.offset[k], objective().marching.step) else {
                continue;
            };
            let ray = Ray { origin: segment.start, direction: segment.momentum };
            let behind = reference.background.radiance(ray.origin, ray.direction);
            let scene = ClearcoatedScene { field: &reference.field, clearcoat: &clearcoat, behind };
            let own = scene.shown(&ray, &points);
            let d = [0, 1, 2].map(|c| 2.0 * (own[c] - f64::from(b.target[k][c])));
            squared += d.iter().map(|d| 0.25 * d * d).sum::<f64>();
            scene.shown_vjp(&ray, &points, d, &mut grad, &mut d_clearcoat);
            changed += usize::from((seen[k].colour[0] - plain[k].colour[0]).abs() > 1e-3);
        }
        assert!(changed > 50, "only {changed} rays show a reflection");
        let got = backend.gradient(&b, &objective());
        assert!(
            (got.outcome.squared_error / squared - 1.0).abs() < 1e-3,
            "{} {squared}",
            got.outcome.squared_error
        );
        // Normals are sums of slopes that nearly cancel in this rough field.
        let of_clearcoat = got.clearcoat.unwrap();
        let errors = [
            relative(&got.field.density, &grad.density),
            relative(&got.field.colour, &grad.colour),
            relative(&of_clearcoat.strength, &d_clearcoat.strength),
            relative(&of_clearcoat.radiance, &d_clearcoat.radiance),
        ];
        assert!(errors.iter().all(|e| *e < 5e-3), "{errors:?}");
    }
}

#[test]
fn a_coat_learns_and_its_pictures_come_nearer() {
    let (mut backend, b) = (clearcoated(Extent::Bounded), batch(256));
    let reflection = Some(ReflectionObjective { rate: 0.01, rate_strength: 0.0, rate_clearcoat: 0.01 });
    let still =
        Objective { rate_density: 0.0, rate_colour: 0.0, rate_background: 0.0, reflection, ..objective() };
    let before = backend.clearcoat().cloned();
    let errors: Vec<f64> = (0..20).map(|k| backend.learn(&b, &still, k).squared_error).collect();
    assert!(errors[19] < 0.99 * errors[0], "{errors:?}");
    assert_ne!(backend.clearcoat().cloned(), before);
}

/// An opaque grey ball before grey.
fn furnace(source: Source) -> CpuBackend {
    let mut field = field(0, Extent::Bounded);
    field.colour.fill(0.0);
    let mut backend = CpuBackend::new(field, Background::Constant([0.5; 3]));
    backend.set_density(-10.0, |_| true);
    backend.set_density(8.0, |x| x.length() < 0.5);
    backend.set_reflection(Reflection { source, ..Reflection::none() });
    backend.set_clearcoat(Clearcoat { ior: 1.5, strength: probes(4, 0, 3), radiance: probes(3, 2, 4) });
    backend
}

#[test]
fn between_equal_lights_a_coat_is_invisible_and_in_the_dark_it_is_not() {
    let marching = objective().marching;
    let rays = batch(200).rays;
    let far = |backend: &CpuBackend| {
        let pixels = backend.render(&rays, &marching);
        pixels.iter().flat_map(|p| p.colour).map(|c| (c - 0.5).abs()).fold(0.0, f32::max)
    };
    for source in [Source::Baked, Source::Exact, Source::Black] {
        let mut backend = furnace(source);
        backend.bake_clearcoat(&marching);
        let off = far(&backend);
        assert_eq!(off < 1e-3, source != Source::Black, "{source:?}: {off}");
    }
}

#[test]
fn a_second_ray_from_a_coat_starts_outside_of_what_it_coats() {
    let mut backend = furnace(Source::Exact);
    backend.background = Background::Constant([1.0; 3]);
    let ray = Ray { origin: vec3(3.0, 0.0, 0.0), direction: vec3(-1.0, 0.0, 0.0) };
    let seen = backend.render(&[ray], &objective().marching)[0].colour[0];
    backend.background = Background::Constant([0.0; 3]);
    let dark = backend.render(&[ray], &objective().marching)[0].colour[0];
    assert!(seen > 0.5 && dark < 0.5, "{seen} {dark}");
}

#[test]
fn a_silent_coat_can_come_back() {
    let mut backend = furnace(Source::Learned);
    let mut clearcoat = backend.clearcoat().unwrap().clone();
    clearcoat.strength.coefficients.fill(-9.0);
    clearcoat.bound_strength(1e-3);
    backend.set_clearcoat(clearcoat);
    let strength = |backend: &CpuBackend| backend.clearcoat().unwrap().strength_at(vec3(0.5, 0.0, 0.0));
    let before = strength(&backend);
    let mut b = batch(256);
    let lit = furnace(Source::Learned);
    b.target = lit.render(&b.rays, &objective().marching).iter().map(|p| p.colour).collect();
    let reflection = Some(ReflectionObjective { rate: 0.0, rate_strength: 0.0, rate_clearcoat: 0.02 });
    let still =
        Objective { rate_density: 0.0, rate_colour: 0.0, rate_background: 0.0, reflection, ..objective() };
    backend.moments.clearcoat = ClearcoatMoments::zero(backend.clearcoat().unwrap());
    backend.clearcoat.as_mut().unwrap().radiance = lit.clearcoat().unwrap().radiance.clone();
    (0..30).for_each(|step| _ = backend.learn(&b, &still, step));
    assert!(before < 0.002 && strength(&backend) > 0.05, "{before} {}", strength(&backend));
}

#[test]
fn coats_learn_the_same_with_any_number_of_threads() {
    let learned = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut backend = clearcoated(Extent::Bounded);
            let reflection =
                Some(ReflectionObjective { rate: 0.01, rate_strength: 0.01, rate_clearcoat: 0.01 });
            let o = Objective { reflection, ..objective() };
            (0..4).for_each(|step| _ = backend.learn(&batch(700), &o, step));
            backend.bake_clearcoat(&o.marching);
            (
                backend.field().density.to_vec(),
                backend.clearcoat().cloned(),
                backend.moments().clearcoat.clone(),
            )
        })
    };
    let one = learned(1);
    assert!(one == learned(2) && one == learned(3));
}
