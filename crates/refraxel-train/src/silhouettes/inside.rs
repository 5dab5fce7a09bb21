//! How much of each voxel lies inside of a closed shape.

use rayon::prelude::*;
use refraxel_core::{Domain, Ray, vec3};
use refraxel_data::synth::Shape;

/// Lines run beside the samples by this share of their spacing, so that they do not meet edges of regular meshes.
const ASIDE: [f64; 2] = [0.00137, -0.00211];
/// Crossings of one line; more belong to a damaged surface.
const MOST_CROSSINGS: usize = 1000;

/// Share of `samples`³ points of each node's voxel that lie inside, x fastest.
///
/// One line along x per row of samples: a point is inside where the line has crossed the surface an odd number of times.
/// A line with an odd number of crossings in all meets a hole and counts as outside.
pub(super) fn occupancy(shape: &Shape, domain: &Domain<f32>, samples: usize) -> Vec<f32> {
    let n = domain.resolution.map(|n| n as usize);
    let spacing = 1.0 / samples as f64;
    let weight = spacing.powi(3) as f32;
    let mut occupancy = vec![0.0; n[0] * n[1] * n[2]];
    occupancy.par_chunks_exact_mut(n[0]).enumerate().for_each(|(row, out)| {
        for line in 0..samples * samples {
            let aside = |k: usize, a: usize| (k as f64 + 0.5 + ASIDE[a]) * spacing - 0.5;
            let (y, z) = (
                (row % n[1]) as f64 + aside(line % samples, 0),
                (row / n[1]) as f64 + aside(line / samples, 1),
            );
            let at = |x: f64| domain.cast::<f64>().position(vec3(x, y, z));
            let x_at = |sample: usize| at((sample as f64 + 0.5) * spacing - 0.5).x;
            let start = shape.bounds().min.x.min(x_at(0)) - 1e-3 * shape.bounds().extent().x;
            let crossings = crossings(
                shape,
                Ray { origin: vec3(start, at(0.0).y, at(0.0).z), direction: vec3(1.0, 0.0, 0.0) },
            );
            if !crossings.len().is_multiple_of(2) {
                continue;
            }
            let mut passed = 0;
            for sample in 0..n[0] * samples {
                let x = x_at(sample);
                passed += crossings[passed..].iter().take_while(|&&c| c < x).count();
                out[sample / samples] += if passed % 2 == 1 { weight } else { 0.0 };
            }
        }
    });
    occupancy
}

/// World x of all crossings of a line along x, in order.
fn crossings(shape: &Shape, mut ray: Ray<f64>) -> Vec<f64> {
    let mut found = Vec::new();
    while let Some(crossing) = shape.hit(&ray, f64::INFINITY).filter(|_| found.len() < MOST_CROSSINGS) {
        ray.origin = ray.at(crossing.s);
        found.push(ray.origin.x);
    }
    found
}
