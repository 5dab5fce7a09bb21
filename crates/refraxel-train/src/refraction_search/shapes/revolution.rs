//! A body of revolution on an upright axis, as drinking glasses, bottles and bowls are: from a visual hull that has dents
//! where something in front of it was cut out of the masks, and bulges between the views.
//!
//! The axis is where opposite sides of all heights are equally far away. The profile is the median around it, which the dents
//! do not reach.

use super::body::{distance, span};
use super::contours::Contours;
use crate::least_squares::solved;
use crate::level_set::level_set;
use crate::model::axis::Axis;
use crate::model::polyhedron::{Plane, Polyhedron, tangents};
use rayon::prelude::*;
use refraxel_core::{Domain, LevelSet, Vec3};
use std::f32::consts::TAU;
use std::ops::RangeInclusive;

/// Directions around the axis, an even number.
const ANGLES: usize = 48;
/// Times the axis is found anew, with heights along the last one.
const ROUNDS: usize = 3;
/// What misses the axis by this much counts a quarter [voxel]: less and less while the axis gets better.
const SCALES: [f32; 7] = [2.0, 1.0, 0.5, 0.3, 0.3, 0.3, 0.3];
/// Fewest heights that say anything.
const LEAST_HEIGHTS: usize = 8;
/// Smallest mean radius [voxel].
const LEAST_RADIUS: f32 = 4.0;
/// Half of all distances from the axis differ by at most this from the median at their height [voxel; radius]: those of an
/// octagon by 0.017 radii …
const USUAL: (f32, f32) = (0.4, 0.012);
/// … and of all but these shares none lies inwards or outwards by more than so much [voxel]: a dent may be large, a handle is
/// none.
const DENTED: f64 = 0.1;
const BULGING: f64 = 0.02;
const FARTHEST: f32 = 2.0;
/// Least part of hull and body together that both fill: where silhouettes alone say that it is one of revolution, and where it may be, which
/// rough masks leave open.
const OVERLAP: f32 = 0.9;
const ALIKE: f32 = 0.6;
/// Heights between these shares of a body show how wide it is.
const MIDDLE: RangeInclusive<f32> = 0.2..=0.8;

/// A body of revolution.
#[derive(Clone, Debug)]
pub(in crate::refraction_search) struct Revolution {
    axis: Axis,
    /// Distance between samples of the profile [scene unit].
    step: f32,
    /// Height of the lowest samples along the axis [scene unit].
    low: f32,
    /// Lower and upper end along the axis [scene unit].
    span: [f32; 2],
    /// Samples along the radius.
    across: usize,
    /// φ [scene unit], the radius running fastest.
    profile: Vec<f32>,
    /// The hull shows that it is one; otherwise it may be one.
    pub is_sure: bool,
}

/// What a hull shows around an axis.
impl Axis {
    /// Points at a height, at a distance in all directions.
    fn ring(&self, height: f32, radius: f32) -> impl Iterator<Item = Vec3<f32>> + use<> {
        let ([u, v], middle) = (tangents(self.up), self.at + self.up * height);
        (0..ANGLES).map(move |k| {
            let (sin, cos) = (TAU * k as f32 / ANGLES as f32).sin_cos();
            middle + (u * cos + v * sin) * radius
        })
    }

    /// Distance of the outermost surface in each direction; none where there is nothing.
    fn radii(&self, hull: &LevelSet<f32>, height: f32, farthest: f32) -> Vec<Option<f32>> {
        let (middle, step) = (self.at + self.up * height, 0.5 * hull.voxel());
        let of = |rim: Vec3<f32>| {
            let inwards = (middle - rim) / farthest;
            let mut outside = distance(hull, rim);
            for k in 1..=(farthest / step) as usize {
                let here = distance(hull, rim + inwards * (step * k as f32));
                if here < 0.0 {
                    let beyond = if outside > 0.0 { outside / (outside - here) } else { 0.0 };
                    return Some(farthest - step * (k as f32 - 1.0 + beyond));
                }
                outside = here;
            }
            None
        };
        self.ring(height, farthest).map(of).collect()
    }

