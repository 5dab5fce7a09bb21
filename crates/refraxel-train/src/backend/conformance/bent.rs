//! Bent rays against the tracer and the radiance of the reference.

use super::mirrored::{followed, nested_balls};
use super::reference::{Marched, Reference};
use super::scenes::{
    batch, environment, index_objective, objective, picked, projective, relative, smooth_field,
};
use super::suite::{Suite, Tolerances};
use crate::backend::{Backend, IndexObjective, Layers, Marching, Objective};
use crate::model::polyhedron::{Plane, Polyhedron, cut_by};
use crate::model::{Model, Refraction, RegionState};
use refraxel_core::index::MediumGradient;
use refraxel_core::optics::{PathAdjoint, RayAdjoint};
use refraxel_core::radiance::{Pixel, PixelAdjoint, render, render_vjp};
use refraxel_core::{Aabb, Background, Extent, IndexGrid, Interpolation, LevelSet, Ray, Vec3, vec3};

/// Two balls of glass with soft edges beside each other.
pub fn two_balls() -> Refraction {
    let ball = |center: Vec3<f32>| {
        let n = move |x: Vec3<f32>| 1.25 - 0.25 * (((x - center).length() - 0.25) / 0.05).tanh();
        IndexGrid::from_control_values(Aabb::cube_at(center, 0.45), [25; 3], Interpolation::CubicBSpline, n)
    };
    Refraction::of(vec![ball(vec3(-0.5, 0.0, 0.0)), ball(vec3(0.45, 0.1, 0.1))])
}

/// The two balls in a smooth field.
pub fn bent_model(extent: Extent) -> Model {
    Model { refraction: two_balls(), ..Model::straight(smooth_field(extent), environment()) }
}

/// Three sharp surfaces, in and through each other, in a smooth field.
pub fn sharp_model(extent: Extent) -> Model {
    Model { refraction: nested_balls().refraction, ..Model::straight(smooth_field(extent), environment()) }
}

/// A ball with a sharp surface and a lens in its middle, in a smooth field.
pub fn graded_body_model(extent: Extent) -> Model {
    let level = LevelSet::from_samples(Aabb::cube(0.6), [31; 3], |x: Vec3<f32>| x.length() - 0.4);
    let n = |x: Vec3<f32>| 1.3 + 0.25 * (-x.dot(x) / 0.06).exp();
    let body = IndexGrid::sharp_from_samples(level, [27; 3], Interpolation::CubicBSpline, n);
    Model { refraction: Refraction::of(vec![body]), ..Model::straight(smooth_field(extent), environment()) }
}

/// A wedge of glass with flat faces and sharp edges, in a smooth field.
pub fn faceted_model(extent: Extent) -> Model {
    let face = |x: f32, y: f32, z: f32, offset| Plane::facing(vec3(x, y, z).normalized(), offset);
    let faces = vec![
        face(1.0, 0.2, 0.3, 0.35),
        face(-1.0, 0.6, 0.1, 0.3),
        face(-0.2, -1.0, 0.0, 0.35),
        face(0.1, 0.0, 1.0, 0.35),
    ];
    let wedge = Polyhedron { faces, base: Some(face(0.0, 0.0, -1.0, 0.4)) };
    let body = IndexGrid::sharp(wedge.level_set(Aabb::cube(0.9), [31; 3]), 1.5);
    // Its planes are a part of what is stored of a model, and sent to other processes.
    let states = vec![RegionState { solid: Some(wedge), ..RegionState::default() }];
    let refraction = Refraction { states, ..Refraction::of(vec![body]) };
    Model { refraction, ..Model::straight(smooth_field(extent), environment()) }
}

/// A ball of glass of which planes have cut off both ends, in a smooth field.
pub fn cut_model(extent: Extent) -> Model {
    let ball = LevelSet::from_samples(Aabb::cube(0.9), [31; 3], |x: Vec3<f32>| x.length() - 0.55);
    let cuts = vec![
        Plane::facing(vec3(0.36, -0.48, 0.8), 0.2),
        Plane::facing(vec3(-0.3, 0.1, -0.9).normalized(), 0.3),
    ];
    let body = IndexGrid::sharp(cut_by(ball, &cuts), 1.5);
    let states = vec![RegionState { cuts, ..RegionState::default() }];
    let refraction = Refraction { states, ..Refraction::of(vec![body]) };
    Model { refraction, ..Model::straight(smooth_field(extent), environment()) }
}

/// Colours and depths.
pub fn bent_rendering_agrees_with_the_reference<B: Backend>(suite: &Suite<B>) {
    rendering_agrees_with_the_reference(bent_model, &suite.tolerances, &see(suite));
}

