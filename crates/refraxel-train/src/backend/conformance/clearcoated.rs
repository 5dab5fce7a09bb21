//! Clearcoats of opaque things against the reference.

use super::mirrored::wide;
use super::reference::Reference;
use super::scenes::{Sequence, batch, environment, field, objective, projective, relative, still};
use super::suite::Suite;
use crate::backend::{Backend, BrickMask, Caches, Layers, Objective, ReflectionObjective, step};
use crate::cancel::Cancel;
use crate::model::{MirrorSource, Model, Reflection};
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::radiance::clearcoat::{Clearcoat, ClearcoatGradient, ClearcoatedScene};
use refraxel_core::sh::ShDegree;
use refraxel_core::{Background, Extent, Ray, vec3};

fn probes(longest: u32, degree: u8, seed: u64) -> ProbeGrid<f32> {
    let bounds = field(0, Extent::Bounded).domain.bounds;
    let mut grid = ProbeGrid::grey(bounds, [longest; 3], ShDegree::new(degree).unwrap());
    let mut r = Sequence(seed);
    grid.coefficients.iter_mut().for_each(|c| *c = 0.2 * r.next());
    grid
}

fn clearcoat() -> Clearcoat<f32> {
    Clearcoat { ior: 1.5, strength: probes(4, 0, 3), radiance: probes(3, 2, 4) }
}

/// A field of noise with a clearcoat of noise.
pub fn clearcoated_model(extent: Extent) -> Model {
    Model { clearcoat: Some(clearcoat()), ..Model::straight(field(2, extent), environment()) }
}

/// Colours and dLoss/d(density, colour, strength, radiance).
pub fn clearcoats_and_their_gradients_agree_with_the_reference<B: Backend>(suite: &Suite<B>) {
    for extent in [Extent::Bounded, Extent::Contracted, projective()] {
        let model = clearcoated_model(extent);
        let reference = Reference::new(&model);
        let own = model.clearcoat.as_ref().unwrap();
        let wide_clearcoat =
            Clearcoat { ior: own.ior.into(), strength: wide(&own.strength), radiance: wide(&own.radiance) };
        let (backend, b, marching) = (suite.backend(model), batch(400), objective().marching);
        let mut grad = reference.field.zero_gradient();
        let zeros = |g: &ProbeGrid<f64>| vec![0.0; g.coefficients.len()];
        let mut d_clearcoat = ClearcoatGradient {
            strength: zeros(&wide_clearcoat.strength),
            radiance: zeros(&wide_clearcoat.radiance),
        };
        let (mut squared, mut changed) = (0.0, 0);
        let plain = backend.render(&b.rays, &marching, Layers::Transmitted);
        let seen = backend.render(&b.rays, &marching, Layers::All);
        for (k, ray) in b.rays.iter().enumerate() {
            let Some((segment, points)) = reference.straight(ray, b.offset[k]) else { continue };
            let ray = Ray { origin: segment.start, direction: segment.momentum };
            let behind = reference.background.radiance(ray.origin, ray.direction);
            let scene = ClearcoatedScene { field: &reference.field, clearcoat: &wide_clearcoat, behind };
            let own = scene.shown(&ray, &points);
            let d = [0, 1, 2].map(|c| 2.0 * (own[c] - f64::from(b.target[k][c])));
            squared += d.iter().map(|d| 0.25 * d * d).sum::<f64>();
            scene.shown_vjp(&ray, &points, d, &mut grad, &mut d_clearcoat);
            changed += usize::from((seen[k].colour[0] - plain[k].colour[0]).abs() > 1e-3);
        }
        assert!(changed > 50, "only {changed} rays show a reflection");
        let got = backend.gradient(&b, &objective());
        let error = (got.outcome.squared_error / squared - 1.0).abs();
        assert!(error < suite.tolerances.ray, "{} {squared}", got.outcome.squared_error);
        let of_clearcoat = got.clearcoat.unwrap();
        let errors = [
            relative(&got.field.density, &grad.density),
            relative(&got.field.colour, &grad.colour),
            relative(&of_clearcoat.strength, &d_clearcoat.strength),
            relative(&of_clearcoat.radiance, &d_clearcoat.radiance),
        ];
        assert!(errors.iter().all(|e| *e < suite.tolerances.clearcoat), "{errors:?}");
    }
}