    /// The line in the middle between opposite surfaces, by least squares: with its middle at c + t · height,
    /// (r(θ) − r(θ + π))/2 = (c + t · height) · u(θ). Distances that do not fit count less.
    fn centred(&self, slices: &[(f32, Vec<Option<f32>>)], voxel: f32) -> Option<Self> {
        const UNKNOWNS: usize = 4;
        let opposite = |(height, radii): &(f32, Vec<Option<f32>>)| -> Vec<([f64; UNKNOWNS], f64)> {
            let one = |k: usize| {
                let (a, b) = (radii[k]?, radii[k + ANGLES / 2]?);
                let (sin, cos) = (TAU * k as f32 / ANGLES as f32).sin_cos();
                let row = [cos, sin, cos * height, sin * height].map(f64::from);
                Some((row, f64::from(0.5 * (a - b))))
            };
            (0..ANGLES / 2).filter_map(one).collect()
        };
        let equations: Vec<_> = slices.iter().flat_map(opposite).collect();
        let mut found = vec![0.0; UNKNOWNS];
        for scale in SCALES.map(|s| f64::from(s * voxel)) {
            let (mut matrix, mut right) = (vec![0.0; UNKNOWNS * UNKNOWNS], vec![0.0; UNKNOWNS]);
            for (row, value) in &equations {
                let miss = value - row.iter().zip(&found).map(|(a, b)| a * b).sum::<f64>();
                let weight = (1.0 + (miss / scale).powi(2)).powi(-2);
                for i in 0..UNKNOWNS {
                    right[i] += weight * row[i] * value;
                    (0..UNKNOWNS).for_each(|j| matrix[UNKNOWNS * i + j] += weight * row[i] * row[j]);
                }
            }
            found = solved(&matrix, &right, 0.0)?;
        }
        let [u, v] = tangents(self.up);
        let along = |a: f64, b: f64| u * a as f32 + v * b as f32;
        let (at, up) = (self.at + along(found[0], found[1]), self.up + along(found[2], found[3]));
        Some(Self { at, up: up.normalized() })
    }
}

/// The body of revolution that a hull shows or may show, a signed distance, on what it stands on; `up` is about its axis. `None`
/// where the hull has another shape.
///
/// Error: for a hull with noise of half a voxel and dents on a quarter of it, a tenth of a voxel across and 0.1° along the axis.
pub(in crate::refraction_search) fn revolution(
    hull: &LevelSet<f32>,
    up: Vec3<f32>,
    ground: Option<&Plane>,
) -> Option<Revolution> {
    let voxel = hull.voxel();
    let stands = |x: Vec3<f32>| ground.is_none_or(|g| g.height(x) > voxel);
    let inside: Vec<Vec3<f32>> =
        hull.parameters().map(|j| hull.position(j)).filter(|x| stands(*x) && hull.is_inside(*x)).collect();
    let middle = inside.iter().fold(Vec3::zero(), |s, x| s + *x) / inside.len().max(1) as f32;
    let farthest = 0.5 * hull.domain().bounds.extent().length();
    let mut axis = Axis { at: middle, up };
    let mut slices = Vec::new();
    for round in 0..=ROUNDS {
        let of = |x: &Vec3<f32>| axis.up.dot(*x - axis.at);
        let ends = inside.iter().map(of).fold([f32::MAX, f32::MIN], |[a, b], h| [a.min(h), b.max(h)]);
        let heights = ((ends[1] - ends[0]) / voxel - 3.0).max(0.0) as usize;
        if heights < LEAST_HEIGHTS {
            return None;
        }
        let height = |k: usize| ends[0] + voxel * (k as f32 + 2.0);
        let slice = |k: usize| (height(k), axis.radii(hull, height(k), farthest));
        slices = (0..heights).into_par_iter().map(slice).collect();
        if round < ROUNDS {
            axis = axis.centred(&slices, voxel)?;
        }
    }
    let body = Revolution::of(hull, axis, farthest)?;
    let overlap = body.overlap(hull, stands);
    let is_sure = overlap >= OVERLAP && is_round(&slices, voxel);
    (overlap >= ALIKE).then_some(Revolution { is_sure, ..body })
}

