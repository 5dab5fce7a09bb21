//! Straight rays against the reference.

use super::reference::{Reference, Sample};
use super::scenes::{batch, environment, field, objective, picked, projective, relative, straight_model};
use super::suite::Suite;
use crate::backend::{Backend, BatchGradient, Layers, Marching, Objective, step};
use crate::cancel::Cancel;
use crate::model::Model;
use refraxel_core::field::Matter;
use refraxel_core::optimiser::near_share;
use refraxel_core::priors::{depth_cost, sample_colour_slope};
use refraxel_core::radiance::{PixelAdjoint, render, render_vjp};
use refraxel_core::sh::{self, ShDegree};
use refraxel_core::{Aabb, Background, BrickMap, Domain, Extent, FieldGradient, Ray, Vec3, VoxelField, vec3};

/// Colours of straight rays in every kind of grid, at every degree.
pub fn rendering_agrees_with_the_reference<B: Backend>(suite: &Suite<B>) {
    for (degree, extent) in
        [(0, Extent::Bounded), (1, projective()), (2, Extent::Contracted), (3, Extent::Bounded)]
    {
        let model = straight_model(degree, extent);
        let reference = Reference::new(&model);
        let (backend, b, marching) = (suite.backend(model), batch(64), objective().marching);
        for (ray, got) in b.rays.iter().zip(backend.render(&b.rays, &marching, Layers::All)) {
            let (s, points) = reference.straight(ray, 0.5).unwrap();
            let want = render(&reference.field, &[s], &points);
            let behind = reference.background.radiance(s.start, s.momentum);
            for c in 0..3 {
                let colour = want.colour[c] + want.transmittance * behind[c];
                let error = (f64::from(got.colour[c]) - colour).abs();
                assert!(error < suite.tolerances.straight, "degree {degree}: {error}");
            }
        }
    }
}

/// What the reference says of the gradients of a batch.
struct Expected {
    field: FieldGradient<f64>,
    texels: Vec<f64>,
    rays: Vec<f64>,
    /// The gradients of the backend for the same rays.
    got_rays: Vec<f32>,
}

impl Expected {
    fn of(reference: &Reference, b: &crate::backend::Batch, thin: f32, got: &BatchGradient) -> Self {
        let mut e = Self {
            field: reference.field.zero_gradient(),
            texels: vec![0.0; 3 * got.background.len()],
            rays: Vec::new(),
            got_rays: Vec::new(),
        };
        for (k, ray) in b.rays.iter().enumerate() {
            let Some((s, points)) = reference.straight(ray, b.offset[k]) else { continue };
            let points = reference.thinned(&[s], &points, thin, b.offset[k]).unwrap();
            let behind = reference.background.radiance(s.start, s.momentum);
            let pixel = render(&reference.field, &[s], &points);
            let error =
                |c: usize| pixel.colour[c] + pixel.transmittance * behind[c] - f64::from(b.target[k][c]);
            let colour = [0, 1, 2].map(|c| 2.0 * error(c));
            let d = PixelAdjoint { colour, transmittance: 0.0, behind };
            let path = render_vjp(&reference.field, &[s], &points, &d, &mut e.field);
            let Background::Environment(map) = &reference.background else { unreachable!() };
            let (stencil, left) = (map.stencil(s.momentum), pixel.transmittance);
            for (i, w) in stencil.index.into_iter().zip(stencil.weight) {
                (0..3).for_each(|c| e.texels[3 * i + c] += left * w * colour[c]);
            }
            let free = map.radiance_vjp(s.momentum, colour.map(|g| g * left));
            let d_direction = path[0].momentum + free - s.momentum * s.momentum.dot(free);
            e.rays.extend([path[0].start, d_direction].iter().flat_map(|v| v.to_array()));
            let got = &got.rays[k];
            e.got_rays.extend([got.origin, got.direction].iter().flat_map(|v| v.to_array()));
        }
        e
    }
}

/// dLoss/d(density, colour, background, rays) at every degree.
pub fn gradients_agree_with_the_reference<B: Backend>(suite: &Suite<B>) {
    for (degree, extent) in [0, 1, 2, 3].map(|d| (d, if d == 1 { projective() } else { Extent::Bounded })) {
        compare_gradients(suite, straight_model(degree, extent), 0.0);
    }
}

