//! The trained renderer's paths through the truth of a scene, held on grids, are those of the exact tracer.

use refraxel_core::optics::{Options as TracerOptions, PathEnd, Tracer};
use refraxel_core::{Domain, Extent, Medium, Ray, Vec3, vec3};
use refraxel_data::IndexSource;
use refraxel_data::synth::{self, IndexTruth, Limits, Scene, SceneOptions, scene};
use refraxel_train::options::Options;
use refraxel_train::refraction_search::known_refraction;

/// Nodes along the longest edge of each body.
const NODES: u32 = 96;

/// A scene without its opaque bodies.
fn refractive(name: &str) -> Scene {
    let mut scene = scene(name, &SceneOptions::default()).unwrap();
    scene.bodies.retain(|b| b.medium().is_some());
    scene
}

/// The truth of a scene on grids of so many nodes along the longest edge, one body each.
fn held(scene: &Scene, nodes: u32) -> Medium<f64> {
    let source = IndexSource::Truth(IndexTruth::of_scene(scene).unwrap());
    known_refraction(&source, nodes, &Options::default()).medium.cast()
}

/// Rays from around the scene, through random points of its bodies.
fn rays(scene: &Scene, count: usize) -> Vec<Ray<f64>> {
    let truth = IndexTruth::of_scene(scene).unwrap();
    let (bounds, mut state) = (truth.bounding_box(), 5_u64);
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut vector = || vec3(next(), next(), next());
    (0..count)
        .map(|_| {
            let target = bounds.center() + vector().hadamard(bounds.extent() * 0.5);
            let origin = bounds.center() + vector().normalized() * 3.0;
            Ray { origin, direction: (target - origin).normalized() }
        })
        .collect()
}

/// Angles between the exit rays of both tracers [degree], sorted, and the share of rays that turn at all.
fn deviations(name: &str, nodes: u32) -> (Vec<f64>, f64) {
    let (scene, far) = (refractive(name), Vec3::splat(4.0));
    let medium = held(&scene, nodes);
    let domain = Domain::with_longest(refraxel_core::Aabb::new(-far, far), Extent::Bounded, 16);
    let exact = synth::Tracer { scene: &scene, limits: Limits::default() };
    let tracer = Tracer::new(&medium, &domain, TracerOptions { max_segments: 256, ..Default::default() });
    let (mut off, mut turned) = (Vec::new(), 0);
    let rays = rays(&scene, 2000);
    for ray in &rays {
        let exact = exact.main_path(*ray);
        let path = tracer.trace(ray);
        if exact.len() > 60 || path.end == PathEnd::Exhausted {
            continue; // caught by total reflections
        }
        let (a, b) = (exact.last().unwrap().direction, path.exit.direction);
        off.push(a.cross(b).length().atan2(a.dot(b)).to_degrees());
        turned += usize::from(a.dot(ray.direction) < 0.9999);
    }
    off.sort_by(f64::total_cmp);
    (off, turned as f64 / rays.len() as f64)
}

#[test]
fn exit_rays_through_nested_and_separate_bodies_are_those_of_the_exact_tracer() {
    for (name, share) in [("hollow_ball", 0.95), ("two_indices", 0.95), ("tinted_glass", 0.9)] {
        let (off, turned) = deviations(name, NODES);
        let [median, most] = [0.5, share].map(|q| off[(q * off.len() as f64) as usize]);
        assert!(off.len() > 1500 && turned > 0.2, "{name}: {} rays, {turned} turn", off.len());
        assert!(median < 0.01 && most < 0.2, "{name}: {median} {most} degrees");
    }
}

#[test]
fn only_rays_that_meet_the_rounded_edges_of_boxes_leave_elsewhere_and_finer_grids_have_fewer() {
    // Grids round edges over two voxels. A ray through the tank crosses up to six faces; whichever of them it crosses within
    // that distance of an edge turns it elsewhere. Were anything else wrong, finer grids would not help.
    let astray = [NODES, 3 * NODES / 2].map(|nodes| {
        let (off, turned) = deviations("aquarium", nodes);
        assert!(off.len() > 1500 && turned > 0.2 && off[off.len() / 2] < 0.01, "{}", off[off.len() / 2]);
        off.iter().filter(|angle| **angle > 0.2).count() as f64 / off.len() as f64
    });
    assert!(astray[1] < 0.8 * astray[0] && astray[0] < 0.45, "{astray:?}");
}
