//! What somebody knows of where refractive things are seen: lines of sight that meet them, and masks beside which nothing is.

use refraxel_core::{Camera, Ray, Vec3};
use refraxel_data::{Mask, is_white};
use std::sync::Arc;

/// A place counts as seen in a mask that is white within this part of the width of the picture around it.
const TOLERANCE: f64 = 0.01;
/// Least share of the masks that see a place which must show it: opaque things hide what is behind them, and masks err.
const AGREEING: f64 = 0.6;

/// Where refractive things are seen, as far as somebody knows it.
#[derive(Clone, Debug, Default)]
pub struct Hints {
    /// Views with masks beside whose white nothing refractive is seen.
    pub within: Vec<(Camera, Arc<Mask>)>,
    /// Lines of sight that meet refractive things. Where there are some, only the things that they meet are refractive.
    pub clicks: Vec<Ray<f32>>,
}

impl Hints {
    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.within.is_empty() && self.clicks.is_empty()
    }

    /// Whether something refractive can be at a place.
    pub(super) fn allow(&self, x: Vec3<f32>) -> bool {
        let (mut see, mut show) = (0, 0);
        for (camera, mask) in &self.within {
            if let Some(white) = is_white_about(camera, mask, x) {
                see += 1;
                show += usize::from(white);
            }
        }
        show as f64 >= AGREEING * see as f64
    }
}

/// Whether a mask is white where a view shows a point, or near there; `None` where the view does not show it.
fn is_white_about(camera: &Camera, mask: &Mask, x: Vec3<f32>) -> Option<bool> {
    let at = camera.project(x.cast())?;
    let [width, height] = [mask.width, mask.height].map(f64::from);
    let scale = [width / f64::from(camera.width), height / f64::from(camera.height)];
    let [u, v] = [at[0] * scale[0], at[1] * scale[1]];
    if !(u >= 0.0 && v >= 0.0 && u < width && v < height) {
        return None;
    }
    let reach = TOLERANCE * width;
    let is_white = |du: f64, dv: f64| {
        let column = (u + du * reach).clamp(0.0, width - 1.0) as usize;
        let row = (v + dv * reach).clamp(0.0, height - 1.0) as usize;
        is_white(mask.coverage[row * mask.width as usize + column])
    };
    const AROUND: [f64; 3] = [0.0, -1.0, 1.0];
    Some(AROUND.iter().any(|du| AROUND.iter().any(|dv| is_white(*du, *dv))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    /// A view along y with a mask that is white in its left half.
    fn left_half(eye: Vec3<f64>) -> (Camera, Arc<Mask>) {
        let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.8, [100, 80]);
        let coverage = (0..8000).map(|p| if p % 100 < 50 { 255 } else { 0 }).collect();
        (camera, Arc::new(Mask { width: 100, height: 80, coverage }))
    }

    #[test]
    fn nothing_refractive_is_where_most_masks_are_black() {
        let front = left_half(vec3(0.0, -4.0, 0.0));
        let [left, right, behind] = [vec3(-0.5, 0.0, 0.0), vec3(0.5, 0.0, 0.0), vec3(0.0, -9.0, 0.0)];
        let one = Hints { within: vec![front.clone()], clicks: Vec::new() };
        assert!(one.allow(left) && !one.allow(right));
        assert!(one.allow(vec3(0.02, 0.0, 0.0)), "within a hundredth of the picture");
        assert!(one.allow(behind), "the view does not see it");
        // From behind, left is right.
        let both = Hints { within: vec![front, left_half(vec3(0.0, 4.0, 0.0))], clicks: Vec::new() };
        assert!(!both.allow(left) && !both.allow(right) && both.allow(Vec3::zero()));
        assert!(Hints::default().allow(right));
    }
}
