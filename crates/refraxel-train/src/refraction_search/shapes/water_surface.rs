//! Water that is seen from above only: its surface is all that a mask shows.
//!
//! A mask in such a view is the surface as far as the basin does not hide it. Carried to the true level along
//! their lines of sight, the masks of all views coincide; at a wrong level each is displaced away from its
//! camera.

use super::body::{ShapeBody, Substance};
use crate::level_set::level_set;
use crate::silhouettes::Outlines;
use refraxel_core::{Aabb, Vec3};

/// Levels of a sweep, and of each refinement around the best one.
const SWEEP: usize = 33;
const FINER: usize = 9;
/// Places along the longer edge of the level plane.
const PLACES: f32 = 64.0;
/// Least views that must see a place.
const VIEWS: usize = 3;
/// A level belongs to the proposed range if its score is at least this part of the best one.
const PLAUSIBLE: f64 = 0.95;
/// Views abstain about places this far behind something opaque [voxel].
const MARGIN: f32 = 1.0;
/// Share of the views that a place of the surface may be in by mistake.
const MISTAKEN: f64 = 0.05;

/// Where water is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::refraction_search) struct Basin {
    /// Box that holds the basin [scene unit].
    pub bounds: Aabb<f32>,
    /// Unit vector away from the water.
    pub up: Vec3<f32>,
    /// Edge of a voxel of the body [scene unit].
    pub voxel: f32,
}

/// How well a level explains the masks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::refraction_search) struct Level {
    /// Height along `up` [scene unit].
    pub height: f32,
    /// 1 where all masks coincide on the level plane: Σ p / Σ 1 · Σ p / Σ (p + q) over the places that some
    /// view shows as water, p and q being the shares of the views that show water there and that show
    /// something else. Too low a level spreads the masks over more places, behind the walls; too high a level
    /// lets views contradict.
    pub score: f64,
}

/// The levels that the masks allow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::refraction_search) struct Levels {
    pub best: Level,
    /// Lowest and highest level whose score is at least 95 % of the best one, and one step of the sweep beyond
    /// [scene unit].
    pub range: [f32; 2],
}

impl Basin {
    /// Heights of the box along `up` [scene unit].
    fn heights(&self) -> [f32; 2] {
        let half = 0.5 * self.up.map(f32::abs).dot(self.bounds.extent());
        let middle = self.up.dot(self.bounds.center());
        [middle - half, middle + half]
    }

    /// Points of a level plane inside the box.
    fn places(&self, height: f32) -> Vec<Vec3<f32>> {
        let axis = if self.up.x.abs() < 0.5 { Vec3::new(1.0, 0.0, 0.0) } else { Vec3::new(0.0, 1.0, 0.0) };
        let u = (axis - self.up * self.up.dot(axis)).normalized();
        let v = self.up.cross(u);
        let (center, extent) = (self.bounds.center(), self.bounds.extent());
        let middle = center + self.up * (height - self.up.dot(center));
        let half = |d: Vec3<f32>| 0.5 * d.map(f32::abs).dot(extent);
        let step = 2.0 * half(u).max(half(v)) / PLACES;
        let range = |d: Vec3<f32>| {
            let n = (half(d) / step).floor() as i32;
            -n..=n
        };
        let places = range(v).flat_map(|j| range(u).map(move |i| (i as f32, j as f32)));
        let point = |(i, j): (f32, f32)| middle + (u * i + v * j) * step;
        places.map(point).filter(|x| self.bounds.contains(*x)).collect()
    }

    /// How well a level explains the masks.
    pub(super) fn level(&self, outlines: &Outlines, height: f32) -> Level {
        let (mut places, mut shown, mut denied) = (0.0, 0.0, 0.0);
        outlines.ask(&self.places(height), MARGIN * self.voxel, &mut Vec::new(), |_, votes| {
            let seen = votes.len() as f64;
            let inside = votes.iter().filter(|d| **d <= 0.0).count() as f64;
            let outside = votes.iter().filter(|d| **d > 0.0 && d.is_finite()).count() as f64;
            if votes.len() >= VIEWS && inside > MISTAKEN * seen {
                places += 1.0;
                shown += inside / seen;
                denied += outside / seen;
            }
        });
        let score = if places > 0.0 { shown / places * shown / (shown + denied) } else { 0.0 };
        Level { height, score }
    }

    /// The level at which the masks of all views coincide best, and the range around it; `None` where no
    /// level inside the box shows water to three views.
    ///
    /// Error: a tenth of a voxel where views look down from different sides, 60 views of 200² pixels. Views
    /// from one side only, or straight from above, tell nothing: the range is wide then. Where views do not
    /// know that the rim of the basin hides water, every level between the water and the rim is about as
    /// good.
    pub(in crate::refraction_search) fn levels(&self, outlines: &Outlines) -> Option<Levels> {
        let [low, high] = self.heights();
        let coarse = (high - low) / (SWEEP - 1) as f32;
        let mut step = coarse;
        // Once nobody is interested any more, no level is as good as another.
        let at = |height: f32| {
            if outlines.is_cancelled() { Level::default() } else { self.level(outlines, height) }
        };
        let sweep: Vec<Level> = (0..SWEEP).map(|k| at(low + step * k as f32)).collect();
        let better = |a: Level, b: Level| if b.score > a.score { b } else { a };
        let mut best = sweep.iter().copied().fold(Level::default(), better);
        if best.score <= 0.0 {
            return None;
        }
        while step > 0.25 * self.voxel {
            let around = (0..FINER).map(|k| 2.0 * k as f32 / (FINER - 1) as f32 - 1.0);
            best = around.map(|k| at(best.height + step * k)).fold(best, better);
            step *= 2.0 / (FINER - 1) as f32;
        }
        let plausible = sweep.iter().filter(|l| l.score >= PLAUSIBLE * best.score).map(|l| l.height);
        let range = plausible.fold([best.height; 2], |[a, b], h| [a.min(h), b.max(h)]);
        Some(Levels { best, range: [range[0] - coarse, range[1] + coarse] })
    }

