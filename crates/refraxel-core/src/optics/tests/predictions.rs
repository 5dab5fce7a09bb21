//! The score of a prediction, theory (4.24), and its gradient by the surface and the index, theory (4.25).

use crate::optics::{Options, PathAdjoint, RayAdjoint, Tracer};
use crate::segment::SegmentAdjoint;
use crate::structure::{Pictures, Structure};
use crate::{Aabb, Domain, Extent, IndexGrid, LevelSet, Medium, Path, Ray, Vec3, vec3};

const SIZE: [usize; 2] = [40, 40];

/// What lies behind, by the direction in which it is seen, and the derivative.
fn panorama(d: Vec3<f64>) -> (f64, Vec3<f64>) {
    let (a, b) = (vec3(5.0, 9.0, 14.0), vec3(-11.0, 6.0, 4.0));
    let value = 0.5 + 0.2 * a.dot(d).sin() + 0.15 * b.dot(d).cos();
    (value, a * (0.2 * a.dot(d).cos()) - b * (0.15 * b.dot(d).sin()))
}

fn medium(index: f64, dent: f64) -> Medium<f64> {
    let cube = Aabb::cube(1.0);
    let phi = |x: Vec3<f64>| x.length() - 0.6 - dent * (4.0 * x.x).sin() * (3.0 * x.y).cos();
    Medium::new(vec![IndexGrid::sharp(LevelSet::from_samples(cube, [33; 3], phi), index)]).unwrap()
}

/// Rays through the middle of the ball, one per pixel: none meets its surface so flat that derivatives are bounded.
fn rays() -> Vec<Ray<f64>> {
    let ray = |k: usize| {
        let place = |k: usize, n: usize| 0.7 * ((k as f64 + 0.5) / n as f64 - 0.5);
        let to = vec3(place(k % SIZE[0], SIZE[0]), place(k / SIZE[0], SIZE[1]), 0.0);
        let origin = vec3(0.1, -0.2, -4.0);
        Ray { origin, direction: (to - origin).normalized() }
    };
    (0..SIZE[0] * SIZE[1]).map(ray).collect()
}

fn paths(medium: &Medium<f64>, domain: &Domain<f64>) -> Vec<Path<f64>> {
    let tracer = Tracer::new(medium, domain, Options::default());
    rays().iter().map(|r| tracer.trace(r)).collect()
}

#[test]
fn the_score_of_a_prediction_has_the_gradient_of_its_differences() {
    const STEP: f64 = 1e-5;
    const TOL: f64 = 1e-4; // relative; crossings are found to 1e-9
    let cube = Aabb::cube(2.0);
    let domain = Domain::with_longest(cube, Extent::Bounded, 17);
    let seen = |m: &Medium<f64>| -> Vec<f64> {
        paths(m, &domain).iter().map(|p| panorama(p.exit.direction).0).collect()
    };
    let photograph = seen(&medium(1.5, 0.0));
    let is_inner =
        |k: usize| (1..SIZE[0] - 1).contains(&(k % SIZE[0])) && (1..SIZE[1] - 1).contains(&(k / SIZE[0]));
    let weight: Vec<f64> = (0..photograph.len()).map(|k| if is_inner(k) { 1.0 } else { 0.0 }).collect();
    let structure = Structure::new(4.0, 2.0);
    let score = |m: &Medium<f64>| {
        let shown = seen(m);
        let pictures = Pictures { size: SIZE, shown: &shown, photograph: &photograph, weight: &weight };
        structure.similarity(&pictures).unwrap().score
    };
    let assumed = medium(1.47, 0.004);
    let shown = seen(&assumed);
    let pictures = Pictures { size: SIZE, shown: &shown, photograph: &photograph, weight: &weight };
    let (similarity, d_shown) = structure.similarity_vjp(&pictures).unwrap();
    assert!(similarity.score > 0.1 && similarity.score < 0.95, "{similarity:?}");
    let mut gradient = assumed.zero_gradient();
    let tracer = Tracer::new(&assumed, &domain, Options::default());
    for ((ray, path), d) in rays().iter().zip(&paths(&assumed, &domain)).zip(&d_shown) {
        let segments = vec![SegmentAdjoint::default(); path.segments.len()];
        let exit = RayAdjoint { origin: Vec3::zero(), direction: panorama(path.exit.direction).1 * *d };
        tracer.vjp(ray, path, &PathAdjoint { segments: &segments, reflections: &[], exit }, &mut gradient);
    }
    let slope = |change: &dyn Fn(&mut Medium<f64>, f64)| {
        let at = |by: f64| {
            let mut moved = assumed.clone();
            change(&mut moved, by);
            score(&moved)
        };
        (at(STEP) - at(-STEP)) / (2.0 * STEP)
    };
    let by_index = 1.47 * gradient.index[0].iter().sum::<f64>();
    let expected = slope(&|m, by| m.region_mut(0).set_interior_index(1.47 + by));
    assert!((by_index - expected).abs() < TOL * expected.abs(), "{by_index} {expected}");
    // Along its own gradient the surface raises the score by the length of the gradient.
    let along = &gradient.level_set[0];
    let length = along.iter().map(|g| g * g).sum::<f64>().sqrt();
    let expected = slope(&|m, by| {
        let surface = m.region_mut(0).level_set_mut().unwrap();
        surface.coefficients_mut().iter_mut().zip(along).for_each(|(c, g)| *c += by * g / length);
        surface.find_surface();
    });
    assert!((length - expected).abs() < TOL * expected.abs(), "{length} {expected}");
}
