//! An open vessel: glass around a cavity that is open at the top, with water in it or not.

use super::body::{ShapeBody, Substance, distance, span};
use crate::level_set::level_set;
use crate::model::polyhedron::{Plane, Polyhedron};
use rayon::prelude::*;
use refraxel_core::{Aabb, Camera, LevelSet, Vec3};
use std::ops::Range;

/// What is assumed of a vessel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::refraction_search) struct Vessel {
    /// Thickness of its wall [scene unit].
    pub wall: f32,
    /// Thickness of its base [scene unit]; not less than the wall's where the bottom is round.
    pub base: f32,
    /// Height of the water above the base [scene unit]; 0 where it is empty.
    pub water: f32,
    /// Height of its bottom above the lowest point of the hull [scene unit]. Below it is air: what stands on a table does not
    /// touch it, and mirrors at its bottom.
    pub raised: f32,
}

/// The lid of a visual hull is cut off this far below the rim [voxel], where its edge is rounded.
const RIM: f32 = 2.0;

/// So far below the side, and so far below the rim, lies the edge between both [voxel].
const EDGE: [Range<f32>; 2] = [0.25..1.5, 0.25..2.0];
/// At least this part of the edge is below the lid where that is flat and meets the side in a sharp edge, which a spline rounds: 0.91 in
/// the hull of a cylinder, 0.4 to 0.7 of a bowl with a round rim.
const FLAT_LID: f64 = 0.85;

/// Water ends this far inside of the wall [voxel], so that its surface and that of the air above nowhere coincide.
const WITHIN: f32 = 0.02;
/// It reaches this far into the air, which rules there [voxel].
const ABOVE: f32 = 3.0;

/// The outer surface of a vessel, with and without its lid: without it, the wall goes on above the rim. It is the same for all
/// walls and levels.
#[derive(Clone, Debug)]
pub(in crate::refraction_search) struct Side {
    /// The hull, as if it were filled up to the rim.
    outer: LevelSet<f32>,
    /// Without lid.
    side: LevelSet<f32>,
    /// Unit vector out of the opening.
    up: Vec3<f32>,
    /// The planes of the hull, if all of its faces are flat.
    solid: Option<Polyhedron>,
    /// Its lid is a plane across `up`, with a sharp edge.
    has_flat_lid: bool,
    /// Per node: signed distance from it, and height along the vector out of the opening [scene unit].
    nodes: Vec<[f32; 2]>,
    /// Lowest and highest point of the vessel along `up` [scene unit].
    pub span: [f32; 2],
}

impl Side {
    /// Of the hull of a vessel as if it were filled up to the rim, a signed distance; `None` for an empty one.
    pub(in crate::refraction_search) fn new(outer: LevelSet<f32>, up: Vec3<f32>) -> Option<Self> {
        let span @ [low, rim] = span(&outer, up)?;
        let voxel = outer.voxel();
        let last = rim - RIM * voxel;
        // Far enough above the rim for the border of the grid not to be a lid again, whatever the wall.
        let bounds = outer.domain().bounds;
        let raise = up * (MOST_RAISED * (rim - low) + 6.0 * voxel);
        let mut taller = bounds;
        taller.include(bounds.min + raise);
        taller.include(bounds.max + raise);
        let cells = taller.extent().map(|e| (e / voxel - 1e-3).ceil());
        let taller = Aabb { max: taller.min + cells * voxel, ..taller };
        let resolution = cells.to_array().map(|c| c as u32 + 1);
        let mut surface = level_set(taller, resolution, |x| {
            let above = (up.dot(x) - last).max(0.0);
            distance(&outer, x - up * above)
        });
        surface.redistance();
        let count = surface.coefficients().len();
        let node = |j: usize| {
            let x = surface.position(j);
            [surface.value(x), up.dot(x)]
        };
        let nodes: Vec<[f32; 2]> = (0..count).into_par_iter().map(node).collect();
        let is_in_edge = |j: &usize| {
            let [below_side, below_rim] = [-nodes[*j][0] / voxel, (rim - nodes[*j][1]) / voxel];
            EDGE[0].contains(&below_side) && EDGE[1].contains(&below_rim)
        };
        let edge: Vec<usize> = (0..count).filter(is_in_edge).collect();
        let below_lid = edge.iter().filter(|&&j| distance(&outer, surface.position(j)) < 0.0).count();
        let has_flat_lid = below_lid as f64 >= FLAT_LID * edge.len() as f64;
        Some(Self { side: surface, outer, up, solid: None, has_flat_lid, nodes, span })
    }

