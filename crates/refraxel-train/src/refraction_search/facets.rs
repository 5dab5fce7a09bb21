//! Flat faces that no view sees edge-on.
//!
//! A visual hull is as large as the views allow. Over a flat face it bulges: views from at least 10° above a tank leave it a
//! roof that rises by 10° from the rim. Nothing of the roof shows in any silhouette, so a plane can cut it off: where the
//! normals of a hull crowd around one direction, the deepest plane that takes no ray inside a mask off the body.
//!
//! `shapes/polyhedron` finds faces as well, from the outlines alone: all faces of a convex body at once, by least squares. That needs many views
//! whose masks are exact, and tells nothing of a body that is only flat in places. Here a face stands for itself, on any body.
//!
//! Where such planes bound the whole body, it is a polyhedron, and what the hull lacks of it was cut out by something opaque
//! in front that was not recognised.

use super::shapes::{Crowd, Point, points};
use crate::model::polyhedron::{Plane, Polyhedron};
use refraxel_core::optics::Options;
use refraxel_core::{Domain, IndexGrid, LevelSet, Medium, Ray, Tracer, Vec3};

/// Normals belong together within this angle [rad]: the slope of a roof, and room for noise.
const CONE: f32 = 0.2;
/// Least share of the surface that makes a face of a polyhedron; a ball has 0.01 within the cone, an oblate body more.
const SHARE: f64 = 0.03;
/// Least share of a face that cuts bodies that are no polyhedra too.
const LARGE: f64 = 0.05;
/// Points that bulge more than this lie on a curved surface, which a fitted plane would cut into. Of flat faces with rounded edges the hull shows
/// 0.07.
const BULGE: f32 = 0.5 * CONE;
/// Share of the rays that a face may take off the body: silhouettes are not exact.
const LOST: f64 = 5e-4;
/// Deepest cut [extent of the body along the normal].
const DEEPEST: f32 = 0.2;
/// Steps of the search for the normal [rad], each tried until it helps no more.
const TILTS: [f32; 4] = [0.06, 0.02, 0.006, 0.002];
/// Points of the surface that decide; more are thinned.
const POINTS: usize = 3000;

/// A polyhedron fills at least this share of what its planes enclose.
const FILLED: f64 = 0.85;
/// At least this share of its surface is on them.
const ON_FACES: f64 = 0.65;
/// A point is on a face within this distance [voxel] and angle [cosine].
const ON: (f32, f32) = (1.0, 0.95);

/// Where rays are inside the body: the ends of the intervals, per ray.
struct Chords {
    ends: Vec<Vec3<f32>>,
    first: Vec<usize>,
}

/// A face of a hull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Face {
    pub plane: Plane,
    /// It may cut bodies that are no polyhedra too, and has something to cut.
    pub large: bool,
}

/// The planes above which nothing of the body is: faces of a hull that `rays`, all of which meet the true body, allow. The body
/// ends at `base`, which is not sought.
pub(super) fn faces(surface: &LevelSet<f32>, rays: &[Ray<f32>], base: Option<&Plane>) -> Vec<Face> {
    faces_by(&Chords::new(surface, rays), surface, base)
}

fn faces_by(chords: &Chords, surface: &LevelSet<f32>, base: Option<&Plane>) -> Vec<Face> {
    let mut left = points(surface, POINTS, |_| true);
    let apart = |m: Vec3<f32>| move |p: &Point<f32>| p.normal.dot(m) < (2.0 * CONE).cos();
    if let Some(base) = base {
        left.retain(apart(base.normal()));
    }
    let all = left.len();
    let mut faces = Vec::new();
    while !chords.first.is_empty() {
        let Some(crowd) = Crowd::densest(&left, CONE.cos()) else { break };
        let count = crowd.points.len() as f64;
        if count < SHARE * all as f64 {
            break;
        }
        let large = count >= LARGE * all as f64;
        let found = match face(chords, &crowd, surface.voxel()) {
            Some(plane) => Face { plane, large: large && is_shallow(&plane, surface) },
            None if bulge(&crowd) > BULGE => Face { plane: touching(&crowd), large: false },
            None => Face { plane: Plane::facing(crowd.normal, crowd.offset()), large: false },
        };
        faces.push(found);
        left.retain(apart(crowd.normal));
        // The other slopes of a roof.
        left.retain(apart(found.plane.normal()));
    }
    faces
}

/// The wall below a rim narrows by at most this part of what the roof above does; a dome narrows alike on both sides.
const NARROWING: f32 = 0.3;
/// How far below and above a rim that is measured [voxel].
const BESIDE_RIM: f32 = 2.0;

