//! An open vessel: glass around a cavity that is open at the top, with water in it or not.

use super::{ShapeBody, Substance, distance, grid_for, level_set, span};
use crate::model::polyhedron::Plane;
use refraxel_core::{Aabb, Camera, LevelSet, Vec3};

/// What is assumed of a vessel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::recipe) struct Vessel {
    /// Unit vector out of its opening.
    pub up: Vec3<f32>,
    /// Thickness of its wall [scene unit].
    pub wall: f32,
    /// Thickness of its base [scene unit]; not less than the wall's where the bottom is round.
    pub base: f32,
    /// Height of the water above the base [scene unit]; 0 where it is empty.
    pub water: f32,
}

/// The lid of a visual hull is cut off this far below the rim [voxel], where its edge is rounded.
const RIM: f32 = 2.0;

/// The cavity of a vessel.
struct Cavity {
    /// Distance from the outer surface without its lid: the wall goes on above the rim.
    side: LevelSet<f32>,
    up: Vec3<f32>,
    /// Height of its floor [scene unit].
    floor: f32,
}

impl Cavity {
    /// `None` for an empty hull.
    fn new(outer: &LevelSet<f32>, vessel: &Vessel) -> Option<Self> {
        let [low, rim] = span(outer, vessel.up)?;
        let voxel = outer.voxel();
        let last = rim - RIM * voxel;
        // Far enough above the rim for the border of the grid not to be a lid again.
        let bounds = outer.domain().bounds;
        let raise = vessel.up * (vessel.wall + 6.0 * voxel);
        let mut taller = bounds;
        taller.include(bounds.min + raise);
        taller.include(bounds.max + raise);
        let (taller, resolution) = grid_for(&taller, voxel, f32::MAX);
        let mut side = level_set(taller, resolution, |x| {
            let above = (vessel.up.dot(x) - last).max(0.0);
            distance(outer, x - vessel.up * above)
        });
        side.redistance();
        Some(Self { side, up: vessel.up, floor: low + vessel.base })
    }

    /// Negative where a point is `wall` away from the outer surface and `above` the floor [scene unit].
    fn value(&self, x: Vec3<f32>, wall: f32, above: f32) -> f32 {
        let over_floor = self.up.dot(x) - self.floor;
        (distance(&self.side, x) + wall).max(above - over_floor)
    }
}

/// Water and the glass around it. The glass rules: the water reaches half a wall into it, and no two surfaces
/// coincide. Above the water is no body.
///
/// `outer` is a signed distance: the hull of the vessel as if it were filled up to the rim. The glass has
/// four voxels per wall as far as the number of nodes allows . `None` where the wall leaves
/// no cavity.
pub(in crate::recipe) fn vessel(outer: &LevelSet<f32>, vessel: &Vessel) -> Option<Vec<ShapeBody>> {
    let cavity = Cavity::new(outer, vessel)?;
    let Vessel { up, wall, base, water } = *vessel;
    let (bounds, resolution) = grid_for(&outer.domain().bounds, outer.voxel(), wall.min(base));
    let glass = level_set(bounds, resolution, |x| distance(outer, x).max(-cavity.value(x, wall, 0.0)));
    let is_open = |j: usize| {
        let x = outer.position(j);
        outer.coefficients()[j] < 0.0 && cavity.value(x, wall, 0.0) < -outer.voxel()
    };
    if !outer.parameters().any(is_open) {
        return None;
    }
    let level = cavity.floor + water;
    let mut bodies = Vec::new();
    if water > 0.0 {
        let Aabb { min, max } = outer.domain().bounds;
        let liquid = level_set(Aabb { min, max }, outer.domain().resolution, |x| {
            cavity.value(x, 0.5 * wall, -0.5 * base).max(up.dot(x) - level)
        });
        bodies.push(ShapeBody { surface: liquid, substance: Substance::Water });
    }
    bodies.push(ShapeBody { surface: glass, substance: Substance::Glass });
    Some(bodies)
}

/// Voxels across the wall of a vessel's glass: below 3 it is thinner than asked for, and below 2 it has
/// holes.
#[cfg(test)]
fn per_wall(bodies: &[ShapeBody], vessel: &Vessel) -> f32 {
    let glass = bodies.iter().find(|b| b.substance == Substance::Glass);
    glass.map_or(0.0, |g| vessel.wall / g.surface.voxel())
}

/// The way up: out of the ground, or the mean of what is up in the pictures; `None` where these cancel.
pub(in crate::recipe) fn upwards<'a>(
    ground: Option<&Plane>,
    cameras: impl Iterator<Item = &'a Camera>,
) -> Option<Vec3<f32>> {
    let (mut sum, mut count) = (Vec3::zero(), 0);
    for camera in cameras {
        sum += -camera.world_from_camera.rotation.columns[1];
        count += 1;
    }
    let mean = (sum.length() > 0.3 * f64::from(count)).then(|| sum.normalized().cast());
    ground.map(Plane::normal).or(mean)
}

#[cfg(test)]
mod tests {
    use super::super::views::{index, runs};
    use super::*;
    use refraxel_core::vec3;

