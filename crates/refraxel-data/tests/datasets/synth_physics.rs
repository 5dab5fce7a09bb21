//! The reference tracer against closed forms of geometrical optics.

use refraxel_core::{Ray, Vec3, vec3};
use refraxel_data::synth::{
    Body, Elevations, Environment, HeightField, Index, Limits, Medium, Polyhedron, Reflection, Scene,
    SceneOptions, Shape, Texture, Tracer, Wave, scene,
};

const TIGHT: Limits = Limits { reflection: Reflection::On, energy_cut: 1e-3, depth: 64, tolerance: 1e-13 };

fn of(bodies: Vec<Body>) -> Scene {
    Scene {
        name: "test".into(),
        shows: String::new(),
        bodies,
        environment: Environment::Constant([1.0; 3]),
        bounds: Scene::usual_bounds(),
        elevations: Elevations::UPPER,
    }
}

fn glass(shape: Shape, ior: f64) -> Body {
    Body::refractive("glass", shape, Medium::clear(ior), 1)
}

fn path(scene: &Scene, origin: Vec3<f64>, direction: Vec3<f64>) -> Vec<Ray<f64>> {
    Tracer { scene, limits: TIGHT }.main_path(Ray { origin, direction: direction.normalized() })
}

fn exit(scene: &Scene, origin: Vec3<f64>, direction: Vec3<f64>) -> Ray<f64> {
    path(scene, origin, direction)[..].last().copied().unwrap()
}

fn angle(a: Vec3<f64>, b: Vec3<f64>) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[test]
fn synth_a_sphere_deflects_by_twice_the_difference_of_its_angles() {
    let (radius, n) = (0.5_f64, 1.5_f64);
    let ball = of(vec![glass(Shape::sphere([0.0; 3], radius), n)]);
    for b in [0.01_f64, 0.2, 0.4, 0.49] {
        let d = vec3(1.0, 0.0, 0.0);
        let out = exit(&ball, vec3(-3.0, b, 0.0), d);
        let incidence = (b / radius).asin();
        let exact = 2.0 * (incidence - (incidence.sin() / n).asin());
        assert!((angle(d, out.direction) - exact).abs() < 1e-12, "{b}");
    }
}

#[test]
fn synth_a_slab_shifts_a_ray_and_keeps_its_direction() {
    let (thickness, n) = (0.3, 1.5_f64);
    let slab = of(vec![glass(Shape::cuboid([-9.0, -9.0, -thickness], [9.0, 9.0, 0.0]), n)]);
    for a in [0.1_f64, 0.7, 1.4] {
        let start = vec3(0.0, 0.0, 0.4);
        let d = vec3(a.sin(), 0.0, -a.cos());
        let out = exit(&slab, start, d);
        let inner = (a.sin() / n).asin();
        let exact = thickness * (a - inner).sin() / inner.cos();
        assert!((out.direction - d).length() < 1e-12);
        assert!(((out.origin - start).cross(d).length() - exact).abs() < 1e-12, "{a}");
    }
}

#[test]
fn synth_a_vertical_ray_is_deflected_by_the_slope_of_a_wave() {
    let (n, wave) = (1.33_f64, Wave { amplitude: 0.04, vector: [7.0, 0.0], phase: 0.4 });
    let sea = HeightField { min: vec3(-9.0, -9.0, -9.0), max: [9.0; 2], level: 0.1, waves: vec![wave] };
    let sea = of(vec![glass(Shape::HeightField(sea), n)]);
    let down = vec3(0.0, 0.0, -1.0);
    for x in [-0.31, 0.0, 0.17, 0.4_f64] {
        let below = path(&sea, vec3(x, 0.2, 2.0), down)[2];
        let phase = 7.0 * x + 0.4;
        assert!((below.origin - vec3(x, 0.2, 0.1 + 0.04 * phase.sin())).length() < 1e-14);
        // The angle of incidence is that of the slope; the ray turns towards the normal, away from the crest.
        let incidence = (0.04 * 7.0 * phase.cos()).atan();
        let turn = incidence - (incidence.sin() / n).asin();
        assert!((below.direction - vec3(turn.sin(), 0.0, -turn.cos())).length() < 1e-14, "{x}");
    }
}

