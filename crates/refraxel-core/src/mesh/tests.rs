use super::triangles::{Mesh, doubled_area};
use crate::{Aabb, Domain, Extent, Vec3, vec3};
use std::f64::consts::PI;

fn domain(nodes: u32) -> Domain<f64> {
    let bounds = Aabb::cube(1.0);
    Domain { bounds, extent: Extent::Bounded, resolution: [nodes; 3] }
}

fn sphere(radius: f64) -> impl Fn(Vec3<f64>) -> (f64, Vec3<f64>) {
    // Off the centre: no symmetry with the nodes.
    move |x| {
        let r = x - vec3(0.013, -0.021, 0.034);
        (r.length() - radius, r.normalized())
    }
}

/// Smallest angle of each triangle [rad].
fn smallest_angles(mesh: &Mesh) -> Vec<f64> {
    let angle = |t: &[u32; 3]| {
        let x = mesh.corners(*t);
        let at = |k: usize| {
            let [a, b] = [1, 2].map(|i| (x[(k + i) % 3] - x[k]).normalized());
            a.dot(b).clamp(-1.0, 1.0).acos()
        };
        (0..3).map(at).fold(PI, f64::min)
    };
    mesh.triangles.iter().map(angle).collect()
}

/// Closed, turned outwards everywhere, of the topology of `bodies` spheres.
fn is_sound(mesh: &Mesh, bodies: usize) {
    assert_eq!(mesh.open_edges(), 0);
    assert_eq!(mesh.bodies(), bodies);
    // Euler: V − E + F = 2 per sphere, with 3 F = 2 E.
    assert_eq!(2 * mesh.vertices.len(), mesh.triangles.len() + 4 * bodies);
    for &t in &mesh.triangles {
        let normal = doubled_area(mesh.corners(t));
        assert!(t.iter().all(|&v| mesh.normals[v as usize].dot(normal) > 0.0), "a triangle is turned over");
    }
}

#[test]
fn a_ball_has_its_volume_and_area_to_second_order() {
    let radius = 0.6;
    let errors: Vec<[f64; 2]> = [17, 33, 65]
        .into_iter()
        .map(|nodes| {
            let mesh = Mesh::of_level(&domain(nodes), 1, sphere(radius));
            is_sound(&mesh, 1);
            let off = mesh.vertices.iter().map(|&x| sphere(radius)(x).0.abs()).fold(0.0, f64::max);
            assert!(off < 1e-5 * domain(nodes).voxel(), "{off}");
            let volume = mesh.volume() / (4.0 / 3.0 * PI * radius.powi(3)) - 1.0;
            [volume.abs(), (mesh.area() / (4.0 * PI * radius * radius) - 1.0).abs()]
        })
        .collect();
    // A chord of length h lies h²/8R below its arc: volume and area miss about (h/R)²/4 and (h/R)²/8 at edges of 0.7 h.
    for (k, [volume, area]) in errors.iter().enumerate() {
        let h = 2.0 / f64::from(16 << k) / radius;
        assert!(*volume < 0.25 * h * h && *area < 0.25 * h * h, "{k}: {volume} {area}");
    }
    assert!(errors.windows(2).all(|e| e[1][0] < 0.3 * e[0][0] && e[1][1] < 0.3 * e[0][1]), "{errors:?}");
}

#[test]
fn triangles_are_well_shaped() {
    let angles = smallest_angles(&Mesh::of_level(&domain(33), 1, sphere(0.6)));
    let least = angles.iter().copied().fold(PI, f64::min).to_degrees();
    let mean = angles.iter().sum::<f64>() / angles.len() as f64;
    assert!(least > 15.0 && mean.to_degrees() > 38.0, "{least} {}", mean.to_degrees());
}

#[test]
fn a_hollow_ball_has_two_surfaces_that_face_away_from_the_glass() {
    let shell = |x: Vec3<f64>| {
        let (d, n) = sphere(0.5)(x);
        if d > 0.0 { (d - 0.2, n) } else { (-d - 0.2, -n) }
    };
    let mesh = Mesh::of_level(&domain(41), 1, shell);
    is_sound(&mesh, 2);
    let expected = 4.0 / 3.0 * PI * (0.7_f64.powi(3) - 0.3_f64.powi(3));
    assert!((mesh.volume() / expected - 1.0).abs() < 0.005, "{} {expected}", mesh.volume());
    let center = vec3(0.013, -0.021, 0.034);
    for (&x, n) in mesh.vertices.iter().zip(&mesh.normals) {
        let outward = (x - center).normalized();
        let is_outer = (x - center).length() > 0.5;
        assert!((n.dot(outward) - if is_outer { 1.0 } else { -1.0 }).abs() < 1e-6);
    }
}

#[test]
fn any_signs_at_all_give_a_closed_mesh() {
    // The worst there is: signs of a random number per node.
    let nodes = 12;
    let noise = |x: Vec3<f64>| {
        let g = domain(nodes).node(x).map(|g| (g + 0.5).floor() as i64);
        let inner = (0..3).all(|a| (1..i64::from(nodes) - 1).contains(&g[a]));
        let hash = ((g.x * 73_856_093) ^ (g.y * 19_349_663) ^ (g.z * 83_492_791))
            .wrapping_mul(0x9e37_79b9_7f4a_7c15_u64 as i64);
        (if inner && hash >> 40 & 1 == 1 { -1.0 } else { 1.0 }, vec3(0.0, 0.0, 1.0))
    };
    let mesh = Mesh::of_level(&domain(nodes), 1, noise);
    assert!(mesh.triangles.len() > 4000, "{}", mesh.triangles.len());
    assert_eq!(mesh.open_edges(), 0);
    assert!(mesh.vertices.iter().all(|x| x.is_finite()));
}

#[test]
fn nothing_has_no_mesh() {
    let mesh = Mesh::of_level(&domain(9), 2, |_| (1.0, Vec3::zero()));
    assert_eq!((mesh.triangles.len(), mesh.volume(), mesh.area(), mesh.bodies()), (0, 0.0, 0.0, 0));
    assert!(mesh.bounds().is_none());
}

#[test]
fn more_detail_finds_what_lies_between_the_nodes() {
    let speck = |x: Vec3<f64>| {
        let r = x - Vec3::splat(0.125);
        (r.length() - 0.1, r.normalized())
    };
    assert!(Mesh::of_level(&domain(9), 1, speck).vertices.is_empty());
    is_sound(&Mesh::of_level(&domain(9), 4, speck), 1);
}

#[test]
fn a_surface_among_others_is_kept_whole() {
    let two = |x: Vec3<f64>| {
        let [a, b] = [(-0.5, 0.3), (0.45, 0.2)].map(|(at, radius)| {
            let r = x - vec3(at, 0.013, -0.021);
            (r.length() - radius, r.normalized())
        });
        if a.0 < b.0 { a } else { b }
    };
    let mesh = Mesh::of_level(&domain(33), 1, two);
    is_sound(&mesh, 2);
    let part = mesh.parts();
    let left = |v: usize| mesh.vertices[v].x < 0.0;
    assert!((0..part.len()).all(|v| (part[v] == part[0]) == (left(v) == left(0))));
    let (small, from) = mesh.of_parts(|v| !left(v));
    is_sound(&small, 1);
    assert!((small.volume() / (4.0 / 3.0 * PI * 0.008) - 1.0).abs() < 0.03, "{}", small.volume());
    assert!(from.iter().zip(&small.vertices).all(|(&v, &x)| mesh.vertices[v] == x));
}