/// The planes across the axis of a body of revolution, above and below it, beyond which no ray inside a mask needs anything of the body;
/// `None` where that would be much of it. The upper one makes its rim flat: it cuts a roof off, a cone as steep as the lowest view, or what
/// rough masks have rounded. There is none where the body has no rim.
pub(super) fn ends(surface: &LevelSet<f32>, rays: &[Ray<f32>], up: Vec3<f32>) -> [Option<Plane>; 2] {
    let chords = Chords::new(surface, rays);
    let end = |towards: Vec3<f32>| {
        let is_seen = !chords.first.is_empty();
        is_seen
            .then(|| Plane::facing(towards, chords.deepest(towards)))
            .filter(|end| is_shallow(end, surface))
    };
    [end(up).filter(|lid| is_rim(lid, surface)), end(-up)]
}

/// Whether a body narrows hardly below a plane, and at once above it.
fn is_rim(lid: &Plane, surface: &LevelSet<f32>) -> bool {
    let nodes = surface.coefficients().iter().enumerate().filter(|(_, phi)| **phi < 0.0);
    let heights: Vec<f32> = nodes.map(|(j, _)| lid.height(surface.position(j)) / surface.voxel()).collect();
    // Proportional to the mean radius between so many times that height and once more.
    let radius = |from: f32| {
        let within = (BESIDE_RIM * from)..(BESIDE_RIM * (from + 1.0));
        (heights.iter().filter(|h| within.contains(h)).count() as f32).sqrt()
    };
    let [below, at, above] = [-2.0, -1.0, 0.0].map(radius);
    below - at < NARROWING * (at - above)
}

/// The plane near the normal of a crowd that most of its points are above. More than a voxel hardly counts more, and what is below the plane counts
/// against it: else one that cuts off a sharp edge would win over the face, of which there may be nothing to cut.
fn face(chords: &Chords, crowd: &Crowd<f32>, voxel: f32) -> Option<Plane> {
    let above = |h: f32| h / (h.abs() + voxel);
    let gain = |plane: &Plane| crowd.points.iter().map(|p| above(plane.height(p.x))).sum::<f32>();
    let at = |m: Vec3<f32>| Plane::facing(m, chords.deepest(m));
    let mut best = at(crowd.normal);
    for tilt in TILTS {
        loop {
            let m = best.normal();
            let [u, v] = best.tangents();
            let tried = [u, -u, v, -v].map(|d| at((m + d * tilt).normalized()));
            let better = tried.into_iter().max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
            if gain(&better) <= gain(&best) {
                break;
            }
            best = better;
        }
    }
    (gain(&best) > 0.0).then_some(best)
}

/// The plane of the mean normal on the outermost of the points: it cuts nothing.
fn touching(Crowd { points, normal }: &Crowd<f32>) -> Plane {
    Plane::facing(*normal, points.iter().map(|p| normal.dot(p.x)).fold(f32::NEG_INFINITY, f32::max))
}

/// How far the normals of points turn outwards with their places [rad, root mean square]: of a cap of a ball within the cone
/// [`CONE`]/√2, of a plane 0, whatever their noise.
fn bulge(Crowd { points, normal }: &Crowd<f32>) -> f32 {
    let count = points.len() as f32;
    let centre = points.iter().fold(Vec3::zero(), |sum, p| sum + p.x) / count;
    let across = |v: Vec3<f32>| v - *normal * normal.dot(v);
    let places = || points.iter().map(|p| across(p.x - centre));
    let turned: f32 = places().zip(points).map(|(x, p)| x.dot(p.normal)).sum();
    let width = places().map(|x| x.dot(x)).sum::<f32>().sqrt();
    if width > 0.0 { turned / (width * count.sqrt()) } else { 0.0 }
}

/// Whether a face leaves most of the body.
fn is_shallow(face: &Plane, surface: &LevelSet<f32>) -> bool {
    let nodes = surface.coefficients();
    let heights = (0..nodes.len()).filter(|&j| nodes[j] < 0.0).map(|j| face.height(surface.position(j)));
    let (low, high) = heights.fold((f32::MAX, f32::MIN), |(low, high), h| (low.min(h), high.max(h)));
    high < DEEPEST * (high - low)
}