#[test]
fn synth_a_luneburg_lens_focuses_parallel_light_on_its_rim() {
    let (center, radius) = (vec3(0.1, -0.2, 0.05), 0.5);
    let index = Index::Luneburg { center, radius };
    let lens = of(vec![Body::refractive(
        "lens",
        Shape::sphere(center.to_array(), radius),
        Medium::graded(index),
        1,
    )]);
    let d = vec3(2.0, 1.0, -0.5).normalized();
    let (u, v) = (d.cross(vec3(0.0, 0.0, 1.0)).normalized(), vec3(0.0, 0.0, 1.0));
    for (a, b) in [(0.0, 0.0), (0.2, 0.1), (-0.3, 0.25), (0.44, 0.0), (0.05, -0.45)] {
        let start = center - d * 2.0 + u * a + v.cross(u).cross(u) * -b;
        let leaves = path(&lens, start, d);
        let focus = leaves[leaves.len() - 2].origin;
        assert!(
            (focus - center - d * radius).length() <= 1e-9 * radius,
            "{:e}",
            (focus - center - d * radius).length()
        );
    }
}

#[test]
fn synth_a_fish_eye_images_each_point_of_its_rim_on_the_opposite_one() {
    let (center, radius) = (vec3(0.02, 0.03, -0.13), 0.5);
    let index = Index::FishEye { center, radius };
    let lens = of(vec![Body::refractive(
        "lens",
        Shape::sphere(center.to_array(), radius),
        Medium::graded(index),
        1,
    )]);
    let point = center + vec3(-0.6, 0.8, 0.0) * radius;
    for to in [vec3(0.1, 0.2, 0.3), vec3(-0.3, -0.1, 0.0), vec3(0.0, 0.0, -0.3), vec3(0.3, 0.3, 0.1)] {
        let d = (center + to - point).normalized();
        let p = path(&lens, point - d * 1.5, d);
        let image = p[p.len() - 2].origin;
        assert!((image + point - center * 2.0).length() <= 1e-9 * radius);
        assert!(angle(p[p.len() - 1].direction, d) > 0.1, "the lens did bend the ray");
    }
}

#[test]
fn synth_a_layered_block_bends_rays_into_parabolas_up_to_its_exact_border() {
    let index = Index::Layered { z_bottom: -0.5, z_top: 0.5, bottom: 1.2, top: 1.0 };
    let block = of(vec![Body::refractive(
        "air",
        Shape::cuboid([-1.0, -1.0, -0.5], [1.0, 1.0, 0.5]),
        Medium::graded(index),
        1,
    )]);
    let p = path(&block, vec3(-3.0, 0.1, -0.1), vec3(1.0, 0.0, 0.0));
    // Inside: p_x is constant and z falls as g t² / 2 with t = 2 / p_x.
    let px = index.n(vec3(-1.0, 0.1, -0.1));
    let g = 0.5 * (1.0 - 1.2 * 1.2);
    let exact = vec3(1.0, 0.1, -0.1 + 0.5 * g * (2.0 / px) * (2.0 / px));
    assert!(exact.z > -0.5, "the ray leaves through the side");
    let leaves = p[3].origin;
    assert!((leaves - exact).length() < 1e-10, "{leaves:?} {exact:?}");
}