/// Whether surfaces at the same height are about equally far from the axis.
fn is_round(slices: &[(f32, Vec<Option<f32>>)], voxel: f32) -> bool {
    let (mut off, mut radii) = (Vec::new(), 0.0);
    for (_, slice) in slices {
        let usual = median(slice.iter().map(|r| r.unwrap_or(0.0)).collect());
        off.extend(slice.iter().map(|r| (r.unwrap_or(0.0) - usual) / voxel));
        radii += usual / voxel;
    }
    off.sort_by(f32::total_cmp);
    let at = |share: f64| off[((share * off.len() as f64) as usize).min(off.len() - 1)];
    let [low, high] = [at(DENTED), at(1.0 - BULGING)];
    let usual = median(off.iter().map(|d| d.abs()).collect());
    let radius = radii / slices.len() as f32;
    let is_usual = usual <= USUAL.0.min(USUAL.1 * radius);
    radius > LEAST_RADIUS && is_usual && low >= -FARTHEST && high <= FARTHEST
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    let n = values.len();
    0.5 * (values[n / 2] + values[(n - 1) / 2])
}

/// Fills what lies between the axis and the outermost surface: around the axis a hole in masks is no small part.
fn filled(row: &mut [f32], depth: f32) {
    if let Some(last) = row.iter().rposition(|d| *d < 0.0) {
        row[..last].iter_mut().filter(|d| **d >= 0.0).for_each(|d| *d = -depth);
    }
}

/// The sample before a place among `count` of them, and how far behind it that is; places beyond the ends lie on them.
fn cell(place: f32, count: usize) -> (usize, f32) {
    let place = place.clamp(0.0, count as f32 - 1.001);
    (place as usize, place.fract())
}

/// Samples, interpolated linearly.
fn at(samples: &[f32], place: f32) -> f32 {
    let (i, s) = cell(place, samples.len());
    samples[i] + s * (samples[i + 1] - samples[i])
}

impl Revolution {
    /// The medians of a hull around an axis.
    fn of(hull: &LevelSet<f32>, axis: Axis, farthest: f32) -> Option<Self> {
        let span = span(hull, axis.up)?.map(|h| h - axis.up.dot(axis.at));
        let [low, high] = span;
        let (step, room) = (0.5 * hull.voxel(), 3.0 * hull.voxel());
        let across = (farthest / step) as usize + 2;
        let along = ((high - low + 2.0 * room) / step) as usize + 2;
        let sample = |j: usize| {
            let (radius, height) = ((j % across) as f32 * step, low - room + (j / across) as f32 * step);
            median(axis.ring(height, radius).map(|x| distance(hull, x)).collect())
        };
        let mut profile: Vec<f32> = (0..across * along).into_par_iter().map(sample).collect();
        profile.chunks_exact_mut(across).for_each(|row| filled(row, step));
        Some(Self { axis, step, low: low - room, span, across, profile, is_sure: false })
    }

    /// φ, about the distance from the surface near it [scene unit].
    pub(in crate::refraction_search) fn distance(&self, x: Vec3<f32>) -> f32 {
        let [radius, height] = self.axis.place(x);
        let along = self.profile.len() / self.across;
        let (j, t) = cell((height - self.low) / self.step, along);
        let row = |j: usize| at(&self.profile[j * self.across..][..self.across], radius / self.step);
        row(j) + t * (row(j + 1) - row(j))
    }

