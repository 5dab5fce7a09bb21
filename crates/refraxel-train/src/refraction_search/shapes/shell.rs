//! A closed shell: glass with air in it.

use super::body::{ShapeBody, Substance};
use refraxel_core::LevelSet;

/// The body inside `outer`, with air in it from `wall` [scene unit] below its surface: glass, then air. The
/// two surfaces are two level sets, so that a wall may be thinner than a voxel. `None` where the body is
/// nowhere deep enough for air.
///
/// `outer` is a signed distance. Error: that of its distance at the depth of the wall, a few hundredths of a
/// voxel; the air's creases are rounded over a voxel.
pub(in crate::refraction_search) fn shell(outer: &LevelSet<f32>, wall: f32) -> Option<Vec<ShapeBody>> {
    let air = outer.raised(wall);
    let is_deep = |j: usize| air.value(air.position(j)) < -air.voxel();
    let holds_air = wall > 0.0 && air.parameters().any(is_deep);
    let bodies =
        || vec![ShapeBody::new(outer.clone(), Substance::Glass), ShapeBody::new(air.clone(), Substance::Air)];
    holds_air.then(bodies)
}

#[cfg(test)]
mod tests {
    use super::super::views::{index, runs};
    use super::*;
    use refraxel_core::{Aabb, vec3};

    fn ball() -> LevelSet<f32> {
        LevelSet::from_samples(Aabb::cube(1.0), [49; 3], |x| x.length() - 0.7)
    }

    #[test]
    fn a_wall_of_half_a_voxel_is_as_thick_as_asked_for() {
        let (outer, wall) = (ball(), 0.5 * ball().voxel());
        let bodies = shell(&outer, wall).unwrap();
        for direction in [vec3(1.0, 0.0, 0.0), vec3(0.6, 0.0, 0.8), vec3(0.577, 0.577, 0.577)] {
            let found = runs(|s| index(&bodies, direction * s), [-1.0, 1.0]);
            let indices: Vec<f32> = found.iter().map(|r| r.0).collect();
            assert_eq!(indices, [1.0, 1.5, 1.0, 1.5, 1.0]);
            for glass in [found[1].1, found[3].1] {
                assert!((glass - wall).abs() < 0.03 * outer.voxel(), "{glass} for {wall}");
            }
        }
    }

    #[test]
    fn a_body_that_is_thinner_than_two_walls_has_no_air() {
        assert!(shell(&ball(), 0.75).is_none() && shell(&ball(), 0.0).is_none());
    }
}