    /// The same side, of a hull that is a polyhedron.
    #[must_use]
    pub(in crate::refraction_search) fn of_planes(self, solid: Option<&Polyhedron>) -> Self {
        Self { solid: solid.cloned(), ..self }
    }

    /// The hull above a height, if that is not all of it.
    fn standing(&self, low: f32, substance: Substance) -> ShapeBody {
        let [lowest, rim] = self.span;
        let foot = (low > lowest).then(|| Plane::facing(-self.up, -low));
        if let Some(solid) = &self.solid {
            let solid = Polyhedron { faces: solid.faces.clone(), base: foot.or(solid.base) };
            return ShapeBody::of_planes(solid, self.outer.domain(), substance);
        }
        if self.has_flat_lid {
            let cuts = foot.into_iter().chain([Plane::facing(self.up, rim)]).collect();
            return ShapeBody::cut(self.surface(0.0), cuts, substance);
        }
        ShapeBody::cut(self.outer.clone(), foot.into_iter().collect(), substance)
    }

    /// What lies deeper than `within` below the side.
    fn surface(&self, within: f32) -> LevelSet<f32> {
        if within > 0.0 { self.side.raised(within) } else { self.side.clone() }
    }

    /// What lies deeper than `within` below the side, between two heights.
    fn body(&self, within: f32, [low, high]: [f32; 2], substance: Substance) -> ShapeBody {
        let top = (high < f32::MAX).then(|| Plane::facing(self.up, high));
        let bottom = Plane::facing(-self.up, -low);
        let Some(solid) = &self.solid else {
            return ShapeBody::cut(
                self.surface(within),
                top.into_iter().chain([bottom]).collect(),
                substance,
            );
        };
        let is_side = |p: &&Plane| p.normal().dot(self.up).abs() < UPRIGHT;
        let inner = |p: &Plane| Plane::facing(p.normal(), p.offset() - within);
        let faces = solid.faces.iter().filter(is_side).map(inner).chain(top).collect();
        ShapeBody::of_planes(Polyhedron { faces, base: Some(bottom) }, self.side.domain(), substance)
    }
}

/// Planes are sides of a vessel and no lid or base where the cosine between their normal and the way up is less.
const UPRIGHT: f32 = 0.9;

/// The wall goes on above the rim for this part of the height of the vessel.
const MOST_RAISED: f32 = 0.15;

/// Glass, water in it and the air above. Each rules over those before it, so that a wall is the space between two surfaces
/// and may be thinner than a voxel.
///
/// `None` where the wall leaves no cavity.
pub(in crate::refraction_search) fn vessel(side: &Side, vessel: &Vessel) -> Option<Vec<ShapeBody>> {
    let Vessel { wall, base, water, raised } = *vessel;
    let (voxel, [low, rim]) = (side.outer.voxel(), side.span);
    let low = low + raised;
    let level = low + base + water;
    if !side.nodes.iter().any(|[d, h]| *d < -wall - voxel && *h > level + voxel && *h < rim) {
        return None;
    }
    let mut bodies = vec![side.standing(low, Substance::Glass)];
    if water > 0.0 {
        let heights = [low + base, level + ABOVE * voxel];
        bodies.push(side.body(wall + WITHIN * voxel, heights, Substance::Water));
    }
    bodies.push(side.body(wall, [level, f32::MAX], Substance::Air));
    Some(bodies)
}

