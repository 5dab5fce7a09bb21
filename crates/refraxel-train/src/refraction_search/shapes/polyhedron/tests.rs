use super::super::contours::Contours;
use super::super::views::{cameras, footprint, hull, meets_body, shaken, silhouette, silhouettes};
use super::boundary::{Boundary, Facet};
use super::{Faceted, polyhedron};
use crate::cancel::Cancel;
use crate::model::polyhedron::Plane;
use crate::random::Random;
use crate::silhouettes::{Occluders, Outlines, Silhouette};
use refraxel_core::{Ray, Vec3, vec3};
use std::f64::consts::TAU;

const EVERYWHERE: [f64; 2] = [-1.0, 1.0];
const FROM_ABOVE: [f64; 2] = [0.1, 0.9];

fn facet(x: f64, y: f64, z: f64, offset: f64) -> Facet {
    Facet { normal: vec3(x, y, z).normalized(), offset }
}

/// `count` faces of random directions, no two closer than `apart` [rad].
fn irregular(count: usize, apart: f64, seed: u64) -> Vec<Facet> {
    let random = Random::new(seed);
    let mut faces: Vec<Facet> = Vec::new();
    for i in 0.. {
        let u = |k: u64| 2.0 * random.uniform(i, k) - 1.0;
        let m = vec3(u(0), u(1), u(2));
        let is_apart = faces.iter().all(|f| f.normal.dot(m.normalized()) < apart.cos());
        if m.length() < 1.0 && is_apart {
            faces.push(facet(m.x, m.y, m.z, 0.66 + 0.06 * u(3)));
        }
        if faces.len() == count {
            break;
        }
    }
    faces
}

/// A round brilliant of girdle radius 0.8, tilted.
fn brilliant() -> Vec<Facet> {
    let (radius, girdle) = (0.8, 0.02);
    let slope = |sign: f64, degrees: f64, around: f64, reach: f64| {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        facet(sin * around.cos(), sin * around.sin(), sign * cos, reach)
    };
    let through = |degrees: f64, radius: f64, height: f64| {
        let (sin, cos) = f64::to_radians(degrees).sin_cos();
        radius * sin + height * cos
    };
    let table = girdle + 0.43 * radius * 34.5_f64.to_radians().tan();
    let mut faces = vec![facet(0.0, 0.0, 1.0, table)];
    for k in 0..8 {
        let (a, b) = (f64::from(k) * TAU / 8.0, (f64::from(k) + 0.5) * TAU / 8.0);
        faces.push(slope(1.0, 34.5, a, through(34.5, radius, girdle)));
        faces.push(slope(1.0, 20.0, b, through(20.0, 0.585 * radius, table)));
        faces.push(slope(-1.0, 40.75, a, through(40.75, radius, girdle)));
        faces.push(slope(-1.0, 42.5, b, through(42.5, radius, girdle)));
    }
    faces.extend((0..16).map(|k| slope(0.0, 90.0, f64::from(k) * TAU / 16.0, radius)));
    let (sin, cos) = 58_f64.to_radians().sin_cos();
    let tilt = |n: Vec3<f64>| vec3(cos * n.x + sin * n.z, n.y, -sin * n.x + cos * n.z);
    // Off the middle.
    faces
        .into_iter()
        .map(|f| Facet { normal: tilt(f.normal), offset: f.offset + 0.1 * tilt(f.normal).z })
        .collect()
}

fn cube() -> Vec<Facet> {
    let turn =
        |x, y, z| facet(0.9 * x - 0.3 * y + 0.1 * z, 0.3 * x + 0.9 * y + 0.2 * z, 0.0 - 0.2 * x + z, 0.5);
    let [a, b] = [turn(1.0, 0.0, 0.0), turn(0.0, 1.0, 0.0)];
    let b = b.normal - a.normal * a.normal.dot(b.normal);
    let (a, b) = (a.normal, b.normalized());
    [a, -a, b, -b, a.cross(b), -a.cross(b)].map(|normal| Facet { normal, offset: 0.5 }).to_vec()
}

/// A three-sided prism.
fn prism() -> Vec<Facet> {
    let mut faces = vec![facet(0.1, 0.2, 1.0, 0.6), facet(-0.1, -0.2, -1.0, 0.6)];
    let axis = faces[0].normal;
    let [u, v] = faces[0].tangents();
    faces.extend([0.3, 0.7, 0.0].into_iter().enumerate().map(|(k, by)| {
        let a = TAU / 3.0 * k as f64 + 0.3 * by;
        let m = u * a.cos() + v * a.sin();
        Facet { normal: (m - axis * m.dot(axis)).normalized(), offset: 0.35 }
    }));
    faces
}