/// The same where many samples are left out by chance.
pub fn thinned_haze_has_the_reference_gradient<B: Backend>(suite: &Suite<B>) {
    for extent in [Extent::Bounded, Extent::Contracted, projective()] {
        compare_gradients(suite, straight_model(1, extent), 0.2);
    }
}

fn compare_gradients<B: Backend>(suite: &Suite<B>, model: Model, thin: f32) {
    let named = format!("degree {} in {:?}", model.field.degree.get(), model.field.domain.extent);
    let reference = Reference::new(&model);
    let (backend, b) = (suite.backend(model), batch(300));
    let (mut all, mut left) = (0, 0);
    let is_sure = |k: usize| {
        let Some((s, points)) = reference.straight(&b.rays[k], b.offset[k]) else { return true };
        reference.thinned(&[s], &points, thin, b.offset[k]).is_some()
    };
    let b = picked(&b, is_sure);
    for (ray, offset) in b.rays.iter().zip(&b.offset) {
        let Some((s, points)) = reference.straight(ray, *offset) else { continue };
        all += points.len();
        left += reference.thinned(&[s], &points, thin, *offset).map_or(0, |left| left.len());
    }
    assert!(
        b.rays.len() > 150 && (thin == 0.0 || 4 * left < 3 * all),
        "{} rays, {left} of {all}",
        b.rays.len()
    );
    let got = backend.gradient(&b, &Objective { thin, ..objective() });
    let want = Expected::of(&reference, &b, thin, &got);
    let t = &suite.tolerances;
    for (name, error, tolerance) in [
        ("density", relative(&got.field.density, &want.field.density), t.straight),
        ("colour", relative(&got.field.colour, &want.field.colour), t.straight),
        ("texels", relative(got.background.as_flattened(), &want.texels), t.straight),
        ("rays", relative(&want.got_rays, &want.rays), t.ray),
    ] {
        assert!(error < tolerance, "{name}, {named}: {error}");
    }
}

/// The colours of samples.
pub fn the_prior_on_samples_has_the_reference_gradient<B: Backend>(suite: &Suite<B>) {
    let model = Model::straight(field(0, Extent::Bounded), Background::Constant([0.3; 3]));
    let reference = Reference::new(&model);
    let (backend, b) = (suite.backend(model), batch(100));
    let o = Objective { sample_colour: 0.7, ..objective() };
    let (with, without) = (backend.gradient(&b, &o), backend.gradient(&b, &objective()));
    let mut grad = reference.field.zero_gradient();
    for (k, ray) in b.rays.iter().enumerate() {
        let Some((s, points)) = reference.straight(ray, b.offset[k]) else { continue };
        let y = sh::basis(reference.field.degree, s.momentum);
        for Sample { x, colour, alpha, before, .. } in reference.samples(&s, &points, &y) {
            let colour = sample_colour_slope(0.7 * before * alpha, colour, b.target[k].map(f64::from));
            reference.field.at_vjp(x, &y, &Matter { density: 0.0, colour }, &mut grad);
        }
    }
    let (with, without) = (with.field, without.field);
    let difference: Vec<f32> = with.colour.iter().zip(&without.colour[..]).map(|(a, b)| a - b).collect();
    let error = relative(&difference, &grad.colour);
    assert!(error < suite.tolerances.ray, "colour: {error}");
    assert!(with.density[..] == without.density[..], "density owes nothing");
}

