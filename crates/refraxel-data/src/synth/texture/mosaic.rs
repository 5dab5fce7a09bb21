//! Cells of hashed colours with a motif each.

use super::color::Rgb;
use super::noise::noise;
use crate::synth::hash::{cell, mix};
use refraxel_core::{Vec3, vec3};

/// Cells of hashed colours. Each shows a dot, ring, cross, stripes, checks or small dots in a second colour, under
/// brightness noise at a coarse and a fine scale.
#[derive(Clone, Debug)]
pub struct Mosaic {
    /// Linear colours to choose from; at least two.
    pub palette: Vec<Rgb>,
    /// Edge of a cell per axis [scene unit]; infinity makes the texture constant along an axis.
    pub cell: Vec3<f64>,
    /// Edge of a fine noise cell [scene unit].
    pub grain: f64,
    /// Choice of colours and motifs.
    pub seed: u64,
}

impl Mosaic {
    pub(super) fn color(&self, x: Vec3<f64>) -> Rgb {
        let q = vec3(x.x / self.cell.x, x.y / self.cell.y, x.z / self.cell.z);
        let i = q.map(f64::floor);
        let flat = self.cell.map(f64::is_infinite);
        let mut f = q - i - Vec3::splat(0.5);
        for a in 0..3 {
            if flat[a] {
                f[a] = 0.0;
            }
        }
        let h = cell(self.seed, [i.x as i64, i.y as i64, i.z as i64]);
        let n = self.palette.len() as u64;
        let base = h % n;
        let ink = (base + 1 + (h >> 8) % (n - 1)) % n;
        let color =
            self.palette[if motif((h >> 16) % 6, (h >> 24) & 1 == 0, f) { ink } else { base } as usize];
        let fine = noise(mix(self.seed, 1), x, self.grain);
        let coarse = noise(mix(self.seed, 2), x, 12.0 * self.grain);
        let light = 0.55 + 0.25 * coarse + 0.35 * fine;
        color.map(|c| (c * light).min(1.0))
    }
}

/// True where a cell's motif is inked; `f` in [−½, ½]³ from the cell's centre, 0 along constant axes.
fn motif(kind: u64, turned: bool, f: Vec3<f64>) -> bool {
    let stripe = |t: f64, per_cell: f64| (t * per_cell).rem_euclid(1.0) < 0.5;
    let parity = |t: f64| (4.0 * t).floor() as i64;
    match kind {
        0 => f.dot(f) < 0.34 * 0.34,
        1 => (0.2 * 0.2..0.4 * 0.4).contains(&f.dot(f)),
        2 => f.map(f64::abs).dot(vec3(1.0, 1.0, 1.0)) < 0.5 && f.x.abs().min(f.y.abs()).max(f.z.abs()) < 0.12,
        3 => stripe(if turned { f.x + f.y + f.z } else { f.x - f.y + f.z }, 3.0),
        4 => (parity(f.x) + parity(f.y) + parity(f.z)).rem_euclid(2) == 0,
        _ => {
            let g = f.map(|t| (3.0 * t + 0.5).rem_euclid(1.0) - 0.5);
            g.dot(g) < 0.3 * 0.3
        }
    }
}