    /// The same, as wide as outlines show it on the mean: its sides move away from the axis, and its ends stay where they are, with sharp
    /// edges. `surface` is its own, as it was carved; near its ends rough masks round it off.
    pub(in crate::refraction_search) fn widened_to(
        mut self,
        outlines: &Contours,
        surface: &LevelSet<f32>,
    ) -> Self {
        let [low, high] = self.span;
        let is_side = |x| MIDDLE.contains(&((self.axis.place(x)[1] - low) / (high - low)));
        let by = outlines.beyond(surface, is_side) / self.step;
        for row in self.profile.chunks_exact_mut(self.across) {
            let old = row.to_vec();
            row.iter_mut().enumerate().for_each(|(i, phi)| *phi = at(&old, i as f32 - by));
        }
        self
    }

    /// Its axis, upwards.
    pub(in crate::refraction_search) fn axis(&self) -> Axis {
        self.axis
    }

    /// The body on a grid, as far as planes leave it.
    pub(in crate::refraction_search) fn surface(
        &self,
        grid: &Domain<f32>,
        ends: &Polyhedron,
    ) -> LevelSet<f32> {
        let phi = |x: Vec3<f32>| self.distance(x).max(ends.height(x));
        let mut surface = level_set(grid.bounds, grid.resolution, phi);
        surface.redistance();
        surface
    }

