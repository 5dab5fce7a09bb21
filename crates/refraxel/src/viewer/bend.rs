//! The ray through a pixel: its path by the tracer that renders, and what happens on it.

use super::protocol::{BentRay, Bounce};
use super::scene::Scene;
use crate::verbs::render::paths::{Ball, corners};
use refraxel_core::optics::{EventKind, PathEnd, Step, fresnel::Incidence};
use refraxel_core::radiance::Segment;
use refraxel_core::{Path, Ray, Vec3};
use refraxel_data::quantize;
use refraxel_train::backend::Layers;
use refraxel_train::{Backend, Refraction};

/// Pixels less opaque than this show no place.
const OPAQUE: f32 = 0.05;

/// Follows a ray through the medium that the renderer has.
pub fn follow(scene: &Scene, ray: &Ray<f32>) -> BentRay {
    let backend = scene.backend();
    let (refraction, domain) = (backend.medium(), backend.domain());
    let start = ray.cast::<f64>();
    let bounds = domain.bounds.cast::<f64>();
    let distance = (bounds.center() - start.origin).length();
    let ball = Ball { middle: bounds.center(), radius: distance.max(bounds.extent().length()) };
    let straight = [start.origin, ball.exit(&start)];
    let mut path = Path::default();
    let bends = refraction.admits(ray);
    if bends {
        refraction.tracer(domain, scene.marching().near).trace_into(ray, &mut path);
    }
    let points = if bends { corners(&path, ball) } else { straight.to_vec() };
    let pixel = backend.render(&[*ray], scene.marching(), Layers::All)[0];
    let opacity = 1.0 - pixel.transmittance;
    let depth = (opacity > OPAQUE).then(|| f64::from(pixel.depth / opacity));
    let (densest, late) = optical(&path);
    let shown = |x: Vec3<f64>| scene.origin().to_world(x).to_array();
    let bounces = if bends { bounces(refraction, &path) } else { Vec::new() };
    BentRay {
        seen: depth.map(|s| (s, shown(along(&points, s)))),
        straight: straight.map(shown),
        bounces: bounces.into_iter().map(|b| Bounce { place: shown(b.place.into()), ..b }).collect(),
        turned: if bends { angle(start.direction, path.exit.direction.cast()) } else { 0.0 },
        densest,
        late,
        colour: pixel.colour.map(quantize),
        opacity,
        is_whole: !bends || path.end == PathEnd::Escaped,
        points: points.into_iter().map(shown).collect(),
    }
}

/// Largest index on a path, and ∫ (n − 1) ds over it.
fn optical(path: &Path<f32>) -> (f64, f64) {
    path.segments.iter().zip(&path.steps).fold((1.0, 0.0), |(densest, late), (segment, step)| {
        let n = f64::from(segment.momentum.length());
        (f64::max(densest, n), late + (n - 1.0) * n * f64::from(step.drift))
    })
}

fn bounces(refraction: &Refraction, path: &Path<f32>) -> Vec<Bounce> {
    let pairs = path.segments.iter().zip(&path.steps).enumerate();
    let after = |i: usize| path.segments.get(i + 1).map_or(path.exit.direction, |s| s.momentum);
    pairs.filter_map(|(i, (segment, step))| bounce(refraction, segment, step, after(i))).collect()
}

fn bounce(
    refraction: &Refraction,
    segment: &Segment<f32>,
    step: &Step<f32>,
    after: Vec3<f32>,
) -> Option<Bounce> {
    let event = step.event.as_ref()?;
    let regions = refraction.medium.regions();
    let place = segment.at(step.drift);
    let normal = regions[usize::from(step.region)].level_set()?.sample(place).1.normalized().cast::<f64>();
    let index = |region: Option<u16>| region.map_or(1.0, |r| f64::from(regions[usize::from(r)].index(place)));
    let [before, beyond] = [index(step.within), index(event.beyond)];
    let (p, q) = (segment.momentum.cast::<f64>(), after.cast::<f64>());
    let total = event.kind == EventKind::Reflection;
    let [w_before, w_after] = [before, beyond].map(|n| 0.5 * n * n);
    let incidence = Incidence { before: p.dot(normal).abs(), after: q.dot(normal).abs(), w_before, w_after };
    Some(Bounce {
        place: place.cast::<f64>().to_array(),
        region: step.region,
        total,
        index: [before, beyond],
        angle: [p, q].map(|d| acute(d, normal)),
        reflectance: if total { 1.0 } else { incidence.reflectance() },
    })
}

/// The angle of two directions [degree].
fn angle(a: Vec3<f64>, b: Vec3<f64>) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// The angle of a direction to a line [degree].
fn acute(a: Vec3<f64>, line: Vec3<f64>) -> f64 {
    a.cross(line).length().atan2(a.dot(line).abs()).to_degrees()
}

/// The place on a polyline at an arc length.
fn along(points: &[Vec3<f64>], mut length: f64) -> Vec3<f64> {
    for pair in points.windows(2) {
        let piece = (pair[1] - pair[0]).length();
        if length <= piece {
            return pair[0] + (pair[1] - pair[0]) * (length / piece.max(f64::MIN_POSITIVE));
        }
        length -= piece;
    }
    points[points.len() - 1]
}