#[test]
fn synth_reversing_a_ray_retraces_its_path() {
    let mut checked = 0;
    for name in [
        "glass_ball",
        "glass_blob",
        "wine_glass",
        "diamond",
        "prism",
        "hollow_ball",
        "aquarium",
        "drinking_glass",
        "wavy_pool",
        "bubble",
        "pair",
        "faceted",
        "luneburg",
        "gaussian_bump",
    ] {
        let mut scene = scene(name, &SceneOptions::default()).unwrap();
        scene.bodies.retain(|b| b.medium().is_some());
        for k in 0..60_u32 {
            let t = f64::from(k);
            let origin = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalized() * 3.0;
            let target =
                vec3((t * 2.1).sin(), (t * 0.9).cos(), (t * 1.7).sin()) * 0.3 + vec3(0.0, 0.0, -0.13);
            let there = path(&scene, origin, target - origin);
            // Total reflection and chains of bounces amplify rounding; longer chains prove nothing more.
            if !(4..=12).contains(&there.len()) {
                continue;
            }
            let last = there[there.len() - 1];
            let back = path(&scene, last.origin + last.direction, -last.direction);
            let last_back = back[back.len() - 1];
            let line = origin - last_back.origin;
            let miss = (line - last_back.direction * line.dot(last_back.direction)).length();
            assert_eq!(there.len(), back.len(), "{name} {k}");
            assert!(miss < 1e-6, "{name} {k}: {miss:e}");
            checked += 1;
        }
    }
    assert!(checked > 300, "{checked}");
}

#[test]
fn synth_a_white_furnace_stays_white() {
    // Fresnel's R + T = 1 at every interface and the invariance of L/n²: no index change makes or takes light.
    for name in [
        "glass_ball",
        "glass_blob",
        "diamond",
        "hollow_ball",
        "aquarium",
        "drinking_glass",
        "wavy_pool",
        "bubble",
        "pair",
        "faceted",
        "two_indices",
        "fish_eye",
        "gaussian_bump",
    ] {
        let mut scene = scene(name, &SceneOptions::default()).unwrap();
        scene.bodies.retain(|b| b.medium().is_some());
        let tracer = Tracer { scene: &scene, limits: Limits::default() };
        for k in 0..40_u32 {
            let t = f64::from(k);
            let origin = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalized() * 3.0;
            let target =
                vec3((t * 2.1).sin(), (t * 0.9).cos(), (t * 1.7).sin()) * 0.3 + vec3(0.0, 0.0, -0.13);
            let (color, tally) = tracer.radiance(Ray { origin, direction: (target - origin).normalized() });
            assert!((color[0] + tally.lost - 1.0).abs() < 1e-10, "{name} {k}: {color:?} {}", tally.lost);
        }
    }
}

#[test]
fn synth_a_surface_under_water_shows_its_own_colour() {
    let color = [0.2, 0.5, 0.8];
    let stone = Body::opaque("stone", Shape::sphere([0.0, 0.0, -0.3], 0.2), Texture::Plain(color));
    let water = glass(Shape::cuboid([-1.0, -1.0, -1.0], [1.0, 1.0, 0.0]), 1.33);
    let scene = of(vec![stone, water]);
    let down = Ray { origin: vec3(0.0, 0.0, 2.0), direction: vec3(0.0, 0.0, -1.0) };
    let limits = Limits { reflection: Reflection::Off, ..Limits::default() };
    let (seen, _) = Tracer { scene: &scene, limits }.radiance(down);
    assert_eq!(seen, color);
    let (seen, _) = Tracer { scene: &scene, limits: Limits::default() }.radiance(down);
    let r = (0.33_f64 / 2.33).powi(2);
    for c in 0..3 {
        assert!((seen[c] - (r + (1.0 - r) * color[c])).abs() < 1e-12);
    }
}

#[test]
fn synth_tint_follows_beer_and_lambert_along_the_bent_path() {
    let absorption = [0.5, 2.0, 0.0];
    let medium = Medium { index: Index::Constant { ior: 1.5 }, absorption };
    let ball = of(vec![Body::refractive("ball", Shape::sphere([0.0; 3], 0.5), medium, 1)]);
    let limits = Limits { reflection: Reflection::Off, ..Limits::default() };
    let b = 0.3_f64;
    let (seen, _) = Tracer { scene: &ball, limits }
        .radiance(Ray { origin: vec3(-2.0, b, 0.0), direction: vec3(1.0, 0.0, 0.0) });
    let chord = 2.0 * 0.5 * (1.0 - (b / 0.5 / 1.5).powi(2)).sqrt();
    for c in 0..3 {
        assert!((seen[c] - (-absorption[c] * chord).exp()).abs() < 1e-12);
    }
}