/// Whether a body, already cut by the planes of a polyhedron, is that polyhedron.
pub(super) fn fills(surface: &LevelSet<f32>, solid: &Polyhedron) -> bool {
    let n = surface.domain().resolution.map(|n| n as usize);
    let (mut enclosed, mut filled) = (0_u32, 0_u32);
    for (j, phi) in surface.coefficients().iter().enumerate() {
        if solid.height(surface.position(j)) < 0.0 {
            let at = [j % n[0], j / n[0] % n[1], j / (n[0] * n[1])];
            if (0..3).any(|a| at[a] == 0 || at[a] + 1 == n[a]) {
                return false; // open
            }
            enclosed += 1;
            filled += u32::from(*phi < 0.0);
        }
    }
    let on = |p: &Plane, at: &Point<f32>| {
        p.height(at.x).abs() < ON.0 * surface.voxel() && p.normal().dot(at.normal) > ON.1
    };
    let points = points(surface, POINTS, |_| true);
    let on_faces = points.iter().filter(|at| solid.planes().any(|p| on(p, at))).count();
    f64::from(filled) >= FILLED * f64::from(enclosed) && on_faces as f64 >= ON_FACES * points.len() as f64
}

impl Chords {
    /// The straight rays that meet the body.
    fn new(surface: &LevelSet<f32>, rays: &[Ray<f32>]) -> Self {
        let mut chords = Self { ends: Vec::new(), first: Vec::new() };
        let domain = Domain { ..*surface.domain() };
        // An index of 1 has a surface and bends nothing.
        let Ok(medium) = Medium::new(vec![IndexGrid::sharp(surface.clone(), 1.0)]) else { return chords };
        let tracer = Tracer::new(&medium, &domain, Options::default());
        for ray in rays {
            let path = tracer.trace(ray);
            let first = chords.ends.len();
            let events = path.segments.iter().zip(&path.steps).filter(|(_, step)| step.event.is_some());
            chords.ends.extend(events.map(|(segment, step)| segment.start + segment.momentum * step.drift));
            if chords.ends.len() > first {
                chords.first.push(first);
            }
        }
        chords
    }