fn meets_planes(planes: &[Facet]) -> impl Fn(&Ray<f64>) -> bool {
    move |ray| {
        let (mut from, mut to) = (f64::MIN, f64::MAX);
        for p in planes {
            let (height, slope) = (p.height(ray.origin), p.normal.dot(ray.direction));
            if slope < 0.0 {
                from = from.max(-height / slope);
            } else {
                to = to.min(-height / slope);
            }
        }
        from < to
    }
}

fn found(views: &[Silhouette], base: Option<&Plane>) -> Option<Faceted> {
    let outlines = Outlines::new(views);
    let hull = hull(&outlines, 1.05, 64);
    polyhedron(&Contours::new(&outlines, &hull, base)?, &hull, base)
}

/// What was found of a body whose planes are known.
#[derive(Debug)]
struct Errors {
    /// Faces found, without the base.
    faces: usize,
    /// Angle of the planes whose faces have more than 3 % of the area: median and nine tenths [degree].
    angle: [f64; 2],
    /// Their distance from the middle of the true face [pixel], likewise.
    offset: [f64; 2],
    /// Volume of the symmetric difference over that of the body.
    volume: f64,
}

fn errors(found: &Faceted, truth: &[Facet]) -> Errors {
    let boundary = Boundary::of(truth);
    let large = (0..truth.len()).filter(|&k| boundary.faces[k].area > 0.03 * boundary.area());
    let of_face = |k: usize| {
        let m = truth[k].normal;
        let cosine = |p: &&Plane| p.normal().cast::<f64>().dot(m);
        let nearest = found.body.planes().max_by(|a, b| cosine(a).total_cmp(&cosine(b))).unwrap();
        let height = nearest.height(boundary.faces[k].middle.cast());
        let sine = nearest.normal().cast::<f64>().cross(m).length();
        (sine.asin().to_degrees(), f64::from(height.abs()) / footprint())
    };
    let quantiles = |mut v: Vec<f64>| {
        v.sort_by(f64::total_cmp);
        [0.5, 0.9].map(|q| v[((v.len() - 1) as f64 * q).round() as usize])
    };
    let (angles, offsets): (Vec<f64>, Vec<f64>) = large.map(of_face).unzip();
    let (mut inside, mut differ) = (0, 0);
    for i in 0..80 * 80 * 80_usize {
        let x = Vec3::from([i % 80, i / 80 % 80, i / 6400].map(|n| (n as f64 - 39.5) / 38.0));
        let (a, b) = (truth.iter().all(|p| p.height(x) < 0.0), found.body.height(x.cast()) < 0.0);
        inside += usize::from(a);
        differ += usize::from(a != b);
    }
    let volume = f64::from(differ as u32) / f64::from(inside as u32);
    Errors { faces: found.body.faces.len(), angle: quantiles(angles), offset: quantiles(offsets), volume }
}

fn assert_exact(name: &str, truth: &[Facet], sines: [f64; 2]) {
    let found = found(&silhouettes(&cameras(60, sines), meets_planes(truth)), None).unwrap();
    let e = errors(&found, truth);
    let touching = Boundary::of(truth).faces.iter().filter(|f| f.area > 0.0).count();
    assert!(e.faces == touching && found.score > 0.95, "{name}: {} of {touching} faces", e.faces);
    assert!(e.angle[1] < 0.1 && e.offset[1] < 0.05 && e.volume < 2e-3, "{name}: {e:?}");
}

#[test]
fn planes_of_convex_bodies_are_found_to_a_tenth_of_a_degree() {
    assert_exact("cube", &cube(), EVERYWHERE);
    assert_exact("prism", &prism(), EVERYWHERE);
    assert_exact("twenty irregular faces", &irregular(20, 0.45, 0), EVERYWHERE);
}

#[test]
fn views_from_above_are_enough() {
    assert_exact("cube", &cube(), FROM_ABOVE);
    assert_exact("twenty irregular faces", &irregular(20, 0.45, 1), FROM_ABOVE);
}

#[test]
fn a_brilliant_is_found_but_for_the_slivers_of_its_girdle() {
    let truth = brilliant();
    let found = found(&silhouettes(&cameras(60, EVERYWHERE), meets_planes(&truth)), None).unwrap();
    let e = errors(&found, &truth);
    assert!((33..=49).contains(&e.faces), "{e:?}");
    let largest = Boundary::of(&truth).faces.iter().map(|f| f.area).fold(0.0, f64::max);
    assert!((found.areas[0] / largest - 1.0).abs() < 0.03, "{} {largest}", found.areas[0]);
    assert!(found.areas.is_sorted_by(|a, b| a >= b));
    assert!(e.angle[0] < 0.1 && e.angle[1] < 0.5 && e.offset[1] < 0.1 && e.volume < 2e-3, "{e:?}");
}

