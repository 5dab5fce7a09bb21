//! Value noise.

use crate::synth::hash::{cell, unit};
use refraxel_core::Vec3;

/// Value noise in [0, 1], 1/2 in the mean: trilinear between hashed lattice values, with smoothed weights.
pub(in crate::synth) fn noise(seed: u64, x: Vec3<f64>, scale: f64) -> f64 {
    let q = x / scale;
    let i = q.map(f64::floor);
    let t = (q - i).map(|t| t * t * (3.0 - 2.0 * t));
    let at =
        |dx: i64, dy: i64, dz: i64| unit(cell(seed, [i.x as i64 + dx, i.y as i64 + dy, i.z as i64 + dz]));
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let row = |dy, dz| mix(at(0, dy, dz), at(1, dy, dz), t.x);
    let sheet = |dz| mix(row(0, dz), row(1, dz), t.y);
    mix(sheet(0), sheet(1), t.z)
}
