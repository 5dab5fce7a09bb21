//! What single scenes claim to show.

use crate::fixture::go_on;
use refraxel_core::{Camera, Ray, Vec3, vec3};
use refraxel_data::synth::{
    CAMERA_RADIUS, CameraSet, Elevations, IndexTruth, Limits, Scene, SceneOptions, Shape, SynthError,
    SynthOptions, Tracer, ViewCounts, cameras, scene, scene_list, synthesize,
};

fn seeded(name: &str, seed: u64) -> Scene {
    scene(name, &SceneOptions { seed, ..SceneOptions::default() }).unwrap()
}

fn views(scene: &Scene, count: usize) -> Vec<Camera> {
    cameras(CameraSet::Upper.elevations(scene), count, 3, [24, 24])
}

/// The rays through the centres of all pixels.
fn rays(camera: &Camera) -> impl Iterator<Item = Ray<f64>> {
    let pixels = 0..camera.width * camera.height;
    pixels.filter_map(|p| camera.ray(f64::from(p % camera.width) + 0.5, f64::from(p / camera.width) + 0.5))
}

/// The refractive bodies that the transmitted path of a ray touches, by name.
fn touched(scene: &Scene, ray: Ray<f64>) -> Vec<&str> {
    let path = Tracer { scene, limits: Limits::default() }.main_path(ray);
    let bodies = scene.bodies.iter().filter(|b| b.medium().is_some());
    bodies
        .filter(|b| path.iter().any(|r| b.shape.surface(r.origin).0.abs() < 1e-9))
        .map(|b| b.name.as_str())
        .collect()
}

#[test]
fn the_pool_is_seen_from_above_its_rim_and_only_its_waves_are_seen() {
    for seed in [0, 5] {
        let pool = seeded("wavy_pool", seed);
        let rim = pool.bodies.iter().filter(|b| b.name == "wall").map(|b| b.shape.bounds().max.z);
        let rim = rim.fold(f64::NEG_INFINITY, f64::max);
        let (mut surface, mut below) = (0, 0);
        for camera in views(&pool, 20) {
            let eye = camera.world_from_camera.translation;
            let elevation = (eye.z / CAMERA_RADIUS).asin().to_degrees();
            assert!(eye.z > rim + 1.0 && (35.0..=80.0).contains(&elevation), "{elevation}");
            for ray in rays(&camera) {
                let Some(hit) = pool.first_visible(&ray, 0) else { continue };
                if pool.bodies[hit.body].name != "water" {
                    continue;
                }
                assert!(hit.crossing.normal.z > 0.7, "a side of the water is seen: {:?}", hit.crossing);
                surface += 1;
                // Under water too, rays end at floor, walls and things before they reach a side or the bottom.
                let tracer = Tracer { scene: &pool, limits: Limits::default() };
                for at in tracer.main_path(ray).iter().step_by(2) {
                    let inner = pool.first_visible(at, pool.inside(at.origin + at.direction * 1e-6));
                    let inner = inner.filter(|h| pool.bodies[h.body].name == "water");
                    assert!(inner.is_none_or(|h| h.crossing.normal.z > 0.7));
                    below += 1;
                }
            }
        }
        assert!(surface > 1000 && below > 2000, "{surface} {below}");
    }
}

#[test]
fn a_scene_seen_from_above_only_refuses_cameras_all_around() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("pool");
    let options = SynthOptions { cameras: CameraSet::Full, ..SynthOptions::new("wavy_pool", &out) };
    let error = synthesize(&options, &go_on).unwrap_err();
    assert!(matches!(error, SynthError::Range { option: "--cameras", .. }));
    let message = error.to_string();
    assert!(
        message.contains("full") && message.contains("wavy_pool is seen from 35° to 80° only"),
        "{message}"
    );
    assert!(!out.exists());
}