/// The same with surfaces at which the index jumps.
pub fn sharp_rendering_agrees_with_the_reference<B: Backend>(suite: &Suite<B>) {
    rendering_agrees_with_the_reference(sharp_model, &suite.tolerances, &see(suite));
    rendering_agrees_with_the_reference(graded_body_model, &suite.tolerances, &see(suite));
    rendering_agrees_with_the_reference(faceted_model, &suite.tolerances, &see(suite));
    rendering_agrees_with_the_reference(cut_model, &suite.tolerances, &see(suite));
}

fn see<B: Backend>(suite: &Suite<B>) -> impl Fn(Model, &[Ray<f32>], &Marching) -> Vec<Pixel<f32>> {
    |model, rays, marching| suite.backend(model).render(rays, marching, Layers::All)
}

/// Colours and depths of whatever `see`s a model, also where it is no backend.
pub fn rendering_agrees_with_the_reference(
    model_of: fn(Extent) -> Model,
    tolerances: &Tolerances,
    see: &dyn Fn(Model, &[Ray<f32>], &Marching) -> Vec<Pixel<f32>>,
) {
    for extent in [Extent::Bounded, Extent::Contracted, projective()] {
        let (model, b) = (model_of(extent), batch(200));
        let reference = Reference::new(&model);
        let mut turned = 0;
        for (ray, got) in b.rays.iter().zip(see(model, &b.rays, &objective().marching)) {
            let marched = reference.march(ray, 0.5);
            let exit = &marched.path.exit;
            turned += usize::from(exit.direction.dot(ray.direction.cast()) < 0.999);
            let want = render(&reference.field, &marched.path.segments, &marched.points);
            let behind = reference.background.radiance(exit.origin, exit.direction);
            for c in 0..3 {
                let want = want.colour[c] + want.transmittance * behind[c];
                let error = (f64::from(got.colour[c]) - want).abs();
                assert!(error < tolerances.bent, "{extent:?}: {} {want}", got.colour[c]);
            }
            let error = (f64::from(got.depth) - want.depth).abs();
            assert!(error < 5.0 * tolerances.bent * want.depth.max(1.0));
        }
        assert!(turned > 60, "only {turned} rays bend");
    }
}

/// dLoss/d(density, colour, index, rays).
pub fn bent_gradients_agree_with_the_reference<B: Backend>(suite: &Suite<B>) {
    gradients_agree_with_the_reference(suite, bent_model(Extent::Bounded), 0.0);
    // Where many samples are left out by chance.
    gradients_agree_with_the_reference(suite, bent_model(projective()), 0.3);
}

/// The same with surfaces at which the index jumps, in and through each other, and around a field.
pub fn sharp_gradients_agree_with_the_reference<B: Backend>(suite: &Suite<B>) {
    gradients_agree_with_the_reference(suite, sharp_model(Extent::Bounded), 0.0);
    gradients_agree_with_the_reference(suite, graded_body_model(Extent::Bounded), 0.0);
    gradients_agree_with_the_reference(suite, faceted_model(Extent::Bounded), 0.0);
    gradients_agree_with_the_reference(suite, cut_model(Extent::Bounded), 0.0);
}

