//! Where the refractive objects are: a coarse carve of the scene, its connected parts, and a fine carve of each.

use super::hull::{Hull, Vote};
use super::outline::Outlines;
use super::region::{Spacing, overlap, region_grid};
use refraxel_core::{Aabb, Domain, Extent, Vec3, vec3};
use refraxel_data::LocalOrigin;

/// How refractive regions are sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// How views decide.
    pub vote: Vote,
    /// Nodes along the longest edge of the scene. An object thinner than half their distance may be missed.
    pub coarse: u32,
    /// Nodes along the longest edge of each object.
    pub fine: u32,
    /// Added on each side of an object's box, in its longest edge.
    pub margin: f32,
    /// The grid that will be laid around each box; boxes are joined until these grids do not overlap.
    pub spacing: Spacing,
}

impl Default for Search {
    fn default() -> Self {
        Self { vote: Vote::default(), coarse: 60, fine: 48, margin: 0.03, spacing: Spacing::Longest(96) }
    }
}

/// Parts smaller than this share of the largest one are specks: the corners where wrong cones of sight meet.
const SPECK: f32 = 0.005;

/// Why no refractive region was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum LocateError {
    /// No silhouettes at all.
    #[error("no view has a refractive mask; give masks of the glass, or train with --refraction off")]
    NoViews,
    /// All masks are empty.
    #[error(
        "all {views} refractive masks are empty: white must mark glass or water, in the same image coordinates as the \
         photographs; check the mask files, or train with --refraction off"
    )]
    EmptyMasks {
        /// Number of masks.
        views: usize,
    },
    /// Masks that no place of the scene agrees with.
    #[error(
        "the masks of {views} views carve nothing out of the box {min:?} to {max:?}: at most {best:.0} % of the views that \
         see a place show glass there, {needed:.0} % are needed; check that masks and poses belong together (no mirrored view, \
         no masks in another order) and that the box contains the glass, or lower shape.vote"
    )]
    NothingCarved {
        /// Number of views.
        views: usize,
        /// The box that was searched, in the user's world.
        min: [f64; 3],
        /// Its other corner.
        max: [f64; 3],
        /// Largest agreement found [%].
        best: f32,
        /// Agreement asked for [%].
        needed: f32,
    },
}

impl LocateError {
    /// The same of a box in the user's world, where coordinates have another origin there.
    #[must_use]
    pub fn in_world(mut self, origin: LocalOrigin) -> Self {
        if let Self::NothingCarved { min, max, .. } = &mut self {
            [*min, *max] = [*min, *max].map(|corner| origin.to_world(Vec3::from(corner)).to_array());
        }
        self
    }
}

impl Outlines {
    /// The boxes of the refractive objects inside the box of the scene, largest object first, without the room that
    /// [`region_grid`] adds. Grids of `search.spacing` around them do not overlap.
    pub fn locate(&self, scene: &Aabb<f32>, search: &Search) -> Result<Vec<Aabb<f32>>, LocateError> {
        if self.is_empty() {
            return Err(LocateError::NoViews);
        }
        if self.all_empty() {
            return Err(LocateError::EmptyMasks { views: self.len() });
        }
        let coarse =
            self.hull(&Domain::with_longest(*scene, Extent::Bounded, search.coarse.max(8)), &search.vote);
        let parts = parts(&coarse);
        let largest = parts.first().map_or(0.0, |p| p.volume);
        let kept = parts.iter().filter(|p| p.volume >= SPECK * largest);
        let refined: Vec<Aabb<f32>> = kept.filter_map(|part| self.refine(part, search)).collect();
        if refined.is_empty() {
            return Err(self.nothing(scene, search));
        }
        Ok(joined(refined, search.spacing))
    }

    /// The box of a part from a finer carve of its surroundings; `None` where that finds nothing.
    fn refine(&self, part: &Part, search: &Search) -> Option<Aabb<f32>> {
        let fine =
            self.hull(&Domain::with_longest(part.bounds, Extent::Bounded, search.fine.max(8)), &search.vote);
        let main = parts(&fine).into_iter().next()?;
        let margin = Vec3::splat(main.tight.extent().max_element() * search.margin);
        Some(Aabb::new(main.tight.min - margin, main.tight.max + margin))
    }

    fn nothing(&self, scene: &Aabb<f32>, search: &Search) -> LocateError {
        let domain = Domain::with_longest(*scene, Extent::Bounded, 24);
        let best = (1..=100).rev().map(|p| p as f32).find(|p| {
            let vote = Vote { share: p / 100.0, ..search.vote };
            self.hull(&domain, &vote).fraction.iter().any(|&f| f > 0.0)
        });
        LocateError::NothingCarved {
            views: self.len(),
            min: scene.min.cast().to_array(),
            max: scene.max.cast().to_array(),
            best: best.unwrap_or(0.0),
            needed: 100.0 * search.vote.share,
        }
    }
}

/// A connected part of a hull.
struct Part {
    /// Box of its voxels, grown by one voxel.
    bounds: Aabb<f32>,
    /// Box of its voxels.
    tight: Aabb<f32>,
    /// Sum of the fractions of its nodes.
    volume: f32,
}