    const UP: Vec3<f32> = Vec3 { x: 0.0, y: 0.0, z: 1.0 };

    fn body(f: impl Fn(Vec3<f32>) -> f32) -> LevelSet<f32> {
        let bounds = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let mut level = LevelSet::from_control_values(bounds, [65; 3], f);
        level.redistance();
        level
    }

    /// A cylinder of radius 0.5 from −0.6 to 0.5 along an axis.
    fn cylinder(up: Vec3<f32>) -> LevelSet<f32> {
        body(|x| {
            let h = up.dot(x);
            ((x - up * h).length() - 0.5).max(h - 0.5).max(-0.6 - h)
        })
    }

    fn check(found: &[(f32, f32)], expected: &[(f32, f32)], tolerance: f32) {
        let indices = |runs: &[(f32, f32)]| runs.iter().map(|r| r.0).collect::<Vec<_>>();
        assert_eq!(indices(found), indices(expected), "{found:?}");
        for (a, b) in found.iter().zip(expected).skip(1).take(found.len() - 2) {
            assert!((a.1 - b.1).abs() < tolerance, "{found:?}");
        }
    }

    #[test]
    fn lines_through_a_glass_of_water_meet_air_glass_water_glass_air() {
        for up in [UP, vec3(0.36, -0.48, 0.8)] {
            let glass = Vessel { up, wall: 0.1, base: 0.12, water: 0.6 };
            let outer = cylinder(up);
            let bodies = vessel(&outer, &glass).unwrap();
            assert!(per_wall(&bodies, &glass) > 3.99);
            let side = up.cross(vec3(1.0, 0.0, 0.0)).normalized();
            let tolerance = 0.2 * outer.voxel();
            let across = |h: f32| runs(|s| index(&bodies, up * h + side * s), [-0.9, 0.9]);
            let walls = [(1.0, 0.0), (1.5, 0.1), (1.33, 0.8), (1.5, 0.1), (1.0, 0.0)];
            check(&across(-0.2), &walls, tolerance);
            check(&across(0.3), &walls.map(|(n, s)| (if n == 1.33 { 1.0 } else { n }, s)), tolerance);
            check(&across(-0.55), &[(1.0, 0.0), (1.5, 1.0), (1.0, 0.0)], tolerance);
            let along = |r: f32| runs(|s| index(&bodies, up * s + side * r), [-0.9, 0.9]);
            check(&along(0.1), &[(1.0, 0.0), (1.5, 0.12), (1.33, 0.6), (1.0, 0.0)], tolerance);
            check(&along(0.45), &[(1.0, 0.0), (1.5, 1.1), (1.0, 0.0)], tolerance);
        }
    }

    #[test]
    fn a_bowl_keeps_the_thickness_of_its_wall_up_to_its_open_rim() {
        // The lower part of a ball.
        let outer = body(|x| (x.length() - 0.7).max(x.z - 0.2));
        let bowl = Vessel { up: UP, wall: 0.05, base: 0.08, water: 0.3 };
        let bodies = vessel(&outer, &bowl).unwrap();
        let tolerance = 0.2 * outer.voxel();
        for angle in [0.6_f32, 0.9, 1.2, 1.5] {
            let direction = vec3(angle.sin(), 0.0, -angle.cos());
            let found = runs(|s| index(&bodies, direction * s), [0.3, 0.9]);
            let glass = found.iter().find(|r| r.0 == 1.5).unwrap();
            assert!((glass.1 - 0.05).abs() < tolerance, "{angle}: {found:?}");
        }
        let axis = runs(|s| index(&bodies, UP * s), [-0.9, 0.9]);
        check(&axis, &[(1.0, 0.0), (1.5, 0.08), (1.33, 0.3), (1.0, 0.0)], tolerance);
        let below_the_rim = runs(|s| index(&bodies, vec3(s, 0.0, 0.17)), [-0.9, 0.9]);
        let indices: Vec<f32> = below_the_rim.iter().map(|r| r.0).collect();
        assert_eq!(indices, [1.0, 1.5, 1.0, 1.5, 1.0]);
    }

    #[test]
    fn an_empty_vessel_has_no_water_and_a_thick_wall_leaves_no_cavity() {
        let glass = Vessel { up: UP, wall: 0.04, base: 0.1, water: 0.0 };
        let bodies = vessel(&cylinder(UP), &glass).unwrap();
        assert!(bodies.iter().all(|b| b.substance == Substance::Glass));
        assert!(vessel(&cylinder(UP), &Vessel { wall: 0.6, ..glass }).is_none());
    }

    #[test]
    fn the_ground_says_what_is_up_and_else_the_pictures() {
        let cameras = super::super::views::cameras(9, [0.2, 0.7]);
        let ground = Plane::facing(vec3(0.6, 0.0, 0.8), 0.1);
        assert_eq!(upwards(Some(&ground), cameras.iter()), Some(ground.normal()));
        assert!(upwards(None, cameras.iter()).unwrap().z > 0.9);
        assert_eq!(upwards(None, [].iter()), None);
    }
}