#[test]
fn masks_may_be_wrong_by_a_pixel() {
    for truth in [irregular(20, 0.45, 1), brilliant()] {
        let views = shaken(silhouettes(&cameras(60, EVERYWHERE), meets_planes(&truth)), 1.0);
        let e = errors(&found(&views, None).unwrap(), &truth);
        assert!(e.angle[0] < 0.5 && e.angle[1] < 1.5 && e.offset[1] < 0.3 && e.volume < 0.01, "{e:?}");
    }
}

#[test]
fn a_body_ends_at_the_ground_that_it_stands_on() {
    let mut truth: Vec<Facet> = irregular(20, 0.45, 2);
    let ground = facet(0.0, 0.0, -1.0, 0.35);
    truth.push(ground);
    let base = Plane::facing(ground.normal.cast(), 0.35);
    let views = silhouettes(&cameras(60, FROM_ABOVE), meets_planes(&truth));
    let found = found(&views, Some(&base)).unwrap();
    assert_eq!(found.body.base, Some(base));
    let e = errors(&found, &truth);
    assert!(e.angle[1] < 0.1 && e.offset[1] < 0.05 && e.volume < 2e-3, "{e:?}");
}

#[test]
fn views_may_be_cut_by_something_in_front() {
    let truth = irregular(20, 0.45, 3);
    let opaque = [(vec3(1.3, 0.3, 0.1), 0.45), (vec3(-0.7, -1.2, 0.4), 0.4)];
    let hidden = |ray: &Ray<f64>| {
        let enter = |&(center, radius): &(Vec3<f64>, f64)| {
            let to: Vec3<f64> = center - ray.origin;
            let along = to.dot(ray.direction);
            let inside = radius * radius - (to.dot(to) - along * along);
            if inside > 0.0 { along - inside.sqrt() } else { f64::INFINITY }
        };
        opaque.iter().map(enter).fold(f64::INFINITY, f64::min)
    };
    let meets = meets_planes(&truth);
    let view = |camera| {
        // Both balls lie outside of the body: nearer than its middle is in front of it.
        let to = |ray: &Ray<f64>| -ray.origin.dot(ray.direction);
        let mut view = silhouette(&camera, |ray| meets(ray) && hidden(ray) > to(ray));
        let width = camera.width as usize;
        let center = |i: &usize| [i % width, i / width].map(|p| p as f64 + 0.5);
        let depth = |i: &usize| {
            let [u, v] = center(i);
            hidden(&camera.ray(u, v).unwrap()) as f32
        };
        let look = |pixels: &[usize]| pixels.iter().map(depth).collect();
        view.occluders = Some(Occluders::new(&view.mask, 1, look));
        view
    };
    let views: Vec<Silhouette> = cameras(60, EVERYWHERE).into_iter().map(view).collect();
    let found = found(&views, None).unwrap();
    let e = errors(&found, &truth);
    assert!(e.angle[0] < 0.5 && e.angle[1] < 1.5 && e.offset[1] < 0.3 && e.volume < 0.01, "{e:?}");
}

#[test]
fn round_bodies_are_declined() {
    let declined = |name: &str, distance: &(dyn Fn(Vec3<f64>) -> f64 + Sync)| {
        let found = found(&silhouettes(&cameras(60, EVERYWHERE), meets_body(distance)), None);
        assert!(found.is_none(), "{name}: {:?}", found.map(|f| (f.body.faces.len(), f.misfit, f.score)));
    };
    declined("ball", &|x| x.length() - 0.8);
    declined("ellipsoid", &|x| 0.5 * (vec3(x.x / 0.8, x.y / 0.5, x.z / 0.6).length() - 1.0));
    declined("capsule", &|x| vec3(x.x, x.y, x.z - x.z.clamp(-0.4, 0.4)).length() - 0.4);
    let bumps = |x: Vec3<f64>| 0.1 * (5.0 * x.x).sin() * (4.0 * x.y).cos() + 0.05 * (4.0 * x.z).sin();
    declined("blob", &|x| 0.7 * (x.length() - 0.6 - bumps(x)));
}

#[test]
fn a_cylinder_scores_less_than_polyhedra() {
    let cylinder = meets_body(|x| (x.x.hypot(x.y) - 0.5).max(x.z.abs() - 0.5));
    let found = found(&silhouettes(&cameras(60, EVERYWHERE), cylinder), None);
    assert!(found.is_none_or(|f| f.score < 0.85 && f.misfit > 0.2));
}

#[test]
fn a_wish_to_stop_ends_the_search_for_planes() {
    let cancel = Cancel::new();
    let views = silhouettes(&cameras(20, EVERYWHERE), meets_planes(&cube()));
    let outlines = Outlines::new(&views).cancelled_by(&cancel);
    let hull = hull(&outlines, 1.05, 32);
    let contours = Contours::new(&outlines, &hull, None).unwrap();
    assert!(polyhedron(&contours, &hull, None).is_some());
    cancel.cancel();
    assert!(polyhedron(&contours, &hull, None).is_none());
}
