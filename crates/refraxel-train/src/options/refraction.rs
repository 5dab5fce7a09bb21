//! Whether, where and when rays bend.

use super::section::section;
use super::{Allowed, Switch};
use refraxel_core::{Aabb, vec3};

section! {
    /// Whether, where and when rays bend.
    pub struct RefractionOptions "refraction" {
        /// Whether rays follow the index of refraction. Otherwise all of them are straight.
        bend: Switch = Switch::Off;
        /// Box that holds everything refractive, `x0,y0,z0,x1,y1,z1` [scene unit]; empty: the masks show where it is.
        bounds: String = String::new(),
            in Allowed::Form("x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1, z0 < z1, or empty", is_box_or_empty);
        /// Steps with straight rays at the start, which learn the scene outside the masks; at most a quarter of the run.
        straight_steps: u64 = 300;
        /// They leave out pixels that are so near to a mask: masks may be too small, and glass that straight rays have learned
        /// as fog hides what stands there.
        mask_margin: u32 = 3, in 0..=100, "pixels";
        /// Whether the borders of masks move to where straight rays begin to fail, when rays are to bend, if that is at least a pixel
        /// away: by the same distance in all views, at most twice `mask_margin` less 1.5 pixels.
        mask_shift: Switch = Switch::On;
        /// Share of the run after them in which only the index learns.
        index_alone_share: f64 = 0.02, in 0.0..=0.7;
        /// When rays begin to bend, at least this fraction of the rays of a batch lies inside masks.
        mask_ray_fraction: f64 = 0.3, in 0.0..=1.0;
        /// Factor on `mask_ray_fraction` that is reached, linearly in time, at the end of the run.
        mask_ray_decay: f64 = 0.0, in 0.0..=1.0;
        /// Weight of rays that bend in the loss. They err more, by what is not yet right about the glass, and things that straight
        /// rays see as well must not learn those errors.
        bent_weight: f32 = 0.3, in 0.01..=1.0;
        /// Raw density inside the refractive shape when rays begin to bend.
        contents_density: f32 = -5.0, in -12.0..=9.0;
        /// The same below water that is seen from above only: something must stand there, and is learned sooner from haze.
        submerged_density: f32 = -2.0, in -12.0..=9.0;
    }
}

impl RefractionOptions {
    /// The box of `bounds`, where there is one.
    pub fn aabb(&self) -> Option<Aabb<f32>> {
        aabb(&self.bounds)
    }
}

fn is_box_or_empty(text: &str) -> bool {
    text.is_empty() || aabb(text).is_some()
}

fn aabb(text: &str) -> Option<Aabb<f32>> {
    let v: Vec<f32> = text.split(',').map(|v| v.trim().parse().ok()).collect::<Option<_>>()?;
    let &[x0, y0, z0, x1, y1, z1] = v.as_slice() else { return None };
    let valid = x0 < x1 && y0 < y1 && z0 < z1 && v.iter().all(|v| v.is_finite());
    valid.then(|| Aabb::new(vec3(x0, y0, z0), vec3(x1, y1, z1)))
}
