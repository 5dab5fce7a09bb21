//! Measures of a mesh: area, volume, and whether it is closed.

use super::triangles::{Mesh, doubled_area};
use std::collections::HashMap;

impl Mesh {
    /// Area of all triangles [scene unit²].
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|&t| 0.5 * doubled_area(self.corners(t)).length()).sum()
    }

    /// Enclosed volume [scene unit³] without cavities: by the divergence theorem, the sum of the signed volumes of the
    /// tetrahedra between an origin and all triangles. 0 for an empty mesh; without meaning for an open one.
    pub fn volume(&self) -> f64 {
        // An origin nearby keeps digits where the world is far from 0.
        let Some(origin) = self.bounds().map(|b| b.center()) else { return 0.0 };
        let signed = self.triangles.iter().map(|&t| {
            let [a, b, c] = self.corners(t).map(|x| x - origin);
            a.dot(b.cross(c)) / 6.0
        });
        signed.sum()
    }

    /// Number of directed edges without exactly one partner in the opposite direction: 0 for a closed mesh whose triangles
    /// have one orientation.
    pub fn open_edges(&self) -> usize {
        let mut count: HashMap<(u32, u32), u32> = HashMap::new();
        for &[a, b, c] in &self.triangles {
            [(a, b), (b, c), (c, a)].into_iter().for_each(|edge| *count.entry(edge).or_default() += 1);
        }
        count.iter().filter(|&(&(a, b), &n)| n != 1 || count.get(&(b, a)) != Some(&1)).count()
    }
}
