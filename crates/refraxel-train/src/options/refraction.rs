//! Whether, where and when rays bend.

use super::section::section;
use super::{Allowed, Switch};
use refraxel_core::{Aabb, vec3};
use refraxel_data::LocalOrigin;

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
        /// When rays begin to bend, at least this fraction of the rays of a batch lies inside masks.
        mask_ray_fraction: f64 = 0.3, in 0.0..=1.0;
    }
}

impl RefractionOptions {
    /// The box of `bounds` in the user's world, where there is one.
    pub fn stated_box(&self) -> Option<Aabb<f64>> {
        aabb(&self.bounds)
    }

    /// The same relative to the origin of a dataset.
    pub fn local_box(&self, origin: LocalOrigin) -> Option<Aabb<f32>> {
        self.stated_box().map(|b| origin.to_local(b).cast())
    }
}

fn is_box_or_empty(text: &str) -> bool {
    text.is_empty() || aabb(text).is_some()
}

fn aabb(text: &str) -> Option<Aabb<f64>> {
    let v: Vec<f64> = text.split(',').map(|v| v.trim().parse().ok()).collect::<Option<_>>()?;
    let &[x0, y0, z0, x1, y1, z1] = v.as_slice() else { return None };
    let valid = x0 < x1 && y0 < y1 && z0 < z1 && v.iter().all(|v| v.is_finite());
    valid.then(|| Aabb::new(vec3(x0, y0, z0), vec3(x1, y1, z1)))
}