#[test]
fn synth_a_right_angled_prism_turns_light_by_a_right_angle() {
    let h = std::f64::consts::FRAC_1_SQRT_2;
    let faces = [
        (vec3(-1.0, 0.0, 0.0), 0.2),
        (vec3(0.0, 0.0, -1.0), 0.2),
        (vec3(h, 0.0, h), 0.1),
        (vec3(0.0, 1.0, 0.0), 0.5),
        (vec3(0.0, -1.0, 0.0), 0.5),
    ];
    let prism = of(vec![glass(Shape::Polyhedron(Polyhedron::around(Vec3::zero(), faces)), 1.5)]);
    let out = exit(&prism, vec3(-2.0, 0.0, 0.01), vec3(1.0, 0.0, 0.0));
    assert!((out.direction - vec3(0.0, 0.0, -1.0)).length() < 1e-12);
}

#[test]
fn synth_a_bubble_of_the_same_index_does_nothing() {
    let shell = || glass(Shape::sphere([0.0; 3], 0.5), 1.5);
    let same = Body::refractive("same", Shape::sphere([0.1, 0.0, 0.0], 0.2), Medium::clear(1.5), 2);
    let (plain, bubble) = (of(vec![shell()]), of(vec![shell(), same]));
    let (start, d) = (vec3(-2.0, 0.13, 0.1), vec3(1.0, 0.0, 0.0));
    let (a, b) = (exit(&plain, start, d), exit(&bubble, start, d));
    assert!(
        (a.direction - b.direction).length() < 1e-12
            && (a.origin - b.origin).cross(a.direction).length() < 1e-12
    );
}

#[test]
fn synth_nested_media_obey_snell_at_every_border() {
    // Water on glass on an air gap: n sin θ is the same in all layers.
    let slab = |low: f64, high: f64| Shape::cuboid([-50.0, -50.0, low], [50.0, 50.0, high]);
    let scene = of(vec![
        Body::refractive("glass", slab(-1.0, 0.0), Medium::clear(1.5), 1),
        Body::refractive("water", slab(-0.5, 0.5), Medium::clear(1.33), 2),
        Body::refractive("air", slab(-0.8, -0.6), Medium::clear(1.0), 3),
    ]);
    let a = 0.6_f64;
    let p = path(&scene, vec3(0.0, 0.0, 1.0), vec3(a.sin(), 0.0, -a.cos()));
    // Every other vertex is a departure, the rest are arrivals.
    for ray in p.iter().step_by(2) {
        let n = scene.index_at(ray.origin + ray.direction * 1e-6);
        assert!((n * ray.direction.x - a.sin()).abs() < 1e-12);
    }
    let seen: Vec<f64> = p.iter().step_by(2).map(|r| scene.index_at(r.origin + r.direction * 1e-6)).collect();
    for n in [1.0, 1.33, 1.5] {
        assert!(seen.contains(&n), "{seen:?}");
    }
}

#[test]
fn synth_the_energy_cut_changes_a_sample_by_less_than_itself() {
    let scene = scene("hollow_ball", &SceneOptions::default()).unwrap();
    let render = |energy_cut| Tracer { scene: &scene, limits: Limits { energy_cut, ..Limits::default() } };
    let mut worst = 0.0_f64;
    let mut mean = 0.0;
    for k in 0..200_u32 {
        let t = f64::from(k);
        let origin = vec3((t * 0.71).sin(), (t * 1.3).cos(), 0.8).normalized() * 4.0;
        let target = vec3((t * 2.1).sin(), (t * 0.9).cos(), (t * 1.7).sin()) * 0.4 + vec3(0.0, 0.0, -0.13);
        let ray = Ray { origin, direction: (target - origin).normalized() };
        let (a, b) = (render(1e-3).radiance(ray).0, render(1e-7).radiance(ray).0);
        let d = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
        worst = worst.max(d);
        mean += d / 200.0;
    }
    assert!(mean < 1e-3 && worst < 1e-2, "{mean} {worst}");
}
