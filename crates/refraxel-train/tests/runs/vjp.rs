//! The transpose of rendering for losses of any kind.

use refraxel_core::Extent;
use refraxel_train::backend::conformance::absorbing::tinted_ball;
use refraxel_train::backend::conformance::mirrored::sharp_ball;
use refraxel_train::backend::conformance::scenes::{batch, objective, straight_model};
use refraxel_train::backend::{
    AbsorptionObjective, Batch, BatchGradient, Layers, Marching, Objective, PixelGradient,
};
use refraxel_train::{Backend, CpuBackend, Model};

/// Of the rays of [`batch`], with their points in the middle of the steps.
fn middle() -> Batch {
    let all = batch(400);
    Batch { offset: vec![0.5; all.rays.len()], ..all }
}

fn marching() -> Marching {
    objective().marching
}

fn largest(values: &[f32]) -> f32 {
    values.iter().fold(0.0, |m, v| m.max(v.abs()))
}

fn assert_near(name: &str, got: &[f32], expected: &[f32]) {
    let size = largest(expected);
    let off: Vec<f32> = got.iter().zip(expected).map(|(a, b)| a - b).collect();
    assert!(
        got.len() == expected.len() && largest(&off) <= 1e-5 * size,
        "{name}: {} of {size}",
        largest(&off)
    );
}

/// Everything that two gradients have.
fn assert_same(got: &BatchGradient, expected: &BatchGradient) {
    assert_near("density", &got.field.density, &expected.field.density);
    assert_near("colour", &got.field.colour, &expected.field.colour);
    assert_near("background", got.background.as_flattened(), expected.background.as_flattened());
    for (got, expected) in got.medium.index.iter().zip(&expected.medium.index) {
        assert_near("index", got, expected);
    }
    for (got, expected) in got.medium.level_set.iter().zip(&expected.medium.level_set) {
        assert_near("surface", got, expected);
    }
    let rays = |g: &BatchGradient| -> Vec<f32> {
        g.rays.iter().flat_map(|r| [r.origin.to_array(), r.direction.to_array()].concat()).collect()
    };
    assert_near("rays", &rays(got), &rays(expected));
}

#[test]
fn the_adjoint_of_squared_errors_is_their_gradient() {
    for model in [straight_model(2, Extent::Bounded), sharp_ball(), tinted_ball()] {
        let (backend, batch) = (CpuBackend::new(model), middle());
        let shown = backend.render(&batch.rays, &marching(), Layers::All);
        let d = |(pixel, target): (&refraxel_core::radiance::Pixel<f32>, &[f32; 3])| PixelGradient {
            colour: [0, 1, 2].map(|c| 2.0 * (pixel.colour[c] - target[c])),
            transmittance: 0.0,
        };
        let d_pixels: Vec<PixelGradient> = shown.iter().zip(&batch.target).map(d).collect();
        let absorption = Some(AbsorptionObjective { rate: 0.0 });
        let expected = backend.gradient(&batch, &Objective { absorption, ..objective() });
        let got = backend.vjp(&batch.rays, &marching(), &d_pixels);
        assert_same(&got, &expected);
        for (got, expected) in got.absorption.iter().flatten().zip(expected.absorption.iter().flatten()) {
            assert!((got - expected).abs() <= 1e-4 * expected.abs().max(1.0), "{got} {expected}");
        }
    }
}

#[test]
fn the_adjoint_of_transmittance_matches_central_differences() {
    let model = || straight_model(1, Extent::Bounded);
    let rays = middle().rays;
    let loss = |model: Model| -> f64 {
        let shown = CpuBackend::new(model).render(&rays, &marching(), Layers::All);
        shown.iter().map(|p| f64::from(p.transmittance)).sum()
    };
    let along = |step: f32| {
        let mut model = model();
        model.field.density.iter_mut().enumerate().for_each(|(k, v)| *v += step * (k as f32 * 0.7).sin());
        model.field.clear_empty_brick();
        loss(model)
    };
    let d_pixels = vec![PixelGradient { transmittance: 1.0, ..PixelGradient::default() }; rays.len()];
    let got = CpuBackend::new(model()).vjp(&rays, &marching(), &d_pixels);
    let stored = got.field.density.iter().enumerate().skip(64);
    let derivative: f64 = stored.map(|(k, d)| f64::from(*d) * f64::from((k as f32 * 0.7).sin())).sum();
    const STEP: f32 = 1e-2; // differences of f32 sums over 400 rays: 1e-5 of the loss, truncation 1e-4
    let difference = (along(STEP) - along(-STEP)) / f64::from(2.0 * STEP);
    assert!((derivative / difference - 1.0).abs() < 2e-3, "{derivative} {difference}");
    assert!(got.field.colour.iter().all(|d| *d == 0.0), "colours do not change transmittance");
}