fn gradients_agree_with_the_reference<B: Backend>(suite: &Suite<B>, model: Model, thin: f32) {
    let reference = Reference::new(&model);
    let (backend, b) = (suite.backend(model), followed(batch(300), &reference));
    let (mut all, mut left) = (0, 0);
    let is_sure = |k: usize| {
        let Marched { path, points } = reference.march(&b.rays[k], b.offset[k]);
        reference.thinned(&path.segments, &points, thin, b.offset[k]).is_some()
    };
    let mut b = picked(&b, is_sure);
    assert!(b.rays.len() > 100, "{} rays", b.rays.len());
    b.beside = (0..b.rays.len()).map(|k| k % 3 == 0).collect();
    let bent_weight = 0.3;
    let learning = Objective { index: Some(index_objective()), bent_weight, thin, ..objective() };
    let got = backend.gradient(&b, &learning);
    let mut field = reference.field.zero_gradient();
    let mut medium = reference.medium.zero_gradient();
    let mut rays = Vec::new();
    for (k, ray) in b.rays.iter().enumerate() {
        let Marched { path, points } = reference.march(ray, b.offset[k]);
        all += points.len();
        let points = reference.thinned(&path.segments, &points, thin, b.offset[k]).unwrap();
        left += points.len();
        let marched = Marched { path, points };
        let (path, points) = (&marched.path, &marched.points);
        let pixel = render(&reference.field, &path.segments, points);
        let behind = reference.background.radiance(path.exit.origin, path.exit.direction);
        let error = |c: usize| pixel.colour[c] + pixel.transmittance * behind[c] - f64::from(b.target[k][c]);
        let weight = if path.bends(&ray.cast()) && !b.is_beside(k) { f64::from(bent_weight) } else { 1.0 };
        let colour = [0, 1, 2].map(|c| 2.0 * weight * error(c));
        let d = PixelAdjoint { colour, transmittance: 0.0, behind };
        let d_segments = render_vjp(&reference.field, &path.segments, points, &d, &mut field);
        let Background::Environment(map) = &reference.background else { unreachable!() };
        let d_background = colour.map(|g| g * pixel.transmittance);
        let direction = map.radiance_vjp(path.exit.direction, d_background);
        let exit = RayAdjoint { origin: Vec3::zero(), direction };
        let d_path = PathAdjoint { segments: &d_segments, reflections: &[], exit };
        rays.push(reference.tracer().vjp(&ray.cast(), path, &d_path, &mut medium));
        if b.is_beside(k) {
            add_trespass(&reference, &marched, &mut medium);
        }
    }
    assert!(thin == 0.0 || 4 * left < 3 * all, "{left} of {all} points are left");
    let t = &suite.tolerances;
    let want: Vec<f64> = rays.iter().flat_map(|d| d.origin.to_array()).collect();
    let origins: Vec<f32> = got.rays.iter().flat_map(|d| d.origin.to_array()).collect();
    for (name, error, tolerance) in [
        ("density", relative(&got.field.density, &field.density), t.bent),
        ("colour", relative(&got.field.colour, &field.colour), t.bent),
        ("origins", relative(&origins, &want), t.index),
    ] {
        assert!(error < tolerance, "{name}: {error}");
    }
    let arrays = medium.index.iter().zip(&got.medium.index);
    for (want, got) in arrays.chain(medium.level_set.iter().zip(&got.medium.level_set)) {
        let error = if want.is_empty() { 0.0 } else { relative(got, want) };
        assert!(error < t.index, "index or surface: {error}");
    }
}

/// Theory (4.22): what a path owes that should have missed the first body that it enters.
fn add_trespass(reference: &Reference, Marched { path, points }: &Marched, sums: &mut MediumGradient<f64>) {
    let Some(entry) = path.steps.iter().position(|s| s.event.is_some_and(|e| !e.from_inside)) else { return };
    let region = usize::from(path.steps[entry].region);
    let level = reference.medium.regions()[region].level_set().unwrap();
    let x = path.segments[entry + 1].at(0.5 * path.steps[entry + 1].drift);
    if level.value(x) >= 0.0 {
        return;
    }
    let before = points.partition_point(|p| p.segment <= entry);
    let transmittance = render(&reference.field, &path.segments, &points[..before]).transmittance;
    let weight = f64::from(index_objective().silhouette) * transmittance / level.voxel();
    level.scatter(x, -weight, Vec3::zero(), &mut sums.level_set[region]);
}

/// See [`Backend::ray_gradients`].
pub fn gradients_of_rays_alone_are_the_same<B: Backend>(suite: &Suite<B>) {
    let (backend, b) = (suite.backend(bent_model(Extent::Bounded)), batch(150));
    let (all, alone) = (backend.gradient(&b, &objective()), backend.ray_gradients(&b, &objective()));
    assert_eq!(all.rays, alone);
    let squared = |r: &[f32; 3]| r.iter().map(|r| f64::from(*r).powi(2)).sum::<f64>();
    let sum: f64 = alone.iter().map(|d| squared(&d.residual)).sum();
    assert!((sum / all.outcome.squared_error - 1.0).abs() < 1e-6, "{sum} {}", all.outcome.squared_error);
}

/// What no ray through a body teaches, as the surface around a cavity, rays beside masks alone must not move either.
pub fn surfaces_owe_nothing_for_rays_that_do_not_teach_them<B: Backend>(suite: &Suite<B>) {
    let model = sharp_model(Extent::Bounded);
    let mut b = followed(batch(300), &Reference::new(&model));
    b.beside = vec![true; b.rays.len()];
    let backend = suite.backend(model);
    let owed = |surface_events: u32| {
        let index = IndexObjective { surface_events, ..index_objective() };
        let got = backend.gradient(&b, &Objective { index: Some(index), ..objective() });
        got.medium.level_set.iter().flatten().filter(|g| **g != 0.0).count()
    };
    assert!(owed(index_objective().surface_events) > 0);
    assert_eq!(owed(0), 0);
}
