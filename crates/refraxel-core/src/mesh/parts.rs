//! The connected surfaces that a mesh consists of.

use super::triangles::Mesh;

impl Mesh {
    /// The number of its connected surface for each vertex, from 0 in the order of their first vertices. By union–find over
    /// the edges.
    pub fn parts(&self) -> Vec<u32> {
        let mut root: Vec<u32> = (0..self.vertices.len() as u32).collect();
        for &[a, b, c] in &self.triangles {
            for other in [b, c] {
                let (i, j) = (find(&mut root, a), find(&mut root, other));
                root[i.max(j) as usize] = i.min(j);
            }
        }
        let mut count = 0;
        let mut number = vec![0; root.len()];
        for v in 0..root.len() as u32 {
            let first = find(&mut root, v);
            if first == v {
                number[v as usize] = count;
                count += 1;
            } else {
                number[v as usize] = number[first as usize]; // the representative is the lowest vertex
            }
        }
        number
    }

    /// Number of connected surfaces: one for a ball, two for a hollow ball.
    pub fn bodies(&self) -> usize {
        self.parts().into_iter().max().map_or(0, |last| last as usize + 1)
    }

    /// The mesh of the vertices for which `keep` holds, which are whole surfaces, and their numbers in this one.
    pub fn of_parts(&self, keep: impl Fn(usize) -> bool) -> (Self, Vec<usize>) {
        let kept: Vec<usize> = (0..self.vertices.len()).filter(|&v| keep(v)).collect();
        let mut new = vec![u32::MAX; self.vertices.len()];
        kept.iter().enumerate().for_each(|(to, &from)| new[from] = to as u32);
        let whole = self.triangles.iter().map(|t| t.map(|v| new[v as usize]));
        let mesh = Self {
            vertices: kept.iter().map(|&v| self.vertices[v]).collect(),
            normals: kept.iter().map(|&v| self.normals[v]).collect(),
            triangles: whole.filter(|t| t.iter().all(|&v| v != u32::MAX)).collect(),
        };
        (mesh, kept)
    }
}

/// The representative of the surface of a vertex, its lowest vertex so far. Halves the way to it for the next call (path
/// halving).
fn find(root: &mut [u32], mut v: u32) -> u32 {
    while root[v as usize] != v {
        root[v as usize] = root[root[v as usize] as usize];
        v = root[v as usize];
    }
    v
}