/// The way up: out of the ground, or the mean of what is up in the pictures; `None` where these cancel.
pub(in crate::refraction_search) fn upwards<'a>(
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
        let bounds = Aabb::cube(1.0);
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

    fn bodies(outer: &LevelSet<f32>, up: Vec3<f32>, glass: &Vessel) -> Option<Vec<ShapeBody>> {
        vessel(&Side::new(outer.clone(), up)?, glass)
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
            let glass = Vessel { wall: 0.1, base: 0.12, water: 0.6, raised: 0.0 };
            let outer = cylinder(up);
            let bodies = bodies(&outer, up, &glass).unwrap();
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
    fn a_tank_of_flat_glass_has_sharp_edges_inside_too() {
        let face = |x: f32, y: f32, z: f32, offset| Plane::facing(vec3(x, y, z), offset);
        let walls = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)].map(|(x, y)| face(x, y, 0.0, 0.5));
        let faces = walls.into_iter().chain([face(0.0, 0.0, 1.0, 0.4)]).collect();
        let block = Polyhedron { faces, base: Some(face(0.0, 0.0, -1.0, 0.6)) };
        let bounds = Aabb::cube(1.0);
        let outer = block.level_set(bounds, [65; 3]);
        let side = Side::new(outer, UP).unwrap().of_planes(Some(&block));
        for raised in [0.0, 0.05] {
            let tank = Vessel { wall: 0.08, base: 0.1, water: 0.4, raised };
            let bodies = vessel(&side, &tank).unwrap();
            assert!(bodies.iter().all(|b| b.solid.is_some()));
            let low = side.span[0] + raised;
            let at = |x: f32, h: f32| index(&bodies, vec3(x, x, low + h));
            // Along the diagonal through edges of wall, water and base, a hundredth of a voxel before and behind.
            for (x, h, n) in [
                (0.4997, 0.3, 1.5),
                (0.5003, 0.3, 1.0),
                (0.4203, 0.3, 1.5),
                (0.418, 0.3, 1.33),
                (0.418, 0.1003, 1.33),
                (0.418, 0.0997, 1.5),
                (0.4197, 0.5003, 1.0),
                (0.418, 0.4997, 1.33),
                (0.4197, 0.9, 1.0),
                (0.3, -0.0003, 1.0),
                (0.3, 0.0003, 1.5),
            ] {
                assert_eq!(at(x, h), n, "at {x}, {h} over {raised}");
            }
        }
    }

    #[test]
    fn a_vessel_whose_foot_stands_higher_is_shorter_and_has_air_below() {
        let outer = cylinder(UP);
        let along = |raised: f32| {
            let bodies = bodies(&outer, UP, &Vessel { wall: 0.1, base: 0.12, water: 0.5, raised }).unwrap();
            runs(|s| index(&bodies, vec3(0.1, 0.0, s)), [-0.9, 0.9])
        };
        let (deep, high) = (along(0.0), along(0.07));
        let expected = [(1.0, 0.0), (1.5, 0.12), (1.33, 0.5), (1.0, 0.0)];
        check(&deep, &expected, 0.2 * outer.voxel());
        check(&high, &expected, 0.2 * outer.voxel());
        assert!((high[0].1 - deep[0].1 - 0.07).abs() < 0.2 * outer.voxel());
    }

    #[test]
    fn a_bowl_keeps_the_thickness_of_its_wall_up_to_its_open_rim() {
        // The lower part of a ball.
        let outer = body(|x| (x.length() - 0.7).max(x.z - 0.2));
        let bowl = Vessel { wall: 0.05, base: 0.08, water: 0.3, raised: 0.0 };
        let bodies = bodies(&outer, UP, &bowl).unwrap();
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
    fn a_round_rim_stays_round_and_a_flat_one_is_sharp() {
        let round = |edge: f32| {
            let outer = body(|x| {
                let [side, lid] = [x.x.hypot(x.y) - 0.5, (x.z - 0.5).max(-0.6 - x.z)].map(|d| d + edge);
                side.max(0.0).hypot(lid.max(0.0)) + side.max(lid).min(0.0) - edge
            });
            let edge_of = |side: Side| side.standing(side.span[0], Substance::Glass);
            edge_of(Side::new(outer, UP).unwrap())
        };
        let sharp = round(0.0);
        assert_eq!(sharp.cuts.len(), 1);
        assert!(sharp.surface.is_inside(vec3(0.493, 0.0, 0.493)), "a spline ends 0.4 voxels before the edge");
        let rounded = round(0.12);
        assert!(rounded.cuts.is_empty());
        assert!(!rounded.surface.is_inside(vec3(0.47, 0.0, 0.47)));
    }

    #[test]
    fn an_empty_vessel_has_no_water_and_a_thick_wall_leaves_no_cavity() {
        let glass = Vessel { wall: 0.04, base: 0.1, water: 0.0, raised: 0.0 };
        let found = bodies(&cylinder(UP), UP, &glass).unwrap();
        assert!(found.iter().all(|b| b.substance != Substance::Water));
        assert!(bodies(&cylinder(UP), UP, &Vessel { wall: 0.6, ..glass }).is_none());
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