    /// The part of hull and body together that both fill.
    fn overlap(&self, hull: &LevelSet<f32>, stands: impl Fn(Vec3<f32>) -> bool) -> f32 {
        let (mut both, mut either) = (0.0, 0.0);
        for j in hull.parameters().filter(|&j| stands(hull.position(j))) {
            let x = hull.position(j);
            let [a, b] = [hull.is_inside(x), self.distance(x) < 0.0];
            both += f32::from(u8::from(a && b));
            either += f32::from(u8::from(a || b));
        }
        if either > 0.0 { both / either } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::views::{self, cameras, footprint, meets_body, shaken, silhouettes};
    use super::*;
    use crate::random::Random;
    use crate::silhouettes::Outlines;
    use refraxel_core::{Aabb, vec3};

    const RADIUS: f32 = 0.36;
    const HALF: f32 = 0.42;

    /// A hull on 61 nodes along each axis, its distances disturbed by up to half a voxel.
    fn hull(phi: impl Fn(Vec3<f32>) -> f32) -> LevelSet<f32> {
        let bounds = Aabb::cube(0.7);
        let exact = LevelSet::from_samples(bounds, [61; 3], phi);
        let (random, voxel) = (Random::new(3), exact.voxel());
        let noisy = |(j, d): (usize, &f32)| d + voxel * (random.uniform(j as u64, 0) as f32 - 0.5);
        let phi = exact.coefficients().iter().enumerate().map(noisy).collect();
        let mut found = LevelSet::from_coefficients(bounds, [61; 3], phi).unwrap();
        found.smooth(0.6);
        found
    }

    fn axis() -> Axis {
        Axis { at: vec3(0.04, -0.03, 0.01), up: vec3(0.03, -0.05, 1.0).normalized() }
    }

    /// An upright cylinder with a dent on a quarter of its side, and a hole on its axis.
    fn cylinder(x: Vec3<f32>) -> f32 {
        let [radius, height] = axis().place(x);
        let dent = if x.x > 0.2 && x.y > 0.0 { 0.04 } else { 0.0 };
        let hole = 0.05 - (x - vec3(0.05, 0.0, 0.1)).length();
        (radius - RADIUS + dent).max(height.abs() - HALF).max(hole)
    }

    #[test]
    fn axis_and_profile_of_a_dented_cylinder_are_found() {
        let hull = hull(cylinder);
        let voxel = hull.voxel();
        let found = revolution(&hull, vec3(0.0, 0.0, 1.0), None).unwrap();
        assert!(found.axis().up.dot(axis().up).acos() < 0.2_f32.to_radians(), "{:?}", found.axis().up);
        let whole = Polyhedron { faces: Vec::new(), base: None };
        let surface = found.surface(hull.domain(), &whole);
        for height in [-0.3, 0.0, 0.3] {
            let ring: Vec<f32> = axis().ring(height, RADIUS).map(|x| surface.value(x) / voxel).collect();
            assert!(ring.iter().all(|d| d.abs() < 0.25), "{height}: {ring:?}");
        }
        assert!(surface.is_inside(vec3(0.05, 0.0, 0.1)));
        assert!(axis().ring(HALF, 0.2).all(|x| surface.value(x).abs() < 0.3 * voxel));
    }

    #[test]
    fn rough_masks_show_a_cylinder_as_wide_as_it_is() {
        let meets = meets_body(|x| (x.x.hypot(x.y) - 0.4).max(x.z.abs() - 0.5));
        let views = shaken(silhouettes(&cameras(36, [0.1, 0.9]), meets), 2.0);
        let outlines = Outlines::new(&views);
        let carved = views::hull(&outlines, 0.7, 64);
        let rough = revolution(&carved, vec3(0.0, 0.0, 1.0), None).unwrap();
        let whole = Polyhedron { faces: Vec::new(), base: None };
        let surface = rough.surface(carved.domain(), &whole);
        let contours = Contours::new(&outlines, &carved, None).unwrap();
        let off = |body: &Revolution| f64::from(body.distance(vec3(0.4, 0.0, 0.0))) / footprint();
        let wide = rough.clone().widened_to(&contours, &surface);
        let (before, after) = (off(&rough), off(&wide));
        assert!(before > 0.3 && after.abs() < 0.1, "{before} {after}");
        // Its ends stay where they were.
        let height = |body: &Revolution| body.distance(vec3(0.2, 0.0, 0.5));
        assert!(
            (height(&wide) - height(&rough)).abs() < 0.1 * carved.voxel(),
            "{} {}",
            height(&rough),
            height(&wide)
        );
    }

    #[test]
    fn boxes_handles_and_lying_bottles_are_not_turned() {
        let upright = vec3(0.0, 0.0, 1.0);
        fn is_sure(phi: impl Fn(Vec3<f32>) -> f32) -> bool {
            revolution(&hull(phi), vec3(0.0, 0.0, 1.0), None).is_some_and(|t| t.is_sure)
        }
        let block = |x: Vec3<f32>| x.x.abs().max(x.y.abs()).max(x.z.abs()) - 0.4;
        let mug = |x: Vec3<f32>| {
            let ring = vec3(vec3(x.x - 0.42, 0.0, x.z).length() - 0.18, x.y, 0.0).length() - 0.06;
            (vec3(x.x, x.y, 0.0).length() - 0.36).max(x.z.abs() - 0.4).min(ring)
        };
        let lying = |x: Vec3<f32>| (vec3(0.0, x.y, x.z).length() - 0.3).max(x.x.abs() - 0.5);
        let polygon = |sides: u32, radius: f32| {
            move |x: Vec3<f32>| {
                let side = |k: u32| {
                    let (sin, cos) = (TAU * (k as f32 + 0.3) / sides as f32).sin_cos();
                    x.x * cos + x.y * sin - radius
                };
                (0..sides).map(side).fold(x.z.abs() - 0.4, f32::max)
            }
        };
        for radius in [0.2, 0.3, 0.45] {
            for sides in [4, 6, 8] {
                assert!(!is_sure(polygon(sides, radius)), "{sides} {radius}");
            }
        }
        assert!(!is_sure(block) && !is_sure(mug));
        assert!(revolution(&hull(lying), upright, None).is_none());
    }

    #[test]
    fn a_body_ends_at_what_it_stands_on() {
        let ground = Plane::facing(vec3(0.0, 0.0, 1.0), -0.2);
        let found = revolution(&hull(cylinder), vec3(0.0, 0.0, 1.0), Some(&ground)).unwrap();
        let base = Some(Plane::facing(vec3(0.0, 0.0, -1.0), 0.25));
        let lid = Plane::facing(vec3(0.0, 0.0, 1.0), 0.15);
        let surface = found.surface(hull(cylinder).domain(), &Polyhedron { faces: vec![lid], base });
        for (height, is_inside) in [(-0.28, false), (-0.22, true), (0.12, true), (0.18, false)] {
            assert_eq!(surface.is_inside(vec3(0.0, 0.0, height)), is_inside, "{height}");
        }
    }
}
