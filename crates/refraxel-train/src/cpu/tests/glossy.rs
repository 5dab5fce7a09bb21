//! Coats of opaque things on the CPU backend, against the reference of `refraxel-core` in double precision.

use super::*;
use crate::backend::ReflectionObjective;
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::radiance::gloss::{Gloss, GlossGradient, shown, shown_vjp};

fn probes(longest: u32, degree: u8, seed: u64) -> ProbeGrid<f32> {
    let bounds = field(0, Extent::Bounded).domain.bounds;
    let mut grid = ProbeGrid::grey(bounds, [longest; 3], ShDegree::new(degree).unwrap());
    let mut r = Sequence(seed);
    grid.coefficients.iter_mut().for_each(|c| *c = 0.2 * r.next());
    grid
}

fn glossy(extent: Extent) -> CpuBackend {
    let mut backend = CpuBackend::new(field(2, extent), environment());
    backend.set_gloss(Gloss { ior: 1.5, strength: probes(4, 0, 3), radiance: probes(3, 2, 4) });
    backend
}

fn wide(gloss: &Gloss<f32>) -> Gloss<f64> {
    let grid = |g: &ProbeGrid<f32>| {
        let values = g.coefficients.iter().map(|&v| f64::from(v)).collect();
        ProbeGrid::grey(g.bounds().cast(), g.resolution(), g.degree()).with_coefficients(values).unwrap()
    };
    Gloss { ior: gloss.ior.into(), strength: grid(&gloss.strength), radiance: grid(&gloss.radiance) }
}

#[test]
fn coats_and_their_gradients_agree_with_the_reference() {
    for extent in [Extent::Bounded, Extent::Contracted] {
        let (backend, b) = (glossy(extent), batch(200));
        let (reference, gloss) = (Oracle::new(&backend), wide(backend.gloss().unwrap()));
        let mut grad = reference.field.zero_gradient();
        let zeros = |g: &ProbeGrid<f64>| vec![0.0; g.coefficients.len()];
        let mut d_gloss =
            GlossGradient { strength: zeros(&gloss.strength), radiance: zeros(&gloss.radiance) };
        let (mut squared, mut changed) = (0.0, 0);
        let plain = backend.render_transmitted(&b.rays, &objective().marching);
        let seen = backend.render(&b.rays, &objective().marching);
        for (k, ray) in b.rays.iter().enumerate() {
            let Some((segment, points)) = reference.path(ray, b.offset[k], objective().marching.step) else {
                continue;
            };
            let ray = Ray { origin: segment.start, direction: segment.momentum };
            let behind = reference.background.radiance(ray.origin, ray.direction);
            let own = shown(&reference.field, (&ray, &points), &gloss, behind);
            let d = [0, 1, 2].map(|c| 2.0 * (own[c] - f64::from(b.target[k][c])));
            squared += d.iter().map(|d| 0.25 * d * d).sum::<f64>();
            shown_vjp(&reference.field, (&ray, &points), &gloss, (behind, d), (&mut grad, &mut d_gloss));
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
        let of_gloss = got.gloss.unwrap();
        let errors = [
            relative(&got.field.density, &grad.density),
            relative(&got.field.colour, &grad.colour),
            relative(&of_gloss.strength, &d_gloss.strength),
            relative(&of_gloss.radiance, &d_gloss.radiance),
        ];
        assert!(errors.iter().all(|e| *e < 5e-3), "{errors:?}");
    }
}

#[test]
fn a_coat_learns_and_its_pictures_come_nearer() {
    let (mut backend, b) = (glossy(Extent::Bounded), batch(256));
    let reflection = Some(ReflectionObjective { rate: 0.01, rate_strength: 0.0, rate_gloss: 0.01 });
    let still =
        Objective { rate_density: 0.0, rate_colour: 0.0, rate_background: 0.0, reflection, ..objective() };
    let before = backend.gloss().cloned();
    let errors: Vec<f64> = (0..20).map(|k| backend.learn(&b, &still, k).squared_error).collect();
    assert!(errors[19] < 0.99 * errors[0], "{errors:?}");
    assert_ne!(backend.gloss().cloned(), before);
}
