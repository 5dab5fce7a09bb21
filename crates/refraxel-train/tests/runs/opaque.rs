//! Meshes of what is opaque, of fields that are known.

use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::{
    Aabb, BrickMap, Domain, Extent, Mesh, Projection, Ray, ShDegree, Vec3, VoxelField, vec3,
};
use refraxel_train::model::opaque::{Opacity, USUAL_LEVEL};
use std::f64::consts::PI;

/// A field with this optical depth per voxel inside a ball of `radius` about `center`, falling off over a voxel.
fn ball(domain: Domain<f32>, center: Vec3<f32>, radius: f32) -> VoxelField<f32> {
    let map = BrickMap::dense(domain.resolution);
    let mut field = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -10.0);
    for voxel in BRICK_VOXELS..field.map.voxels() {
        let node = field.map.node(voxel).map(|n| n as f32);
        let inside = radius - (domain.position(Vec3::from(node)) - center).length();
        let raw = 12.0 * inside / domain.voxel();
        field.density[voxel] = raw.clamp(-10.0, 20.0);
    }
    field
}

fn is_a_ball(mesh: &Mesh, center: Vec3<f32>, radius: f64, tolerance: f64) {
    assert_eq!((mesh.open_edges(), mesh.bodies()), (0, 1));
    let volume = mesh.volume() / (4.0 / 3.0 * PI * radius.powi(3));
    assert!((volume - 1.0).abs() < tolerance, "{volume}");
    for (x, normal) in mesh.vertices.iter().zip(&mesh.normals) {
        let outwards = (*x - center.cast()).normalized();
        assert!(normal.dot(outwards) > 0.7, "{x:?} {normal:?}");
    }
}

#[test]
fn a_ball_of_density_has_a_closed_mesh_of_its_size_that_faces_outwards() {
    let bounds = Aabb::new(vec3(-1.0, -1.0, -0.8), vec3(1.0, 1.2, 1.0));
    let center = vec3(0.02, 0.11, 0.05);
    let field = ball(Domain::with_longest(bounds, Extent::Bounded, 41), center, 0.6);
    for detail in [1, 2] {
        is_a_ball(&Opacity::of(&field).mesh(0.5, detail), center, 0.6, 0.04);
    }
}

#[test]
fn beyond_the_box_and_before_forward_facing_cameras_a_ball_is_a_ball_in_the_world() {
    let bounds = Aabb::cube(1.0);
    let contracted = Domain::with_longest(bounds, Extent::Contracted, 121);
    let center = vec3(0.9, 0.1, -0.2);
    is_a_ball(&Opacity::of(&ball(contracted, center, 0.6)).mesh(0.5, 1), center, 0.6, 0.1);
    let projection = Projection {
        eye: vec3(0.1, 0.2, 4.0),
        axes: [vec3(1.0, 0.0, 0.0), vec3(0.0, -1.0, 0.0), vec3(0.0, 0.0, -1.0)],
        near: 2.0,
        edges: [[-0.4, 0.4], [-0.4, 0.4]],
        baseline: 4.8,
    };
    let ahead = Domain::with_longest(bounds, Extent::Projective(projection), 65);
    let center = vec3(0.1, 0.0, 0.0);
    is_a_ball(&Opacity::of(&ball(ahead, center, 0.7)).mesh(0.5, 1), center, 0.7, 0.15);
}

#[test]
fn what_reaches_the_end_of_the_grid_is_closed_there() {
    let bounds = Aabb::cube(1.0);
    let field = ball(Domain::with_longest(bounds, Extent::Bounded, 41), vec3(0.0, 0.0, -1.0), 0.7);
    let mesh = Opacity::of(&field).mesh(0.5, 1);
    assert_eq!(mesh.open_edges(), 0);
    let half = 2.0 / 3.0 * PI * 0.343;
    assert!((mesh.volume() / half - 1.0).abs() < 0.1, "{}", mesh.volume() / half);
}

#[test]
fn the_level_is_where_the_light_of_rays_comes_from_however_soft_things_are() {
    let bounds = Aabb::cube(1.0);
    let rays: Vec<Ray<f32>> = (0..100)
        .map(|k| {
            let at = vec3(-0.4 + 0.09 * (k % 10) as f32, -0.4 + 0.09 * (k / 10) as f32, -0.7);
            let origin = vec3(0.1, 0.2, 4.0);
            Ray { origin, direction: (at - origin).normalized() }
        })
        .collect();
    let levels = [20.0, -1.5].map(|most| {
        let mut field = ball(Domain::with_longest(bounds, Extent::Bounded, 41), Vec3::zero(), 0.6);
        field.density.iter_mut().for_each(|raw| *raw = raw.min(most));
        let opacity = Opacity::of(&field);
        let level = opacity.level(&field, &rays);
        let near = opacity.mesh(level, 1);
        assert!(near.bodies() == 1 && (near.bounds().unwrap().max.z - 0.6).abs() < 0.1, "{level}");
        level
    });
    assert!(levels[1] < 0.6 * levels[0], "{levels:?}");
    let nothing = ball(Domain::with_longest(bounds, Extent::Bounded, 41), Vec3::zero(), -1.0);
    assert_eq!(Opacity::of(&nothing).level(&nothing, &rays), USUAL_LEVEL);
}

#[test]
fn too_much_detail_is_noticed() {
    let bounds = Aabb::cube(1.0);
    let field = ball(Domain::with_longest(bounds, Extent::Bounded, 21), Vec3::zero(), 0.5);
    assert!(Opacity::fits(&field, 16) && !Opacity::fits(&field, 64) && !Opacity::fits(&field, u32::MAX));
}