#[test]
fn the_elevations_of_a_scene_are_written_with_it() {
    let folder = tempfile::tempdir().unwrap();
    for (name, expected) in [("wavy_pool", [35.0, 80.0]), ("pair", [12.0, 78.0])] {
        let views = ViewCounts { train: 1, val: 0, test: 1 };
        let usual = SynthOptions::new(name, folder.path().join(name));
        let options = SynthOptions { size: 8, views, spp: 1, detail_spp: 0, index_resolution: 0, ..usual };
        synthesize(&options, &go_on).unwrap();
        let text = std::fs::read_to_string(folder.path().join(name).join("scene.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        for k in 0..2 {
            assert!((json["camera_elevations"][k].as_f64().unwrap() - expected[k]).abs() < 1e-9);
        }
        assert!(IndexTruth::from_scene_json(&json).is_some());
    }
}

#[test]
fn scenes_other_than_the_pool_keep_the_usual_cameras() {
    for info in scene_list().iter().filter(|i| i.name != "wavy_pool") {
        assert_eq!(seeded(info.name, 0).elevations, Elevations::UPPER, "{}", info.name);
    }
}

#[test]
fn every_face_of_the_faceted_stone_is_a_part_of_its_surface() {
    let stone = seeded("faceted", 0);
    let body = stone.bodies.iter().find(|b| b.medium().is_some()).unwrap();
    let Shape::Polyhedron(stone) = &body.shape else { panic!("{:?}", body.shape) };
    assert_eq!(stone.faces.len(), 20);
    assert!(body.shape.bounds().min.z > -0.7, "it does not reach below the ground");
    const RAYS: u32 = 20_000;
    let center = body.shape.bounds().center();
    let mut seen = [0; 20];
    for k in 0..RAYS {
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(RAYS);
        let (sin, cos) = (f64::from(k) * 2.399_963_229_728_653).sin_cos();
        let d = vec3(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z);
        let hit = body.shape.hit(&Ray { origin: center + d * 3.0, direction: -d }, 9.0).unwrap();
        let face = stone.faces.iter().position(|f| f.normal == hit.normal).unwrap();
        seen[face] += 1;
    }
    // A fifth of the mean solid angle is still a face that one sees.
    assert!(seen.iter().all(|&n| n > RAYS / 100), "{seen:?}");
    assert!(seen.iter().max() > seen.iter().min().map(|n| 2 * n).as_ref(), "irregular: {seen:?}");
}

#[test]
fn in_many_views_of_the_pair_one_body_is_seen_through_the_other() {
    let pair = seeded("pair", 0);
    let share = |camera: &Camera| {
        let bodies: Vec<usize> = rays(&camera.resized(96, 96)).map(|r| touched(&pair, r).len()).collect();
        let count = |n: usize| bodies.iter().filter(|&&b| b >= n).count() as f64;
        count(2) / count(1)
    };
    let shares: Vec<f64> = views(&pair, 20).iter().map(share).collect();
    assert!(shares.iter().filter(|&&s| s > 0.05).count() >= 8, "{shares:?}");
}

#[test]
fn the_glass_is_three_fifths_full_and_water_touches_its_walls() {
    let glass = seeded("drinking_glass", 0);
    let n = |x: f64, z: f64| glass.index_at(vec3(x, 0.0, z));
    let (base, rim) = (-0.6, 0.16);
    let level = base + 0.6 * (rim - base);
    for z in [base + 0.01, level - 0.01] {
        let across = (0..500).map(|i| n(0.001 * f64::from(i), z));
        let mut kinds: Vec<f64> = across.collect();
        kinds.dedup();
        assert_eq!(kinds, [1.33, 1.5, 1.0], "at height {z}");
    }
    assert_eq!([n(0.1, base - 0.02), n(0.1, level + 0.01), n(0.34, level + 0.01)], [1.5, 1.0, 1.5]);
    assert_eq!([n(0.1, rim + 0.01), n(0.34, rim + 0.01)], [1.0, 1.0]);
    let truth = IndexTruth::of_scene(&glass).unwrap();
    assert!(truth.is_inside(vec3(0.1, 0.0, base + 0.1)) && !truth.is_inside(vec3(0.1, 0.0, level + 0.1)));
    assert!((truth.bounding_box().max.z - rim).abs() < 1e-9);
}

#[test]
fn bubbles_lie_in_their_block_and_are_air() {
    let scene = seeded("bubble", 0);
    let block = scene.bodies.iter().find(|b| b.name == "glass").unwrap();
    let bubbles: Vec<_> = scene.bodies.iter().filter(|b| b.name == "air").collect();
    assert_eq!(bubbles.len(), 3);
    for (i, bubble) in bubbles.iter().enumerate() {
        let b = bubble.shape.bounds();
        let radius = 0.5 * b.extent().x;
        assert!(block.shape.surface(b.center()).0 < -radius - 0.02);
        assert_eq!(scene.index_at(b.center()), 1.0);
        assert_eq!(scene.index_at(b.center() + vec3(0.0, 0.0, radius + 0.01)), 1.5);
        let apart = |o: &Vec3<f64>| (*o - b.center()).length() > radius + 0.1;
        assert!(bubbles[..i].iter().all(|o| apart(&o.shape.bounds().center())));
    }
}

#[test]
fn masks_of_new_scenes_cover_a_fair_share_of_every_view() {
    for name in ["drinking_glass", "wavy_pool", "bubble", "pair", "faceted"] {
        let scene = seeded(name, 0);
        for camera in views(&scene, 12) {
            let eye = scene.inside(camera.world_from_camera.translation);
            let is_refractive = |r: &Ray<f64>| {
                scene.first_visible(r, eye).is_some_and(|h| scene.bodies[h.body].medium().is_some())
            };
            let share = rays(&camera).filter(is_refractive).count() as f64 / 576.0;
            assert!((0.03..0.4).contains(&share), "{name}: {share}");
        }
    }
}