/// Steps of the clearcoat alone.
pub fn a_clearcoat_learns_and_its_pictures_come_nearer<B: Backend>(suite: &Suite<B>) {
    let (mut backend, b) = (suite.backend(clearcoated_model(Extent::Bounded)), batch(256));
    let reflection = Some(ReflectionObjective { rate: 0.01, rate_strength: 0.0, rate_clearcoat: 0.01 });
    let still = Objective { reflection, ..still() };
    let before = backend.snapshot().model.clearcoat.clone();
    let errors: Vec<f64> = (0..20).map(|k| step(&mut backend, &b, &still, k).squared_error).collect();
    assert!(errors[19] < 0.99 * errors[0], "{errors:?}");
    assert_ne!(backend.snapshot().model.clearcoat, before);
}

/// An opaque grey ball before a constant background.
fn furnace<B: Backend>(suite: &Suite<B>, source: MirrorSource, behind: f32) -> B {
    let mut field = field(0, Extent::Bounded);
    field.colour.fill(0.0);
    let mut backend = suite.backend(Model::straight(field, Background::Constant([behind; 3])));
    let all = BrickMask::new(backend.domain(), backend.map(), |_| true);
    let ball = BrickMask::new(backend.domain(), backend.map(), |x| x.length() < 0.5);
    backend.set_density(-10.0, &all);
    backend.set_density(8.0, &ball);
    backend.set_reflection(Reflection { source, ..Reflection::none() });
    backend.set_clearcoat(clearcoat());
    backend
}

/// A grey thing in grey light mirrors grey.
pub fn between_equal_lights_a_clearcoat_is_invisible_and_in_the_dark_it_is_not<B: Backend>(suite: &Suite<B>) {
    let marching = objective().marching;
    let rays = batch(200).rays;
    for source in [MirrorSource::Learned, MirrorSource::Exact, MirrorSource::Black] {
        let mut backend = furnace(suite, source, 0.5);
        backend.bake(Caches::Clearcoat, &marching, &Cancel::new()).unwrap();
        let pixels = backend.render(&rays, &marching, Layers::All);
        let off = pixels.iter().flat_map(|p| p.colour).map(|c| (c - 0.5).abs()).fold(0.0, f32::max);
        assert_eq!(off < 1e-3, source != MirrorSource::Black, "{source:?}: {off}");
    }
}

/// What the second ray sees is the background, not the thing itself.
pub fn a_second_ray_from_a_clearcoat_starts_outside_of_what_it_coats<B: Backend>(suite: &Suite<B>) {
    let ray = Ray { origin: vec3(3.0, 0.0, 0.0), direction: vec3(-1.0, 0.0, 0.0) };
    let [seen, dark] = [1.0, 0.0].map(|behind| {
        let backend = furnace(suite, MirrorSource::Exact, behind);
        backend.render(&[ray], &objective().marching, Layers::All)[0].colour[0]
    });
    assert!(seen > 0.5 && dark < 0.5, "{seen} {dark}");
}

/// A strength near 0 keeps a slope.
pub fn a_silent_clearcoat_can_come_back<B: Backend>(suite: &Suite<B>) {
    let mut backend = furnace(suite, MirrorSource::Learned, 0.5);
    let lit = furnace(suite, MirrorSource::Learned, 0.5);
    let mut silent = clearcoat();
    silent.strength.coefficients.fill(-9.0);
    silent.bound_strength(1e-3);
    backend.set_clearcoat(silent);
    let strength = |backend: &B| {
        let at = vec3(0.5, 0.0, 0.0);
        backend.snapshot().model.clearcoat.as_ref().map_or(0.0, |c| c.strength_at(at))
    };
    let before = strength(&backend);
    let mut b = batch(256);
    b.target = lit.render(&b.rays, &objective().marching, Layers::All).iter().map(|p| p.colour).collect();
    let reflection = Some(ReflectionObjective { rate: 0.0, rate_strength: 0.0, rate_clearcoat: 0.02 });
    let still = Objective { reflection, ..still() };
    (0..30).for_each(|k| _ = step(&mut backend, &b, &still, k));
    assert!(before < 0.002 && strength(&backend) > 0.05, "{before} {}", strength(&backend));
}
