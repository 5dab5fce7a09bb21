//! Narrow gaps in silhouettes: a straw in front of a glass, a thread, a scratch of a mask.

use super::super::contour::signed_distance;
use super::{Outline, Outlines};
use rayon::prelude::*;
use refraxel_core::Ray;
use std::sync::Arc;

impl Outlines {
    /// The same outlines without gaps narrower than `width` [part of the longest edge of the picture], where lines of sight
    /// meet something refractive by what the other views say.
    ///
    /// What hides glass there is too thin for the depth that straight rays have learned, and would carve the glass as far as it
    /// lies in front of it. Gaps between two things that other views see apart stay open: no line of sight through them
    /// meets anything.
    pub(crate) fn without_gaps(&self, width: f64, meets: impl Fn(&Ray<f32>) -> bool + Sync) -> Self {
        let closed = |view: &Arc<Outline>| {
            let distance = view.closed(width, &meets);
            distance.map(|distance| Arc::new(view.with(distance)))
        };
        let views = self.views.par_iter().map(|view| closed(view).unwrap_or_else(|| view.clone())).collect();
        Self { views, cancel: self.cancel.clone() }
    }
}

/// Distance from the contour that shows a gap [sample], and how far around such samples it reaches.
const BEYOND: f32 = 1.0;
const AROUND: usize = 2;

impl Outline {
    /// The distances with gaps closed; `None` where there are none.
    fn closed(&self, width: f64, meets: impl Fn(&Ray<f32>) -> bool) -> Option<Vec<f32>> {
        let stride = self.stride as f32;
        let reach = (0.5 * width * self.size[0].max(self.size[1]) as f64) as f32;
        // Closing: what lies deeper than `reach` in the mask grown by `reach`.
        let coverage = |is_inside: &dyn Fn(usize) -> bool| -> Vec<u8> {
            (0..self.distance.len()).map(|k| if is_inside(k) { 255 } else { 0 }).collect()
        };
        let grown = signed_distance(&coverage(&|k| self.distance[k] < reach * stride), self.size);
        // A closing on a raster is uncertain by half a sample: a gap reaches further beyond the contour somewhere.
        let is_sure = |k: usize| grown[k] < -reach - 0.5 && self.distance[k] > BEYOND * stride;
        let near_sure = |k: usize| {
            let [x, y] = [k % self.size[0], k / self.size[0]];
            let around = |c: usize, n: usize| c.saturating_sub(AROUND)..(c + AROUND + 1).min(n);
            around(y, self.size[1]).any(|v| around(x, self.size[0]).any(|u| is_sure(v * self.size[0] + u)))
        };
        let is_gap = |k: usize| grown[k] < -reach && self.distance[k] > 0.0 && near_sure(k);
        let met: Vec<usize> =
            (0..grown.len()).filter(|&k| is_gap(k) && self.ray(k).is_some_and(|ray| meets(&ray))).collect();
        if met.is_empty() {
            return None;
        }
        let mut filled = vec![0; grown.len()];
        met.iter().for_each(|&k| filled[k] = 255);
        // They overlap with the mask beside them, so that no seam stays open.
        let filled = signed_distance(&filled, self.size);
        Some(self.distance.iter().zip(filled).map(|(d, f)| d.min((f - 1.0) * stride)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::Silhouette;
    use super::*;
    use refraxel_core::{Camera, Vec3, vec3};
    use refraxel_data::Mask;

    const SIZE: u32 = 100;

    /// A mask all over the picture but where `is_open`.
    fn outlines(is_open: impl Fn(u32, u32) -> bool) -> Outlines {
        let camera = Camera::look_at(vec3(0.0, -4.0, 0.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.6, [SIZE; 2]);
        let is_shown = |x: u32, y: u32| (20..80).contains(&x) && (20..80).contains(&y) && !is_open(x, y);
        let coverage = (0..SIZE * SIZE).map(|k| if is_shown(k % SIZE, k / SIZE) { 255 } else { 0 }).collect();
        let mask = Mask { width: SIZE, height: SIZE, coverage };
        Outlines::new(&[Silhouette { camera, mask: mask.into(), occluders: None }])
    }

    fn shown(outlines: &Outlines, x: u32, y: u32) -> bool {
        outlines.views[0].shows((y * SIZE + x) as usize)
    }

    #[test]
    fn a_narrow_gap_is_closed_where_lines_of_sight_meet_the_body_and_a_wide_one_stays() {
        let slit = |x: u32, y: u32| (40..44).contains(&x) && y < 60;
        let gap = |x: u32, y: u32| slit(x, y) || ((60..70).contains(&x) && (40..50).contains(&y));
        let outlines = outlines(gap);
        let closed = outlines.without_gaps(0.06, |_| true);
        assert!((24..60).all(|y| (38..46).all(|x| shown(&closed, x, y))));
        assert!(!shown(&closed, 65, 45) && !shown(&closed, 15, 50) && !shown(&closed, 41, 15));
        // Only below the middle of the picture.
        let half = outlines.without_gaps(0.06, |ray| ray.direction.z < 0.0);
        assert!(!shown(&half, 41, 30) && shown(&half, 41, 55));
        let none = outlines.without_gaps(0.06, |_| false);
        assert_eq!(none.views[0].distance, outlines.views[0].distance);
        let narrower = outlines.without_gaps(0.03, |_| true);
        assert!((24..50).all(|y| !shown(&narrower, 41, y)), "corners are rounded at most");
    }
}