/// Where something was measured along rays; every third ray has no measurement.
pub fn measured_depth_has_the_reference_gradient<B: Backend>(suite: &Suite<B>) {
    let model = Model::straight(field(0, Extent::Bounded), Background::Constant([0.3; 3]));
    let reference = Reference::new(&model);
    let (backend, mut b) = (suite.backend(model), batch(100));
    b.depth = (0..100).map(|k| if k % 3 == 0 { f32::NAN } else { 2.0 + 0.02 * k as f32 }).collect();
    let o = Objective { depth: 0.7, ..objective() };
    let (with, without) = (backend.gradient(&b, &o), backend.gradient(&b, &objective()));
    let mut grad = reference.field.zero_gradient();
    for (k, ray) in b.rays.iter().enumerate() {
        let Some((s, points)) = reference.straight(ray, b.offset[k]) else { continue };
        let Some(measured) = b.measured(k).map(f64::from) else { continue };
        let y = sh::basis(reference.field.degree, s.momentum);
        // From the back, Σ w κ + T over what lies behind a sample, which costs 1 where nothing does.
        let mut behind = 1.0;
        for Sample { x, dt, alpha, before, .. } in reference.samples(&s, &points, &y).into_iter().rev() {
            // From the start of the ray: its momentum is of length 1.
            let cost = depth_cost((x - ray.cast().origin).length(), measured);
            let density = 0.7 * before * (1.0 - alpha) * (cost - behind) * dt;
            reference.field.at_vjp(x, &y, &Matter { density, colour: [0.0; 3] }, &mut grad);
            behind += alpha * (cost - behind);
        }
    }
    let difference: Vec<f32> =
        with.field.density.iter().zip(&without.field.density[..]).map(|(a, b)| a - b).collect();
    let error = relative(&difference, &grad.density);
    assert!(error < suite.tolerances.ray, "density: {error}");
    assert!(with.field.colour[..] == without.field.colour[..], "colours explain no distances");
}

/// Samples near the camera, as all rays have that start around the grid.
pub fn samples_near_the_camera_move_the_field_by_their_share<B: Backend>(suite: &Suite<B>) {
    const FULL: f32 = 3.0;
    let model = Model::straight(field(0, Extent::Bounded), Background::Constant([0.3; 3]));
    let reference = Reference::new(&model);
    let (backend, b) = (suite.backend(model), batch(100));
    let got = backend.gradient(&b, &Objective { full_distance: FULL, ..objective() }).field;
    let (mut grad, mut least) = (reference.field.zero_gradient(), 1.0_f64);
    for (k, ray) in b.rays.iter().enumerate() {
        let Some((s, points)) = reference.straight(ray, b.offset[k]) else { continue };
        let y = sh::basis(reference.field.degree, s.momentum);
        let samples = reference.samples(&s, &points, &y);
        let over = |behind: [f64; 3], s: &Sample| {
            [0, 1, 2].map(|c| s.alpha * s.colour[c] + (1.0 - s.alpha) * behind[c])
        };
        let mut behind = [f64::from(0.3_f32); 3];
        let shown = samples.iter().rev().fold(behind, over);
        let d_colour = [0, 1, 2].map(|c| 2.0 * (shown[c] - f64::from(b.target[k][c])));
        for sample in samples.iter().rev() {
            let Sample { x, dt, colour, alpha, before } = *sample;
            let share = near_share((x - ray.cast().origin).length(), f64::from(FULL));
            let contrast: f64 = (0..3).map(|c| d_colour[c] * (colour[c] - behind[c])).sum();
            let d = Matter {
                density: share * before * (1.0 - alpha) * contrast * dt,
                colour: d_colour.map(|d| share * before * alpha * d),
            };
            reference.field.at_vjp(x, &y, &d, &mut grad);
            (behind, least) = (over(behind, sample), least.min(share));
        }
    }
    assert!(least < 0.5, "{least}");
    for (name, got, want) in [("density", &got.density, &grad.density), ("colour", &got.colour, &grad.colour)]
    {
        let error = relative(got, want);
        assert!(error < suite.tolerances.straight, "{name}: {error}");
    }
}

/// What is skipped as transparent or hidden.
pub fn cut_offs_change_a_picture_by_no_more_than_they_say<B: Backend>(suite: &Suite<B>) {
    let (mut backend, b) = (suite.backend(straight_model(2, Extent::Bounded)), batch(200));
    let exact = backend.render(&b.rays, &Marching::exhaustive(0.7), Layers::All);
    let marching = Marching { min_optical_depth: 1e-4, min_transmittance: 1e-3, ..Marching::exhaustive(0.7) };
    backend.refresh_occupancy(&marching);
    let samples = 4.0 * 27.0 / 0.7;
    for (a, b) in exact.iter().zip(backend.render(&b.rays, &marching, Layers::All)) {
        let bound = (1e-4 * samples + 1e-3) * 2.0;
        assert!((0..3).all(|c| (a.colour[c] - b.colour[c]).abs() < bound));
    }
}