/// The parts of a hull whose nodes touch, diagonally too (26 neighbours), largest first.
fn parts(hull: &Hull) -> Vec<Part> {
    let n = hull.domain.resolution.map(|n| n as usize);
    let mut open: Vec<bool> = hull.fraction.iter().map(|&f| f > 0.0).collect();
    let mut parts = Vec::new();
    for seed in 0..open.len() {
        if !std::mem::take(&mut open[seed]) {
            continue;
        }
        let (mut low, mut high, mut volume) = (n, [0; 3], 0.0);
        let mut stack = vec![seed];
        while let Some(node) = stack.pop() {
            let at = [node % n[0], node / n[0] % n[1], node / (n[0] * n[1])];
            volume += hull.fraction[node];
            for a in 0..3 {
                low[a] = low[a].min(at[a]);
                high[a] = high[a].max(at[a]);
            }
            let range = |a: usize| at[a].saturating_sub(1)..(at[a] + 2).min(n[a]);
            for (z, y, x) in
                range(2).flat_map(|z| range(1).flat_map(move |y| range(0).map(move |x| (z, y, x))))
            {
                let neighbour = x + n[0] * (y + n[1] * z);
                if std::mem::take(&mut open[neighbour]) {
                    stack.push(neighbour);
                }
            }
        }
        let corner = |c: [usize; 3], by: f32| {
            hull.domain.position(vec3(c[0] as f32 + by, c[1] as f32 + by, c[2] as f32 + by))
        };
        let grown = |by: f32| Aabb::new(corner(low, -by), corner(high, by));
        parts.push(Part { bounds: grown(1.5), tight: grown(0.5), volume });
    }
    parts.sort_by(|a, b| b.volume.total_cmp(&a.volume));
    parts
}

/// Boxes joined until the grids around them do not overlap.
fn joined(mut boxes: Vec<Aabb<f32>>, spacing: Spacing) -> Vec<Aabb<f32>> {
    loop {
        let grids: Vec<Aabb<f32>> = boxes.iter().map(|b| region_grid(b, spacing).0).collect();
        let pairs = (0..boxes.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let Some((a, b)) = pairs.into_iter().find(|&(a, b)| overlap(&grids[a], &grids[b])) else {
            return boxes;
        };
        let other = boxes.remove(b);
        boxes[a].include(other.min);
        boxes[a].include(other.max);
    }
}

#[cfg(test)]
mod tests {
    use super::super::around::{Ball, cameras, silhouettes};
    use super::*;
    use refraxel_core::{IndexGrid, Interpolation, Medium};

    const SCENE: Aabb<f32> = Aabb { min: vec3(-1.0, -1.0, -1.0), max: vec3(1.0, 1.0, 1.0) };

    fn assert_fits(found: &Aabb<f32>, Ball(centre, radius): Ball) {
        for a in 0..3 {
            let (low, high) = ((centre[a] - radius) as f32, (centre[a] + radius) as f32);
            assert!(found.min[a] < low && found.min[a] > low - 0.15 * radius as f32, "{found:?}");
            assert!(found.max[a] > high && found.max[a] < high + 0.15 * radius as f32, "{found:?}");
        }
    }

    #[test]
    fn two_balls_give_two_regions_that_make_a_medium() {
        let balls = [Ball(vec3(0.4, 0.3, 0.1), 0.35), Ball(vec3(-0.5, -0.4, -0.2), 0.2)];
        let outlines = Outlines::new(&silhouettes(&cameras(40, 64), &balls, &[]));
        let found = outlines.locate(&SCENE, &Search::default()).unwrap();
        assert_eq!(found.len(), 2, "{found:?}");
        assert_fits(&found[0], balls[0]);
        assert_fits(&found[1], balls[1]);
        let grids = found.iter().map(|b| {
            let (bounds, resolution) = region_grid(b, Search::default().spacing);
            IndexGrid::<f32>::vacuum(bounds, resolution, Interpolation::default())
        });
        assert!(Medium::new(grids.collect()).is_ok());
    }

    #[test]
    fn balls_that_nearly_touch_share_a_region() {
        let balls = [Ball(vec3(0.3, 0.0, 0.0), 0.29), Ball(vec3(-0.3, 0.0, 0.0), 0.29)];
        let outlines = Outlines::new(&silhouettes(&cameras(40, 64), &balls, &[]));
        let found = outlines.locate(&SCENE, &Search::default()).unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
    }

    #[test]
    fn masks_that_show_nothing_or_disagree_say_what_to_check() {
        let outlines = |s: &[_]| Outlines::new(s).locate(&SCENE, &Search::default()).unwrap_err();
        assert_eq!(outlines(&[]), LocateError::NoViews);
        let cameras = cameras(12, 48);
        let empty = silhouettes(&cameras, &[], &[]);
        assert_eq!(outlines(&empty), LocateError::EmptyMasks { views: 12 });
        // Each view shows the ball somewhere else.
        let wrong = (0..12).flat_map(|i| {
            let angle = f64::from(i);
            let ball = Ball(vec3(angle.cos(), angle.sin(), (2.0 * angle).sin()) * 0.7, 0.15);
            silhouettes(&cameras[i as usize..][..1], &[ball], &[])
        });
        let error = outlines(&wrong.collect::<Vec<_>>());
        let LocateError::NothingCarved { views: 12, best, .. } = error else { panic!("{error}") };
        assert!(best > 0.0 && best < 95.0, "{error}");
        assert!(error.to_string().contains("check that masks and poses belong together"));
    }
}
