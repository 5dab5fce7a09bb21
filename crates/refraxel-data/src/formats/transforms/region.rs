//! The region of interest that an instant-ngp file may state.

use crate::DataError;
use crate::json::Object;
use refraxel_core::{Aabb, Vec3, vec3};

const EXPECTED: &str = "two corners [[x, y, z], [x, y, z]]";

/// `aabb` in the file's own coordinates, or `render_aabb` in instant-ngp's unit cube, mapped back by
/// p = (cycle(q) − offset) / scale.
pub(super) fn stated_box(top: &Object) -> Result<Option<Aabb<f64>>, DataError> {
    if let Some(corners) = top.matrix::<2, 3>("aabb", EXPECTED)? {
        return between(top, "aabb", corners.map(Vec3::from)).map(Some);
    }
    let Some(corners) = top.matrix::<2, 3>("render_aabb", EXPECTED)? else { return Ok(None) };
    let scale = top.number("scale")?.unwrap_or(0.33);
    let offset = top.numbers::<3>("offset", "three numbers")?.unwrap_or([0.5; 3]);
    if scale <= 0.0 {
        return Err(top.wrong("scale", "a number > 0"));
    }
    let back = |q: [f64; 3]| (vec3(q[2], q[0], q[1]) - Vec3::from(offset)) / scale;
    between(top, "render_aabb", corners.map(back)).map(Some)
}

fn between(top: &Object, key: &str, [a, b]: [Vec3<f64>; 2]) -> Result<Aabb<f64>, DataError> {
    let bounds = Aabb::new(a.min(b), a.max(b));
    let solid = bounds.extent().min_element() > 0.0;
    solid.then_some(bounds).ok_or_else(|| top.wrong(key, "two corners that differ in x, y and z"))
}