/// Leaps over empty bricks in a contracted space.
pub fn skipping_never_jumps_over_matter_in_flat_contracted_boxes<B: Backend>(suite: &Suite<B>) {
    let bounds = Aabb::new(vec3(-4.0, -4.0, -0.4), vec3(4.0, 4.0, 0.4));
    let domain = Domain::with_longest(bounds, Extent::Contracted, 80);
    let map = BrickMap::new(domain.resolution, |b| (b[0] * 7 + b[1] * 5 + b[2] * 3) % 11 == 0);
    let mut f = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -1.0);
    f.clear_empty_brick();
    let model = Model::straight(f, Background::Constant([0.2; 3]));
    let reference = Reference::new(&model);
    let (backend, mut b) = (suite.backend(model), batch(300));
    b.rays.iter_mut().for_each(|r| r.origin *= 2.0);
    for (ray, got) in b.rays.iter().zip(backend.render(&b.rays, &objective().marching, Layers::All)) {
        let (s, points) = reference.straight(ray, 0.5).unwrap();
        let want = render(&reference.field, &[s], &points);
        let error = (f64::from(got.transmittance) - want.transmittance).abs();
        assert!(error < suite.tolerances.ray, "{ray:?}");
    }
}

/// Steps on one batch.
pub fn learning_lowers_the_loss<B: Backend>(suite: &Suite<B>) {
    let mut backend = suite.backend(straight_model(1, Extent::Bounded));
    let (b, o) = (batch(500), objective());
    let losses: Vec<f64> = (0..30).map(|k| step(&mut backend, &b, &o, k).squared_error).collect();
    assert!(losses[29] < 0.3 * losses[0], "{losses:?}");
}

/// A field that trilinear interpolation keeps exactly.
pub fn resampling_to_a_finer_grid_keeps_the_picture<B: Backend>(suite: &Suite<B>) {
    let domain = field(1, Extent::Bounded).domain;
    let map = BrickMap::dense(domain.resolution);
    let mut smooth = VoxelField::uniform(domain, map.clone(), ShDegree::new(1).unwrap(), -3.0);
    for node in refraxel_core::grid::bricks::coordinates(domain.resolution) {
        // Linear in the coordinates, so that trilinear interpolation is exact.
        smooth.density[map.voxel(node)] = -3.0 + 0.02 * node[0] as f32 - 0.01 * node[2] as f32;
    }
    let mut backend = suite.backend(Model::straight(smooth, Background::Constant([1.0; 3])));
    let b = batch(100);
    let before = backend.render(&b.rays, &Marching::exhaustive(0.5), Layers::All);
    let fine = Domain { resolution: domain.resolution.map(|n| 2 * n - 1), ..domain };
    backend.resample(fine, BrickMap::dense(fine.resolution));
    assert_eq!((backend.domain(), backend.map().resolution()), (&fine, fine.resolution));
    // Twice as many nodes: a step of one voxel is as long as half a voxel was.
    for (a, b) in before.iter().zip(backend.render(&b.rays, &Marching::exhaustive(1.0), Layers::All)) {
        assert!((a.transmittance - b.transmittance).abs() < 1e-4, "{} {}", a.transmittance, b.transmittance);
    }
}

/// One voxel and one ray through it.
pub fn peak_weights_mark_what_rays_see<B: Backend>(suite: &Suite<B>) {
    let mut f = field(0, Extent::Bounded);
    f.density.fill(-8.0);
    let node = [13, 16, 10];
    let voxel = f.map.voxel(node);
    assert!(voxel >= 64);
    f.density[voxel] = 6.0;
    let at = f.domain.position(Vec3::from(node.map(|n| n as f32)));
    let backend = suite.backend(Model::straight(f, environment()));
    let origin = at + vec3(3.0, 0.0, 0.0);
    let ray = Ray { origin, direction: (at - origin).normalized() };
    let peak = backend.peak_weights(&[ray], &Marching::exhaustive(0.5), &Cancel::new()).unwrap();
    assert!(peak[voxel] > 0.3, "{}", peak[voxel]);
    assert!(peak.iter().filter(|&&p| p > 0.1).count() < 30);
    let cancelled = Cancel::new();
    cancelled.cancel();
    assert!(backend.peak_weights(&[ray], &Marching::exhaustive(0.5), &cancelled).is_err());
}