    /// The least offset of a plane of this normal that leaves all but a few rays on the body below it.
    fn deepest(&self, normal: Vec3<f32>) -> f32 {
        let count = self.ends.len();
        let ends = self.first.iter().skip(1).chain([&count]);
        let lowest = |(&a, &b): (&usize, &usize)| {
            self.ends[a..b].iter().map(|x| normal.dot(*x)).fold(f32::INFINITY, f32::min)
        };
        let mut offsets: Vec<f32> = self.first.iter().zip(ends).map(lowest).collect();
        let at = offsets.len() - 1 - (LOST * offsets.len() as f64) as usize;
        *offsets.select_nth_unstable_by(at, f32::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use refraxel_core::{Aabb, vec3};

    /// Rays through random points that meet something, from random directions whose height above the horizon has a sine in this range.
    fn rays(inside: impl Fn(Vec3<f32>) -> bool, sines: [f32; 2]) -> Vec<Ray<f32>> {
        let random = Random::new(7);
        let u = |i: u64, k: u64| random.uniform(i, k) as f32;
        let ray = |i: u64| {
            let (azimuth, z) = (std::f32::consts::TAU * u(i, 0), sines[0] + (sines[1] - sines[0]) * u(i, 1));
            let flat = (1.0 - z * z).sqrt();
            let direction = -vec3(flat * azimuth.cos(), flat * azimuth.sin(), z);
            let target = vec3(u(i, 2) - 0.5, u(i, 3) - 0.5, u(i, 4) - 0.5) * 2.0;
            Ray { origin: target - direction * 5.0, direction }
        };
        let meets = |ray: &Ray<f32>| (0..150).any(|k| inside(ray.at(3.5 + 0.02 * k as f32)));
        (0..150_000).map(ray).filter(meets).take(16_000).collect()
    }

    #[test]
    fn a_steep_roof_over_a_rim_is_cut_off_and_a_dome_stays() {
        // Views from 20° above and higher: the hull of a tumbler has a cone of 20° on its rim, whose normals lie all around.
        let up = vec3(0.0, 0.0, 1.0);
        let across = |x: Vec3<f32>| x.x.hypot(x.y);
        let tumbler = |x: Vec3<f32>| across(x) < 0.5 && x.z > -0.5 && x.z < 0.3;
        let slope = 20.0_f32.to_radians().tan();
        let roofed = |x: Vec3<f32>| {
            let roof = (x.z - 0.3 - slope * (0.5 - across(x))) / slope.hypot(1.0);
            (across(x) - 0.5).max(-0.5 - x.z).max(roof)
        };
        let hull = LevelSet::from_samples(Aabb::cube(1.0), [65; 3], roofed);
        let lid = |hull: &LevelSet<f32>, rays: &[Ray<f32>]| ends(hull, rays, up)[0];
        let found = lid(&hull, &rays(tumbler, [20.0_f32.to_radians().sin(), 0.8])).unwrap();
        assert!((found.offset() - 0.3).abs() < 0.5 * hull.voxel(), "{found:?}");
        let dome = |x: Vec3<f32>| (x.length() - 0.5).max(-0.3 - x.z);
        let round = LevelSet::from_samples(Aabb::cube(1.0), [65; 3], dome);
        assert_eq!(lid(&round, &rays(|x| dome(x) < 0.0, [0.34, 0.8])), None);
    }

    #[test]
    fn the_roof_over_a_block_is_cut_off_at_its_rim() {
        // Views from 8° to 50° above: the hull has a roof of 8°.
        let block = |x: Vec3<f32>| x.x.abs() < 0.6 && x.y.abs() < 0.5 && x.z > -0.4 && x.z < 0.2;
        let roofed = |x: Vec3<f32>| {
            let walls = (x.x.abs() - 0.6).max(x.y.abs() - 0.5).max(-0.4 - x.z);
            let slope = 0.14;
            walls.max(x.z - 0.2 - slope * (0.6 - x.x.abs()).min(0.5 - x.y.abs()).max(0.0))
        };
        let surface = LevelSet::from_samples(Aabb::cube(1.0), [65; 3], roofed);
        let found = faces(&surface, &rays(block, [0.14, 0.77]), None);
        let top = found.iter().map(|f| f.plane).max_by(|a, b| a.normal().z.total_cmp(&b.normal().z)).unwrap();
        let voxel = 2.0 / 64.0;
        for corner in [vec3(0.5, 0.4, 0.2), vec3(-0.5, 0.4, 0.2), vec3(0.5, -0.4, 0.2), vec3(-0.5, -0.4, 0.2)]
        {
            assert!(top.height(corner).abs() < 0.35 * voxel, "{found:?}");
        }
        assert!(found.len() >= 5);
    }

    #[test]
    fn a_block_with_a_notch_is_a_polyhedron_and_a_pillar_is_none() {
        let face = |x: f32, y: f32, z: f32, offset| Plane::facing(vec3(x, y, z), offset);
        let faces = vec![
            face(1.0, 0.0, 0.0, 0.6),
            face(-1.0, 0.0, 0.0, 0.6),
            face(0.0, 1.0, 0.0, 0.5),
            face(0.0, -1.0, 0.0, 0.5),
            face(0.0, 0.0, 1.0, 0.2),
        ];
        let base = face(0.0, 0.0, -1.0, 0.4);
        let block = Polyhedron { faces, base: Some(base) };
        let notched = |deep: f32| {
            let notch = move |x: Vec3<f32>| ((x.x - 0.4).abs() - 0.12).max(0.2 - deep - x.z);
            LevelSet::from_samples(Aabb::cube(1.0), [65; 3], |x| block.height(x).max(-notch(x)))
        };
        assert!(fills(&notched(0.1), &block));
        assert!(!fills(&notched(0.5), &block), "a notch right through it belongs to the body");
        let pillar = |x: Vec3<f32>| vec3(x.x, x.y, 0.0).length() - 0.5;
        let pillar =
            LevelSet::from_samples(Aabb::cube(1.0), [65; 3], |x| pillar(x).max(x.z - 0.2).max(-0.4 - x.z));
        let lids = Polyhedron { faces: vec![face(0.0, 0.0, 1.0, 0.2)], base: Some(base) };
        assert!(!fills(&pillar, &lids), "two planes enclose nothing");
        assert!(!fills(&pillar, &block), "its side is not flat");
    }

    #[test]
    fn round_things_have_no_faces_and_lenses_keep_their_backs() {
        let ball = |x: Vec3<f32>| x.length() - 0.6;
        let of = |f: &dyn Fn(Vec3<f32>) -> f32| {
            let surface = LevelSet::from_samples(Aabb::cube(1.0), [65; 3], f);
            faces(&surface, &rays(|x| f(x) < 0.0, [-0.8, 0.8]), None)
        };
        assert_eq!(of(&ball), []);
        // Both faces of a lens lie within the cone.
        let lens = |x: Vec3<f32>| {
            let from = |z: f32| (x - vec3(0.0, 0.0, z)).length() - 2.0;
            from(1.9).max(from(-1.9))
        };
        let backs = of(&lens);
        assert_eq!(backs.len(), 2, "{backs:?}");
        for face in &backs {
            let plane = face.plane;
            assert!(plane.height(vec3(0.0, 0.0, 0.1 * plane.normal().z)) < 0.01, "{face:?}");
        }
        let planes = Polyhedron { faces: backs.iter().map(|f| f.plane).collect(), base: None };
        assert!(!fills(&LevelSet::from_samples(Aabb::cube(1.0), [65; 3], lens), &planes), "{backs:?}");
    }
}