    /// The water below a level plane: down to the bottom of the box, and sideways `beyond` [scene unit]
    /// further than what any view shows of its surface, into the opaque walls. The top is a plane up to
    /// there.
    pub(in crate::refraction_search) fn water(
        &self,
        outlines: &Outlines,
        height: f32,
        beyond: f32,
    ) -> ShapeBody {
        let cells = self.bounds.extent().map(|e| (e / self.voxel - 1e-3).ceil().max(8.0));
        let half = cells * (0.5 * self.voxel);
        let bounds = Aabb::new(self.bounds.center() - half, self.bounds.center() + half);
        let far = self.bounds.extent().length();
        let side = |x: Vec3<f32>| {
            let on_plane = x - self.up * (self.up.dot(x) - height);
            let mut least = far;
            // Nobody abstains: the rim hides all that lies beyond the surface.
            outlines.ask(&[on_plane], far, &mut Vec::new(), |_, votes| {
                votes.sort_by(f32::total_cmp);
                let mistaken = (MISTAKEN * votes.len() as f64) as usize;
                least = votes.get(mistaken).copied().filter(|d| d.is_finite()).unwrap_or(far);
            });
            least
        };
        let phi = |x: Vec3<f32>| (side(x) - beyond).clamp(-far, far).max(self.up.dot(x) - height);
        let surface = level_set(bounds, cells.to_array().map(|c| c as u32 + 1), phi);
        ShapeBody::new(surface, Substance::Water)
    }
}

#[cfg(test)]
mod tests {
    use super::super::views::{cameras, silhouette};
    use super::*;
    use crate::silhouettes::{Occluders, Silhouette};
    use refraxel_core::{Ray, vec3};

    const UP: Vec3<f32> = Vec3 { x: 0.0, y: 0.0, z: 1.0 };
    const LEVEL: f64 = 0.13;
    /// The rim of the basin stands this far above the water.
    const RIM: f64 = 0.1;

    fn basin() -> Basin {
        let bounds = Aabb::new(vec3(-1.0, -1.0, -0.6), vec3(1.0, 1.0, 0.6));
        Basin { bounds, up: UP, voxel: 0.03 }
    }

    /// A basin of 1.2 by 0.9 with opaque walls.
    fn is_in_basin(x: Vec3<f64>) -> bool {
        x.x.abs() < 0.6 && x.y.abs() < 0.45
    }

    /// Masks of the water below a rim; views know how far away the opaque walls are.
    fn views(rim: f64) -> Vec<Silhouette> {
        let plane = |ray: &Ray<f64>, z: f64| (z - ray.origin.z) / ray.direction.z;
        let depth = |ray: &Ray<f64>| {
            let (mut near, mut far) = (plane(ray, LEVEL + rim), plane(ray, LEVEL));
            if !is_in_basin(ray.at(near)) || is_in_basin(ray.at(far)) {
                return near;
            }
            for _ in 0..40 {
                let middle = 0.5 * (near + far);
                if is_in_basin(ray.at(middle)) { near = middle } else { far = middle }
            }
            near
        };
        let meets = |ray: &Ray<f64>| [LEVEL, LEVEL + rim].iter().all(|z| is_in_basin(ray.at(plane(ray, *z))));
        let view = |camera| {
            let mut view = silhouette(&camera, meets);
            let opaque = |i: &usize| {
                let width = camera.width as usize;
                let [u, v] = [i % width, i / width].map(|p| p as f64 + 0.5);
                let ray = camera.ray(u, v).unwrap();
                if meets(&ray) { f32::INFINITY } else { depth(&ray) as f32 }
            };
            let look = |pixels: &[usize]| pixels.iter().map(opaque).collect();
            view.occluders = Some(Occluders::new(&view.mask, 1, look));
            view
        };
        cameras(40, [0.45, 0.9]).into_iter().map(view).collect()
    }

    #[test]
    fn the_level_is_where_the_masks_of_all_views_coincide() {
        for rim in [0.0, RIM] {
            let found = basin().levels(&Outlines::new(&views(rim))).unwrap();
            let error = f64::from(found.best.height) - LEVEL;
            assert!(error.abs() < 0.5 * 0.03, "{found:?}");
            assert!(
                found.range[0] <= 0.13 && found.range[1] >= 0.13 && found.range[1] - found.range[0] < 0.4
            );
        }
    }

    #[test]
    fn the_water_ends_at_its_level_and_reaches_down_and_into_the_walls() {
        let body = basin().water(&Outlines::new(&views(RIM)), LEVEL as f32, 0.1).surface;
        let voxel = body.voxel();
        for (x, y) in [(0.0, 0.0), (0.55, 0.4), (-0.6, 0.3), (0.63, -0.45)] {
            let at = |z: f32| body.value(vec3(x, y, z));
            assert!(at(0.13).abs() < 0.01 * voxel, "{x} {y}: {}", at(0.13));
            assert!(at(0.08) < 0.0 && at(-0.4) < 0.0, "{x} {y}");
        }
        assert!(!body.is_inside(vec3(0.85, 0.0, 0.0)) && !body.is_inside(vec3(0.0, -0.7, 0.0)));
    }

    #[test]
    fn masks_that_show_nothing_have_no_level() {
        let empty = cameras(5, [0.45, 0.9]).into_iter().map(|c| silhouette(&c, |_| false));
        assert_eq!(basin().levels(&Outlines::new(&empty.collect::<Vec<_>>())), None);
    }
}
